// Reflection of one colour by facets without a Fresnel term: a mirror where it is not rough.
#pragma once
#include "facets.h"

namespace viewcam::VIEWCAM_ISA {

struct GlossyClosure {
    static constexpr const char* NAME = "glossy";
    static constexpr uint32_t KINDS = GLOSSY;
    Color color, roughness, normal;
    Anisotropy anisotropy;
    Distribution distribution;

    explicit GlossyClosure(const Inputs& in)
        : color(in["color"]), roughness(in["roughness"]), normal(in["normal"]), anisotropy{in["anisotropy"], in["rotation"], in["tangent"]},
          distribution(in.choice("distribution")) {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        Vec3 rgb = at.color(color), normal = at.specular_normal(this->normal);
        Facets facets = anisotropy.of_glossy(at, normal, distribution.facets(at.number(roughness)));
        weight = weight * rgb;
        if (distribution.multiple) {
            MultipleScattering more = multiple_reflection(at, normal, facets, unit_range(rgb));
            weight = weight * more.albedo * more.lobe;
        }
        add_reflection(bsdf, at, weight, normal, facets, NoFresnel{});
    }
};

}  // namespace viewcam::VIEWCAM_ISA
