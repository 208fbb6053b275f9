// Sine, cosine, their inverses and powers, by polynomials of our own.
//
// glibc picks variants with fused multiply-adds of its functions at run time, and other platforms have others: their last bits
// differ, and pictures would. These have the same bits everywhere. The coefficients interpolate at Chebyshev's points (mpmath,
// 50 digits), to less than 1e-18 of the function; rounding makes of that at most 2⁻⁵² in sines and cosines, 3 units of their own last
// place in angles, and 2⁻⁵² (1 + |log₂|) of a power. tests/tracer/test_trig.py compares with mpmath.
#pragma once
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "simd.h"

namespace viewcam::VIEWCAM_ISA {

constexpr double PI = 3.14159265358979323846;

// The polynomial with these coefficients, the lowest first.
template <class T, int N>
inline T polynomial(T x, const double (&coefficients)[N]) {
    T value = splat<T>(coefficients[N - 1]);
    for (int k = N - 2; k >= 0; k--) value = value * x + coefficients[k];
    return value;
}

template <class T> struct SinCosOf {
    T sin, cos;
};
using SinCos = SinCosOf<double>;

// Sine and cosine of an angle in turns, |turns| < 2^30, or of four: no digit is lost to a multiple of π.
template <class T> inline SinCosOf<T> sincos_of_turns(T turns) {
    constexpr double WHOLE = 0x1.8p52;  // added to a number, it rounds that to a whole number, which is in the sum's last binary digits
    static constexpr double SIN[] = {6.283185307179586,  -41.34170224039976, 81.60524927607493,  -76.70585975299812,
                                     42.05869392898878,  -15.094640403891546, 3.8197881201632113, -0.7116358090781666};
    static constexpr double COS[] = {1.0,
                                     -19.739208802178716,
                                     64.9393940226683,
                                     -85.45681720669354,
                                     60.244641371818105,
                                     -26.426256772545436,
                                     7.9035351947629575,
                                     -1.7143161879285278,
                                     0.27945867147528963};
    T four = 4.0 * turns + 0.5, quarters = (four + WHOLE) - WHOLE;
    quarters = select(Mask<T>(quarters > four), quarters - 1.0, quarters);
    T x = turns - 0.25 * quarters, squared = x * x, sin = x * polynomial(squared, SIN), cos = polynomial(squared, COS);
    auto quarter = bits_of(quarters + WHOLE);
    Mask<T> odd((quarter & 1) != 0);
    T across = select(odd, cos, sin), along = select(odd, sin, cos);
    return {of_bits(bits_of(across) ^ quarter >> 1 << 63), of_bits(bits_of(along) ^ (quarter ^ quarter >> 1) << 63)};
}
// A vector that is turned about a unit axis (Rodrigues).
inline Vec3 turned_about(Vec3 axis, Vec3 v, SinCos angle) { return v * angle.cos + cross(axis, v) * angle.sin + axis * (dot(axis, v) * (1 - angle.cos)); }
inline double sin(double angle) { return sincos_of_turns(angle * (0.5 / PI)).sin; }
inline double cos(double angle) { return sincos_of_turns(angle * (0.5 / PI)).cos; }

namespace detail {
// The arc sine of 0 ≤ x ≤ ½.
template <class T> inline T asin_of_small(T x) {
    static constexpr double ASIN[] = {0.16666666666666666,  0.07500000000000118,  0.044642857142551895, 0.03038194447553234,
                                      0.02237215744350722,  0.017352816540325496, 0.01396378001220357,  0.011566459612121669,
                                      0.009621842970100282, 0.009319560794767446, 0.0030448799094556773, 0.019554513336123378,
                                      -0.01924167174674304, 0.02961201126495512};
    T squared = x * x;
    return x + x * (squared * polynomial(squared, ASIN));
}
}  // namespace detail

// An argument that was rounded to beyond ±1 counts as ±1.
template <class T> inline T asin(T x) {
    T size = abs(x);
    Mask<T> is_small(size <= 0.5);
    T angle = detail::asin_of_small(select(is_small, size, sqrt(max((1.0 - size) / 2.0, T{}))));
    return copysign(select(is_small, angle, PI / 2 - 2.0 * angle), x);
}
template <class T> inline T acos(T x) {
    T size = abs(x), half = detail::asin_of_small(sqrt(max((1.0 - size) / 2.0, T{})));
    T far = select(Mask<T>(x > 0.0), 2.0 * half, PI - 2.0 * half);
    return select(Mask<T>(size <= 0.5), PI / 2 - asin(x), far);
}
// 0 of (0, 0).
inline double atan2(double y, double x) {
    static constexpr double ATAN[] = {-0.3333333333333333,  0.19999999999999993,  -0.14285714285711518, 0.11111111110754729,
                                      -0.0909090906700999,  0.07692306736000173,  -0.06666642020055166, 0.058819252531928636,
                                      -0.05258041554297779, 0.04719395030027433,  -0.04104436265755082, 0.030635704112969498,
                                      -0.01391822929102443};
    constexpr double TAN_OF_AN_EIGHTH = 0.41421356237309503;
    double across = std::fabs(y), along = std::fabs(x), large = max(across, along), small = min(across, along);
    if (large == 0) return 0;
    double slope = small / large, start = 0;
    if (slope > TAN_OF_AN_EIGHTH) start = PI / 4, slope = (slope - 1) / (slope + 1);
    double squared = slope * slope, angle = start + (slope + slope * (squared * polynomial(squared, ATAN)));
    if (across > along) angle = PI / 2 - angle;
    if (x < 0) angle = PI - angle;
    return std::copysign(angle, y);
}

// The binary logarithm of 1e-300 < x < 1e300.
inline double log2(double x) {
    static constexpr double LOG2[] = {2.8853900817779268,  0.9617966939259754,  0.5770780163557014,
                                      0.4121985830711221,  0.32059890487808423, 0.2623075212731535,
                                      0.22199096082951125, 0.19111353353277502, 0.19156360034169936};
    auto bits = std::bit_cast<uint64_t>(x);
    auto exponent = int(bits >> 52) - 1023;
    double mantissa = std::bit_cast<double>((bits & 0xfffffffffffffull) | 0x3ff0000000000000ull);
    if (mantissa > 1.4142135623730951) mantissa /= 2, exponent++;
    double s = (mantissa - 1) / (mantissa + 1);
    return exponent + s * polynomial(s * s, LOG2);
}
inline double log(double x) { return log2(x) * 0.6931471805599453; }

// x^power of 1e-300 < x < 1e300: 0 where that is less than float64's normal numbers, infinite above 2^1023.5, no number for none.
inline double pow(double x, double power) {
    static constexpr double EXP2[] = {1.0,
                                      0.6931471805599453,
                                      0.24022650695910072,
                                      0.0555041086648217,
                                      0.009618129107628484,
                                      0.0013333558146390353,
                                      0.00015403530393362755,
                                      1.5252733856293466e-05,
                                      1.3215486815999978e-06,
                                      1.0178051192960649e-07,
                                      7.054894386348348e-09,
                                      4.456675341049206e-10,
                                      2.5733568308756892e-11};
    double wanted = power * log2(x);
    if (!(std::fabs(wanted) < 1022)) {
        if (wanted <= -1022) return 0;
        if (!(wanted < 1023.5)) return wanted * std::numeric_limits<double>::infinity();
    }
    double whole = std::floor(wanted + 0.5), rest = polynomial(wanted - whole, EXP2);
    return rest * std::bit_cast<double>(uint64_t(int64_t(whole) + 1023) << 52);
}

// e^x, 0 where that is less than float64's own numbers go down to; x < 690.
inline double exp(double x) { return x < -690 ? 0 : pow(2.718281828459045, x); }

}  // namespace viewcam::VIEWCAM_ISA
