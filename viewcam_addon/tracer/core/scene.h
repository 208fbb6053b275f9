// A scene as the core traces it: geometries with a hierarchy each, objects that place them, and all that gives or scatters light.
//
// Rendering space has the world's axes and an origin near camera and scene (`origin`), so that scenes in map coordinates lose
// no digits; pbrt calls it "camera-world space". Python has checked whatever comes here (native.py): nothing is checked twice.
//
// Geometries that only one object places, and others where that takes little memory, are merged in rendering space: one hierarchy of
// triangles and one of spheres for all that the same kinds of rays see. Whatever else is an instance: the ray is taken into its space,
// where its geometry's own hierarchy was built once.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <variant>
#include <vector>

#include "camera.h"
#include "film/film.h"
#include "film/filter.h"
#include "lights/environment.h"
#include "lights/lamps.h"
#include "material.h"
#include "nodes/value_node.h"
#include "shapes/sphere.h"
#include "shapes/tangents.h"
#include "shapes/triangle_mesh.h"

namespace viewcam::VIEWCAM_ISA {

struct Lamp {
    LampOr<> kind;  // in rendering space
    Vec3 middle;
    Color emission{{1, 1, 1}};  // a factor of its light, at each place of the lamp and in each direction
    bool casts_shadow = true, multiple_importance = true;
    uint32_t hidden_from = 0;
    uint64_t receivers = EVERYTHING;    // the sets of objects that it lights, as bits
    RayKind shadow_rays = SHADOW;  // a kind of its own, where it has blockers of its own
};

// The most scatterings of light before it must reach a lamp: in all, and by each kind of surface; and how often it may go
// straight through a surface. Cycles' own counting.
struct Bounces {
    int total = 0, diffuse = 0, glossy = 0, transmission = 0, transparent = 0;
};

// All of a scene that gives or scatters light, as it was described: images, materials, lights, the world and the film.
struct Illumination {
    std::vector<Texture> textures;
    ValueNodes nodes;
    std::vector<Material> materials;
    std::vector<Lamp> lamps;
    Environment environment;
    std::optional<Environment> backdrop;  // seen by the camera in the environment's place
    FilmSettings film;
    FilterShape filter = BOX;
    double filter_width = 1;  // pixels
    Bounces bounces;
    int version = CYCLES_5_2;  // the Cycles that computes materials so
};

class Scene {
   public:
    // A new shape is one more here, with functions of these names: bounds, intersect, interaction, magnitude; the latter two may take several hits at once.
    using Shape = std::variant<TriangleMesh, Spheres>;
    struct Slot {
        float index;        // shown by the Material Index pass
        uint32_t material;  // index into materials
    };

    std::vector<Shape> geometries;
    std::vector<uint32_t> material_counts;  // by geometry, as many as its materials' numbers need
    std::vector<Object> objects;
    std::vector<Slot> slots;
    Camera camera;
    Vec3 origin;  // rendering space's, in the world
    Illumination illumination;
    int threads = 1;  // the threads that make it ready

    // Makes the scene ready for rays. matrices: (objects, 3, 4), to world space.
    void commit(const double* matrices) {
        std::vector<size_t> users(geometries.size());
        for (size_t i = 0; i < objects.size(); i++) {
            objects[i].place(matrices + 12 * i, origin);
            users[objects[i].geometry]++;
        }
        for (Object& object : objects) object.shared = users[object.geometry] > 1;
        std::vector<bool> merged = choose_merged(users);
        std::map<uint32_t, std::vector<uint32_t>> still;  // visibility → objects
        std::vector<uint32_t> placed;
        for (uint32_t i = 0; i < objects.size(); i++) (merged[i] ? still[objects[i].visible] : placed).push_back(i);
        merged_.clear();
        for (auto& [visible, members] : still) merged_.push_back(merge(visible, members));
        build_geometries(placed);
        instances_ = build_bvh(placed.size(), [&](size_t i) { return world_bounds(objects[placed[i]]); }, 1, threads);
        for (uint32_t& leaf : instances_.leaves) leaf = placed[leaf];
    }

