// The lobes that several closures add: diffuse reflection, and reflection and refraction by facets, which are mirrors where the
// facets are too small to tell.
#pragma once
#include "../bsdf/albedo.h"
#include "../bsdf/diffuse.h"
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

constexpr double LEAST_IOR = 1e-5;

// albedo: as of OrenNayar.
template <class At, class T>
[[gnu::always_inline]] inline void add_diffuse(BSDFOf<T>& bsdf, const At& at, const Vec3Of<T>& color, const Vec3Of<T>& normal, T roughness, const Vec3Of<T>& albedo) {
    constexpr double SMOOTH = 1e-5;
    Mask<T> smooth(roughness < SMOOTH);
    if (any(smooth)) bsdf.add(LambertOf<T>{select(smooth, color, Vec3Of<T>{}), normal});
    if (all(smooth)) return;
    bsdf.add(OrenNayarOf<T>(select(smooth, Vec3Of<T>{}, color), normal, -at.incoming, unit_range(roughness), albedo, at.version >= CYCLES_4_3));
}

// Facets, and along what they are stretched: 0 where they are alike all round.
template <class T> struct FacetsOf : MicrofacetsOf<T> {
    Vec3Of<T> tangent;
};
using Facets = FacetsOf<double>;

template <class T> inline FacetsOf<T> facets_of(T roughness, bool beckmann = false) {
    T alpha = unit_range(roughness) * unit_range(roughness);
    return {{alpha, alpha, beckmann}, {}};
}

// The stretch of facets: by how much, and along what, which is turned about the normal.
struct Anisotropy {
    Color amount, rotation, tangent;

    bool is_none() const { return amount.is_black(); }
    // As a Glossy BSDF has it: below 0 across the tangent.
    template <class At> FacetsOf<NumberOf<At>> of_glossy(const At& at, Vec3Of<NumberOf<At>> normal, const FacetsOf<NumberOf<At>>& round) const {
        constexpr double MOST = 0.99, NEGLIGIBLE = 1e-4;
        if constexpr (IS_ONE<At>) {
            double a = min(max(at.number(amount), -MOST), MOST);
            if (std::fabs(a) > NEGLIGIBLE) return stretched(at, normal, round, a < 0 ? 1 / (1 + a) : 1 - a);
        }
        return round;
    }
    // As Metallic and Principled have it.
    template <class At> FacetsOf<NumberOf<At>> of(const At& at, Vec3Of<NumberOf<At>> normal, const FacetsOf<NumberOf<At>>& round) const {
        if constexpr (IS_ONE<At>)
            if (double a = unit_range(at.number(amount)); a > 0) return stretched(at, normal, round, 1 / std::sqrt(1 - 0.9 * a));
        return round;
    }

   private:
    // along: by what their slopes are larger along the tangent, and smaller across it.
    Facets stretched(const ShadingPoint& at, Vec3 normal, const Facets& round, double along) const {
        double turns = at.number(rotation);
        Vec3 turned = turned_about(normal, at.tangent(tangent), sincos_of_turns(turns - std::floor(turns)));
        return {{unit_range(round.alpha_x * along), unit_range(round.alpha_y / along), round.beckmann}, turned};
    }
};

// The distribution of the facets of rough closures, and whether light that they scatter more than once counts.
struct Distribution {
    bool beckmann, multiple;

    explicit Distribution(const std::string& choice) : beckmann(choice == "beckmann"), multiple(choice == "multiscatter_ggx") {}
    template <class T> FacetsOf<T> facets(T roughness) const { return facets_of(roughness, beckmann); }
};

template <class T> inline T roughness_of(const MicrofacetsOf<T>& facets) { return sqrt(sqrt(facets.alpha_x * facets.alpha_y)); }

template <class At, class T>
inline void add_reflection(BSDFOf<T>& bsdf, const At& at, Vec3Of<T> color, Vec3Of<T> normal, const FacetsOf<T>& facets, const FresnelOf<Scalar<T>>& fresnel) {
    Mask<T> smooth = at.is_smooth(facets);
    if (any(smooth)) {
        T cosine = -dot(normal, at.incoming);
        bsdf.add(SpecularReflectionOf<T>{select(smooth, color * reflectance<T>(fresnel, cosine), Vec3Of<T>{}), normal, at.incoming});
        if (all(smooth)) return;
        color = select(smooth, Vec3Of<T>{}, color);
    }
    FrameOf<T> frame(normal);
    if constexpr (IS_ONE<At>)
        if (!is_black(facets.tangent)) frame = frame_along(normal, facets.tangent);
    bsdf.add(MicrofacetReflectionOf<T>{{color, frame, frame.to_local(-at.incoming), facets, fresnel}, at.version < CYCLES_5_0});
}
// Adds the refraction of what `fresnel` lets through. ratio: see `refracted`.
inline void add_refraction(BSDF& bsdf, const ShadingPoint& at, Vec3 color, Vec3 normal, const Facets& facets, const Fresnel& fresnel,
                           double ratio) {
    if (at.is_smooth(facets)) {
        Vec3 let_through = gray(1) - reflectance<double>(fresnel, -dot(normal, at.incoming));
        bsdf.add(SpecularTransmission{color * let_through, normal, at.incoming, ratio});
        return;
    }
    Frame frame(normal);
    bsdf.add(MicrofacetTransmission{{color, frame, frame.to_local(-at.incoming), facets, fresnel}, ratio});
}

// The gain by light that facets scatter more than once, which reflect by a Fresnel term of this mean.
template <class At, class T>
inline MultipleScatteringOf<T> multiple_reflection(const At& at, Vec3Of<T> normal, const MicrofacetsOf<T>& facets, Vec3Of<T> mean) {
    return MultipleScatteringOf<T>::of(ggx_albedo<T>(roughness_of(facets), -dot(normal, at.incoming)), mean);
}

// Adds what a dielectric reflects and refracts. ratio: see `refracted`. reflected, transmitted: the colors of both.
// multiple: whether light that facets scatter more than once counts.
inline void add_glass(BSDF& bsdf, const ShadingPoint& at, Vec3 weight, Vec3 normal, const Facets& facets, double ratio, const Fresnel& fresnel,
                      Vec3 reflected, Vec3 transmitted, bool multiple) {
    if (multiple && !at.is_smooth(facets)) {
        AlbedoOf<double> single = glass_albedo(roughness_of(facets), -dot(normal, at.incoming), ratio);
        MultipleScattering more = MultipleScattering::of(single, transmitted);
        weight = weight * more.albedo * more.lobe;
    }
    add_reflection(bsdf, at, weight * reflected, normal, facets, fresnel);
    add_refraction(bsdf, at, weight * transmitted, normal, facets, fresnel, ratio);
}

}  // namespace viewcam::VIEWCAM_ISA
