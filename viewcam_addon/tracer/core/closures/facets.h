// Reflection and refraction by facets, as closures add them: of a mirror where the facets are too small to tell.
#pragma once
#include "../bsdf/albedo.h"
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

inline Microfacets facets_of(double roughness, bool beckmann = false) {
    double alpha = unit_range(roughness) * unit_range(roughness);
    return {alpha, alpha, beckmann};
}

// What the facets of rough closures are like, and whether light that they scatter more than once counts.
struct Distribution {
    bool beckmann, multiple;

    explicit Distribution(const std::string& choice) : beckmann(choice == "beckmann"), multiple(choice == "multiscatter_ggx") {}
    Microfacets facets(double roughness) const { return facets_of(roughness, beckmann); }
};

inline double roughness_of(const Microfacets& facets) { return std::sqrt(std::sqrt(facets.alpha_x * facets.alpha_y)); }

inline void add_reflection(BSDF& bsdf, const ShadingPoint& at, Vec3 color, Vec3 normal, const Microfacets& facets, const Fresnel& fresnel) {
    if (at.is_smooth(facets)) {
        bsdf.add(SpecularReflection{color * reflectance(fresnel, -dot(normal, at.incoming)), normal, at.incoming});
        return;
    }
    Frame frame(normal);
    bsdf.add(MicrofacetReflection{{color, frame, frame.to_local(-at.incoming), facets, fresnel}});
}
// What `fresnel` lets through. ratio: as of `refracted`.
inline void add_refraction(BSDF& bsdf, const ShadingPoint& at, Vec3 color, Vec3 normal, const Microfacets& facets, const Fresnel& fresnel,
                           double ratio) {
    constexpr double UNBENT = 1e-4;
    if (at.is_smooth(facets) || std::fabs(ratio - 1) < UNBENT) {
        Vec3 let_through = grey(1) - reflectance(fresnel, -dot(normal, at.incoming));
        bsdf.add(SpecularTransmission{color * let_through, normal, at.incoming, ratio});
        return;
    }
    Frame frame(normal);
    bsdf.add(MicrofacetTransmission{{color, frame, frame.to_local(-at.incoming), facets, fresnel}, ratio});
}

// What facets that reflect by a Fresnel term of this mean make of light that they scatter more than once.
inline MultipleScattering multiple_reflection(const ShadingPoint& at, Vec3 normal, const Microfacets& facets, Vec3 mean) {
    return MultipleScattering::of(ggx_albedo(roughness_of(facets), -dot(normal, at.incoming)), mean);
}

}  // namespace viewcam::VIEWCAM_ISA
