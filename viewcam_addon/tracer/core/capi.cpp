// Picks the instance of the core for this processor. cpuid is asked here: __builtin_cpu_supports says no to everything in
// libraries that zig links.
#include "capi.h"

#include <cstring>

#if defined(__x86_64__) && !defined(VIEWCAM_ONE_INSTANCE)
#include <cpuid.h>

namespace viewcam {
namespace v2 { extern const ViewcamCore core; }
namespace v3 { extern const ViewcamCore core; }
namespace v4 { extern const ViewcamCore core; }

namespace {

bool has_all(unsigned value, unsigned wanted) { return (value & wanted) == wanted; }

// The registers that the system saves when it changes threads: XCR0.
unsigned saved_registers() {
    unsigned low, high;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

// x86-64's level: 2, 3 or 4 (System V ABI, table 3.1).
int level() {
    unsigned a, b, c, d, features, extended = 0;
    if (!__get_cpuid(1, &a, &b, &features, &d)) return 2;
    constexpr unsigned OSXSAVE = 1u << 27, AVX = 1u << 28, F16C = 1u << 29, FMA = 1u << 12, MOVBE = 1u << 22;
    if (!has_all(features, OSXSAVE | AVX | F16C | FMA | MOVBE) || !has_all(saved_registers(), 6)) return 2;
    if (!__get_cpuid_count(7, 0, &a, &extended, &c, &d)) return 2;
    constexpr unsigned BMI1 = 1u << 3, AVX2 = 1u << 5, BMI2 = 1u << 8, LZCNT = 1u << 5;
    if (!has_all(extended, BMI1 | AVX2 | BMI2) || !__get_cpuid(0x80000001, &a, &b, &c, &d) || !has_all(c, LZCNT)) return 2;
    constexpr unsigned AVX512 = 1u << 16 | 1u << 17 | 1u << 28 | 1u << 30 | 1u << 31;  // F, DQ, CD, BW, VL
    return has_all(extended, AVX512) && has_all(saved_registers(), 0xe6) ? 4 : 3;
}

}  // namespace
}  // namespace viewcam

extern "C" const ViewcamCore* viewcam_core(const char* name) {
    using namespace viewcam;
    const ViewcamCore* instances[] = {&v2::core, &v3::core, &v4::core};
    int best = level();
    if (!name) return instances[best - 2];
    for (int i = 2; i <= best; i++)
        if (!std::strcmp(instances[i - 2]->name, name)) return instances[i - 2];
    return nullptr;
}

#else

namespace viewcam::base { extern const ViewcamCore core; }

extern "C" const ViewcamCore* viewcam_core(const char* name) {
    const ViewcamCore* only = &viewcam::base::core;
    return !name || !std::strcmp(only->name, name) ? only : nullptr;
}

#endif
