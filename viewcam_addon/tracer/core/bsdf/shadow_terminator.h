// The end of light on a bumped surface: what bumps turn towards the light may lie where the surface itself looks away.
//
// As in Cycles: since 4.3 bumps shadow diffuse light as microfacets would (Conty Estevez et al., A Microfacet-Based Shadowing Function
// to Solve the Bump Terminator Problem, Ray Tracing Gems, 2019), before that it is faded by a cubic (Chiang et al., Taming the Shadow
// Terminator, 2019).
#pragma once
#include "../math/simd.h"
#include "sampling.h"

namespace viewcam::VIEWCAM_ISA {

template <class T> struct ShadowTerminatorOf {
    Vec3Of<T> smooth;  // the normal without bumps
    bool by_facets, of_all;  // since 4.3; since 5.0, of light that is not diffuse, too

    // The share that is left of light from a direction, scattered by a lobe with a bumped normal.
    T left(Vec3Of<T> bumped, bool is_diffuse, Vec3Of<T> to_light) const {
        T flat = dot(smooth, to_light), tilt = dot(smooth, bumped), light = dot(bumped, to_light), none{}, all = splat<T>(1);
        if (!is_diffuse) return select(Mask<T>((of_all ? flat * tilt * light : flat * light) < 0.0), none, all);
        if (!by_facets) {
            T g = select(Mask<T>(light * tilt != 0.0), flat / (light * tilt), none);
            return select(Mask<T>(g >= 1.0), all, select(Mask<T>(g < 0.0), none, ((1.0 - g) * g + 1.0) * g));
        }
        T up = abs(flat), cosine = abs(tilt), squared = min(0.125 * (1.0 / (cosine * cosine) - 1.0), all);
        T left = 2.0 / (1.0 + sqrt(1.0 + squared * (1.0 / (up * up) - 1.0)));
        left = select(Mask<T>(up < 1e-6), none, left);
        left = select(Mask<T>(up >= 1.0) | Mask<T>(cosine >= 1.0), all, left);
        return select(Mask<T>(flat * tilt * light < 0.0), none, left);
    }
};

}  // namespace viewcam::VIEWCAM_ISA
