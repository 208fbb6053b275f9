// Triangles: what they hold, how rays meet them, and the surface there.
//
// A ray is tested in float64 in its own sheared space (Woop, Benthin and Wald, Watertight Ray/Triangle Intersection, JCGT 2013).
// A rounded a·b − c·d has the sign of the exact one or is 0, since rounding is monotone, and 0 counts as inside on both sides of an
// edge: so nothing slips between triangles that share an edge or a vertex, as long as no product is fused with the difference
// (-ffp-contract=off). Where the ray meets the surface is computed again from the triangle that was hit, with its plane.
//
// Leaves hold their corners, 80 bytes a triangle: indices into shared vertices are a third of that, and take single rays a fifth
// longer.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "../accel/packet.h"
#include "object.h"

namespace viewcam::VIEWCAM_ISA {

// An attribute of the corners of a mesh's triangles. values: (count, 3, width).
struct Attribute {
    std::string name;
    int width;
    const float* values;
};

// A mesh as it came from Python, whose arrays outlive the scene.
struct TriangleMesh {
    size_t vertex_count = 0, count = 0;
    const double* vertices = nullptr;        // (vertex_count, 3), object space
    const int32_t* triangles = nullptr;      // (count, 3)
    const int32_t* materials = nullptr;      // (count,), slots of the object
    const float* corner_normals = nullptr;   // (count, 3, 3), or nothing
    const float* corner_uvs = nullptr;       // (count, 3, 2), or nothing
    const float* corner_colors = nullptr;    // (count, 3, 3), linear, or nothing
    std::vector<Attribute> attributes;
    std::map<std::string, std::vector<float>> tangents;  // (count, 3, 4), by the UV map's name, of those that nodes ask for
    Bounds bounds;                           // the vertices'

    Vec3 corner(size_t triangle, int i) const {
        const double* v = vertices + 3 * size_t(triangles[3 * triangle + i]);
        return {v[0], v[1], v[2]};
    }
    // (count, 3, 2): the UV map of this name, "" the mesh's own; or nothing.
    const float* uvs(const std::string& name) const {
        if (name.empty()) return corner_uvs;
        for (const Attribute& attribute : attributes)
            if (attribute.name == name && attribute.width == 2) return attribute.values;
        return nullptr;
    }
    static Vec3 corner_value(const float* values, size_t triangle, int i) {
        const float* v = values + 9 * triangle + 3 * i;
        return {v[0], v[1], v[2]};
    }
};

// Triangles with a hierarchy: those of a mesh, or all that stand still.
class TriangleBvh {
   public:
    struct alignas(64) Block {
        double corner[3][3][4];  // [corner][axis][triangle]; nan where there is none
        uint32_t object[4], primitive[4];

        // The four against one ray, see intersect_triangle.
        [[gnu::always_inline]] long4 intersect(const Shear& axes, double4 x, double4 y, double4 z, double4 by_x, double4 by_y, double4 by_z,
                                               double4& t, double4& determinant) const {
            auto at = [&](int c, int axis) { return load<double4>(corner[c][axis]); };
            return intersect_triangle(at(0, axes.x) - x, at(0, axes.y) - y, at(0, axes.z) - z, at(1, axes.x) - x, at(1, axes.y) - y,
                                      at(1, axes.z) - z, at(2, axes.x) - x, at(2, axes.y) - y, at(2, axes.z) - z, by_x, by_y, by_z, t,
                                      determinant);
        }
    };
    Bvh bvh;
    Array<Block> blocks;

    // corners_of(i, Vec3[3]) and name_of(i, object, primitive) of `count` triangles.
    template <class Corners, class Name> void build(size_t count, const Corners& corners_of, const Name& name_of, int threads) {
        auto box_of = [&](size_t i) {
            Vec3 corner[3];
            corners_of(i, corner);
            Bounds box;
            for (Vec3 p : corner) box.add(p);
            return box;
        };
        bvh = build_bvh(count, box_of, 4, threads);
        blocks = Array<Block>(bvh.leaf_count());
        parallel_pieces(threads, blocks.size(), 4096, [&](size_t begin, size_t end) {
            for (size_t b = begin; b < end; b++)
                for (int lane = 0; lane < 4; lane++) {
                    Block& block = blocks[b];
                    uint32_t i = bvh.leaves[4 * b + lane];
                    Vec3 corner[3];
                    block.object[lane] = block.primitive[lane] = NONE;
                    if (i != NOTHING) {
                        corners_of(i, corner);
                        name_of(i, block.object[lane], block.primitive[lane]);
                    }
                    for (int c = 0; c < 3; c++)
                        for (int axis = 0; axis < 3; axis++) block.corner[c][axis][lane] = i != NOTHING ? corner[c][axis] : NAN;
                }
        });
        bvh.leaves = Array<uint32_t>();
    }
    size_t bytes() const { return bvh.bytes() + blocks.size() * sizeof(Block); }

