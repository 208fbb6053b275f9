// Spots: points that shine into a cone, measured in their own space.
#pragma once
#include "point.h"

namespace viewcam::VIEWCAM_ISA {

class Spot {
   public:
    // to_world: the spot's space to rendering space; it shines along −z. angle: of the whole cone, radians. blend: 0 to 1, the
    // part of the cone over which the light falls off.
    Spot(const Affine& to_world, Vec3 power, double radius, bool soft, double angle, double blend)
        : point_(to_world.translation(), power, radius, soft) {
        constexpr double HARD_EDGE = 1e-30, SHEARED = 1e-9;
        Vec3 x = column(to_world, 0), y = column(to_world, 1), z = column(to_world, 2);
        double determinant = dot(x, cross(y, z));
        inverse_[0] = cross(y, z) / determinant, inverse_[1] = cross(z, x) / determinant, inverse_[2] = cross(x, y) / determinant;
        axis_ = normalize(z);
        edge_ = cos(angle / 2);
        slope_ = 1 / larger((1 - edge_) * blend, HARD_EDGE);
        double askew = larger(std::fabs(dot(x, y)), larger(std::fabs(dot(y, z)), std::fabs(dot(z, x))));
        double longest = larger(dot(x, x), larger(dot(y, y), dot(z, z)));
        double wider = larger(dot(x, x), dot(y, y)) / dot(z, z), tangent = sin(angle / 2) / edge_;
        spread_ = askew > SHEARED * longest ? UNKNOWN : 1 - 1 / std::sqrt(1 + tangent * tangent * wider);
    }

    bool is_sized() const { return point_.is_sized(); }

    LightSample sample_li(const Interaction& from, Vec2 u) const {
        if (point_.is_around(from.position)) return point_.sample_li(from, u);
        LightSample sample = is_narrow(from.position) ? along_the_beam(from, u) : point_.sample_li(from, u);
        sample.weight *= attenuation(sample.direction);
        return sample;
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        if (is_sized() && !point_.is_around(from.position) && is_narrow(from.position)) return 1 / (2 * PI * spread_);
        return point_.pdf_li(from, direction);
    }

    Vec3 le(const LightRay& ray, double& distance) const {
        if (!is_sized() || !point_.is_met(ray, true, distance)) return {};
        return point_.is_around(ray.origin) ? point_.radiance() : point_.radiance() * attenuation(ray.direction);
    }

    Vec3 normal(Vec3 place, Vec3 ahead) const { return point_.normal(place, ahead); }

    // Part of a sphere may be seen from where its middle is dark.
    double estimate(Vec3 position, Vec3 normal) const {
        constexpr double LEAST_OF_A_WIDE_SPOT = 0.05;
        Vec3 way = point_.center() - position;
        double distance = length(way), seen = distance > 0 ? attenuation(way / distance) : 0;
        return point_.estimate(position, normal) * larger(seen, is_sized() ? LEAST_OF_A_WIDE_SPOT : 0);
    }
    LightBounds bounds() const {
        LightBounds bounds = point_.bounds();
        bounds.axis = -axis_, bounds.cos_normals = larger(1 - spread_, -1.0);
        return bounds;
    }

   private:
    static constexpr double UNKNOWN = 2;  // more than any sphere fills

    static Vec3 column(const Affine& map, int k) { return {map.m[0][k], map.m[1][k], map.m[2][k]}; }

    // Of a unit direction towards the spot.
    double attenuation(Vec3 ahead) const {
        double x = dot(inverse_[0], ahead), y = dot(inverse_[1], ahead), z = dot(inverse_[2], ahead);
        double rise = (z / std::sqrt(x * x + y * y + z * z) - edge_) * slope_;
        rise = rise > 0 ? smaller(rise, 1.0) : 0;
        return rise * rise * (3 - 2 * rise);
    }
    // Whether the sphere is so large, or near, that the spot's cone is narrower than it looks.
    bool is_narrow(Vec3 place) const { return is_sized() && !point_.is_soft() && spread_ < point_.spread(place); }
    LightSample along_the_beam(const Interaction& from, Vec2 u) const {
        double short_of, radius = point_.radius();
        Vec3 way = point_.center() - from.position, ahead = cone_direction(axis_, spread_, u, short_of);
        double along = dot(way, ahead), root = radius * radius - (dot(way, way) - along * along);
        Vec3 weight = root >= 0 && along > 0 ? point_.radiance() * (2 * PI * spread_) : Vec3{};
        return {ahead, along - std::sqrt(larger(root, 0.0)), weight, 1 / (2 * PI * spread_)};
    }

    Point point_;
    Vec3 inverse_[3], axis_;        // axis: against the beam
    double edge_, slope_, spread_;  // spread: 1 − cos of half the opening of a cone about the axis that holds all light
};

}  // namespace viewcam::VIEWCAM_ISA
