// Rays, what they hit, and what is known of the surface there.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "math/simd.h"

namespace viewcam::VIEWCAM_ISA {

constexpr double INFINITE = std::numeric_limits<double>::infinity();
constexpr uint32_t NONE = 0xffffffffu;
constexpr double DOUBLE_ROUNDING = 0x1p-53;
constexpr uint64_t EVERYTHING = ~0ull;  // the receivers of a light that has none of its own

// The kinds of rays that objects and lights may be hidden from, as bits; tracer/native.py numbers scene/lamps.py RAYS so.
// NO_RAY: what a light is sampled for. SHADOW_LINKED: sees objects whose light has blockers of its own, and no others.
// Above it there is a bit for the shadow rays of each set of blockers that lights have.
enum RayKind : uint32_t { NO_RAY = 0, CAMERA = 1, DIFFUSE = 2, GLOSSY = 4, TRANSMISSION = 8, SHADOW = 16, SHADOW_LINKED = 32 };

// The state of a ray, which materials may ask for. kind: of its last scattering; diffuse, singular: what scattered it; depth:
// scatterings so far; scattered: those that were diffuse, glossy and transmission; passed: surfaces that it has gone straight
// through; length: how far it has come, width: how wide its pixel was where it started, and spread: what each length adds to
// that, of rays that are not from the eye.
struct RayState {
    RayKind kind = CAMERA;
    bool diffuse = false, singular = false;
    int depth = 0, passed = 0;
    std::array<uint16_t, 3> scattered = {};
    double length = 0, width = 0, spread = 0;
};

// A ray in rendering space (scene.h), as it comes through the C interface. direction: of any length; t counts in it. What is met
// must lie in t_min < t < t_max.
struct Ray {
    Vec3 origin, direction;
    double t_min = 0, t_max = INFINITE;
};

constexpr int PACKET = 64;

// A packet of rays, by coordinate. What is computed of four at once reads and writes the last four whole: where fewer are left,
// `fill` has made the rest like the last.
struct alignas(64) Rays {
    double origin[3][PACKET], direction[3][PACKET], t_min[PACKET], t_max[PACKET];

    Ray ray(int i) const { return {{origin[0][i], origin[1][i], origin[2][i]}, {direction[0][i], direction[1][i], direction[2][i]}, t_min[i], t_max[i]}; }
    void set(int i, const Ray& ray) {
        for (int axis = 0; axis < 3; axis++) origin[axis][i] = ray.origin[axis], direction[axis][i] = ray.direction[axis];
        t_min[i] = ray.t_min, t_max[i] = ray.t_max;
    }
    // Sets some of four rays from t = 0 on, one after the other from i on.
    void set(int i, unsigned lanes, const Vec3x4& origins, const Vec3x4& directions, double4 ends) {
        if (lanes == 15) {
            for (int axis = 0; axis < 3; axis++) store(origin[axis] + i, origins[axis]), store(direction[axis] + i, directions[axis]);
            store(t_min + i, double4{}), store(t_max + i, ends);
            return;
        }
        while (lanes) {
            int lane = take_bit(lanes);
            set(i++, {VIEWCAM_ISA::lane(origins, lane), VIEWCAM_ISA::lane(directions, lane), 0, ends[lane]});
        }
    }
    void fill(int count) {
        for (int i = count; i % 4; i++) set(i, ray(count - 1));
    }
};

// A ray in an object's space. origin_error: by how much the origin may be off in each coordinate, since it was taken there.
struct LocalRay : Ray {
    double origin_error = 0;
};

// The first thing that a ray meets. object: the scene's number of the placed object, NONE where there is nothing. primitive: of
// the object's geometry, a triangle or a sphere.
struct Hit {
    double t = INFINITE;
    uint32_t object = NONE, primitive = NONE;

    explicit operator bool() const { return object != NONE; }
};

// The nearest hit so far. Of equal distances that of the smaller object counts, then that of the smaller primitive.
struct Nearest {
    double t;
    uint64_t name = 0;    // object · 2³² + primitive; 0 so that nothing wins a tie with the ray's end
    uint32_t but = NONE;  // an object that does not count

    bool offer(double distance, uint32_t object, uint32_t primitive) {
        if (object == but) return false;
        uint64_t other = uint64_t(object) << 32 | primitive;
        if (!(distance < t || (distance == t && other < name))) return false;
        t = distance;
        name = other;
        return true;
    }
};

// The nearest hits of as many rays, at infinity where nothing is met.
struct alignas(64) Hits {
    double t[PACKET];
    uint64_t name[PACKET];

    bool met(int i) const { return t[i] < INFINITE; }
    Hit hit(int i) const { return met(i) ? Hit{t[i], uint32_t(name[i] >> 32), uint32_t(name[i])} : Hit{}; }
};

// All hits that lie up to `within` times the nearest one's distance beyond it, taken as `Nearest` takes the nearest.
struct NearestOnes {
    double t, within;
    std::vector<Hit> hits;

    bool offer(double distance, uint32_t object, uint32_t primitive) {
        if (!(distance <= t)) return false;
        hits.push_back({distance, object, primitive});
        t = std::min(t, distance * (1 + within));
        return true;
    }
};

// A point of a surface, in rendering space, or four.
template <class T> struct SurfacePoint {
    Vec3Of<T> position;
    Vec3Of<T> normal;   // unit, of the true geometry, on the side that the ray came from
    Vec3Of<T> shading;  // unit, smooth where the mesh is, turned to the other side where `normal` is
    T offset{};         // the distance along ±normal at which rays that leave must start, so that they do not meet where they start

    // Where a ray in `direction` starts that leaves the surface here.
    Vec3Of<T> ray_origin(Vec3Of<T> direction) const { return position + normal * copysign(offset, dot(normal, direction)); }
};
inline SurfacePoint<double> lane(const SurfacePoint<double4>& points, int i) {
    return {lane(points.position, i), lane(points.normal, i), lane(points.shading, i), points.offset[i]};
}

// The point of a surface that a ray meets, and all that is known of it.
struct Interaction : SurfacePoint<double> {
    Vec2 uv;               // by the mesh's UV map, 0 without one
    Vec3 vertex_color;     // linear, 0 on what has none
    Vec2 barycentric;      // on a triangle, the shares of its second and third corner
    uint32_t material = 0; // index into Scene::materials
    uint32_t slot = 0;     // index into Scene::slots
    uint32_t object = NONE, primitive = NONE;
    double t = INFINITE;   // along the ray that came, of its direction's length
    double cosine = 0;     // between that ray and the true surface, which an ellipsoid's `normal` is not at a right angle to
    bool has_uv = false;   // true if the mesh has a UV map
    bool backside = false; // met from behind: from where the corners run clockwise in the object's own space, as in Cycles
};

}  // namespace viewcam::VIEWCAM_ISA