    // object: whose the triangles are, NONE where the blocks tell. origin_error: see LocalRay.
    template <bool ANY, class HitRecord> bool intersect(const Ray& ray, uint32_t object, HitRecord& nearest, double origin_error = 0) const {
        BoxRay box;
        if (bvh.root == NOTHING || !enter(bvh, ray, nearest.t, origin_error, box)) return false;
        Shear shear(ray.direction, box);
        const double* origin = &ray.origin.x;
        double4 x = splat4(origin[shear.x]), y = splat4(origin[shear.y]), z = splat4(origin[shear.z]);
        double4 by_x = splat4(shear.by_x), by_y = splat4(shear.by_y), by_z = splat4(shear.by_z);
        return traverse<ANY>(bvh, box, [&](uint32_t leaf) {
            const Block& block = blocks[leaf];
            double4 t, determinant;
            unsigned met = bits(block.intersect(shear, x, y, z, by_x, by_y, by_z, t, determinant));
            if (!met) return false;
            t = t / determinant;
            met &= bits(long4(t > splat4(ray.t_min)));
            bool nearer = false;
            while (met) {
                int lane = take_bit(met);
                if (!nearest.offer(t[lane], object == NONE ? block.object[lane] : object, block.primitive[lane])) continue;
                if (ANY) return true;
                nearer = true;
            }
            if (nearer) box.limit(nearest.t);
            return false;
        });
    }

    // A packet's rays, each with what `intersect` would find.
    template <bool ANY> void intersect(Packet& packet) const {
        if (bvh.root == NOTHING) return;
        const Shear& shear = packet.shear;
        traverse_packet<ANY>(bvh, packet, [&](uint32_t leaf, int first, unsigned rays) {
            const Block& block = blocks[leaf];
            bool nearer = false;
            while (rays) {
                int ray = first + take_bit(rays);
                double4 t, determinant;
                unsigned met = bits(block.intersect(shear, splat4(packet.origin[shear.x][ray]), splat4(packet.origin[shear.y][ray]),
                                                    splat4(packet.origin[shear.z][ray]), splat4(packet.by_x[ray]),
                                                    splat4(packet.by_y[ray]), splat4(packet.by_z[ray]), t, determinant));
                if (!met) continue;
                t = t / determinant;
                met &= bits(long4(t > splat4(packet.t_min[ray])) & long4(t <= splat4(packet.t[ray])));
                while (met) {
                    int i = take_bit(met);
                    nearer |= packet.offer<ANY>(ray, t[i], block.object[i], block.primitive[i]);
                }
            }
            return nearer;
        });
    }
};

// A triangle of a mesh, or a sphere where there is none, that a ray was found to hit.
struct SurfaceHit {
    const TriangleMesh* mesh;
    const Object* object;
    const Ray* ray;
    uint32_t primitive;
};

// Where up to four rays meet the triangles that they were found to hit, and all about the surfaces there, four at once: what is
// found of one is the same whatever goes along with it.
class TriangleSurfaces {
   public:
    TriangleSurfaces(const SurfaceHit* hits, int count)
        : TriangleSurfaces(hits, count, gather4([&](int i) { return hits[i < count ? i : 0].ray->origin; }),
                           gather4([&](int i) { return hits[i < count ? i : 0].ray->direction; })) {}
    // origins, directions: of the rays.
    [[gnu::always_inline]] TriangleSurfaces(const SurfaceHit* hits, int count, const Vec3x4& origins, const Vec3x4& directions)
        : count_(count), origin_(origins), direction_(directions) {
        for (int i = 0; i < 4; i++) hits_[i] = hits[i < count ? i : 0], on_one_ &= hits_[i].object == hits_[0].object;
        translation_ = {of_objects([](auto& object) { return object.to_world.m[0][3]; }),
                        of_objects([](auto& object) { return object.to_world.m[1][3]; }),
                        of_objects([](auto& object) { return object.to_world.m[2][3]; })};
        double4 linear[3][3];
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                linear[row][column] = of_objects([=](auto& object) { return object.to_world.m[row][column]; });
        for (int c = 0; c < 3; c++)
            corner_[c] = product(linear, gather4([&](int i) { return hits_[i].mesh->corner(hits_[i].primitive, c); })) + translation_;
        first_ = corner_[1] - corner_[0];
        second_ = corner_[2] - corner_[0];
        Vec3x4 third = corner_[2] - corner_[1];
        normal_ = cross(first_, second_);
        double4 squared_first = dot(first_, first_), squared_second = dot(second_, second_), squared = dot(normal_, normal_);
        longest_squared_ = max(max(squared_first, squared_second), dot(third, third));
        if (unsigned slender = bits(long4(squared * splat4(SLENDER * SLENDER) < squared_first * squared_second))) {
            while (slender) {
                int i = take_bit(slender);
                set_lane(normal_, i, exact_cross(lane(first_, i), lane(second_, i)));
            }
            squared = dot(normal_, normal_);
        }
        size_ = sqrt(squared);
        Vec3x4 away = corner_[0] - origin_;
        t_ = dot(normal_, away) / dot(normal_, direction_);
        // A triangle seen so nearly edge-on that its plane tells nothing is met between its corners.
        DominantAxis axis(abs(direction_));
        double4 per = splat4(1.0) / axis.of(direction_), least = axis.of(away) * per, most = least;
        for (int c = 1; c < 3; c++) {
            double4 reached = axis.of(corner_[c] - origin_) * per;
            least = min(least, reached);
            most = max(most, reached);
        }
        t_ = min(max(t_, least), most);
        Vec3x4 inside = direction_ * t_ - away;
        b1_ = dot(cross(inside, second_), normal_) / squared;
        b2_ = dot(cross(first_, inside), normal_) / squared;
        b1_ = max(min(b1_, splat4(1.0)), splat4(0.0));
        b2_ = max(min(b2_, splat4(1.0) - b1_), splat4(0.0));
    }

