// Dielectrics, smooth and rough: what they reflect and refract, and surfaces that refract only.
#pragma once
#include "facets.h"

namespace viewcam::VIEWCAM_ISA {

// f0: what is reflected straight back; where it is that of the index of refraction itself, Fresnel's equations hold as they are.
// mean_color: of light that is scattered more than once.
inline void add_glass(BSDF& bsdf, const ShadingPoint& at, Vec3 weight, Vec3 normal, const Facets& facets, double ratio, const Fresnel& fresnel,
                      Vec3 reflected, Vec3 transmitted, bool multiple) {
    if (multiple && !at.is_smooth(facets)) {
        AlbedoOf<double> single = glass_albedo(roughness_of(facets), -dot(normal, at.incoming), ratio);
        MultipleScattering more = MultipleScattering::of(single, unit_range(transmitted));
        weight = weight * more.albedo * more.lobe;
    }
    add_reflection(bsdf, at, weight * reflected, normal, facets, fresnel);
    add_refraction(bsdf, at, weight * transmitted, normal, facets, fresnel, ratio);
}

struct GlassClosure {
    static constexpr const char* NAME = "glass";
    static constexpr uint32_t KINDS = GLOSSY | TRANSMISSION;
    Color color, ior, roughness, normal;
    Distribution distribution;

    explicit GlassClosure(const Inputs& in)
        : color(in["color"]), ior(in["ior"]), roughness(in["roughness"]), normal(in["normal"]), distribution(in.choice("distribution")) {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        Vec3 rgb = at.color(color);
        double ratio = at.ratio(max(at.number(ior), LEAST_IOR));
        add_glass(bsdf, at, weight, at.specular_normal(normal), distribution.facets(at.number(roughness)), ratio, DielectricFresnel{ratio}, rgb, rgb,
                  distribution.multiple);
    }

   private:
    static constexpr double LEAST_IOR = 1e-5;
};

// It reflects nothing but where all is reflected, and there it is black.
struct RefractionClosure {
    static constexpr const char* NAME = "refraction";
    static constexpr uint32_t KINDS = TRANSMISSION;
    Color color, ior, roughness, normal;
    Distribution distribution;

    explicit RefractionClosure(const Inputs& in)
        : color(in["color"]), ior(in["ior"]), roughness(in["roughness"]), normal(in["normal"]), distribution(in.choice("distribution")) {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        double ratio = at.ratio(max(at.number(ior), LEAST_IOR));
        add_refraction(bsdf, at, at.color(color) * weight, at.specular_normal(normal), distribution.facets(at.number(roughness)), TotalReflection{ratio},
                       ratio);
    }

   private:
    static constexpr double LEAST_IOR = 1e-5;
};

}  // namespace viewcam::VIEWCAM_ISA
