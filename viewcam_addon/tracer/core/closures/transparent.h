// Surfaces, or parts of them, that light goes straight through: the path goes on as if they were not there, but for a colour.
#pragma once
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

struct TransparentClosure {
    static constexpr const char* NAME = "transparent";
    static constexpr uint32_t KINDS = 0;
    Color color;

    explicit TransparentClosure(const Inputs& in) : color(in["color"]) {}
    bool lets_through() const { return !color.is_black(); }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const { bsdf.let_through(weight * at.color(color)); }
};

}  // namespace viewcam::VIEWCAM_ISA
