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

template <class T> struct MicrofacetsOf {
    T alpha_x, alpha_y;
    bool beckmann = false;  // of single points alone

    // The density of facets that are turned so, by solid angle and by the surface's area.
    T d(Vec3Of<T> h) const {
        T x = h.x / alpha_x, y = h.y / alpha_y, slopes = x * x + y * y, up = h.z * h.z;
        if constexpr (std::is_same_v<T, double>)
            if (beckmann) return exp(-slopes / up) / (PI * alpha_x * alpha_y * up * up);
        T size = slopes + up;
        return 1.0 / (PI * alpha_x * alpha_y * size * size);
    }
    // Smith's Λ: the facets that are hidden from a direction over those that are seen.
    T lambda(Vec3Of<T> v) const { return lambda(v, beckmann); }
    // The part of the facets that is seen from both sides.
    T g(Vec3Of<T> wi, Vec3Of<T> wo) const { return 1.0 / (1.0 + lambda(wi) + lambda(wo)); }

    // A facet as often as the viewer sees it. wi: to the viewer, above the surface.
    Vec3Of<T> sample_visible(Vec3Of<T> wi, Vec2Of<T> u) const {
        Vec3Of<T> stretched = normalize(Vec3Of<T>{wi.x * alpha_x, wi.y * alpha_y, wi.z});
        T z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z, across = sqrt(max(1.0 - z * z, T{}));
        SinCosOf<T> turn = sincos_of_turns(u.x);
        Vec3Of<T> h = Vec3Of<T>{across * turn.cos, across * turn.sin, z} + stretched;
        return normalize(Vec3Of<T>{h.x * alpha_x, h.y * alpha_y, max(h.z, splat<T>(LEAST_RISE))});
    }
    // The density of that, by solid angle.
    T pdf_visible(Vec3Of<T> wi, Vec3Of<T> h) const {
        T seen = dot(wi, h), pdf = MicrofacetsOf{alpha_x, alpha_y}.d(h) * seen / (wi.z * (1.0 + lambda(wi, false)));
        return select(Mask<T>(seen > 0.0) & Mask<T>(h.z > 0.0), pdf, T{});
    }

   private:
    static constexpr double LEAST_RISE = 1e-12;

    T lambda(Vec3Of<T> v, bool beckmann) const {
        T x = v.x * alpha_x, y = v.y * alpha_y, squared = (x * x + y * y) / (v.z * v.z);
        if constexpr (std::is_same_v<T, double>)
            if (beckmann) {
                if (squared < 0.39) return 0;
                double a = 1 / std::sqrt(squared);
                return ((0.396 * a - 1.259) * a + 1) / ((2.181 * a + 3.535) * a);
            }
        return 0.5 * (sqrt(1.0 + squared) - 1.0);
    }
};
using Microfacets = MicrofacetsOf<double>;

}  // namespace viewcam::VIEWCAM_ISA
