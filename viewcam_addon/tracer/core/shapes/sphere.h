// Spheres, ellipsoids by their objects' matrices, and where a ray meets one.
//
// A sphere under an affine map is the set of points P with |A⁻¹P − f| = 1, A its linear part times the radius. The ray is taken
// into that space, where the near root is (|f|² − 1)/q with q = f·d + √…, which never cancels. Two things would:
//
// - The discriminant. Far away it is that of the perpendicular from the center to the ray, which loses |f| where the textbook's
//   loses |f|² (Haines et al., Precision improvements for ray/sphere intersection, Ray Tracing Gems, 2019). Near the surface the
//   textbook's is the better one, given an exact |f|² − 1: it keeps the digits of a ray that runs along the surface.
// - |f|² − 1, for an origin close to the surface, and f itself, where the object's space has its origin far away. Then the ray's
//   origin is taken into that space as a pair of float64 and the square is summed in such pairs, so that an eye 1e-16 radii
//   outside knows it.
//
// As Cycles does with point clouds, a ray meets a sphere from outside only: one that starts inside, or on it, passes out through
// it, and a sphere is never met by a ray that leaves it. (So a glass sphere refracts on the way in and not on the way out.)
//
// Rejected: compensated discriminants for every ray. The ray's own rounding, 2⁻⁵³ of its direction, moves the foot of the
// perpendicular by as much as the arithmetic that they would save.
#pragma once
#include "../accel/traverse.h"
#include "object.h"

namespace viewcam::VIEWCAM_ISA {

// Spheres as they came from Python, whose arrays outlive the scene.
struct Spheres {
    size_t count = 0;
    const double* centers = nullptr;     // (count, 3), object space
    const double* radii = nullptr;       // (count,), not negative
    const int32_t* materials = nullptr;  // (count,), slots of the object
    Bvh bvh;

    Vec3 center(size_t i) const { return {centers[3 * i], centers[3 * i + 1], centers[3 * i + 2]}; }
    Bounds bounds(size_t i) const {
        Vec3 c = center(i), r{radii[i], radii[i], radii[i]};
        Bounds box;
        if (!(radii[i] > 0)) return box;
        r = r * (1 + 4 * DOUBLE_ROUNDING) + abs(c) * (4 * DOUBLE_ROUNDING);
        box.add(c - r);
        box.add(c + r);
        return box;
    }
    void build(int threads) {
        bvh = build_bvh(count, [&](size_t i) { return bounds(i); }, 1, threads);
    }
};

// A sphere and a ray in the space where it has radius 1 and the ray starts at the origin.
struct UnitSphere {
    Vec3 center, direction;
    double tangent;  // |center|² − 1

    // local: the ray in object space.
    UnitSphere(const Spheres& spheres, const Object& object, size_t i, const Ray& ray, const Ray& local) {
        Vec3 c = spheres.center(i);
        double radius = spheres.radii[i];
        direction = local.direction / radius;
        center = (c - local.origin) / radius;
        tangent = dot(center, center) - 1;
        double size = max(max_component(abs(c)), max_component(abs(local.origin)));
        if (tangent < NEAR || size > 16 * radius * max_component(abs(center))) take_care(c, radius, object, ray);
    }

    // Where the ray first meets it, INFINITE where it does not.
    double distance() const {
        double squared = dot(direction, direction), along = dot(center, direction);
        if (!(along > 0) || !(tangent > 0)) return INFINITE;
        double foot = along / squared;
        Vec3 beside = center - foot * direction;
        double discriminant = tangent < NEAR ? along * foot - tangent : 1 - dot(beside, beside);
        if (!(discriminant >= 0)) return INFINITE;
        double t = tangent / (along + std::sqrt(discriminant * squared));
        return t < INFINITE ? t : INFINITE;
    }

   private:
    // |f|² − 1 below which the textbook's discriminant, rounded by 2⁻⁵³ |f|² cos² at most, is not worse than the perpendicular's.
    static constexpr double NEAR = 1;

