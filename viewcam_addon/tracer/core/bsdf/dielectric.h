// Clear surfaces: Snell's refraction, and Fresnel's share of what is reflected.
//
// Cycles' smooth, perfectly clear surfaces (measured with 4.2, 5.0 and 5.2) are these: Fresnel's equations as they are, and no
// factor for the narrower cone of light in glass.
#pragma once
#include "specular.h"

namespace viewcam::VIEWCAM_ISA {

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
