// Vectors of eight floats and four doubles, by the compiler's own vector types: one source for SSE, AVX, AVX-512 and NEON.
//
// Intrinsics stand only where compilers make much worse code of the plain expression, and then of the same meaning: min and max
// give the second operand where a number is missing. No fused multiply-add, see vec.h.
#pragma once
#include <cstdint>
#include <cstring>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace viewcam::VIEWCAM_ISA {

typedef float float4 __attribute__((vector_size(16)));
typedef float float8 __attribute__((vector_size(32)));
typedef int32_t int8 __attribute__((vector_size(32)));
typedef double double4 __attribute__((vector_size(32)));
typedef int64_t long4 __attribute__((vector_size(32)));

template <class V, class T> inline V load(const T* from) {
    V v;
    std::memcpy(&v, from, sizeof v);
    return v;
}
template <class V, class T> inline void store(T* to, V v) { std::memcpy(to, &v, sizeof v); }

inline float8 splat8(float x) { return float8{x, x, x, x, x, x, x, x}; }
inline double4 splat4(double x) { return double4{x, x, x, x}; }
inline long4 splat4(int64_t x) { return long4{x, x, x, x}; }

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

inline double4 abs(double4 a) { return (double4)((long4)a & splat4(INT64_MAX)); }
inline double4 copysign(double4 size, double4 sign) {
    return (double4)(((long4)size & splat4(INT64_MAX)) | ((long4)sign & splat4(INT64_MIN)));
}
inline double4 select(long4 mask, double4 a, double4 b) { return (double4)((mask & (long4)a) | (~mask & (long4)b)); }

inline float reduce_min(float8 v) {
    float least = v[0];
    for (int i = 1; i < 8; i++) least = v[i] < least ? v[i] : least;
    return least;
}
inline float reduce_max(float8 v) {
    float most = v[0];
    for (int i = 1; i < 8; i++) most = v[i] > most ? v[i] : most;
    return most;
}

// The lowest bit that is set, which is taken out of `mask`.
inline int take_bit(unsigned& mask) {
    int bit = __builtin_ctz(mask);
    mask &= mask - 1;
    return bit;
}

}  // namespace viewcam::VIEWCAM_ISA
