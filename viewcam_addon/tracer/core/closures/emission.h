// Light that a surface gives off, to both sides.
#pragma once
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

struct EmissionClosure {
    static constexpr const char* NAME = "emission";
    static constexpr uint32_t KINDS = 0;
    Color color, strength;

    explicit EmissionClosure(const Inputs& in) : color(in["color"]), strength(in["strength"]) {}
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const { bsdf.emit(weight * at.color(color) * at.number(strength)); }
    bool shines_evenly() const { return !color.varies() && !strength.varies(); }
    // In the mean over the images of its inputs.
    Vec3 mean_emission(const std::vector<Texture>& textures) const { return color.mean(textures) * strength.mean(textures); }
};

}  // namespace viewcam::VIEWCAM_ISA
