// The perfect mirror, and how smooth normals are bent for mirrors and glass.
#pragma once
#include "bsdf_sample.h"
#include "../math/trig.h"

namespace viewcam::VIEWCAM_ISA {

// Where a mirror sends a ray that comes along `incoming`.
inline Vec3 reflected(Vec3 incoming, Vec3 normal) { return incoming - normal * (2 * dot(incoming, normal)); }

// The smooth, or bumped, normal of a mirror or of glass, bent towards the true one where its mirror's ray would go below the surface.
//
// As in Cycles, a mirror's ray rises by a hundredth above the surface or, where the ray that comes is flatter still, by nine
// tenths of that one's rise, and the normal stays in the plane of the two. There the way back to the eye has the length r and
// the angle φ from the true normal, counted towards the smooth one, and a mirror whose normal is turned by α sends the ray off
// at 2α − φ. Its rise, r cos(2α − φ), is the least where α = (φ + arccos(rise / r)) / 2.
inline Vec3 specular_normal(Vec3 incoming, Vec3 normal, Vec3 shading) {
    constexpr double LEAST_RISE = 0.01, RISE_SHARE = 0.9;
    double rise = min(RISE_SHARE * max(-dot(incoming, normal), 0.0), LEAST_RISE);
    if (dot(reflected(incoming, shading), normal) >= rise) return shading;
    Vec3 back = -incoming, aside = shading - normal * dot(shading, normal);
    double size = length(aside);
    if (size > 0) aside = aside / size;
    double up = dot(back, normal), along = dot(back, aside), reach = std::sqrt(up * up + along * along);
    double turn = (atan2(along, up) + acos(min(rise / (reach > 0 ? reach : 1), 1.0))) / 2;
    return aside * sin(turn) + normal * cos(turn);
}

struct SpecularReflection {
    static constexpr RayKind KIND = GLOSSY;
    static constexpr bool DELTA = true, IS_DIFFUSE = false;
    Vec3 color, normal, incoming;

    Vec3 eval(Vec3) const { return {}; }
    double pdf(Vec3) const { return 0; }
    LobeSample sample(Vec2) const { return {reflected(incoming, normal), color, INFINITE}; }
};

}  // namespace viewcam::VIEWCAM_ISA
