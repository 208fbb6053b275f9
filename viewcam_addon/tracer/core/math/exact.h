// Sums and products with their rounding errors, and what is computed with them: exact.py's in C++.
#pragma once
#include "vec.h"

namespace viewcam::VIEWCAM_ISA {

// A number as the unevaluated sum of two.
struct Pair {
    double high = 0, low = 0;
};

// Knuth's: high + low = a + b exactly.
inline Pair two_sum(double a, double b) {
    double s = a + b, t = s - a;
    return {s, (a - (s - t)) + (b - t)};
}
// fma is called by name: it is exact wherever it is computed, and nothing else is fused.
inline Pair two_product(double a, double b) {
    double p = a * b;
    return {p, std::fma(a, b, -p)};
}
inline Pair operator+(Pair a, double b) {
    Pair s = two_sum(a.high, b);
    return two_sum(s.high, s.low + a.low);
}
inline Pair operator+(Pair a, Pair b) {
    Pair s = two_sum(a.high, b.high);
    return two_sum(s.high, s.low + (a.low + b.low));
}

// a b − c d within one and a half units in the last place (Kahan).
inline double difference_of_products(double a, double b, double c, double d) {
    double cd = c * d, error = std::fma(-c, d, cd);
    return std::fma(a, b, -cd) + error;
}
inline Vec3 exact_cross(Vec3 a, Vec3 b) {
    return {difference_of_products(a.y, b.z, a.z, b.y), difference_of_products(a.z, b.x, a.x, b.z),
            difference_of_products(a.x, b.y, a.y, b.x)};
}

}  // namespace viewcam::VIEWCAM_ISA
