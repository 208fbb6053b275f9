// Vectors and affine maps in float64.
//
// Everything in the core is compiled without contraction (-ffp-contract=off): a product and a sum round one after the other,
// everywhere alike, which the triangle test's watertightness and the pictures' bits stand on.
#pragma once
#include <cmath>
#include <type_traits>

namespace viewcam::VIEWCAM_ISA {

// In line everywhere, as the C library's are not; of something that is no number and b, b.
inline double min(double a, double b) { return a < b ? a : b; }
inline double max(double a, double b) { return a > b ? a : b; }

inline double sqrt(double a) { return std::sqrt(a); }
inline double select(bool mask, double a, double b) { return mask ? a : b; }
inline double copysign(double size, double sign) { return std::copysign(size, sign); }
inline bool any(bool mask) { return mask; }
inline bool all(bool mask) { return mask; }
inline double abs(double a) { return std::fabs(a); }

// A vector of numbers, or of double4 where four are computed at once (simd.h).
template <class T> struct Vec2Of {
    T x{}, y{};
};
using Vec2 = Vec2Of<double>;
template <class T> struct Vec3Of {
    T x{}, y{}, z{};

    T operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};
using Vec3 = Vec3Of<double>;
template <class T> using Scalar = std::type_identity_t<T>;

template <class T> inline Vec3Of<T> operator+(Vec3Of<T> a, Vec3Of<T> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class T> inline Vec3Of<T> operator-(Vec3Of<T> a, Vec3Of<T> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class T> inline Vec3Of<T> operator-(Vec3Of<T> a) { return {-a.x, -a.y, -a.z}; }
template <class T> inline Vec3Of<T> operator*(Vec3Of<T> a, Vec3Of<T> b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
template <class T> inline Vec3Of<T> operator*(Vec3Of<T> a, Scalar<T> s) { return {a.x * s, a.y * s, a.z * s}; }
template <class T> inline Vec3Of<T> operator*(Scalar<T> s, Vec3Of<T> a) { return a * s; }
template <class T> inline Vec3Of<T> operator/(Vec3Of<T> a, Scalar<T> s) { return {a.x / s, a.y / s, a.z / s}; }
inline Vec3& operator+=(Vec3& a, Vec3 b) { return a = a + b; }
inline Vec3& operator*=(Vec3& a, Vec3 b) { return a = a * b; }
inline Vec3& operator*=(Vec3& a, double s) { return a = a * s; }

template <class T> inline T dot(Vec3Of<T> a, Vec3Of<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class T> inline Vec3Of<T> cross(Vec3Of<T> a, Vec3Of<T> b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) { return std::sqrt(dot(a, a)); }
template <class T> inline Vec3Of<T> normalize(Vec3Of<T> a) { return a / length(a); }
inline double max_component(Vec3 a) { return max(a.x, max(a.y, a.z)); }
inline Vec3 min(Vec3 a, double b) { return {min(a.x, b), min(a.y, b), min(a.z, b)}; }
inline Vec3 max(Vec3 a, double b) { return {max(a.x, b), max(a.y, b), max(a.z, b)}; }
inline Vec3 abs(Vec3 a) { return {std::fabs(a.x), std::fabs(a.y), std::fabs(a.z)}; }
inline bool is_black(Vec3 rgb) { return rgb.x == 0 && rgb.y == 0 && rgb.z == 0; }

// A matrix, rows first, and its transposed one, times a vector.
template <class T, class Rows> inline Vec3Of<T> product(const Rows& m, Vec3Of<T> v) {
    return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
            m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}
template <class T, class Rows> inline Vec3Of<T> transposed_product(const Rows& m, Vec3Of<T> v) {
    return {m[0][0] * v.x + m[1][0] * v.y + m[2][0] * v.z, m[0][1] * v.x + m[1][1] * v.y + m[2][1] * v.z,
            m[0][2] * v.x + m[1][2] * v.y + m[2][2] * v.z};
}

// A 3 × 4 affine map, rows first: of points by `point`, of directions by `vector`.
struct Affine {
    double m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};

    Vec3 vector(Vec3 v) const { return product(m, v); }
    Vec3 translation() const { return {m[0][3], m[1][3], m[2][3]}; }
    Vec3 point(Vec3 p) const { return vector(p) + translation(); }
    // The transposed linear part: with the inverse map, what takes normals along.
    Vec3 transposed(Vec3 n) const { return transposed_product(m, n); }
};

}  // namespace viewcam::VIEWCAM_ISA
