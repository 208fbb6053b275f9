// Reflection and refraction by facets, as closures add them: of a mirror where the facets are too small to tell.
#pragma once
#include "../bsdf/albedo.h"
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

// Facets, and along what they are stretched: 0 where they are alike all round.
struct Facets : Microfacets {
    Vec3 tangent;
};

inline Facets facets_of(double roughness, bool beckmann = false) {
    double alpha = unit_range(roughness) * unit_range(roughness);
    return {{alpha, alpha, beckmann}, {}};
}

// How facets are stretched: by how much, and along what, which is turned about the normal.
struct Anisotropy {
    Color amount, rotation, tangent;

    // As a Glossy BSDF has it: below 0 across the tangent.
    Facets of_glossy(const ShadingPoint& at, Vec3 normal, const Facets& round) const {
        constexpr double MOST = 0.99, NEGLIGIBLE = 1e-4;
        double a = min(max(at.number(amount), -MOST), MOST);
        return std::fabs(a) <= NEGLIGIBLE ? round : stretched(at, normal, round, a < 0 ? 1 / (1 + a) : 1 - a);
    }
    // As Metallic and Principled have it.
    Facets of(const ShadingPoint& at, Vec3 normal, const Facets& round) const {
        double a = unit_range(at.number(amount));
        return a > 0 ? stretched(at, normal, round, 1 / std::sqrt(1 - 0.9 * a)) : round;
    }

   private:
    // along: by what their slopes are larger along the tangent, and smaller across it.
    Facets stretched(const ShadingPoint& at, Vec3 normal, const Facets& round, double along) const {
        double turns = at.number(rotation);
        Vec3 turned = turned_about(normal, at.tangent(tangent), sincos_of_turns(turns - std::floor(turns)));
        return {{unit_range(round.alpha_x * along), unit_range(round.alpha_y / along), round.beckmann}, turned};
    }
};

// What the facets of rough closures are like, and whether light that they scatter more than once counts.
struct Distribution {
    bool beckmann, multiple;

    explicit Distribution(const std::string& choice) : beckmann(choice == "beckmann"), multiple(choice == "multiscatter_ggx") {}
    Facets facets(double roughness) const { return facets_of(roughness, beckmann); }
};

inline double roughness_of(const Microfacets& facets) { return std::sqrt(std::sqrt(facets.alpha_x * facets.alpha_y)); }

inline void add_reflection(BSDF& bsdf, const ShadingPoint& at, Vec3 color, Vec3 normal, const Facets& facets, const Fresnel& fresnel) {
    if (at.is_smooth(facets)) {
        bsdf.add(SpecularReflection{color * reflectance(fresnel, -dot(normal, at.incoming)), normal, at.incoming});
        return;
    }
    Frame frame = is_black(facets.tangent) ? Frame(normal) : frame_along(normal, facets.tangent);
    bsdf.add(MicrofacetReflection{{color, frame, frame.to_local(-at.incoming), facets, fresnel}});
}
// What `fresnel` lets through. ratio: as of `refracted`.
inline void add_refraction(BSDF& bsdf, const ShadingPoint& at, Vec3 color, Vec3 normal, const Facets& facets, const Fresnel& fresnel,
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
