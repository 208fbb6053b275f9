// Where the light of one or more lamps comes from and where it goes, as far as a bound of what it brings to a point asks for it:
// a box, and a cone about the normals of what shines (Conty Estevez and Kulla, Importance Sampling of Many Lights with Adaptive
// Tree Splitting, 2018; Pharr, Jakob and Humphreys, Physically Based Rendering, 4th edition, 12.6.3).
#pragma once
#include "../accel/bvh.h"
#include "../math/trig.h"

namespace viewcam::VIEWCAM_ISA {

struct LightBounds {
    Bounds box;
    double intensity = 0;     // the most that any direction has, power by solid angle
    Vec3 axis{0, 0, 1};       // unit, in the middle of all normals
    double cos_normals = -1;  // the cosine of the largest angle from the axis to a normal
    double cos_emission = 1;  // the cosine of the largest angle from a normal to where light is given

    Vec3 center() const { return box.low * 0.5 + box.high * 0.5; }
    bool is_around(Vec3 position) const {
        Vec3 way = center() - position, half = (box.high - box.low) * 0.5;
        return dot(way, way) <= dot(half, half);
    }
    // About what a surface receives, 0 only where it is nothing. shading: its smooth normal. through: from behind as well.
    double importance(Vec3 position, Vec3 normal, Vec3 shading, bool through) const {
        constexpr double ROUNDING = 1e-12, MOST = 1e100;
        Vec3 way = center() - position, half = (box.high - box.low) * 0.5;
        double squared = dot(way, way), reach = dot(half, half) * (1 + ROUNDING);
        if (squared <= reach) return reach > 0 ? min(intensity / reach, MOST) : 0;
        double distance = std::sqrt(squared), cos_box = std::sqrt(1 - reach / squared), sin_box = std::sqrt(reach / squared);
        double off_axis = cosine_of_rest(-dot(axis, way) / distance, cos_normals, sine(cos_normals));
        double off_normal = cosine_of_rest(off_axis, cos_box, sin_box);
        if (off_normal < cos_emission - ROUNDING) return 0;
        double above = dot(normal, way), smooth = dot(shading, way);  // light behind the true surface counts before the smooth one
        double risen = (through ? max(std::fabs(above), std::fabs(smooth)) : max(above, smooth)) / distance;
        double facing = cosine_of_rest(risen, cos_box, sin_box);
        return min(intensity / squared, MOST) * max(off_normal, 0.0) * max(facing, 0.0);
    }
    // The cost of a split that leaves these lights together: what they give, over the directions and from the places they may.
    double cost() const {
        Vec3 size = box.high - box.low;
        double normals = acos(cos_normals), reached = min(normals + acos(cos_emission), PI), sin_normals = sine(cos_normals);
        double directions = 2 * PI * (1 - cos_normals) +
                            PI / 2 * (2 * reached * sin_normals - cos(normals - 2 * reached) - 2 * normals * sin_normals + cos_normals);
        return intensity * directions * (size.x * size.y + size.y * size.z + size.z * size.x);
    }
    void add(const LightBounds& other) {
        if (other.intensity == 0) return;
        if (intensity == 0) {
            *this = other;
            return;
        }
        box.add(other.box);
        intensity += other.intensity;
        cos_emission = min(cos_emission, other.cos_emission);
        double own = acos(cos_normals), others = acos(other.cos_normals), apart = acos(std::clamp(dot(axis, other.axis), -1.0, 1.0));
        if (min(apart + others, PI) <= own) return;
        if (min(apart + own, PI) <= others) {
            axis = other.axis, cos_normals = other.cos_normals;
            return;
        }
        double half = (own + apart + others) / 2;
        Vec3 aside = other.axis - axis * dot(axis, other.axis);
        double size = length(aside);
        if (!(half < PI) || !(size > 1e-9)) {
            cos_normals = -1;
            return;
        }
        axis = normalize(axis * cos(half - own) + aside * (sin(half - own) / size));
        cos_normals = cos(half) - 1e-14;  // more than the rounding of all this
    }

   private:
    static double sine(double cosine) { return std::sqrt(max(1 - cosine * cosine, 0.0)); }
    // cos max(a − b, 0).
    static double cosine_of_rest(double cos_a, double cos_b, double sin_b) {
        return cos_a > cos_b ? 1 : cos_a * cos_b + sine(cos_a) * sin_b;
    }
};

// The box about a center, wider by more than what the place of a hit on its edge is rounded by.
inline Bounds box_around(Vec3 center, Vec3 reach) {
    constexpr double ROUNDINGS = 64 * 0x1p-53;
    Vec3 rounding = (abs(center) + reach) * ROUNDINGS;
    Bounds box;
    box.add(center - reach - rounding);
    box.add(center + reach + rounding);
    return box;
}

}  // namespace viewcam::VIEWCAM_ISA
