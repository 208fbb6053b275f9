// Vectors of eight floats and four doubles, by the compiler's own vector types: one source for SSE, AVX, AVX-512 and NEON.
//
// Intrinsics stand only where compilers make much worse code of the plain expression, and then of the same meaning: min and max
// give the second operand where a number is missing. No fused multiply-add but for boxes, see vec.h.
#pragma once
#include <bit>
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "vec.h"

namespace viewcam::VIEWCAM_ISA {

typedef float float4 __attribute__((vector_size(16)));
typedef float float8 __attribute__((vector_size(32)));
typedef int32_t int8 __attribute__((vector_size(32)));
typedef double double4 __attribute__((vector_size(32)));
typedef int64_t long4 __attribute__((vector_size(32)));
typedef uint64_t ulong4 __attribute__((vector_size(32)));
typedef int32_t int4 __attribute__((vector_size(16)));
typedef uint32_t uint4 __attribute__((vector_size(16)));
typedef uint8_t byte16 __attribute__((vector_size(16)));

template <class V, class T> inline V load(const T* from) {
    V v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
template <class V, class T> inline void store(T* to, V v) { std::memcpy(to, &v, sizeof v); }

inline float8 splat8(float x) { return float8{x, x, x, x, x, x, x, x}; }
inline double4 splat4(double x) { return double4{x, x, x, x}; }
inline long4 splat4(int64_t x) { return long4{x, x, x, x}; }
inline uint4 splat4(uint32_t x) { return uint4{x, x, x, x}; }

#if defined(__AVX__)
inline float8 min(float8 a, float8 b) { return (float8)_mm256_min_ps((__m256)a, (__m256)b); }
inline float8 max(float8 a, float8 b) { return (float8)_mm256_max_ps((__m256)a, (__m256)b); }
inline double4 min(double4 a, double4 b) { return (double4)_mm256_min_pd((__m256d)a, (__m256d)b); }
inline double4 max(double4 a, double4 b) { return (double4)_mm256_max_pd((__m256d)a, (__m256d)b); }
inline unsigned bits(int8 mask) { return unsigned(_mm256_movemask_ps((__m256)mask)); }
inline unsigned bits(long4 mask) { return unsigned(_mm256_movemask_pd((__m256d)mask)); }
#else
inline float8 min(float8 a, float8 b) { return a < b ? a : b; }
inline float8 max(float8 a, float8 b) { return a > b ? a : b; }
inline double4 min(double4 a, double4 b) { return a < b ? a : b; }
inline double4 max(double4 a, double4 b) { return a > b ? a : b; }
#if defined(__SSE2__)
// One bit for each lane of a mask.
inline unsigned bits(int8 mask) {
    __m128 half[2];
    std::memcpy(half, &mask, 32);
    return unsigned(_mm_movemask_ps(half[0]) | _mm_movemask_ps(half[1]) << 4);
}
inline unsigned bits(long4 mask) {
    __m128d half[2];
    std::memcpy(half, &mask, 32);
    return unsigned(_mm_movemask_pd(half[0]) | _mm_movemask_pd(half[1]) << 2);
}
#else
inline unsigned bits(int8 mask) {
    mask &= int8{1, 2, 4, 8, 16, 32, 64, 128};
    return unsigned((mask[0] | mask[1] | mask[2] | mask[3]) | (mask[4] | mask[5] | mask[6] | mask[7]));
}
inline unsigned bits(long4 mask) {
    mask &= long4{1, 2, 4, 8};
    return unsigned(mask[0] | mask[1] | mask[2] | mask[3]);
}
#endif
#endif
#if defined(__SSE2__)
inline float4 min(float4 a, float4 b) { return (float4)_mm_min_ps((__m128)a, (__m128)b); }
inline float4 max(float4 a, float4 b) { return (float4)_mm_max_ps((__m128)a, (__m128)b); }
#else
inline float4 min(float4 a, float4 b) { return a < b ? a : b; }
inline float4 max(float4 a, float4 b) { return a > b ? a : b; }
#endif

// a · b − c, rounded once where the processor can. For boxes alone: what they only leave out changes no picture's bits.
inline float8 multiply_subtract(float8 a, float8 b, float8 c) {
#if defined(__FMA__)
    return (float8)_mm256_fmsub_ps((__m256)a, (__m256)b, (__m256)c);
#else
    return a * b - c;
#endif
}

inline double4 abs(double4 a) { return (double4)((long4)a & splat4(INT64_MAX)); }
inline double4 copysign(double4 size, double4 sign) {
    return (double4)(((long4)size & splat4(INT64_MAX)) | ((long4)sign & splat4(INT64_MIN)));
}
// Sizes that have no sign of their own get one.
inline double4 with_sign(double4 size, double4 sign) { return (double4)((long4)size | ((long4)sign & splat4(INT64_MIN))); }
inline double4 select(long4 mask, double4 a, double4 b) { return mask ? a : b; }

inline double4 sqrt(double4 a) {
#if defined(__AVX__)
    return (double4)_mm256_sqrt_pd((__m256d)a);
#else
    return double4{std::sqrt(a[0]), std::sqrt(a[1]), std::sqrt(a[2]), std::sqrt(a[3])};
#endif
}

// Words as numbers, exactly: they become signed by their highest bit, which is added again.
inline double4 number_of(uint4 words) { return __builtin_convertvector((int4)(words ^ 0x80000000u), double4) + splat4(0x1p31); }
inline double number_of(uint32_t word) { return word; }

// Four vectors: their coordinates in one register each.
using Vec2x4 = Vec2Of<double4>;
using Vec3x4 = Vec3Of<double4>;

inline Vec3x4 splat4(Vec3 v) { return {splat4(v.x), splat4(v.y), splat4(v.z)}; }
inline Vec3 lane(const Vec3x4& v, int i) { return {v.x[i], v.y[i], v.z[i]}; }
inline void set_lane(Vec3x4& v, int i, Vec3 a) { v.x[i] = a.x, v.y[i] = a.y, v.z[i] = a.z; }
inline Vec3x4 select(long4 mask, const Vec3x4& a, const Vec3x4& b) {
    return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}
inline double4 length(const Vec3x4& a) { return sqrt(dot(a, a)); }
inline double4 max_component(const Vec3x4& a) { return max(a.x, max(a.y, a.z)); }
inline Vec3x4 min(const Vec3x4& a, double b) { return {min(a.x, splat4(b)), min(a.y, splat4(b)), min(a.z, splat4(b))}; }
inline Vec3x4 max(const Vec3x4& a, double b) { return {max(a.x, splat4(b)), max(a.y, splat4(b)), max(a.z, splat4(b))}; }
inline long4 is_black(const Vec3x4& rgb) { return long4(rgb.x == 0.0) & long4(rgb.y == 0.0) & long4(rgb.z == 0.0); }
inline Vec3x4 abs(const Vec3x4& a) { return {abs(a.x), abs(a.y), abs(a.z)}; }
// of(i) → double of four lanes, or Vec3.
template <class Of> inline auto gather4(const Of& of) {
    if constexpr (std::is_same_v<decltype(of(0)), Vec3>) {
        Vec3 a = of(0), b = of(1), c = of(2), d = of(3);
        return Vec3x4{{a.x, b.x, c.x, d.x}, {a.y, b.y, c.y, d.y}, {a.z, b.z, c.z, d.z}};
    } else {
        return double4{of(0), of(1), of(2), of(3)};
    }
}

// The lanes of a mask of half the width.
inline unsigned bits(int4 mask) {
#if defined(__SSE2__)
    return unsigned(_mm_movemask_ps((__m128)mask));
#else
    return bits(__builtin_convertvector(mask, long4));
#endif
}
inline bool any(long4 mask) { return bits(mask); }
inline bool all(long4 mask) { return bits(mask) == 15; }
// The bits of numbers, and numbers of bits.
inline uint64_t bits_of(double x) { return std::bit_cast<uint64_t>(x); }
inline ulong4 bits_of(double4 x) { return (ulong4)x; }
inline double of_bits(uint64_t bits) { return std::bit_cast<double>(bits); }
inline double4 of_bits(ulong4 bits) { return (double4)bits; }

// A number or a vector in the type that a formula is computed in, for one or for four at once.
template <class T> inline T splat(double x) {
    if constexpr (std::is_same_v<T, double4>)
        return splat4(x);
    else
        return x;
}
template <class T> inline Vec3Of<T> splat(Vec3 v) { return {splat<T>(v.x), splat<T>(v.y), splat<T>(v.z)}; }
// The type of a comparison of these.
inline Vec3 select(bool mask, Vec3 a, Vec3 b) { return mask ? a : b; }
template <class T> using Mask = std::conditional_t<std::is_same_v<T, double4>, long4, bool>;
// A set of flags for a number, or for each of four; those of `flags` where a mask holds.
template <class T> using Flags = std::conditional_t<std::is_same_v<T, double4>, uint4, uint32_t>;
inline uint32_t where(bool mask, uint32_t flags) { return mask ? flags : 0; }
inline uint4 where(long4 mask, uint32_t flags) { return (uint4)__builtin_convertvector(mask, int4) & flags; }
inline bool has(uint32_t flags, uint32_t flag) { return flags & flag; }
// The lanes of four that have a flag, as bits.
inline unsigned lanes_with(uint4 flags, uint32_t flag) { return ~bits(int4((flags & flag) == 0u)) & 15; }
inline long4 has(uint4 flags, uint32_t flag) { return __builtin_convertvector((int4)((flags & flag) != 0u), long4); }

// A right-handed orthonormal frame about a unit vector, without a singularity; its error is 4e-16 for any vector.
// Duff et al., Building an Orthonormal Basis, Revisited, JCGT 6 (2017).
template <class T> struct FrameOf {
    Vec3Of<T> s, t, n;

    explicit FrameOf(Vec3Of<T> normal) : n(normal) {
        T sign = copysign(T{} + 1.0, n.z), a = -1.0 / (sign + n.z), b = n.x * n.y * a;
        s = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
        t = {b, sign + n.y * n.y * a, -n.y};
    }
    Vec3Of<T> to_world(Vec3Of<T> v) const { return s * v.x + t * v.y + n * v.z; }
    Vec3Of<T> to_local(Vec3Of<T> v) const { return {dot(s, v), dot(t, v), dot(n, v)}; }
};
using Frame = FrameOf<double>;

// Rows become columns.
inline void transpose(double4& a, double4& b, double4& c, double4& d) {
    double4 ab0 = __builtin_shufflevector(a, b, 0, 4, 2, 6), ab1 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    double4 cd0 = __builtin_shufflevector(c, d, 0, 4, 2, 6), cd1 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    a = __builtin_shufflevector(ab0, cd0, 0, 1, 4, 5), c = __builtin_shufflevector(ab0, cd0, 2, 3, 6, 7);
    b = __builtin_shufflevector(ab1, cd1, 0, 1, 4, 5), d = __builtin_shufflevector(ab1, cd1, 2, 3, 6, 7);
}

// Each of four vectors with 0 behind it.
inline void rows(const Vec3x4& v, double4 (&rows)[4]) {
    rows[0] = v.x, rows[1] = v.y, rows[2] = v.z, rows[3] = double4{};
    transpose(rows[0], rows[1], rows[2], rows[3]);
}

inline float reduce_min(float8 v) {
    v = min(v, __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3));
    v = min(v, __builtin_shufflevector(v, v, 2, 3, 0, 1, 6, 7, 4, 5));
    return v[0] < v[1] ? v[0] : v[1];
}
inline float reduce_max(float8 v) {
    v = max(v, __builtin_shufflevector(v, v, 4, 5, 6, 7, 0, 1, 2, 3));
    v = max(v, __builtin_shufflevector(v, v, 2, 3, 0, 1, 6, 7, 4, 5));
    return v[0] > v[1] ? v[0] : v[1];
}

// The most of each of eight vectors, or the least.
template <bool MOST> inline float8 reduce_eight(const float8 (&v)[8]) {
    auto of = [](float8 a, float8 b) { return MOST ? max(a, b) : min(a, b); };
    float8 two[4], four[2];
    for (int i = 0; i < 4; i++)
        two[i] = of(__builtin_shufflevector(v[2 * i], v[2 * i + 1], 0, 8, 2, 10, 4, 12, 6, 14),
                    __builtin_shufflevector(v[2 * i], v[2 * i + 1], 1, 9, 3, 11, 5, 13, 7, 15));
    for (int i = 0; i < 2; i++)
        four[i] = of(__builtin_shufflevector(two[2 * i], two[2 * i + 1], 0, 1, 8, 9, 4, 5, 12, 13),
                     __builtin_shufflevector(two[2 * i], two[2 * i + 1], 2, 3, 10, 11, 6, 7, 14, 15));
    return of(__builtin_shufflevector(four[0], four[1], 0, 1, 2, 3, 8, 9, 10, 11),
              __builtin_shufflevector(four[0], four[1], 4, 5, 6, 7, 12, 13, 14, 15));
}

// The lowest bit that is set, which is taken out of `mask`.
inline int take_bit(unsigned& mask) {
    int bit = __builtin_ctz(mask);
    mask &= mask - 1;
    return bit;
}

}  // namespace viewcam::VIEWCAM_ISA