    // The first hit of a ray among the objects that its kind sees, but one.
    Hit closest(const Ray& ray, RayKind kind, uint32_t but = NONE) const {
        Nearest nearest{ray.t_max, 0, but};
        for (const Merged& merged : merged_)
            if (merged.visible & kind) merged.intersect<false>(ray, nearest);
        intersect_instances<false>(ray, kind, nearest);
        return hit(nearest, ray);
    }
    // True if anything that a kind of ray sees stands in t_min < t < t_max.
    bool occluded(const Ray& ray, RayKind kind = SHADOW) const {
        Nearest nearest{ray.t_max};
        for (const Merged& merged : merged_)
            if (merged.visible & kind && merged.intersect<true>(ray, nearest)) return true;
        return intersect_instances<true>(ray, kind, nearest);
    }
    // The first hit of a ray, and all others up to `within` times as far beyond, the nearest first; of equal distances as
    // `Nearest` has it.
    void surfaces(const Ray& ray, RayKind kind, double within, std::vector<Hit>& hits) const {
        NearestOnes nearest{ray.t_max, within, std::move(hits)};
        nearest.hits.clear();
        for (const Merged& merged : merged_)
            if (merged.visible & kind) merged.intersect<false>(ray, nearest);
        intersect_instances<false>(ray, kind, nearest);
        hits = std::move(nearest.hits);
        std::erase_if(hits, [&](const Hit& hit) { return hit.t > nearest.t; });
        std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) {
            return std::tie(a.t, a.object, a.primitive) < std::tie(b.t, b.object, b.primitive);
        });
    }
    // `closest` for up to 64 rays, as packets where enough of them go the same way.
    void closest(const Rays& rays, int count, RayKind kind, Hits& hits) const {
        intersect<false>(rays, count, kind, hits);
        for (int i = 0; i < count; i += 4) {
            double4 t = load<double4>(hits.t + i);
            store(hits.t + i, select(long4(t < load<double4>(rays.t_max + i)), t, splat4(INFINITE)));
        }
    }
    void occluded(const Rays& rays, int count, bool* hidden) const {
        Hits& hits = of_this_thread<Hits>();
        intersect<true>(rays, count, SHADOW, hits);
        for (int i = 0; i < count; i++) hidden[i] = hits.t[i] < rays.t_max[i];
    }

    // The surfaces at hits, with all that light needs to know there. magnitudes: receive what a renderer's relative rounding
    // applies to there, world units, if wanted.
    void interactions(const Ray* const* rays, const Hit* hits, int count, Interaction* points, double* magnitudes = nullptr) const {
        SurfaceHit triangles[4];
        Interaction* to[4];
        int pending = 0;
        auto finish_triangles = [&] {
            TriangleSurfaces surfaces(triangles, pending);
            surfaces.interactions(to);
            if (magnitudes) {
                double4 magnitude = surfaces.magnitude(origin);
                for (int i = 0; i < pending; i++) magnitudes[to[i] - points] = magnitude[i];
            }
            pending = 0;
        };
        for (int i = 0; i < count; i++) {
            const Object& object = objects[hits[i].object];
            const Shape& shape = geometries[object.geometry];
            if (auto spheres = std::get_if<Spheres>(&shape)) {
                points[i] = sphere_interaction(*spheres, object, *rays[i], hits[i].primitive);
                if (magnitudes) magnitudes[i] = sphere_magnitude(*spheres, object, *rays[i], hits[i].primitive, origin);
                continue;
            }
            triangles[pending] = {&std::get<TriangleMesh>(shape), &object, rays[i], hits[i].primitive};
            to[pending++] = &points[i];
            if (pending == 4) finish_triangles();
        }
        if (pending) finish_triangles();
        for (int i = 0; i < count; i++) name(points[i], hits[i].object, hits[i].primitive);
    }
    // The surfaces where four rays meet triangles, or four meet spheres. t: along the rays. points: all that is known there, if wanted.
    [[gnu::always_inline]] SurfacePoint<double4> surfaces(const SurfaceHit (&hits)[4], const Vec3x4& origins, const Vec3x4& directions,
                                                          double4& t, Interaction* points) const {
        auto number = [&](int i) { return uint32_t(hits[i].object - objects.data()); };
        if (hits[0].mesh) {
            TriangleSurfaces surfaces(hits, 4, origins, directions);
            t = surfaces.t();
            if (points) {
                Interaction* const to[] = {&points[0], &points[1], &points[2], &points[3]};
                surfaces.interactions(to);
                for (int i = 0; i < 4; i++) name(points[i], number(i), hits[i].primitive);
            }
            return surfaces.points();
        }
        Interaction spheres[4];
        for (int i = 0; i < 4; i++) {
            spheres[i] = interaction({lane(origins, i), lane(directions, i)}, {0, number(i), hits[i].primitive});
            if (points) points[i] = spheres[i];
        }
        auto vectors = [&](auto of) { return gather4([&](int i) { return of(spheres[i]); }); };
        t = vectors([](auto& point) { return point.t; });
        return {vectors([](auto& point) { return point.position; }), vectors([](auto& point) { return point.normal; }),
                vectors([](auto& point) { return point.shading; }), vectors([](auto& point) { return point.offset; })};
    }
    Interaction interaction(const Ray& ray, const Hit& hit) const {
        const Ray* rays[] = {&ray};
        Interaction point;
        interactions(rays, &hit, 1, &point);
        return point;
    }

    // The point that a path reaches, as a material is told of it.
    ShadingPoint shading(const Interaction& point, Vec3 incoming, RayState ray) const {
        return {point, incoming, illumination.textures, illumination.version, &illumination.nodes, &objects[point.object], origin, this, ray};
    }

    // Makes the tangents that nodes ask for, of meshes that have such materials.
    void make_tangents() {
        for (const ValueNode& node : illumination.nodes.all) {
            const std::string* uv = ValueNodes::uv_of_tangents(node);
            if (!uv) continue;
            for (const Object& object : objects) {
                auto mesh = std::get_if<TriangleMesh>(&geometries[object.geometry]);
                if (!mesh || !mesh->uvs(*uv) || mesh->tangents.contains(*uv)) continue;
                auto first = slots.begin() + object.first_slot, last = first + material_counts[object.geometry];
                if (std::any_of(first, last, [&](const Slot& slot) { return illumination.materials[slot.material].needs_tangents(); }))
                    mesh->tangents[*uv] = TangentsOfMesh::of(*mesh, mesh->uvs(*uv));
            }
        }
    }

    // The surfaces that shine, as lights need them. triangle_count: 0 of spheres. material: a triangle's, an index into
    // illumination.materials. corners: in rendering space.
    uint32_t triangle_count(uint32_t object) const {
        auto mesh = std::get_if<TriangleMesh>(&geometries[objects[object].geometry]);
        return mesh ? uint32_t(mesh->count) : 0;
    }
    uint32_t material(uint32_t object, uint32_t triangle) const {
        const TriangleMesh& mesh = std::get<TriangleMesh>(geometries[objects[object].geometry]);
        return slots[objects[object].first_slot + mesh.materials[triangle]].material;
    }
    void corners(uint32_t object, uint32_t triangle, Vec3 (&corners)[3]) const {
        const TriangleMesh& mesh = std::get<TriangleMesh>(geometries[objects[object].geometry]);
        for (int c = 0; c < 3; c++) corners[c] = objects[object].to_world.point(mesh.corner(triangle, c));
    }
    // True if the light of any object has blockers of its own.
    bool is_shadow_linked() const {
        return std::any_of(objects.begin(), objects.end(), [](const Object& object) { return object.visible & SHADOW_LINKED; });
    }
    // True if an object is hidden from any kind of ray.
    bool hides_anything() const {
        return std::any_of(objects.begin(), objects.end(), [](const Object& object) { return (object.visible & 31) != 31; });
    }

    // The bytes of all hierarchies, beside the arrays that came from Python.
    size_t bytes() const {
        size_t sum = instances_.bytes() + objects.size() * sizeof(Object) + slots.size() * sizeof(Slot);
        for (const Merged& merged : merged_) sum += merged.triangles.bytes() + merged.spheres.bytes();
        for (const TriangleBvh& bvh : triangles_) sum += bvh.bytes();
        for (const Shape& shape : geometries)
            if (auto spheres = std::get_if<Spheres>(&shape)) sum += spheres->bvh.bytes();
        return sum;
    }

   private:
    // Tells an interaction whose it is, once it has the number of its material in the object.
    void name(Interaction& point, uint32_t object, uint32_t primitive) const {
        point.slot = objects[object].first_slot + point.material;
        point.material = slots[point.slot].material;
        point.object = object;
        point.primitive = primitive;
    }

    struct Merged {
        uint32_t visible;
        TriangleBvh triangles;
        SphereBvh spheres;

        template <bool ANY, class HitRecord> bool intersect(const Ray& ray, HitRecord& nearest) const {
            return triangles.intersect<ANY>(ray, NONE, nearest) || spheres.intersect<ANY>(ray, nearest);
        }
    };
    // Triangles and spheres that are written out although an instance could stand for them: a ray then meets one hierarchy instead of many.
    static constexpr size_t WRITTEN_OUT = 1 << 19;
    // A matrix that may enlarge roundings more than this would cost an instance's rays digits that can be seen.
    static constexpr double ILL_CONDITIONED = 0x1p16;

    std::vector<bool> choose_merged(const std::vector<size_t>& users) const {
        std::vector<size_t> extra(geometries.size()), order;
        std::vector<bool> small(geometries.size()), merged(objects.size());
        for (size_t i = 0; i < geometries.size(); i++)
            if (users[i]) {
                extra[i] = (users[i] - 1) * std::visit([](const auto& shape) { return shape.count; }, geometries[i]);
                order.push_back(i);
            }
        std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return extra[a] < extra[b]; });
        size_t sum = 0;
        for (size_t i : order) small[i] = (sum += extra[i]) <= WRITTEN_OUT || !extra[i];
        for (size_t i = 0; i < objects.size(); i++) {
            const Object& object = objects[i];
            bool is_mesh = std::holds_alternative<TriangleMesh>(geometries[object.geometry]), ill = object.condition > ILL_CONDITIONED;
            merged[i] = is_mesh ? small[object.geometry] || ill : small[object.geometry] && !ill;
        }
        return merged;
    }

    Merged merge(uint32_t visible, const std::vector<uint32_t>& still) const {
        Merged merged{visible, {}, {}};
        std::vector<SphereBvh::Member> round;
        std::vector<uint32_t> members;  // that have triangles
        for (uint32_t i : still) {
            auto spheres = std::get_if<Spheres>(&geometries[objects[i].geometry]);
            spheres ? round.push_back({spheres, &objects[i], i}) : members.push_back(i);
        }
        merged.spheres.build(round, threads);
        std::vector<size_t> first(members.size() + 1);
        for (size_t i = 0; i < members.size(); i++)
            first[i + 1] = first[i] + std::get<TriangleMesh>(geometries[objects[members[i]].geometry]).count;
        Array<uint32_t> place(first.back());  // each triangle's object, among the members
        for (size_t i = 0; i < members.size(); i++) std::fill(place.begin() + first[i], place.begin() + first[i + 1], uint32_t(i));
        auto corners_of = [&](size_t triangle, Vec3 corner[3]) {
            size_t i = place[triangle];
            const Object& object = objects[members[i]];
            const TriangleMesh& mesh = std::get<TriangleMesh>(geometries[object.geometry]);
            for (int c = 0; c < 3; c++) corner[c] = object.to_world.point(mesh.corner(triangle - first[i], c));
        };
        auto name_of = [&](size_t triangle, uint32_t& object, uint32_t& primitive) {
            size_t i = place[triangle];
            object = members[i];
            primitive = uint32_t(triangle - first[i]);
        };
        merged.triangles.build(first.back(), corners_of, name_of, threads);
        return merged;
    }

    void build_geometries(const std::vector<uint32_t>& placed) {
        triangles_.clear();
        triangles_.resize(geometries.size());
        std::vector<bool> needed(geometries.size());
        for (uint32_t i : placed) needed[objects[i].geometry] = true;
        for (size_t i = 0; i < geometries.size(); i++) {
            if (!needed[i]) continue;
            if (auto spheres = std::get_if<Spheres>(&geometries[i])) {
                spheres->build(threads);
                continue;
            }
            const TriangleMesh& mesh = std::get<TriangleMesh>(geometries[i]);
            auto corners_of = [&](size_t triangle, Vec3 corner[3]) {
                for (int c = 0; c < 3; c++) corner[c] = mesh.corner(triangle, c);
            };
            auto name_of = [](size_t triangle, uint32_t& object, uint32_t& primitive) { object = 0, primitive = uint32_t(triangle); };
            triangles_[i].build(mesh.count, corners_of, name_of, threads);
        }
    }

    // Bounds of what an instance's own hierarchy holds, in rendering space, and as far as rounding may move it.
    Bounds world_bounds(const Object& object) const {
        auto spheres = std::get_if<Spheres>(&geometries[object.geometry]);
        const Bvh& bvh = spheres ? spheres->bvh : triangles_[object.geometry].bvh;
        Bounds box;
        if (bvh.root == NOTHING || object.flat) return box;
        Vec3 half = bvh.half / bvh.scale, reach = abs(bvh.center) + half;
        double rounding = 16 * DOUBLE_ROUNDING * (object.stretched(max_component(reach)) + max_component(abs(object.to_world.translation())));
        Vec3 middle = object.to_world.point(bvh.center), size;
        for (int row = 0; row < 3; row++) {
            const double* m = object.to_world.m[row];
            double sum = std::fabs(m[0]) * half.x + std::fabs(m[1]) * half.y + std::fabs(m[2]) * half.z + rounding;
            (row == 0 ? size.x : row == 1 ? size.y : size.z) = sum;
        }
        box.add(middle - size);
        box.add(middle + size);
        return box;
    }

    template <bool ANY, class HitRecord> bool intersect_instances(const Ray& ray, RayKind kind, HitRecord& nearest) const {
        if (instances_.root == NOTHING) return false;
        return traverse<ANY>(instances_, ray, nearest.t, 0, [&](uint32_t leaf, BoxRay& box) {
            uint32_t number = instances_.leaves[leaf];
            const Object& object = objects[number];
            if (!(object.visible & kind)) return false;
            double before = nearest.t;
            if (auto spheres = std::get_if<Spheres>(&geometries[object.geometry])) {
                if (intersect_spheres<ANY>(*spheres, object, ray, number, nearest)) return true;
            } else {
                LocalRay local = object.to_object(ray);
                if (triangles_[object.geometry].intersect<ANY>(local, number, nearest, local.origin_error)) return true;
            }
            if (nearest.t < before) box.limit(nearest.t);
            return false;
        });
    }

    // The nearest hits of rays among what their kind sees, at their ends where there is none; of ANY, at −infinity where there is one.
    template <bool ANY> void intersect(const Rays& rays, int count, RayKind kind, Hits& nearest) const {
        for (int i = 0; i < count; i += 4) store(nearest.t + i, load<double4>(rays.t_max + i)), store(nearest.name + i, long4{});
        for (const Merged& merged : merged_)
            if (merged.visible & kind) {
                intersect_packets<ANY>(merged.triangles, rays, count, nearest);
                if (!merged.spheres.is_empty())
                    for (int i = 0; i < count; i++) intersect_one<ANY>(nearest, i, [&](Nearest& hit) { return merged.spheres.intersect<ANY>(rays.ray(i), hit); });
            }
        if (instances_.root == NOTHING) return;
        for (int i = 0; i < count; i++)
            intersect_one<ANY>(nearest, i, [&](Nearest& hit) { return intersect_instances<ANY>(rays.ray(i), kind, hit); });
    }
    template <bool ANY, class Intersect> static void intersect_one(Hits& nearest, int i, const Intersect& intersect) {
        if (ANY && nearest.t[i] == -INFINITE) return;
        Nearest hit{nearest.t[i], nearest.name[i]};
        bool met = intersect(hit);
        nearest.t[i] = ANY && met ? -INFINITE : hit.t, nearest.name[i] = hit.name;
    }
    template <bool ANY> static void intersect_packets(const TriangleBvh& triangles, const Rays& rays, int count, Hits& nearest) {
        constexpr int FEW = 4;
        if (triangles.bvh.root == NOTHING || !count) return;
        auto& [all, group] = of_this_thread<std::array<Packet, 2>>();
        enter(triangles.bvh, rays, nearest, count, all);
        if (std::all_of(all.key, all.key + count, [&](int key) { return key == all.key[0]; })) {
            if (all.key[0] < 0) return;
            all.close();
            triangles.intersect<ANY>(all);
            for (int i = 0; i < count; i += 4) store(nearest.t + i, load<double4>(all.t + i)), store(nearest.name + i, load<ulong4>(all.name + i));
            return;
        }
        for (int i = 0; i < count; i++) {
            int key = all.key[i];
            if (key < 0) continue;
            group.count = 0;
            for (int j = i; j < count; j++)
                if (all.key[j] == key) {
                    group.add(all, j);
                    all.key[j] = -1;
                }
            if (group.count >= FEW) {
                group.close();
                triangles.intersect<ANY>(group);
                for (int j = 0; j < group.count; j++) nearest.t[group.source[j]] = group.t[j], nearest.name[group.source[j]] = group.name[j];
                continue;
            }
            for (int j = 0; j < group.count; j++) {
                int which = group.source[j];
                intersect_one<ANY>(nearest, which, [&](Nearest& hit) { return triangles.intersect<ANY>(rays.ray(which), NONE, hit); });
            }
        }
    }

    static Hit hit(const Nearest& nearest, const Ray& ray) {
        if (!(nearest.t < ray.t_max)) return {};
        return {nearest.t, uint32_t(nearest.name >> 32), uint32_t(nearest.name)};
    }

    std::vector<Merged> merged_;
    std::vector<TriangleBvh> triangles_;  // by geometry, for those that instances stand for
    Bvh instances_;
};

