// Area lights: rectangles and ellipses that shine to one side, into all of it or, as through the slats of a grid, into a cone.
//
// From afar a light is sampled by its area. A rectangle that is near, or seen at a slant, is sampled evenly over the solid angle
// it fills (Ureña, Fajardo and King, An Area-Preserving Parametrization for Spherical Rectangles, 2013), which takes longer and
// is less noisy there. That angle is a sum known to 10⁻¹⁵ only, so rectangles that fill less than 10⁻⁶ are sampled by their area
// again, and so are those that shear has made parallelograms. An ellipse that is near, where sampling its area would be
// unbounded, is sampled as the rectangle round it, of which a fifth is dark.
#pragma once
#include "light_sample.h"

namespace viewcam::VIEWCAM_ISA {

// A rectangle parallel to the x-y plane, seen from the origin: points of it spread evenly over the solid angle that it fills.
class SphericalRectangle {
   public:
    // depth: of the plane, of either sign.
    SphericalRectangle(double x0, double x1, double y0, double y1, double depth)
        : x0_(x0), x1_(x1), y0_(y0), y1_(y1), depth_(depth), squared_(depth * depth) {
        // The depth components of the unit normals of the planes through the origin and each side; the others are 0 in pairs.
        bottom_ = -y0 / std::sqrt(squared_ + y0 * y0), top_ = y1 / std::sqrt(squared_ + y1 * y1);
        double right = x1 / std::sqrt(squared_ + x1 * x1), left = -x0 / std::sqrt(squared_ + x0 * x0);
        behind_ = asin(top_ * left) + asin(left * bottom_);
        angle_ = asin(bottom_ * right) + asin(right * top_) + behind_;
    }
    double solid_angle() const { return angle_ > 0 ? angle_ : 0; }
    Vec2 point(Vec2 u) const {
        // From here on x, that part of the angle is to the left of it which u asks for.
        SinCos turn = sincos_of_turns((u.x * angle_ - behind_) * (0.5 / PI));
        double rest = turn.cos * bottom_ + top_;
        double slope = std::sqrt(larger(rest * rest - turn.sin * turn.sin * (squared_ / (squared_ + y0_ * y0_)), 0.0));
        double x = smaller(larger(std::copysign(depth_, rest) * turn.sin / slope, x0_), x1_);
        // With x known, y spreads as the sine of its elevation.
        double squared = x * x + squared_;
        double low = y0_ / std::sqrt(squared + y0_ * y0_), high = y1_ / std::sqrt(squared + y1_ * y1_);
        double elevation = low + u.y * (high - low);
        double y = elevation * std::sqrt(squared / larger(1 - elevation * elevation, 0.0));
        return {x, smaller(larger(y, y0_), y1_)};
    }

   private:
    double x0_, x1_, y0_, y1_, depth_, squared_, bottom_, top_, behind_, angle_;
};

class Area {
   public:
    // to_world: the light's space to rendering space; it lies in its x-y plane and shines along −z. size: of its sides there.
    // spread: the angle of the cone, radians; π where there is no grid.
    Area(const Affine& to_world, Vec3 power, Vec2 size, bool ellipse, double spread)
        : center_(to_world.translation()), power_(power), ellipse_(ellipse) {
        constexpr double ASKEW = 1e-9, NARROW = 0.05;
        if (spread < PI) {
            double half = spread / 2;
            cos_spread_ = cos(half), tan_spread_ = sin(half) / cos_spread_;
            focus_ = half > NARROW ? 1 / (tan_spread_ - half) : 3 / (half * half * half);  // as Cycles has it: 0.1 % apart where they meet
        }
        Vec3 x = column(to_world, 0) * (size.x / 2), y = column(to_world, 1) * (size.y / 2);
        double area = 4 * length(cross(x, y)) * (ellipse ? PI / 4 : 1);
        if (ellipse) find_half_axes(x, y);
        lengths_[0] = length(x), lengths_[1] = length(y);
        first_ = x / lengths_[0], second_ = y / lengths_[1];
        Vec3 normal = cross(first_, second_);
        sine_ = length(normal);
        normal_ = normal * std::copysign(1 / sine_, -dot(normal, column(to_world, 2)));
        radiance_ = power / (PI * area), area_ = area;
        reach_ = std::sqrt(lengths_[0] * lengths_[0] + lengths_[1] * lengths_[1]);
        askew_ = !ellipse && std::fabs(dot(first_, second_)) > ASKEW;
    }

    bool is_sized() const { return true; }