    // Where the rays meet them: along the rays, and the points.
    double4 t() const { return t_; }
    [[gnu::always_inline]] SurfacePoint<double4> points() const {
        long4 solid = is_solid();
        double4 side = this->side();
        Vec3x4 normal = normal_ * (side / size_);
        if (bits(solid) != 15) normal = select(solid, normal, -(direction_ / length(direction_)));
        Vec3x4 shading = normal;
        if (any([](const SurfaceHit& hit) { return hit.mesh->corner_normals; })) {
            Vec3x4 smooth = smooth_normal();
            double4 size = length(smooth);
            shading = select(long4(size > splat4(0.0)), smooth * (side / size), normal);
        }
        return {corner_[0] + b1_ * first_ + b2_ * second_, normal, shading, offset()};
    }
    // Writes the surfaces to *targets[0], …; material: the slot of the object.
    void interactions(Interaction* const* targets) const {
        SurfacePoint<double4> points = this->points();
        double4 cosine = -dot(points.normal, direction_) / length(direction_);
        unsigned turned = bits(long4(side() < splat4(0.0)));
        for (int i = 0; i < count_; i++) {
            const TriangleMesh& mesh = *hits_[i].mesh;
            uint32_t triangle = hits_[i].primitive;
            Interaction& to = *targets[i];
            static_cast<SurfacePoint<double>&>(to) = lane(points, i);
            to.t = t_[i], to.cosine = cosine[i];
            to.backside = bool(turned >> i & 1) != hits_[i].object->mirrored;
            to.material = uint32_t(mesh.materials[triangle]);
            to.has_uv = mesh.corner_uvs;
            to.barycentric = {b1_[i], b2_[i]};
            to.uv = {};
            if (mesh.corner_uvs) {
                const float* uv = mesh.corner_uvs + 6 * triangle;
                to.uv = {interpolate<double>(i, uv[0], uv[2], uv[4]), interpolate<double>(i, uv[1], uv[3], uv[5])};
            }
            to.vertex_color = {};
            if (mesh.corner_colors)
                to.vertex_color = interpolate(i, TriangleMesh::corner_value(mesh.corner_colors, triangle, 0),
                                              TriangleMesh::corner_value(mesh.corner_colors, triangle, 1),
                                              TriangleMesh::corner_value(mesh.corner_colors, triangle, 2));
        }
    }

    // The length to which a renderer's relative rounding applies: the largest coordinate in world space, or of the object's
    // place, plus the distance of the farthest corner from the ray's origin times the triangle's slenderness. Barycentric
    // coordinates that are computed from the eye are off by a rounding of that distance over the height, and move the hit along
    // the longest side. origin: of rendering space.
    double4 magnitude(Vec3 origin) const {
        double4 largest = max_component(abs(translation_ + splat4(origin))), farthest = splat4(0.0);
        for (const Vec3x4& corner : corner_) {
            largest = max(largest, max_component(abs(corner + splat4(origin))));
            farthest = max(farthest, length(corner - origin_));
        }
        return largest + farthest * slenderness();
    }

   private:
    // A triangle this many times as long as high costs a depth six bits of its 53, if its normal is not taken with care: rounded
    // but once, in each component, so that its roundings turn it about its length.
    static constexpr double SLENDER = 64, MOST_SLENDER = 0x1p24;
    static constexpr uint32_t ALL_KINDS = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW;

