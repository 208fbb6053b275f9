// The world: light from everywhere beyond the scene, the same everywhere.
//
// It is found best by rays that are scattered: none are aimed at it.
#pragma once
#include "../ray.h"

namespace viewcam::VIEWCAM_ISA {

struct Environment {
    Vec3 radiance;
    uint32_t hidden_from = 0;  // kinds of rays

    Vec3 le(Vec3, RayKind kind) const { return hidden_from & kind ? Vec3{} : radiance; }
    bool lights(RayKind kind) const { return !(hidden_from & kind) && !is_black(radiance); }
};

}  // namespace viewcam::VIEWCAM_ISA
