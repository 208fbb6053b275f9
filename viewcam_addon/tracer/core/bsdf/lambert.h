// Lambert's diffuse reflection.
#pragma once
#include "../textures.h"
#include "bsdf_sample.h"
#include "sampling.h"

namespace viewcam::VIEWCAM_ISA {

struct Lambert {
    static constexpr RayKind KIND = DIFFUSE;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3 color, normal;

    // What of light from a unit direction is sent on, cosine included.
    Vec3 eval(Vec3 to_light) const { return color * pdf(to_light); }
    double pdf(Vec3 to_light) const { return larger(dot(normal, to_light), 0.0) / PI; }
    LobeSample sample(Vec2 u) const {
        double cosine;
        Vec3 direction = cosine_direction(normal, u, cosine);
        return {direction, color, cosine / PI};
    }
};

}  // namespace viewcam::VIEWCAM_ISA
