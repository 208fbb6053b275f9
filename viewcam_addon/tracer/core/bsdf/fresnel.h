// Fresnel terms: which part of light a facet reflects, by the cosine of the angle between ray and facet.
//
// One line a term in the variant. The scaled dielectric is what Cycles makes of glass and of Principled's specular, a Fresnel
// curve that is stretched between a color at normal incidence and white at grazing; F82 is Kutz, Hasan and Edmondson's model of
// metals (Novel Aspects of the Adobe Standard Material, 2021) with the tint at 82°. `mean` is twice the integral of c F(c), which
// light that is scattered among facets more than once is colored by; the fit for dielectrics is Kulla and Conty's (2017).
#pragma once
#include <variant>

#include "../math/vec.h"
#include "specular.h"

namespace viewcam::VIEWCAM_ISA {

template <class T> inline T unit_range(T x) { return select(Mask<T>(x > 0.0), min(x, splat<T>(1)), T{}); }
template <class T> inline Vec3Of<T> unit_range(Vec3Of<T> x) { return {unit_range(x.x), unit_range(x.y), unit_range(x.z)}; }
inline double mix(double a, double b, double t) { return a + (b - a) * t; }
inline double4 mix(double4 a, double4 b, double4 t) { return a + (b - a) * t; }
template <class T> inline Vec3Of<T> mix(Vec3Of<T> a, Vec3Of<T> b, Scalar<T> t) { return a + (b - a) * t; }
inline Vec3 gray(double value) { return {value, value, value}; }
inline Vec3x4 gray(double4 value) { return {value, value, value}; }

// The share that an index of refraction reflects straight back; and the index that reflects so much.
template <class T> inline T f0_of(T ior) {
    T root = (ior - 1.0) / (ior + 1.0);
    return root * root;
}
template <class T> inline T ior_of_f0(T f0) {
    T root = sqrt(select(Mask<T>(f0 > 0.0), min(f0, splat<T>(0.99)), T{}));
    return (1.0 + root) / (1.0 - root);
}
template <class T> inline T mean_fresnel(T ior) {
    T inside = 0.997118 + ior * (0.1014 - ior * (0.965241 + ior * 0.130607));
    return select(Mask<T>(ior < 1.0), inside, (ior - 1.0) / (4.08567 + 1.00071 * ior));
}
// Where a dielectric's curve stands between its value at normal incidence, 0, and 1.
template <class T> inline T fresnel_progress(T reflectance, T ior) {
    T f0 = f0_of(ior);
    return unit_range((reflectance - f0) / (1.0 - f0));
}

struct NoFresnel {
    template <class T> Vec3Of<T> at(T) const { return gray(splat<T>(1)); }
};

// ratio: as of `fresnel`.
template <class T> struct DielectricFresnelOf {
    T ratio;
    Vec3Of<T> at(T cosine) const { return gray(fresnel(cosine, ratio)); }
};

// The Fresnel term of a surface that reflects nothing but where Snell's law lets no light through.
template <class T> struct TotalReflectionOf {
    T ratio;
    Vec3Of<T> at(T cosine) const { return gray(select(Mask<T>(fresnel(cosine, ratio) < 1.0), T{}, splat<T>(1))); }
};

template <class T> struct ScaledDielectricOf {
    T ratio;
    Vec3Of<T> f0;
    Vec3Of<T> at(T cosine) const { return mix(f0, gray(splat<T>(1)), fresnel_progress(fresnel(cosine, ratio), ratio)); }
};

template <class T> struct F82Of {
    Vec3Of<T> f0, b;

    static F82Of of(Vec3Of<T> f0, Vec3Of<T> tint) { return {f0, near_grazing(f0) * (gray(splat<T>(1)) - tint) * splat<T>(LIFT)}; }
    // The curve with these values at 0° and at the angle whose cosine is 1/7.
    static F82Of through(Vec3Of<T> f0, Vec3Of<T> f82) { return {f0, (near_grazing(f0) - f82) * splat<T>(LIFT)}; }

    Vec3Of<T> at(T cosine) const {
        T s = unit_range(1.0 - cosine), s5 = s * s * s * s * s;
        return unit_range(mix(f0, gray(splat<T>(1)), s5) - b * (cosine * s5 * s));
    }
    Vec3Of<T> mean() const { return mix(f0, gray(splat<T>(1)), splat<T>(1.0 / 21)) - b / splat<T>(126); }

   private:
    static constexpr double K = 7776.0 / 16807;           // (6/7)⁵
    static constexpr double LIFT = 7.0 * 117649 / 46656;  // 7 / (6/7)⁶
    static Vec3Of<T> near_grazing(Vec3Of<T> f0) { return mix(f0, gray(splat<T>(1)), splat<T>(K)); }
};

// A metal's complex index of refraction. exact: as from Blender 5.0 on; before, an approximation for large ones.
template <class T> struct ConductorFresnelOf {
    Vec3Of<T> n, k;
    bool exact = true;

    Vec3Of<T> at(T cosine) const { return {of(n.x, k.x, cosine), of(n.y, k.y, cosine), of(n.z, k.z, cosine)}; }
    Vec3Of<T> mean() const { return unit_range(F82Of<T>::through(at(splat<T>(1)), at(splat<T>(1.0 / 7))).mean()); }

   private:
    T of(T n, T k, T c) const {
        T squares = n * n + k * k, slanted = 2.0 * n * c;
        if (!exact) {
            T parallel = (squares * c * c - slanted + 1.0) / (squares * c * c + slanted + 1.0);
            T across = (squares - slanted + c * c) / (squares + slanted + c * c);
            return 0.5 * (parallel + across);
        }
        T real = n * n - k * k - (1.0 - c * c), size = sqrt(real * real + 4.0 * n * n * k * k);
        T u2 = max(0.5 * (size + real), T{}), v2 = max(0.5 * (size - real), T{}), u = sqrt(u2), v = sqrt(v2);
        T across = ((c - u) * (c - u) + v2) / ((c + u) * (c + u) + v2);
        T a = (n * n - k * k) * c, e = 2.0 * n * k * c;
        T parallel = ((a - u) * (a - u) + (e - v) * (e - v)) / ((a + u) * (a + u) + (e + v) * (e + v));
        return 0.5 * (across + parallel);
    }
};

template <class T>
using FresnelOf = std::variant<NoFresnel, DielectricFresnelOf<T>, TotalReflectionOf<T>, ScaledDielectricOf<T>, F82Of<T>, ConductorFresnelOf<T>>;
using DielectricFresnel = DielectricFresnelOf<double>;
using TotalReflection = TotalReflectionOf<double>;
using ScaledDielectric = ScaledDielectricOf<double>;
using Fresnel = FresnelOf<double>;

template <class T> inline Vec3Of<T> reflectance(const FresnelOf<T>& fresnel, Scalar<T> cosine) {
    return std::visit([&](const auto& term) { return term.at(cosine); }, fresnel);
}

}  // namespace viewcam::VIEWCAM_ISA
