// Sheen of cloth.
#pragma once
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

struct SheenClosure {
    static constexpr const char* NAME = "sheen";
    static constexpr uint32_t KINDS = DIFFUSE | GLOSSY;
    Color color, roughness, normal;
    bool fibers;  // or Ashikhmin's velvet

    explicit SheenClosure(const Inputs& in)
        : color(in["color"]), roughness(in["roughness"]), normal(in["normal"]), fibers(in.choice("distribution") == "microfiber") {}
    uint32_t kinds() const { return fibers ? DIFFUSE : GLOSSY; }
    bool is_rough() const { return true; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        Vec3 tint = at.color(color) * weight, normal = at.normal(this->normal);
        if (fibers)
            bsdf.add(SheenLobe(tint, normal, -at.incoming, unit_range(at.number(roughness))));
        else
            bsdf.add(VelvetLobe(tint, normal, -at.incoming, unit_range(at.number(roughness))));
    }
};

}  // namespace viewcam::VIEWCAM_ISA
