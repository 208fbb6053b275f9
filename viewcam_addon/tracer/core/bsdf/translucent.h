// Light that is let through and spread evenly on the other side.
#pragma once
#include "lambert.h"

namespace viewcam::VIEWCAM_ISA {

struct Translucent {
    static constexpr RayKind KIND = TRANSMISSION;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3 color, normal;

    double importance() const { return color.x + color.y + color.z; }
    Vec3 eval(Vec3 to_light) const { return color * pdf(to_light); }
    double pdf(Vec3 to_light) const { return max(-dot(normal, to_light), 0.0) / PI; }
    LobeSample sample(Vec2 u) const {
        double cosine;
        Vec3 direction = cosine_direction(-normal, u, cosine);
        return {direction, color, cosine / PI};
    }
};

}  // namespace viewcam::VIEWCAM_ISA
