// Surfaces that give light, as lights that shadow rays are sent to: the triangles of an object that has a bright material.
//
// A triangle is picked by its area times the mean emission of its material, and a point of it evenly. What that brings is
// unbounded close by, so it is weighted against rays that are scattered by chance and run into the triangle (path.h). Spheres
// are only met by such rays. Rejected: sampling triangles by solid angle, which costs more than those rays, and they are
// needed anyway.
#pragma once
#include <algorithm>
#include <vector>

#include "../scene.h"
#include "light_sample.h"

namespace viewcam::VIEWCAM_ISA {

class MeshLight {
   public:
    // emissions: the mean of each of the scene's materials.
    MeshLight(const Scene& scene, uint32_t object, const std::vector<Vec3>& emissions) : scene_(&scene), object_(object) {
        uint32_t count = scene.triangle_count(object);
        double total = 0;
        for (uint32_t triangle = 0; triangle < count; triangle++) {
            Vec3 corners[3];
            double emission = mean(emissions[scene.material(object, triangle)]);
            if (emission > 0) {
                scene.corners(object, triangle, corners);
                total += length(cross(corners[1] - corners[0], corners[2] - corners[0])) / 2 * emission;
                for (Vec3 corner : corners) box_.add(corner);
                triangles_.push_back(triangle);
                reached_.push_back(total);
            }
        }
        brightness_ = total;
        densities_.reserve(emissions.size());
        for (Vec3 emission : emissions) densities_.push_back(total > 0 ? mean(emission) / total : 0);
        if (triangles_.empty()) return;
        center_ = (box_.low + box_.high) / 2, reach_ = length(box_.high - box_.low) / 2;
    }

    uint32_t object() const { return object_; }
    bool is_sized() const { return true; }
    bool is_dark() const { return !(brightness_ > 0); }
    bool is_black() const { return triangles_.empty(); }  // whatever its size

    // part: which triangle, in [0, 1).
    LightSample sample_li(const Interaction& from, double part, Vec2 u) const {
        size_t picked = std::upper_bound(reached_.begin(), reached_.end(), part * brightness_) - reached_.begin();
        picked = std::min(picked, reached_.size() - 1);
        uint32_t triangle = triangles_[picked];
        Vec3 corners[3];
        scene_->corners(object_, triangle, corners);
        Vec3 first = corners[1] - corners[0], second = corners[2] - corners[0], normal = cross(first, second);
        double far = std::sqrt(u.x), along = far * u.y;
        Vec3 to = corners[0] + first * (far - along) + second * along - from.position;
        double squared = dot(to, to), distance = std::sqrt(squared);
        Vec3 ahead = to / distance;
        uint32_t material = scene_->material(object_, triangle);
        double cosine = std::fabs(dot(normal, ahead)) / length(normal), pdf = densities_[material] * squared / cosine;
        if (!(pdf > LEAST_DENSITY && pdf < INFINITE)) return {ahead, distance, {}, INFINITE, 1};
        return {ahead, distance, radiance(material, triangle, from, to, ahead) / pdf, pdf, cosine};
    }
    // The density of a ray that meets a triangle at a distance, under |cos| to its normal.
    double pdf_li(uint32_t material, double distance, double cosine) const {
        return cosine > 0 ? densities_[material] * distance * distance / cosine : 0;
    }

    double estimate(Vec3 position, Vec3 normal) const {
        Vec3 way = center_ - position;
        double squared = dot(way, way), risen = max(dot(normal, way) + reach_, 0.0);
        return risen * (brightness_ / ((squared + reach_ * reach_ / 2) * (std::sqrt(squared) + reach_)));
    }
    LightBounds bounds() const { return {box_, brightness_}; }

   private:
    static constexpr double LEAST_DENSITY = 1e-100;  // less has what a point sees of itself only

    Vec3 radiance(uint32_t material, uint32_t triangle, const Interaction& from, Vec3 to, Vec3 ahead) const {
        const Material& made_of = scene_->illumination.materials[material];
        if (made_of.shines_evenly()) return made_of.mean_emission();
        Hit hit{1, object_, triangle};
        return made_of.emission(scene_->shading(scene_->interaction(Ray{from.position, to}, hit), ahead, {.kind = NO_RAY, .length = length(to)}));
    }

    const Scene* scene_;
    uint32_t object_;
    std::vector<uint32_t> triangles_;  // the emissive ones
    std::vector<double> reached_;      // their areas times mean emissions, summed up
    std::vector<double> densities_;    // by area, of the triangles of each material
    Bounds box_;
    Vec3 center_;
    double reach_ = 0, brightness_ = 0;  // brightness: radiance times area
};

}  // namespace viewcam::VIEWCAM_ISA