    LightSample sample_li(const Interaction& from, Vec2 u) const {
        Vec3 way = center_ - from.position;
        if (is_near(way)) {
            double middle[2] = {dot(first_, way), dot(second_, way)}, depth = dot(normal_, way);
            SphericalRectangle seen = rectangle(way);
            double angle = seen.solid_angle();
            if (ellipse_ || angle >= SMALLEST_ANGLE) {
                Vec2 place = seen.point(u);
                double distance = std::sqrt(place.x * place.x + place.y * place.y + depth * depth);
                Vec3 ahead = (first_ * place.x + second_ * place.y + normal_ * depth) / distance;
                bool lit = depth < 0 && (!ellipse_ || covers((place.x - middle[0]) / lengths_[0], (place.y - middle[1]) / lengths_[1]));
                double cosine = -dot(normal_, ahead);
                return {ahead, distance, lit ? radiance_ * (angle * through_grid(cosine)) : Vec3{}, 1 / angle, cosine};
            }
        }
        double across = 2 * u.x - 1, along = 2 * u.y - 1;
        if (ellipse_) {
            SinCos turn = sincos_of_turns(u.y);
            double radius = std::sqrt(u.x);
            across = radius * turn.cos, along = radius * turn.sin;
        }
        Vec3 to = way + first_ * (lengths_[0] * across) + second_ * (lengths_[1] * along);
        double squared = dot(to, to), distance = std::sqrt(squared);
        Vec3 ahead = to / distance;
        double cosine = larger(-dot(normal_, ahead), 0.0);
        double weight = smaller(cosine / (PI * squared), MOST_WEIGHT_OF_LIGHT) * through_grid(cosine);
        return {ahead, distance, power_ * weight, squared / (cosine * area_), cosine};
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        Vec3 way = center_ - from.position;
        if (is_near(way)) {
            double angle = rectangle(way).solid_angle();
            if (ellipse_ || angle >= SMALLEST_ANGLE) return 1 / angle;
        }
        double cosine = -dot(normal_, direction), distance = -dot(normal_, way) / cosine;
        return cosine > 0 ? distance * distance / (cosine * area_) : 0;
    }

    Vec3 le(const LightRay& ray, double& distance) const {
        double facing = dot(normal_, ray.direction);
        Vec3 way = center_ - ray.origin;
        distance = dot(normal_, way) / facing;
        if (!(facing < 0 && distance > ray.nearest && distance < ray.farthest)) return {};
        // Each coordinate along the direction that the other side is perpendicular to: the sides may be askew.
        Vec3 place = ray.direction * distance - way, plane = cross(first_, second_) / (sine_ * sine_);
        double across = dot(cross(second_, plane), place) / lengths_[0], along = dot(cross(plane, first_), place) / lengths_[1];
        return covers(across, along) ? radiance_ * through_grid(-facing) : Vec3{};
    }

    Vec3 normal(Vec3, Vec3) const { return normal_; }

    double estimate(Vec3 position, Vec3 normal) const {
        Vec3 way = center_ - position;
        double before = -dot(way, normal_), squared = dot(way, way), farthest = std::sqrt(squared) + reach_;
        if (!(before > 0)) return 0;
        double light = larger(dot(normal, way) + reach_, 0.0) * (before + reach_);  // two cosines, as of `risen`
        double aside = larger(std::sqrt(larger(squared - before * before, 0.0)) - reach_, 0.0);  // of what of it is the least aside
        double most = through_grid(before / std::sqrt(before * before + aside * aside));
        return light * most * (mean(power_) / PI / (farthest * farthest * (squared + reach_ * reach_ / 2)));
    }
    LightBounds bounds() const {
        double most = mean(power_) / PI * through_grid(1);
        return {box_around(center_, abs(first_) * lengths_[0] + abs(second_) * lengths_[1]), most, normal_, 1, cos_spread_};
    }

   private:
    // FAR: how many times its longer half axis a light is away where cos/distance² varies less over it than an ellipse's dark
    // fifth costs. SLANT: by which part of its distance the ends of a rectangle may be farther off than its middle there.
    static constexpr double SMALLEST_ANGLE = 1e-6, FAR = 3, SLANT = 0.2;

    static Vec3 column(const Affine& map, int k) { return {map.m[0][k], map.m[1][k], map.m[2][k]}; }

    // The half axes of a circle that a map with these columns has made an ellipse, the longer one first: Jacobi's rotation.
    static void find_half_axes(Vec3& x, Vec3& y) {
        double angle = 0.5 * atan2(2 * dot(x, y), dot(x, x) - dot(y, y));
        Vec3 first = x * cos(angle) + y * sin(angle), second = y * cos(angle) - x * sin(angle);
        x = first, y = second;
    }

    bool is_near(Vec3 way) const {
        double squared = dot(way, way), longest = FAR * larger(lengths_[0], lengths_[1]);
        if (squared < longest * longest) return !askew_;
        if (ellipse_ || askew_) return false;
        return std::fabs(dot(first_, way)) * lengths_[0] + std::fabs(dot(second_, way)) * lengths_[1] > SLANT * squared;
    }
    SphericalRectangle rectangle(Vec3 way) const {
        double x = dot(first_, way), y = dot(second_, way);
        return {x - lengths_[0], x + lengths_[0], y - lengths_[1], y + lengths_[1], dot(normal_, way)};
    }
    // Of the light, by the cosine of the angle at which it leaves: what falls off is the part that the grid's slats leave free, and
    // all of it together stays what it is without a grid (Blender D10594).
    double through_grid(double cosine) const {
        if (focus_ == 0) return 1;
        if (!(cosine > cos_spread_)) return 0;
        return larger(tan_spread_ - std::sqrt(larger(1 - cosine * cosine, 0.0)) / cosine, 0.0) * focus_;
    }
    // Coordinates −1 to 1 along the half sides.
    bool covers(double across, double along) const {
        return ellipse_ ? across * across + along * along <= 1 : std::fabs(across) <= 1 && std::fabs(along) <= 1;
    }

    Vec3 center_, power_, radiance_, first_, second_, normal_;  // half sides, unit; normal: to where it shines
    double lengths_[2], sine_, reach_, area_;
    double cos_spread_ = 0, tan_spread_ = 0, focus_ = 0;  // of half the cone; focus: 0 without a grid
    bool ellipse_, askew_;
};

}  // namespace viewcam::VIEWCAM_ISA
