// Rough conductors.
#pragma once
#include "facets.h"

namespace viewcam::VIEWCAM_ISA {

struct MetallicClosure {
    static constexpr const char* NAME = "metallic";
    static constexpr uint32_t KINDS = GLOSSY;
    Color color, edge_tint, ior, extinction, roughness, normal;
    Anisotropy anisotropy;
    Distribution distribution;
    bool physical;  // by index of refraction and extinction instead of two colours

    explicit MetallicClosure(const Inputs& in)
        : color(in["color"]), edge_tint(in["edge_tint"]), ior(in["ior"]), extinction(in["extinction"]), roughness(in["roughness"]), normal(in["normal"]),
          anisotropy{in["anisotropy"], in["rotation"], in["tangent"]}, distribution(in.choice("distribution")), physical(in.choice("fresnel") == "physical_conductor") {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        Vec3 shading = at.normal(this->normal), normal = at.specular(shading);
        Facets facets = anisotropy.of(at, shading, distribution.facets(at.number(roughness)));
        auto add = [&](const auto& fresnel) {
            if (distribution.multiple) {
                MultipleScattering more = multiple_reflection(at, normal, facets, fresnel.mean());
                weight = weight * more.albedo * more.lobe;
            }
            add_reflection(bsdf, at, weight, normal, facets, fresnel);
        };
        if (physical)
            add(ConductorFresnel{at.color(ior), at.color(extinction), at.version >= CYCLES_5_0});
        else
            add(F82::of(unit_range(at.color(color)), unit_range(at.color(edge_tint))));
    }
};

}  // namespace viewcam::VIEWCAM_ISA
