// Rough reflection and refraction by microfacets, with any Fresnel term: how the little mirrors of a rough surface are turned, how they
// stand in each other's light, and what they scatter.
//
// Facets are in the frame of the surface's normal, z, with x along its tangent. GGX: Walter et al., Microfacet Models for Refraction
// (2007), and Heitz, Understanding the Masking-Shadowing Function (JCGT 3, 2014), whose Smith function for directions that are
// correlated by their height is Cycles' too; Beckmann's with the rational fit of its masking that Walter gives.
//
// Facets are sampled as the viewer sees them (Dupuy and Benyoub, Sampling Visible GGX Normals with Spherical Caps, 2023).
// Beckmann's are sampled by the GGX of the same roughness, whose tails are longer, so that no weight is large.
#pragma once
#include "../math/trig.h"
#include "fresnel.h"

namespace viewcam::VIEWCAM_ISA {

template <class T> struct MicrofacetsOf {
    T alpha_x, alpha_y;
    bool beckmann = false;  // single points alone have it

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

// The frame with z along a unit normal and x along the part of a tangent that lies in the surface; any x where that is nothing.
inline Frame frame_along(Vec3 normal, Vec3 tangent) {
    Frame frame(normal);
    Vec3 across = cross(normal, tangent);
    double size = length(across);
    if (size > 0) frame.t = across / size, frame.s = cross(frame.t, normal);
    return frame;
}

// Facets in a frame, seen by a viewer.
template <class T> struct MicrofacetLobeOf {
    Vec3Of<T> color;
    FrameOf<T> frame;
    Vec3Of<T> wi;  // to the viewer, in the frame
    MicrofacetsOf<T> facets;
    FresnelOf<T> fresnel;

    // About how much light it scatters, which lobes are chosen by: never nothing where there may be something.
    T albedo(Vec3Of<T> scattered) const {
        constexpr double LEAST = 0.05;
        Vec3Of<T> part = color * (gray(splat<T>(LEAST)) + unit_range(scattered) * splat<T>(1 - LEAST));
        return part.x + part.y + part.z;
    }
};

template <class T> struct MicrofacetReflectionOf : MicrofacetLobeOf<T> {
    static constexpr RayKind KIND = GLOSSY;
    static constexpr bool DELTA = false, IS_DIFFUSE = false;
    using MicrofacetLobeOf<T>::color, MicrofacetLobeOf<T>::frame, MicrofacetLobeOf<T>::wi, MicrofacetLobeOf<T>::facets, MicrofacetLobeOf<T>::fresnel;
    // True if rays count that facets send below the plane of a normal, as in Cycles before 5.0; none is asked of lights there.
    bool goes_below = false;

    T importance() const { return this->albedo(reflectance(fresnel, wi.z)); }
    Vec3Of<T> eval(Vec3Of<T> to_light) const { return eval_local(frame.to_local(to_light), false); }
    T pdf(Vec3Of<T> to_light) const { return pdf_local(frame.to_local(to_light), false); }
    LobeSampleOf<T> sample(Vec2Of<T> u) const {
        Vec3Of<T> h = facets.sample_visible(wi, u), wo = h * (2.0 * dot(wi, h)) - wi;
        T pdf = pdf_local(wo, goes_below);
        return {frame.to_world(wo), select(Mask<T>(pdf > 0.0), eval_local(wo, goes_below) / pdf, Vec3Of<T>{}), pdf};
    }

   private:
    Mask<T> is_above(Vec3Of<T> wo, bool or_below) const {
        Mask<T> seen(wi.z > 0.0);
        return or_below ? seen : seen & Mask<T>(wo.z > 0.0);
    }
    Vec3Of<T> eval_local(Vec3Of<T> wo, bool or_below) const {
        Mask<T> above = is_above(wo, or_below);
        if (!any(above)) return {};
        Vec3Of<T> h = normalize(wi + wo);
        Vec3Of<T> light = color * reflectance(fresnel, dot(wi, h)) * (facets.d(h) * facets.g(wi, wo) / (4.0 * wi.z));
        return select(above, light, Vec3Of<T>{});
    }
    T pdf_local(Vec3Of<T> wo, bool or_below) const {
        Mask<T> above = is_above(wo, or_below);
        if (!any(above)) return T{};
        Vec3Of<T> h = normalize(wi + wo);
        return select(above, facets.pdf_visible(wi, h) / (4.0 * dot(wi, h)), T{});
    }
};
using MicrofacetReflection = MicrofacetReflectionOf<double>;

// Refraction of what the Fresnel term does not reflect. ratio: see `fresnel`.
//
// As in Cycles, light from a lamp also comes in by half vectors that no facet can have which sends light down: so do the pictures
// that this is compared with. What is found by scattered rays has none of it. How much of it counts is a matter of the weights between
// the two, and so are these Cycles': it has one density for what facets reflect and refract, each in its share (bsdf_microfacet.h).
struct MicrofacetTransmission : MicrofacetLobeOf<double> {
    static constexpr RayKind KIND = TRANSMISSION;
    static constexpr bool DELTA = false, IS_DIFFUSE = false;
    double ratio;

    double importance() const { return albedo(gray(1) - reflectance(fresnel, wi.z)); }
    Vec3 eval(Vec3 to_light) const { return eval_local(frame.to_local(to_light)); }
    double pdf(Vec3 to_light) const { return pdf_local(frame.to_local(to_light)); }
    // False where no facet refracts light from a direction to the viewer.
    bool has_facet(Vec3 to_light) const {
        Vec3 wo = frame.to_local(to_light), bent = wo * ratio + wi, h = bent * std::copysign(1.0, bent.z);
        return dot(wi, h) > 0 && dot(wo, h) < 0;
    }
    LobeSample sample(Vec2 u) const {
        constexpr double UNBENT = 1e-4;  // as in Cycles, where light from a lamp comes in by all facets even so
        if (std::fabs(ratio - 1) < UNBENT) return {frame.to_world(-wi), color * (gray(1) - reflectance(fresnel, wi.z)), INFINITE};
        Vec3 h = facets.sample_visible(wi, u);
        double cosine = dot(wi, h), squared = 1 - (1 - cosine * cosine) / (ratio * ratio);
        if (!(squared > 0)) return {frame.to_world(-wi), {}, 0};
        Vec3 wo = h * (cosine / ratio - std::sqrt(squared)) - wi / ratio;
        double pdf = pdf_local(wo);
        return {frame.to_world(wo), pdf > 0 ? eval_local(wo) / pdf : Vec3{}, pdf};
    }

   private:
    Vec3 eval_local(Vec3 wo) const {
        if (!(wi.z > 0 && wo.z < 0)) return {};
        Vec3 bent = wo * ratio + wi;
        double squared = dot(bent, bent);
        Vec3 h = bent / std::sqrt(squared);
        double in = dot(wi, h), out = dot(wo, h), jacobian = ratio * ratio / squared * std::fabs(in * out);
        Vec3 let_through = gray(1) - reflectance(fresnel, std::fabs(in));
        return color * let_through * (facets.d(h) * facets.g(wi, wo) / wi.z * jacobian);
    }
    double pdf_local(Vec3 wo) const {
        if (!(wi.z > 0 && wo.z < 0)) return 0;
        Vec3 bent = wo * ratio + wi;
        double squared = dot(bent, bent);
        Vec3 h = bent / std::copysign(std::sqrt(squared), bent.z);
        double out = dot(wo, h), jacobian = ratio * ratio * std::fabs(out) / squared;
        if (dot(wi, h) > 0 && out < 0) return facets.pdf_visible(wi, h) * jacobian;
        // No facet refracts there, and no sample comes of it: the density that Cycles weighs a light's sample by.
        double in = std::fabs(dot(wi, h)), let_through = mean(gray(1) - reflectance(fresnel, in));
        double both = std::holds_alternative<TotalReflection>(fresnel) ? 1 : 1 + albedo(reflectance(fresnel, wi.z)) / importance();
        return let_through * both * facets.d(h) * in / (wi.z * (1 + facets.lambda(wi))) * jacobian;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
