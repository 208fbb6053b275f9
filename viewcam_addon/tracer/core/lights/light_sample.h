// The questions to all lights, and their answers.
//
// Each kind of light is a class with
//
// - `sample_li`: for a point of a surface, a direction in which it sees the light, evenly over the solid angle that the light
//   fills there where that can be. So what a point gets is bounded however near the light, and a light of no size is no special
//   case: power and solid angle are multiplied out, and the radius cancels. `weight` is the radiance over the density.
// - `pdf_li`: the density with which `sample_li` chooses a direction that does see the light.
// - `le`: what a ray sees that runs into the light, and how far away. Lamps block no ray, as in Cycles: a ray sees all that it runs
//   through.
// - `normal`: of lamps, which way they face at a place that is seen along a direction.
// - `estimate`: how much the light brings to a point, roughly, and 0 only where it brings nothing.
// - `irradiance`: of what lies at infinity, the most that a surface receives.
// - `is_sized`: whether rays can run into it.
// - `bounds`: of what has a place, where it shines, and where to.
//
// Rejected: sampling spheres and rectangles by their area, whose samples near a point have the inverse square of their distance,
// and multiple importance sampling of lamps at diffuse surfaces, which that needs, and which costs a second ray.
#pragma once
#include "../bsdf/sampling.h"
#include "../ray.h"
#include "light_bounds.h"

namespace viewcam::VIEWCAM_ISA {

template <class T> struct LightSampleOf {
    Vec3Of<T> direction;               // unit, towards the light
    T distance = splat<T>(INFINITE);   // the distance of the point on the light
    Vec3Of<T> weight;                  // radiance over density
    T pdf = splat<T>(INFINITE);        // by solid angle; INFINITE of what has no size
    T cosine = splat<T>(1);            // under which the light's own surface is seen, of flat lights

    // Makes one of four this.
    void set(int i, const LightSampleOf<double>& sample) {
        set_lane(direction, i, sample.direction), set_lane(weight, i, sample.weight);
        distance[i] = sample.distance, pdf[i] = sample.pdf, cosine[i] = sample.cosine;
    }
};
using LightSample = LightSampleOf<double>;
template <class T> inline LightSampleOf<T> select(Mask<T> mask, const LightSampleOf<T>& a, const LightSampleOf<T>& b) {
    return {select(mask, a.direction, b.direction), select(mask, a.distance, b.distance), select(mask, a.weight, b.weight), select(mask, a.pdf, b.pdf),
            select(mask, a.cosine, b.cosine)};
}

// A ray that may run into lights, its direction unit. escaped: whether it meets no surface. start: from where its length counts.
struct LightRay {
    Vec3 origin, direction;
    double nearest = 0, farthest = INFINITE;
    bool escaped = false;
    double start = 0;
};

constexpr double MOST_WEIGHT_OF_LIGHT = 1e100;  // more light than any picture holds, less than makes products overflow

inline double mean(Vec3 rgb) { return (rgb.x + rgb.y + rgb.z) / 3; }
// The part that counts of a sample whose direction was picked with a density, where another way of picking has the other.
template <class T> inline T power_heuristic(T pdf, T other) {
    T ratio = other / pdf;
    return select(Mask<T>(ratio > 0.0), 1.0 / (1.0 + ratio * ratio), splat<T>(1));
}
// Sizes as they are, but 0 where their squares are nothing that float64 can divide by.
inline double not_tiny(double size) { return size > 1e-100 ? size : 0; }

}  // namespace viewcam::VIEWCAM_ISA
