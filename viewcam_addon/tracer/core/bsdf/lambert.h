// Lambert's diffuse reflection, and light that is let through and spread as evenly on the other side.
#pragma once
#include "../textures.h"
#include "bsdf_sample.h"
#include "sampling.h"

namespace viewcam::VIEWCAM_ISA {

template <class T> struct LambertOf {
    static constexpr RayKind KIND = DIFFUSE;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3Of<T> color, normal;

    // The share of light from a unit direction that is sent on, cosine included.
    Vec3Of<T> eval(Vec3Of<T> to_light) const { return color * pdf(to_light); }
    T pdf(Vec3Of<T> to_light) const { return max(dot(normal, to_light), T{}) / PI; }
    LobeSampleOf<T> sample(Vec2Of<T> u) const {
        T cosine;
        Vec3Of<T> direction = cosine_direction(normal, u, cosine);
        return {direction, color, cosine / PI};
    }
};
using Lambert = LambertOf<double>;

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
