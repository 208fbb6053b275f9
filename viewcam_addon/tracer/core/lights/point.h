// Points: spheres that shine evenly, or, with a soft falloff, discs that face whatever they light.
//
// At the distance d a sphere of the radius R fills a cone of sin θ = R/d, a disc one of tan θ = R/d. Both have the radiance
// P/(4π² R²) and the solid angle 2π (1 − cos θ): R cancels. Inside a sphere light comes evenly from everywhere.
#pragma once
#include "light_sample.h"

namespace viewcam::VIEWCAM_ISA {

class Point {
   public:
    Point(Vec3 center, Vec3 power, double radius, bool soft)
        : center_(center), power_(power), radius_(not_tiny(radius)), soft_(soft) {
        radiance_ = radius_ > 0 ? power / (4 * PI * PI * radius_ * radius_) : Vec3{};
    }

    bool is_sized() const { return radius_ > 0; }
    Vec3 radiance() const { return radiance_; }

    // Whether light comes from everywhere at a place.
    bool is_around(Vec3 place) const {
        Vec3 way = center_ - place;
        return !soft_ && radius_ > 0 && std::sqrt(dot(way, way)) <= radius_;
    }
    // 1 − cos of half the cone that the light fills, seen from outside.
    double spread(Vec3 place) const {
        Vec3 way = center_ - place;
        double to_edge = dot(way, way) + (soft_ ? radius_ * radius_ : 0);
        return to_edge > 0 ? one_minus_cosine(smaller(radius_ * radius_ / to_edge, 1.0)) : 0;
    }

    LightSample sample_li(const Interaction& from, Vec2 u) const {
        Vec3 way = center_ - from.position;
        double squared = dot(way, way), distance = std::sqrt(squared);
        Vec3 axis = distance > 0 ? way / distance : Vec3{0, 0, 1};
        if (radius_ == 0) return {axis, distance, bounded(distance > 0 ? 1 / (4 * PI * squared) : 0)};
        if (is_around(from.position)) {
            double cosine;
            Vec3 ahead = cosine_direction(from.shading, u, cosine);
            double along = dot(way, ahead), reached = along + std::sqrt(larger(radius_ * radius_ - squared + along * along, 0.0));
            return {ahead, reached, radiance_ * (PI / larger(cosine, LEAST_COSINE)), cosine / PI};
        }
        double to_edge = squared + (soft_ ? radius_ * radius_ : 0), open = spread(from.position), short_of;
        Vec3 ahead = cone_direction(axis, open, u, short_of);
        double along = distance * (1 - short_of);
        double root = std::sqrt(larger(radius_ * radius_ - squared * short_of * (2 - short_of), 0.0));
        double reached = !soft_ ? along - root : along > 0 ? squared / along : 0;
        return {ahead, reached, bounded(to_edge > 0 ? 1 / ((2 - open) * (2 * PI * to_edge)) : 0), 1 / (2 * PI * open)};
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        if (radius_ == 0) return INFINITE;
        if (is_around(from.position)) return larger(dot(from.shading, direction), 0.0) / PI;
        return 1 / (2 * PI * spread(from.position));
    }

    // Whether a ray runs into the light. leaves: from inside, `only_outside` forbids what lies behind the middle.
    bool is_met(const LightRay& ray, bool only_ahead, double& distance) const {
        Vec3 way = center_ - ray.origin;
        double along = dot(way, ray.direction), squared = dot(way, way);
        if (soft_) {
            distance = squared / along;
            if (!(along > 0 && distance * distance - squared <= radius_ * radius_)) return false;
        } else {
            Vec3 aside = way - ray.direction * along;
            double root = radius_ * radius_ - dot(aside, aside);
            bool inside = squared <= radius_ * radius_;
            if (!(root >= 0 && (along > 0 || (inside && !only_ahead)))) return false;
            distance = along + (inside ? std::sqrt(root) : -std::sqrt(root));
        }
        return distance > ray.nearest && distance < ray.farthest;
    }
    Vec3 le(const LightRay& ray, double& distance) const { return radius_ > 0 && is_met(ray, false, distance) ? radiance_ : Vec3{}; }
    Vec3 normal(Vec3 place, Vec3 ahead) const {
        if (soft_ || radius_ == 0) return -ahead;
        Vec3 outward = normalize(place - center_);
        return dot(outward, ahead) > 0 ? -outward : outward;
    }

    double estimate(Vec3 position, Vec3 normal) const {
        Vec3 way = center_ - position;
        double distance = length(way), close = larger(distance, radius_);
        if (!(distance + radius_ > 0)) return 0;
        return mean(power_) / (4 * PI * close * close) * risen(dot(normal, way), distance, radius_);
    }
    LightBounds bounds() const { return {box_around(center_, {radius_, radius_, radius_}), mean(power_) / (4 * PI)}; }

    Vec3 center() const { return center_; }
    double radius() const { return radius_; }
    bool is_soft() const { return soft_; }

   private:
    static constexpr double LEAST_COSINE = 1e-30;

    Vec3 bounded(double factor) const { return power_ * smaller(factor, MOST_WEIGHT_OF_LIGHT); }

    Vec3 center_, power_, radiance_;
    double radius_;
    bool soft_;
};

}  // namespace viewcam::VIEWCAM_ISA
