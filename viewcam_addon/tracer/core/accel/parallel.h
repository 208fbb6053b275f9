// Loops over threads, what each thread keeps for itself, and arrays that are not written before they are filled.
#pragma once
#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <system_error>
#include <thread>
#include <vector>
#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace viewcam::VIEWCAM_ISA {

// Calls work(0) … work(count − 1), each once, from as many threads; the first exception is thrown on when all have ended.
template <class Work> void parallel_for(int threads, size_t count, const Work& work) {
    if (threads <= 1 || count <= 1) {
        for (size_t i = 0; i < count; i++) work(i);
        return;
    }
    std::atomic<size_t> next{0};
    std::exception_ptr thrown;
    std::mutex throwing;
    auto run = [&] {
        try {
            for (size_t i; (i = next++) < count;) work(i);
        } catch (...) {
            std::lock_guard<std::mutex> lock(throwing);
            thrown = std::current_exception();
            next = count;
        }
    };
    std::vector<std::thread> others;
    others.reserve(size_t(threads));
    try {
        for (size_t i = 1; i < std::min(size_t(threads), count); i++) others.emplace_back(run);
    } catch (const std::system_error&) {  // no more threads to be had: fewer do it as well
    }
    run();
    for (std::thread& other : others) other.join();
    if (thrown) std::rethrow_exception(thrown);
}

// In pieces: work(begin, end) of [0, count).
template <class Work> void parallel_pieces(int threads, size_t count, size_t piece, const Work& work) {
    parallel_for(threads, (count + piece - 1) / piece,
                 [&](size_t i) { work(i * piece, std::min(count, (i + 1) * piece)); });
}

// One object for each thread and type, made when the thread first asks for it and never cleared: what is too large for a stack.
// On the heap, since not every loader aligns thread_local objects as their types ask (wine 8, Windows before 8.1), and every
// thread of the process would get the space of them, though it never traces a ray.
template <class T> T& of_this_thread() {
    static thread_local const std::unique_ptr<T> object = std::make_unique<T>();
    return *object;
}

// An array on whole cache lines that holds whatever was there, until it is written: std::vector would write it twice. A large one
// lies on huge pages where the system has them: rays jump about in it, and of small pages a processor knows few at a time.
template <class T> class Array {
   public:
    Array() = default;
    explicit Array(size_t count) : size_(count) {
        data_ = static_cast<T*>(::operator new(std::max<size_t>(count, 1) * sizeof(T), alignment()));
#if defined(__linux__)
        if (alignment() == HUGE_PAGE) madvise(data_, count * sizeof(T), MADV_HUGEPAGE);
#endif
    }
    Array(Array&& other) noexcept { swap(other); }
    Array& operator=(Array&& other) noexcept {
        swap(other);
        return *this;
    }
    ~Array() {
        if (data_) ::operator delete(data_, alignment());
    }
    T& operator[](size_t i) { return data_[i]; }
    const T& operator[](size_t i) const { return data_[i]; }
    size_t size() const { return size_; }
    T* begin() { return data_; }
    T* end() { return data_ + size_; }
    const T* begin() const { return data_; }
    const T* end() const { return data_ + size_; }

   private:
    static constexpr std::align_val_t CACHE_LINE{64}, HUGE_PAGE{1 << 21};

    std::align_val_t alignment() const { return size_ * sizeof(T) < size_t(HUGE_PAGE) ? CACHE_LINE : HUGE_PAGE; }
    void swap(Array& other) {
        std::swap(data_, other.data_);
        std::swap(size_, other.size_);
    }
    T* data_ = nullptr;
    size_t size_ = 0;
};

}  // namespace viewcam::VIEWCAM_ISA
