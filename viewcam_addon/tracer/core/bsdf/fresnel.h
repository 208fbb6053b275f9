// Fresnel terms: which part of light a facet reflects, by the cosine of the angle between ray and facet.
//
// One line a term in the variant. The scaled dielectric is what Cycles makes of glass and of Principled's specular, a Fresnel
// curve that is stretched between a colour at normal incidence and white at grazing; F82 is Kutz, Hasan and Edmondson's model of
// metals (Novel Aspects of the Adobe Standard Material, 2021) with the tint at 82°. `mean` is twice the integral of c F(c), which
// light that is scattered among facets more than once is coloured by; the fit for dielectrics is Kulla and Conty's (2017).
#pragma once
#include <variant>

#include "../math/vec.h"
#include "dielectric.h"

namespace viewcam::VIEWCAM_ISA {

inline double unit_range(double x) { return x > 0 ? min(x, 1.0) : 0; }
inline Vec3 unit_range(Vec3 x) { return {unit_range(x.x), unit_range(x.y), unit_range(x.z)}; }
inline double mix(double a, double b, double t) { return a + (b - a) * t; }
inline Vec3 mix(Vec3 a, Vec3 b, double t) { return a + (b - a) * t; }
inline Vec3 grey(double value) { return {value, value, value}; }

// Of the index of refraction, what is reflected straight back; and the index that reflects so much.
inline double f0_of(double ior) {
    double root = (ior - 1) / (ior + 1);
    return root * root;
}
inline double ior_of_f0(double f0) {
    double root = std::sqrt(f0 > 0 ? min(f0, 0.99) : 0);
    return (1 + root) / (1 - root);
}
inline double mean_fresnel(double ior) {
    if (ior < 1) return 0.997118 + ior * (0.1014 - ior * (0.965241 + ior * 0.130607));
    return (ior - 1) / (4.08567 + 1.00071 * ior);
}
// Where a dielectric's curve stands between its value at normal incidence, 0, and 1.
inline double fresnel_progress(double reflectance, double ior) {
    double f0 = f0_of(ior);
    return unit_range((reflectance - f0) / (1 - f0));
}

struct NoFresnel {
    Vec3 at(double) const { return grey(1); }
};

// ratio: as of `fresnel`.
struct DielectricFresnel {
    double ratio;
    Vec3 at(double cosine) const { return grey(fresnel(cosine, ratio)); }
};

// Of a surface that reflects nothing but where Snell's law lets no light through.
struct TotalReflection {
    double ratio;
    Vec3 at(double cosine) const { return grey(fresnel(cosine, ratio) < 1 ? 0 : 1); }
};

struct ScaledDielectric {
    double ratio;
    Vec3 f0;
    Vec3 at(double cosine) const { return mix(f0, grey(1), fresnel_progress(fresnel(cosine, ratio), ratio)); }
};

struct F82 {
    Vec3 f0, b;

    static F82 of(Vec3 f0, Vec3 tint) { return {f0, mix(f0, grey(1), K) * (grey(1) - tint) * LIFT}; }
    // The curve with these values at 0° and at the angle whose cosine is 1/7.
    static F82 through(Vec3 f0, Vec3 f82) { return {f0, (mix(f0, grey(1), K) - f82) * LIFT}; }

    Vec3 at(double cosine) const {
        double s = unit_range(1 - cosine), s5 = s * s * s * s * s;
        return unit_range(mix(f0, grey(1), s5) - b * (cosine * s5 * s));
    }
    Vec3 mean() const { return mix(f0, grey(1), 1.0 / 21) - b / 126; }

   private:
    static constexpr double K = 7776.0 / 16807;           // (6/7)⁵
    static constexpr double LIFT = 7.0 * 117649 / 46656;  // 7 / (6/7)⁶
};

// A metal's complex index of refraction. exact: as from Blender 5.0 on; before, an approximation for large ones.
struct ConductorFresnel {
    Vec3 n, k;
    bool exact = true;

    Vec3 at(double cosine) const { return {of(n.x, k.x, cosine), of(n.y, k.y, cosine), of(n.z, k.z, cosine)}; }
    Vec3 mean() const { return unit_range(F82::through(at(1), at(1.0 / 7)).mean()); }

   private:
    double of(double n, double k, double c) const {
        double squares = n * n + k * k, slanted = 2 * n * c;
        if (!exact) {
            double parallel = (squares * c * c - slanted + 1) / (squares * c * c + slanted + 1);
            double across = (squares - slanted + c * c) / (squares + slanted + c * c);
            return 0.5 * (parallel + across);
        }
        double real = n * n - k * k - (1 - c * c), size = std::sqrt(real * real + 4 * n * n * k * k);
        double u2 = max(0.5 * (size + real), 0.0), v2 = max(0.5 * (size - real), 0.0), u = std::sqrt(u2), v = std::sqrt(v2);
        double across = ((c - u) * (c - u) + v2) / ((c + u) * (c + u) + v2);
        double a = (n * n - k * k) * c, e = 2 * n * k * c;
        double parallel = ((a - u) * (a - u) + (e - v) * (e - v)) / ((a + u) * (a + u) + (e + v) * (e + v));
        return 0.5 * (across + parallel);
    }
};

using Fresnel = std::variant<NoFresnel, DielectricFresnel, TotalReflection, ScaledDielectric, F82, ConductorFresnel>;

inline Vec3 reflectance(const Fresnel& fresnel, double cosine) {
    return std::visit([&](const auto& term) { return term.at(cosine); }, fresnel);
}

}  // namespace viewcam::VIEWCAM_ISA
