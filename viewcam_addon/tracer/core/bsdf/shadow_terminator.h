// How light ends on a bumped surface: what bumps turn towards the light may lie where the surface itself looks away.
//
// As in Cycles: since 4.3 bumps shadow diffuse light as microfacets would (Conty Estevez et al., A Microfacet-Based Shadowing Function
// to Solve the Bump Terminator Problem, Ray Tracing Gems, 2019), before that it is faded by a cubic (Chiang et al., Taming the Shadow
// Terminator, 2019).
#pragma once
#include "../math/vec.h"
#include "sampling.h"

namespace viewcam::VIEWCAM_ISA {

struct ShadowTerminator {
    Vec3 smooth;  // the normal without bumps
    bool by_facets, of_all;  // since 4.3; since 5.0, of light that is not diffuse, too

    // What is left of light from a direction that a lobe with a bumped normal scatters.
    double left(Vec3 bumped, bool is_diffuse, Vec3 to_light) const {
        double flat = dot(smooth, to_light), tilt = dot(smooth, bumped), light = dot(bumped, to_light);
        if (!is_diffuse) return (of_all ? flat * tilt * light : flat * light) < 0 ? 0 : 1;
        if (!by_facets) {
            double g = light * tilt != 0 ? flat / (light * tilt) : 0;
            return g >= 1 ? 1 : g < 0 ? 0 : ((1 - g) * g + 1) * g;
        }
        if (flat * tilt * light < 0) return 0;
        double up = std::fabs(flat), cosine = std::fabs(tilt);
        if (up >= 1 || cosine >= 1) return 1;
        if (up < 1e-6) return 0;
        double squared = min(0.125 * (1 / (cosine * cosine) - 1), 1.0);
        return 2 / (1 + std::sqrt(1 + squared * (1 / (up * up) - 1)));
    }
};

}  // namespace viewcam::VIEWCAM_ISA