inline ShadingPoint::Values ShadingPoint::attribute(const std::string& name) const {
    auto mesh = scene && object ? std::get_if<TriangleMesh>(&scene->geometries[object->geometry]) : nullptr;
    if (!mesh) return {};
    for (const Attribute& attribute : mesh->attributes) {
        if (attribute.name != name) continue;
        const float* corners = attribute.values + 3 * size_t(attribute.width) * point.primitive;
        double b1 = point.barycentric.x, b2 = point.barycentric.y, value[4] = {0, 0, 0, 1};
        for (int i = 0; i < attribute.width; i++)
            value[i] = corners[i] * (1 - b1 - b2) + corners[attribute.width + i] * b1 + corners[2 * attribute.width + i] * b2;
        return {{value[0], value[1], value[2]}, value[3], attribute.width};
    }
    return {};
}
inline ShadingPoint::TangentFrame ShadingPoint::tangent_frame(const std::string& uv) const {
    auto mesh = scene && object && !object->flat ? std::get_if<TriangleMesh>(&scene->geometries[object->geometry]) : nullptr;
    if (!mesh) return {};
    auto tangents_of_map = mesh->tangents.find(uv);
    if (tangents_of_map == mesh->tangents.end()) return {};
    const float* tangents = tangents_of_map->second.data() + 12 * size_t(point.primitive);
    double b1 = point.barycentric.x, b2 = point.barycentric.y, b0 = 1 - b1 - b2;
    auto between = [&](auto&& at) { return at(0) * b0 + at(1) * b1 + at(2) * b2; };
    TangentFrame frame;
    frame.tangent = between([&](int c) { return Vec3{tangents[4 * c], tangents[4 * c + 1], tangents[4 * c + 2]}; });
    frame.side = between([&](int c) { return double(tangents[4 * c + 3]); });
    if (mesh->corner_normals)
        frame.normal = between([&](int c) { return TriangleMesh::corner_value(mesh->corner_normals, point.primitive, c); });
    else
        frame.normal = object->to_world.transposed(point.backside ? -point.normal : point.normal);
    double size = length(frame.normal);
    if (size > 0 && (!mesh->corner_normals || version >= CYCLES_5_1)) frame.normal = frame.normal / size;
    return frame;
}
inline Vec3 tangent_within(const ShadingPoint& at, Vec3 direction) {
    Vec3 normal = at.point.shading;
    return cross(normal, safe::normalized(cross(at.to_world_normal(direction), normal)));
}
inline Vec3 ShadingPoint::tangent_round(int axis) const {
    Vec3 out = generated() - gray(0.5);
    return tangent_within(*this, axis == 0 ? Vec3{0, -out.z, out.y} : axis == 1 ? Vec3{-out.z, 0, out.x} : Vec3{-out.y, out.x, 0});
}
inline Vec3 ShadingPoint::tangent_along(const std::string& uv) const {
    TangentFrame frame = tangent_frame(uv);
    return frame.side == 0 ? Vec3{} : tangent_within(*this, frame.tangent);
}
inline Vec3 ShadingPoint::to_world_normal(Vec3 normal) const { return object && !object->flat ? transposed_product(object->inverse, normal) : normal; }
inline Vec3 ShadingPoint::in_camera() const { return scene ? scene->camera.to_camera(point.position) : Vec3{}; }
inline Vec3 ShadingPoint::camera_eye() const { return scene ? scene->camera.eye + origin : Vec3{}; }
inline Vec3 ShadingPoint::to_camera(Vec3 direction) const { return scene ? scene->camera.to_camera(scene->camera.eye + direction) : direction; }
inline Vec3 ShadingPoint::from_camera(Vec3 direction) const { return scene ? scene->camera.from_camera(direction) : direction; }
inline double ShadingPoint::material_index() const { return scene ? scene->slots[point.slot].index : 0; }
inline double ShadingPoint::ray_length() const {
    if (ray.kind != CAMERA || !scene) return ray.length;
    double ahead = in_camera().z;
    return length(point.position - scene->camera.eye) * (1 - (ahead > 0 ? scene->camera.t_min / ahead : 0));
}
inline double ShadingPoint::footprint() const {
    if (ray.kind != CAMERA || !scene) return ray.width + ray.spread * ray.length;
    Vec3 seen = point.position - scene->camera.eye;
    return length(seen) * scene->camera.spread(seen);
}
inline double ShadingPoint::edge_distance() const {
    if (!scene || !object || !std::holds_alternative<TriangleMesh>(scene->geometries[object->geometry])) return INFINITE;
    Vec3 corner[3];
    scene->corners(point.object, point.primitive, corner);
    double least = INFINITE;
    for (int c = 0; c < 3; c++) {
        Vec3 edge = corner[(c + 1) % 3] - corner[c];
        if (double size = length(edge); size > 0) least = min(least, length(cross(edge, point.position - corner[c])) / size);
    }
    return least;
}
inline double ShadingPoint::height_beside(const Color& height, Vec3 away) const {
    Interaction beside = point;
    beside.position = point.position + away;
    auto mesh = scene && object ? std::get_if<TriangleMesh>(&scene->geometries[object->geometry]) : nullptr;
    if (mesh) {
        Vec3 corner[3];
        scene->corners(point.object, point.primitive, corner);
        Vec3 first = corner[1] - corner[0], second = corner[2] - corner[0], normal = exact_cross(first, second);
        double squared = dot(normal, normal), b1 = 0, b2 = 0;
        // Met from behind, what corners have is asked for on the other side, as in Cycles, whose ∂P/∂u points backwards there.
        Vec3 moved = point.backside ? -away : away;
        if (squared > 0) b1 = dot(cross(moved, second), normal) / squared, b2 = dot(cross(first, moved), normal) / squared;
        beside.barycentric = {point.barycentric.x + b1, point.barycentric.y + b2};
        if (mesh->corner_uvs) {
            const float* uv = mesh->corner_uvs + 6 * size_t(point.primitive);
            beside.uv.x += b1 * (double(uv[2]) - uv[0]) + b2 * (double(uv[4]) - uv[0]);
            beside.uv.y += b1 * (double(uv[3]) - uv[1]) + b2 * (double(uv[5]) - uv[1]);
        }
        if (mesh->corner_colors) {
            auto color = [&](int c) { return TriangleMesh::corner_value(mesh->corner_colors, point.primitive, c); };
            beside.vertex_color += (color(1) - color(0)) * b1 + (color(2) - color(0)) * b2;
        }
    }
    return ShadingPoint{beside, incoming, textures, version, nodes, object, origin, scene, ray}.number(height);
}
inline Vec3 ShadingPoint::in_window() const {
    if (!scene) return {};
    Vec2 place = scene->camera.window(point.position);
    return {place.x, place.y, 0};
}
inline Vec3 ShadingPoint::generated() const {
    if (Values values = attribute("generated"); values.width == 3) return values.first;
    auto mesh = scene && object ? std::get_if<TriangleMesh>(&scene->geometries[object->geometry]) : nullptr;
    if (!mesh) return {};
    double b1 = point.barycentric.x, b2 = point.barycentric.y;
    auto corner = [&](int c) { return mesh->corner(point.primitive, c); };
    Vec3 place = corner(0) * (1 - b1 - b2) + corner(1) * b1 + corner(2) * b2 - mesh->bounds.low, size = mesh->bounds.high - mesh->bounds.low;
    auto along = [](double from, double size) { return size > 0 ? from / size : 0.5; };
    return {along(place.x, size.x), along(place.y, size.y), along(place.z, size.z)};
}

}  // namespace viewcam::VIEWCAM_ISA
