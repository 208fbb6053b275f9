// The perfect mirror, how smooth normals are bent for mirrors and glass, and clear surfaces: Snell's refraction, and Fresnel's share of
// what is reflected.
//
// Cycles' smooth, perfectly clear surfaces (measured with 4.2, 5.0 and 5.2) are these: Fresnel's equations as they are, and no
// factor for the narrower cone of light in glass.
#pragma once
#include "../math/trig.h"
#include "sampling.h"

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

// Where Snell's law sends a ray; along the surface where there is total reflection instead.
// ratio: the index of refraction on the far side over that on the side that the ray comes from.
inline Vec3 refracted(Vec3 incoming, Vec3 normal, double ratio) {
    Vec3 across = (incoming - normal * dot(incoming, normal)) / ratio;
    double squared = dot(across, across);
    if (squared >= 1) return across / std::sqrt(squared);
    return across - normal * std::sqrt(1 - squared);
}

// The part of unpolarized light that a clear surface reflects; the rest is refracted.
// cosine: of the angle between ray and normal, 0 to 1. ratio: as of `refracted`.
template <class T> inline T fresnel(T cosine, T ratio) {
    T excess = ratio * ratio - 1.0, squared = excess + cosine * cosine;
    T far = sqrt(squared);  // the cosine on the far side, times the ratio
    T slowed = ratio * ratio * cosine;
    T perpendicular = excess / ((far + cosine) * (far + cosine));  // (far − cosine) / (far + cosine) without cancellation
    T parallel = (far - slowed) / (far + slowed);
    T reflected = min(0.5 * (perpendicular * perpendicular + parallel * parallel), splat<T>(1));
    return select(Mask<T>(squared > 0.0), reflected, splat<T>(1));
}

struct SpecularTransmission {
    static constexpr RayKind KIND = TRANSMISSION;
    static constexpr bool DELTA = true, IS_DIFFUSE = false;
    Vec3 color, normal, incoming;
    double ratio;

    Vec3 eval(Vec3) const { return {}; }
    double pdf(Vec3) const { return 0; }
    LobeSample sample(Vec2) const { return {refracted(incoming, normal, ratio), color, INFINITE}; }
};

}  // namespace viewcam::VIEWCAM_ISA
