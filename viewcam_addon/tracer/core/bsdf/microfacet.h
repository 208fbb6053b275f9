// Rough reflection and refraction by microfacets, with any Fresnel term: Walter et al., Microfacet Models for Refraction (2007).
#pragma once
#include "bsdf_sample.h"
#include "fresnel.h"
#include "microfacets.h"

namespace viewcam::VIEWCAM_ISA {

// The frame with z along a unit normal and x along the part of a tangent that lies in the surface; any x where that is nothing.
inline Frame frame_along(Vec3 normal, Vec3 tangent) {
    Frame frame(normal);
    Vec3 across = cross(normal, tangent);
    double size = length(across);
    if (size > 0) frame.t = across / size, frame.s = cross(frame.t, normal);
    return frame;
}

// Facets in a frame, seen by a viewer.
struct MicrofacetLobe {
    Vec3 color;
    Frame frame;
    Vec3 wi;  // to the viewer, in the frame
    Microfacets facets;
    Fresnel fresnel;

    // About how much light it scatters, which lobes are chosen by: never nothing where there may be something.
    double albedo(Vec3 scattered) const {
        constexpr double LEAST = 0.05;
        Vec3 part = color * (grey(LEAST) + unit_range(scattered) * (1 - LEAST));
        return part.x + part.y + part.z;
    }
};

struct MicrofacetReflection : MicrofacetLobe {
    static constexpr RayKind KIND = GLOSSY;
    static constexpr bool DELTA = false, IS_DIFFUSE = false;

    double importance() const { return albedo(reflectance(fresnel, wi.z)); }
    Vec3 eval(Vec3 to_light) const { return eval_local(frame.to_local(to_light)); }
    double pdf(Vec3 to_light) const { return pdf_local(frame.to_local(to_light)); }
    LobeSample sample(Vec2 u) const {
        Vec3 h = facets.sample_visible(wi, u), wo = h * (2 * dot(wi, h)) - wi;
        double pdf = pdf_local(wo);
        return {frame.to_world(wo), pdf > 0 ? eval_local(wo) / pdf : Vec3{}, pdf};
    }

   private:
    Vec3 eval_local(Vec3 wo) const {
        if (!(wi.z > 0 && wo.z > 0)) return {};
        Vec3 h = normalize(wi + wo);
        return color * reflectance(fresnel, dot(wi, h)) * (facets.d(h) * facets.g(wi, wo) / (4 * wi.z));
    }
    double pdf_local(Vec3 wo) const {
        if (!(wi.z > 0 && wo.z > 0)) return 0;
        Vec3 h = normalize(wi + wo);
        return facets.pdf_visible(wi, h) / (4 * dot(wi, h));
    }
};

// What the Fresnel term does not reflect, refracted. ratio: as of `fresnel`.
//
// As in Cycles, light from a lamp also comes in by half vectors that no facet can have which sends light down: so do the pictures
// that this is compared with. What is found by scattered rays has none of it.
struct MicrofacetTransmission : MicrofacetLobe {
    static constexpr RayKind KIND = TRANSMISSION;
    static constexpr bool DELTA = false, IS_DIFFUSE = false;
    double ratio;

    double importance() const { return albedo(grey(1) - reflectance(fresnel, wi.z)); }
    Vec3 eval(Vec3 to_light) const { return eval_local(frame.to_local(to_light)); }
    double pdf(Vec3 to_light) const { return pdf_local(frame.to_local(to_light)); }
    LobeSample sample(Vec2 u) const {
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
        double in = dot(wi, h), out = dot(wo, h), spread = ratio * ratio / squared * std::fabs(in * out);
        Vec3 let_through = grey(1) - reflectance(fresnel, std::fabs(in));
        return color * let_through * (facets.d(h) * facets.g(wi, wo) / wi.z * spread);
    }
    double pdf_local(Vec3 wo) const {
        if (!(wi.z > 0 && wo.z < 0)) return 0;
        Vec3 bent = wo * ratio + wi;
        double squared = dot(bent, bent);
        Vec3 h = bent / std::copysign(std::sqrt(squared), bent.z);
        double out = dot(wo, h);
        return out < 0 ? facets.pdf_visible(wi, h) * ratio * ratio * -out / squared : 0;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
