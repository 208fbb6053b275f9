// Microfacets: how the little mirrors of a rough surface are turned, and how they stand in each other's light.
//
// All in the frame of the surface's normal, z, with x along its tangent. GGX: Walter et al., Microfacet Models for Refraction
// (2007), and Heitz, Understanding the Masking-Shadowing Function (JCGT 3, 2014), whose Smith function for directions that are
// correlated by their height is Cycles' too; Beckmann's with the rational fit of its masking that Walter gives.
//
// Facets are sampled as the viewer sees them (Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical Caps, 2023).
// Beckmann's are sampled by the GGX of the same roughness, whose tails are longer, so that no weight is large.
#pragma once
#include "../math/trig.h"

namespace viewcam::VIEWCAM_ISA {

struct Microfacets {
    double alpha_x, alpha_y;
    bool beckmann = false;

    // How many facets are turned so, by solid angle and by the surface's area.
    double d(Vec3 h) const {
        double x = h.x / alpha_x, y = h.y / alpha_y, slopes = x * x + y * y, up = h.z * h.z;
        if (beckmann) return exp(-slopes / up) / (PI * alpha_x * alpha_y * up * up);
        double size = slopes + up;
        return 1 / (PI * alpha_x * alpha_y * size * size);
    }
    // Smith's Λ: the facets that are hidden from a direction over those that are seen.
    double lambda(Vec3 v) const { return lambda(v, beckmann); }
    // The part of the facets that is seen from both sides.
    double g(Vec3 wi, Vec3 wo) const { return 1 / (1 + lambda(wi) + lambda(wo)); }

    // A facet as often as the viewer sees it. wi: to the viewer, above the surface.
    Vec3 sample_visible(Vec3 wi, Vec2 u) const {
        Vec3 stretched = normalize(Vec3{wi.x * alpha_x, wi.y * alpha_y, wi.z});
        double z = (1 - u.y) * (1 + stretched.z) - stretched.z, across = std::sqrt(max(1 - z * z, 0.0));
        SinCos turn = sincos_of_turns(u.x);
        Vec3 h = Vec3{across * turn.cos, across * turn.sin, z} + stretched;
        return normalize(Vec3{h.x * alpha_x, h.y * alpha_y, max(h.z, LEAST_RISE)});
    }
    // The density of that, by solid angle.
    double pdf_visible(Vec3 wi, Vec3 h) const {
        double seen = dot(wi, h);
        if (!(seen > 0 && h.z > 0)) return 0;
        return Microfacets{alpha_x, alpha_y}.d(h) * seen / (wi.z * (1 + lambda(wi, false)));
    }

   private:
    static constexpr double LEAST_RISE = 1e-12;

    double lambda(Vec3 v, bool beckmann) const {
        double x = v.x * alpha_x, y = v.y * alpha_y, squared = (x * x + y * y) / (v.z * v.z);
        if (!beckmann) return 0.5 * (std::sqrt(1 + squared) - 1);
        if (squared < 0.39) return 0;
        double a = 1 / std::sqrt(squared);
        return ((0.396 * a - 1.259) * a + 1) / ((2.181 * a + 3.535) * a);
    }
};

}  // namespace viewcam::VIEWCAM_ISA