    // of(object) of each, which is mostly the same one.
    template <class Of> double4 of_objects(const Of& of) const {
        return on_one_ ? splat4(of(*hits_[0].object)) : gather4([&](int i) { return of(*hits_[i].object); });
    }
    template <class Of> bool any(const Of& of) const { return of(hits_[0]) || of(hits_[1]) || of(hits_[2]) || of(hits_[3]); }
    template <class Value> Value interpolate(int i, Value a, Value b, Value c) const {
        return a * (1 - b1_[i] - b2_[i]) + b * b1_[i] + c * b2_[i];
    }

    // The side from which each is hit: −1 where the normal is turned to look at the ray. A triangle that is no surface, but was
    // found to be hit, is not turned.
    long4 is_solid() const { return long4(size_ > splat4(0.0)) & long4(size_ < splat4(INFINITE)); }
    double4 side() const { return select(long4(dot(normal_, direction_) > splat4(0.0)) & is_solid(), splat4(-1.0), splat4(1.0)); }

    // The longest side over the height on it; slimmer triangles than float32 can tell from a line are no surface.
    double4 slenderness() const { return min(longest_squared_ / size_, splat4(MOST_SLENDER)); }

    // The distance from the surface at which rays that leave it must start, with u = 2⁻⁵³, M the largest coordinate of corners
    // and object in rendering space and L the longest side. The point is rounded along the normal by √3 u (M + 6 L) where it is
    // interpolated. Seen from the start, corners are rounded by √3 u L; each of the three products u, v, w of the test is
    // rounded by 2 u L² and their sum is the normal's projection, so that the plane seems to lie off by 6 u L σ, σ = L²/|N|. An
    // instance's ray is rounded by as much again as its matrix's condition enlarges it.
    [[gnu::always_inline]] double4 offset() const {
        double4 reach = max(max_component(abs(corner_[0])), max(max_component(abs(corner_[1])), max_component(abs(corner_[2]))));
        reach = max(reach, max_component(abs(translation_)));
        double4 placing = of_objects([](auto& object) {
            return object.shared || object.visible != ALL_KINDS ? 6 * object.condition : 0;
        });
        return splat4(DOUBLE_ROUNDING) *
               ((splat4(4.0) + placing) * reach + (splat4(16.0) + splat4(12.0) * slenderness()) * sqrt(longest_squared_));
    }

    // The vertices' normals in the world, interpolated, of any length; 0 without any.
    [[gnu::always_inline]] Vec3x4 smooth_normal() const {
        // Cycles turns those of a mesh that only one object uses into the world before it interpolates, and normalizes them
        // there; those of a shared mesh it interpolates in object space.
        double4 inverse[3][3];
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 3; column++)
                inverse[row][column] = of_objects([=](auto& object) { return object.inverse[row][column]; });
        long4 mirrored = long4(of_objects([](auto& object) { return double(object.mirrored); }) > splat4(0.0));
        auto turned = [&](const Vec3x4& normal) __attribute__((always_inline)) {
            if (any([](const SurfaceHit& hit) { return hit.object->flat; }))
                return gather4([&](int i) { return hits_[i].object->turned_normal(lane(normal, i)); });
            Vec3x4 turned = transposed_product(inverse, normal);
            return select(mirrored, -turned, turned);
        };
        long4 shared = long4(of_objects([](auto& object) { return double(object.shared); }) > splat4(0.0));
        Vec3x4 corner[3];
        for (int c = 0; c < 3; c++) {
            corner[c] = gather4([&](int i) {
                const float* normals = hits_[i].mesh->corner_normals;
                return normals ? TriangleMesh::corner_value(normals, hits_[i].primitive, c) : Vec3{};
            });
            Vec3x4 placed = turned(corner[c]);
            double4 size = length(placed);
            corner[c] = select(shared, corner[c], select(long4(size > splat4(0.0)), placed / size, placed));
        }
        Vec3x4 smooth = corner[0] * (splat4(1.0) - b1_ - b2_) + corner[1] * b1_ + corner[2] * b2_;
        return bits(shared) ? select(shared, turned(smooth), smooth) : smooth;
    }

    SurfaceHit hits_[4];
    int count_;
    bool on_one_ = true;  // on one object
    Vec3x4 origin_, direction_, translation_;  // the rays'; the objects' places
    Vec3x4 corner_[3], first_, second_;        // rendering space; the sides from the first corner
    Vec3x4 normal_;                            // their cross product
    double4 size_, longest_squared_;           // the normal's length; the longest side's square
    double4 t_, b1_, b2_;
};

}  // namespace viewcam::VIEWCAM_ISA