    void take_care(Vec3 c, double radius, const Object& object, const Ray& ray) {
        Pair apart[3];
        for (int i = 0; i < 3; i++) apart[i] = two_sum(object.to_world.m[i][3], -ray.origin[i]) + object.translation_low[i];
        // One step of refinement with an exact residual solves linear · away = apart.
        Vec3 away = object.to_object(Vec3{apart[0].high, apart[1].high, apart[2].high}), residual;
        for (int row = 0; row < 3; row++) {
            Pair sum = apart[row];
            for (int column = 0; column < 3; column++) sum = sum + two_product(-object.to_world.m[row][column], away[column]);
            (row == 0 ? residual.x : row == 1 ? residual.y : residual.z) = sum.high + sum.low;
        }
        Vec3 away_low = object.to_object(residual), relative;
        int exponent = std::ilogb(radius);  // scaled by it, no square leaves float64's range
        double unit = std::ldexp(radius, -exponent);
        Pair total = two_product(-unit, unit);
        for (int i = 0; i < 3; i++) {
            Pair sum = two_sum(c[i], away[i]);
            sum = two_sum(sum.high, sum.low + away_low[i]);
            (i == 0 ? relative.x : i == 1 ? relative.y : relative.z) = sum.high;
            double high = std::ldexp(sum.high, -exponent), low = std::ldexp(sum.low, -exponent);
            total = total + two_product(high, high) + 2 * high * low;
        }
        tangent = (total.high + total.low) / (unit * unit);
        // By the same rounded inverse as the direction: an ellipsoid is then rounded in its shape and not in its place.
        center = object.to_object(object.to_world.vector(relative)) / radius;
    }
};

// True if a ray in object space runs past a sphere, or away from it, by more than all that is rounded there: the way to the center by
// the origin's error and the center's own rounding, the direction, relatively, by four roundings times the matrix's condition. So
// most spheres whose boxes are met are left without a division, and those that a ray has just left without the pairs of `take_care`.
inline bool passes(const LocalRay& local, Vec3 center, double radius, double condition) {
    Vec3 way = center - local.origin, d = local.direction, beside = cross(way, d);
    double size = max_component(abs(center)) + radius + condition * max_component(abs(way));
    double doubt = 2 * local.origin_error + 16 * DOUBLE_ROUNDING * size, reach = radius + doubt;
    return dot(way, d) < -doubt * (std::fabs(d.x) + std::fabs(d.y) + std::fabs(d.z)) || dot(beside, beside) > reach * reach * dot(d, d);
}

// Offers the sphere `i` of an object to `nearest` where a ray meets it nearer. ray: in rendering space. local: in the object's.
template <class HitRecord>
bool offer_sphere(const Spheres& spheres, size_t i, const Object& object, uint32_t number, const Ray& ray, const LocalRay& local, HitRecord& nearest) {
    if (passes(local, spheres.center(i), spheres.radii[i], object.condition)) return false;
    double t = UnitSphere(spheres, object, i, ray, local).distance();
    return t > ray.t_min && t < INFINITE && nearest.offer(t, number, uint32_t(i));
}

// The spheres of an instance, by the hierarchy of its geometry.
template <bool ANY, class HitRecord> bool intersect_spheres(const Spheres& spheres, const Object& object, const Ray& ray, uint32_t number, HitRecord& nearest) {
    if (object.flat) return false;
    LocalRay local = object.to_object(ray);
    return traverse<ANY>(spheres.bvh, local, nearest.t, local.origin_error, [&](uint32_t leaf, BoxRay& box) {
        if (!offer_sphere(spheres, spheres.bvh.leaves[leaf], object, number, ray, local, nearest)) return false;
        if (!ANY) box.limit(nearest.t);
        return ANY;
    });
}

// The spheres of several objects, in one hierarchy in rendering space; each is met in its own object's space.
//
// So a ray's own rounding there, and that of the object's matrix, move a sphere out of its box. In world units all of it is below
// 64 · 2⁻⁵³ · condition · (the ray's origin + what is rounded of the object): of the origin 10 roundings, of the direction 4 over the
// way to the sphere, of the inverse's determinant 6. The boxes are grown by that.
class SphereBvh {
   public:
    struct Member {
        const Spheres* spheres;
        const Object* object;
        uint32_t number;  // the object's
    };

    void build(const std::vector<Member>& members, int threads) {
        members_ = members;
        std::vector<size_t> first(members.size() + 1);
        for (size_t m = 0; m < members.size(); m++) {
            const auto& [spheres, object, number] = members[m];
            first[m + 1] = first[m] + spheres->count;
            condition_ = max(condition_, object->condition);
            for (size_t i = 0; i < spheres->count; i++) size_ = max(size_, size(members[m], i));
        }
        Array<Name> names(first.back());
        for (size_t m = 0; m < members.size(); m++)
            for (size_t i = first[m]; i < first[m + 1]; i++) names[i] = {uint32_t(m), uint32_t(i - first[m])};
        bvh_ = build_bvh(names.size(), [&](size_t i) { return bounds(members[names[i].member], names[i].sphere); }, 1, threads);
        names_ = Array<Name>(bvh_.leaf_count());
        for (size_t leaf = 0; leaf < names_.size(); leaf++) names_[leaf] = names[bvh_.leaves[leaf]];
        bvh_.leaves = Array<uint32_t>();
    }
    bool is_empty() const { return bvh_.root == NOTHING; }
    size_t bytes() const { return bvh_.bytes() + names_.size() * sizeof(Name); }

