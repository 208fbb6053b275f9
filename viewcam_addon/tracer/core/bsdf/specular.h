// The perfect mirror, and how smooth normals are bent for mirrors and glass.
#pragma once
#include "bsdf_sample.h"
#include "../math/trig.h"

namespace viewcam::VIEWCAM_ISA {

// Where a mirror sends a ray that comes along `incoming`.
template <class T> inline Vec3Of<T> reflected(Vec3Of<T> incoming, Vec3Of<T> normal) { return incoming - normal * (2.0 * dot(incoming, normal)); }

// The smooth, or bumped, normal of a mirror or of glass, bent towards the true one where its mirror's ray would go below the surface.
//
// As in Cycles, a mirror's ray rises by a hundredth above the surface or, where the ray that comes is flatter still, by nine
// tenths of that one's rise, and the normal stays in the plane of the two. There the way back to the eye has the length r and
// the angle φ from the true normal, counted towards the smooth one, and a mirror whose normal is turned by α sends the ray off
// at 2α − φ. Its rise, r cos(2α − φ), is the least where α = (φ + arccos(rise / r)) / 2.
template <class T> inline T least_rise(Vec3Of<T> incoming, Vec3Of<T> normal) {
    constexpr double LEAST_RISE = 0.01, RISE_SHARE = 0.9;
    return min(RISE_SHARE * max(-dot(incoming, normal), T{}), splat<T>(LEAST_RISE));
}
inline Vec3 specular_normal(Vec3 incoming, Vec3 normal, Vec3 shading) {
    double rise = least_rise(incoming, normal);
    if (dot(reflected(incoming, shading), normal) >= rise) return shading;
    Vec3 back = -incoming, aside = shading - normal * dot(shading, normal);
    double size = length(aside);
    if (size > 0) aside = aside / size;
    double up = dot(back, normal), along = dot(back, aside), reach = std::sqrt(up * up + along * along);
    double turn = (atan2(along, up) + acos(min(rise / (reach > 0 ? reach : 1), 1.0))) / 2;
    return aside * sin(turn) + normal * cos(turn);
}
inline Vec3x4 specular_normal(const Vec3x4& incoming, const Vec3x4& normal, const Vec3x4& shading) {
    Vec3x4 bent = shading;
    unsigned rising = bits(long4(dot(reflected(incoming, shading), normal) >= least_rise(incoming, normal)));
    for (unsigned low = ~rising & 15; low;) {
        int i = take_bit(low);
        set_lane(bent, i, specular_normal(lane(incoming, i), lane(normal, i), lane(shading, i)));
    }
    return bent;
}

template <class T> struct SpecularReflectionOf {
    static constexpr RayKind KIND = GLOSSY;
    static constexpr bool DELTA = true, IS_DIFFUSE = false;
    Vec3Of<T> color, normal, incoming;

    Vec3Of<T> eval(Vec3Of<T>) const { return {}; }
    T pdf(Vec3Of<T>) const { return T{}; }
    LobeSampleOf<T> sample(Vec2Of<T>) const { return {reflected(incoming, normal), color, splat<T>(INFINITE)}; }
};
using SpecularReflection = SpecularReflectionOf<double>;

}  // namespace viewcam::VIEWCAM_ISA
