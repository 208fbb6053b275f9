// The sample of a BSDF, or of one lobe of it; and directions that are spread over spheres and cones as some density says.
#pragma once
#include "../math/trig.h"
#include "../math/vec.h"
#include "../ray.h"

namespace viewcam::VIEWCAM_ISA {

// direction: unit. weight: the BSDF times the cosine over the density. pdf: the density by solid angle, INFINITE of mirrors.
template <class T> struct LobeSampleOf {
    Vec3Of<T> direction, weight;
    T pdf{};
};
using LobeSample = LobeSampleOf<double>;
// kind: of the ray that goes on, a RayKind.
template <class T> struct BSDFSampleOf : LobeSampleOf<T> {
    Flags<T> kind{};
    Mask<T> is_diffuse{};
};

// A direction as often as the cosine of its angle to the unit normal is large; `cosine` receives that. It points from where a
// unit sphere touches the surface to a point that lies evenly all over the sphere, twice the cosine away: no frame is needed.
template <class T> inline Vec3Of<T> cosine_direction(Vec3Of<T> normal, Vec2Of<T> u, T& cosine) {
    constexpr double POLE = 0x1p-33;  // half of a sampler's last digit: no direction is a pole, which would be none at all
    T height = u.x * (2 - 4 * POLE) + (2 * POLE - 1), across = sqrt(1.0 - height * height);
    SinCosOf<T> turn = sincos_of_turns(u.y);
    Vec3Of<T> direction = Vec3Of<T>{across * turn.cos, across * turn.sin, height} + normal;
    T size = length(direction);
    cosine = size / 2.0;
    return direction / size;
}

// A direction spread evenly over the solid angle of a cone. one_minus_cos_max: of half the opening; `one_minus_cos`: receives that of
// the direction's angle to the axis.
template <class T> inline Vec3Of<T> cone_direction(Vec3Of<T> axis, Scalar<T> one_minus_cos_max, Vec2Of<T> u, T& one_minus_cos) {
    FrameOf<T> frame(axis);
    one_minus_cos = u.x * one_minus_cos_max;
    T sine = sqrt(one_minus_cos * (2.0 - one_minus_cos));
    SinCosOf<T> turn = sincos_of_turns(u.y);
    return axis * (1.0 - one_minus_cos) + frame.s * (sine * turn.cos) + frame.t * (sine * turn.sin);
}

// 1 − cos of angles up to a right one: a light that is far away fills a cone whose cosine is 1 to the last bit.
template <class T> inline T one_minus_cosine(T squared_sine) { return squared_sine / (1.0 + sqrt(1.0 - squared_sine)); }

// About the cosine under which what reaches `reach` round a place is seen, 0 only if all of it is below the horizon.
// height: of the place above the surface's plane. distance: of the place.
inline double risen(double height, double distance, double reach) { return max(height + reach, 0.0) / (distance + reach); }

}  // namespace viewcam::VIEWCAM_ISA