    template <bool ANY, class HitRecord> bool intersect(const Ray& ray, HitRecord& nearest) const {
        if (is_empty()) return false;
        double origin_error = 64 * DOUBLE_ROUNDING * condition_ * (size_ + max_component(abs(ray.origin)));
        uint32_t member = NONE;
        LocalRay local;
        return traverse<ANY>(bvh_, ray, nearest.t, origin_error, [&](uint32_t leaf, BoxRay& box) {
            Name name = names_[leaf];
            const auto& [spheres, object, number] = members_[name.member];
            if (name.member != member) local = object->to_object(ray), member = name.member;
            if (!offer_sphere(*spheres, name.sphere, *object, number, ray, local, nearest)) return false;
            if (!ANY) box.limit(nearest.t);
            return ANY;
        });
    }

   private:
    struct Name {
        uint32_t member, sphere;
    };

    // The size of what is rounded of a sphere's place.
    static double size(const Member& of, size_t i) {
        return max_component(abs(of.object->to_world.translation())) + of.object->stretched(max_component(abs(of.spheres->center(i))) + of.spheres->radii[i]);
    }
    static Bounds bounds(const Member& of, size_t i) {
        Bounds box;
        double radius = of.spheres->radii[i];
        if (!(radius > 0)) return box;
        double rounding = 64 * DOUBLE_ROUNDING * of.object->condition * size(of, i);
        auto half = [&](const double* row) { return radius * std::sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]) + rounding; };
        const auto& m = of.object->to_world.m;
        Vec3 middle = of.object->to_world.point(of.spheres->center(i)), reach{half(m[0]), half(m[1]), half(m[2])};
        box.add(middle - reach);
        box.add(middle + reach);
        return box;
    }

    std::vector<Member> members_;
    Bvh bvh_;
    Array<Name> names_;  // by leaf
    double condition_ = 0, size_ = 0;  // the largest of all
};

// The surface of a sphere where a ray hits it. As in Cycles, the normal of an ellipsoid too is the direction from its center;
// `cosine` is that of the true one. The point lies inside by what its rounding may be, from where nothing of the sphere is seen.
inline Interaction sphere_interaction(const Spheres& spheres, const Object& object, const Ray& ray, size_t i) {
    UnitSphere sphere(spheres, object, i, ray, object.to_object(ray));
    Interaction point;
    point.t = sphere.distance();
    Vec3 unit = normalize(sphere.direction * point.t - sphere.center), c = spheres.center(i);
    double radius = spheres.radii[i];
    Vec3 outward = object.to_world.vector(unit * radius), middle = object.to_world.point(c);
    double reach = max_component(abs(middle)) + max_component(abs(object.to_world.translation())) +
                   object.stretched(max_component(abs(c)) + radius);
    double rounding = 16 * DOUBLE_ROUNDING * object.condition * reach, size = length(outward);
    point.position = middle + outward * max(0.0, 1 - rounding / size);
    outward = outward / size;
    point.backside = dot(outward, ray.direction) > 0;
    point.normal = point.shading = point.backside ? -outward : outward;
    Vec3 gradient = {unit.x * object.inverse[0][0] + unit.y * object.inverse[1][0] + unit.z * object.inverse[2][0],
                     unit.x * object.inverse[0][1] + unit.y * object.inverse[1][1] + unit.z * object.inverse[2][1],
                     unit.x * object.inverse[0][2] + unit.y * object.inverse[1][2] + unit.z * object.inverse[2][2]};
    point.cosine = -dot(normalize(gradient), ray.direction) / length(ray.direction);
    point.material = uint32_t(spheres.materials[i]);
    return point;
}

// The length to which rounding applies, as of triangles, with the sphere's extent; a sphere is as slender as an equilateral
// triangle: not at all.
inline double sphere_magnitude(const Spheres& spheres, const Object& object, const Ray& ray, size_t i, Vec3 origin) {
    Vec3 middle = object.to_world.point(spheres.center(i)), world = abs(middle + origin);
    double largest = max_component(abs(object.to_world.translation() + origin)), radius = spheres.radii[i];
    for (int axis = 0; axis < 3; axis++) {
        const double* row = object.to_world.m[axis];
        largest = max(largest, world[axis] + radius * std::sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]));
    }
    return largest + length(middle - ray.origin);
}

}  // namespace viewcam::VIEWCAM_ISA
