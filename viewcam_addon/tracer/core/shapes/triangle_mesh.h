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
#include "../accel/packet.h"
#include "object.h"

namespace viewcam::VIEWCAM_ISA {

// A mesh as it came from Python, whose arrays outlive the scene.
struct TriangleMesh {
    size_t vertex_count = 0, count = 0;
    const double* vertices = nullptr;        // (vertex_count, 3), object space
    const int32_t* triangles = nullptr;      // (count, 3)
    const int32_t* materials = nullptr;      // (count,), slots of the object
    const float* corner_normals = nullptr;   // (count, 3, 3), or nothing
    const float* corner_uvs = nullptr;       // (count, 3, 2), or nothing
    const float* corner_colors = nullptr;    // (count, 3, 3), linear, or nothing

    Vec3 corner(size_t triangle, int i) const {
        const double* v = vertices + 3 * size_t(triangles[3 * triangle + i]);
        return {v[0], v[1], v[2]};
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

    // object: whose the triangles are, NONE where the blocks tell.
    template <bool ANY> bool intersect(const Ray& ray, uint32_t object, Nearest& nearest) const {
        BoxRay box;
        if (bvh.root == NOTHING || !enter(bvh, Ray{ray.origin, ray.direction, ray.t_min, nearest.t}, box)) return false;
        Shear shear(ray.direction, box);
        double4 x = splat4(ray.origin[shear.x]), y = splat4(ray.origin[shear.y]), z = splat4(ray.origin[shear.z]);
        double4 by_x = splat4(shear.by_x), by_y = splat4(shear.by_y), by_z = splat4(shear.by_z);
        return traverse(bvh, box, [&](uint32_t leaf) {
            const Block& block = blocks[leaf];
            auto at = [&](int corner, int axis) { return load<double4>(block.corner[corner][axis]); };
            double4 t, determinant;
            unsigned met = bits(intersect_triangle(
                at(0, shear.x) - x, at(0, shear.y) - y, at(0, shear.z) - z, at(1, shear.x) - x, at(1, shear.y) - y, at(1, shear.z) - z,
                at(2, shear.x) - x, at(2, shear.y) - y, at(2, shear.z) - z, by_x, by_y, by_z, t, determinant));
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

    // The same of a packet's rays, each with what `intersect` would find.
    template <bool ANY> void intersect(Packet& packet) const {
        if (bvh.root == NOTHING) return;
        traverse_packet<ANY>(bvh, packet, [&](uint32_t leaf, int lane, bool& nearer) {
            const Block& block = blocks[leaf];
            const Shear& shear = packet.shear;
            double4 x = load<double4>(packet.origin[shear.x] + lane), y = load<double4>(packet.origin[shear.y] + lane),
                    z = load<double4>(packet.origin[shear.z] + lane), by_x = load<double4>(packet.by_x + lane),
                    by_y = load<double4>(packet.by_y + lane), by_z = load<double4>(packet.by_z + lane);
            for (int i = 0; i < 4 && block.object[i] != NONE; i++) {
                auto at = [&](int corner, int axis) { return splat4(block.corner[corner][axis][i]); };
                double4 t, determinant;
                long4 inside = intersect_triangle(at(0, shear.x) - x, at(0, shear.y) - y, at(0, shear.z) - z, at(1, shear.x) - x,
                                                  at(1, shear.y) - y, at(1, shear.z) - z, at(2, shear.x) - x, at(2, shear.y) - y,
                                                  at(2, shear.z) - z, by_x, by_y, by_z, t, determinant);
                if (!bits(inside)) continue;
                t = t / determinant;
                unsigned met = bits(inside & long4(t > load<double4>(packet.t_min + lane)) & long4(t <= load<double4>(packet.t + lane)));
                while (met) {
                    int ray = lane + take_bit(met);
                    nearer |= packet.offer<ANY>(ray, t[ray - lane], block.object[i], block.primitive[i]);
                }
            }
        });
    }
};

// Where a ray meets the triangle that it was found to hit, and all about the surface there.
class TriangleSurface {
   public:
    Vec3 corner[3], first, second;  // rendering space; the sides from the first corner
    Vec3 normal;                    // their cross product
    double normal_squared, longest_squared;
    double t, b1, b2;

    TriangleSurface(const TriangleMesh& mesh, const Object& object, size_t triangle, const Ray& ray) {
        for (int i = 0; i < 3; i++) corner[i] = object.to_world.point(mesh.corner(triangle, i));
        first = corner[1] - corner[0];
        second = corner[2] - corner[0];
        Vec3 third = corner[2] - corner[1];
        normal = cross(first, second);
        normal_squared = dot(normal, normal);
        double one = dot(first, first), two = dot(second, second);
        longest_squared = max(max(one, two), dot(third, third));
        if (normal_squared * (SLENDER * SLENDER) < one * two) {
            normal = exact_cross(first, second);
            normal_squared = dot(normal, normal);
        }
        Vec3 away = corner[0] - ray.origin;
        t = dot(normal, away) / dot(normal, ray.direction);
        // A triangle seen so nearly edge-on that its plane tells nothing is met between its corners.
        int axis = dominant_axis(std::fabs(ray.direction.x), std::fabs(ray.direction.y), std::fabs(ray.direction.z));
        double per = 1 / ray.direction[axis], least = away[axis] * per, most = least;
        for (int i = 1; i < 3; i++) {
            double reached = (corner[i][axis] - ray.origin[axis]) * per;
            least = min(least, reached);
            most = max(most, reached);
        }
        t = min(max(t, least), most);
        Vec3 inside = ray.direction * t - away;
        b1 = dot(cross(inside, second), normal) / normal_squared;
        b2 = dot(cross(first, inside), normal) / normal_squared;
        b1 = max(min(b1, 1.0), 0.0);
        b2 = max(min(b2, 1 - b1), 0.0);
    }

    template <class Value> Value interpolate(Value a, Value b, Value c) const { return a * (1 - b1 - b2) + b * b1 + c * b2; }

    // The longest side over the height on it; slimmer triangles than float32 can tell from a line are no surface.
    double slenderness(double most) const { return min(longest_squared / std::sqrt(normal_squared), most); }

    // How far off the surface rays that leave it must start, with u = 2⁻⁵³, M the largest coordinate of corners and object in
    // rendering space and L the longest side. The point is rounded along the normal by √3 u (M + 6 L) where it is interpolated.
    // Seen from the start, corners are rounded by √3 u L; each of the three products u, v, w of the test is rounded by
    // 2 u L² and their sum is the normal's projection, so that the plane seems to lie off by 6 u L σ, σ = L²/|N|. An instance's
    // ray is rounded by as much again as its matrix's condition enlarges it.
    double offset(const Object& object) const {
        double reach = max(max_component(abs(corner[0])), max(max_component(abs(corner[1])), max_component(abs(corner[2]))));
        reach = max(reach, max_component(abs(object.to_world.translation())));
        double longest = std::sqrt(longest_squared), placing = object.shared || object.visible != ALL_KINDS ? 6 * object.condition : 0;
        return DOUBLE_ROUNDING * ((4 + placing) * reach + (16 + 12 * slenderness(MOST_SLENDER)) * longest);
    }

    static constexpr uint32_t ALL_KINDS = CAMERA | DIFFUSE | GLOSSY | TRANSMISSION | SHADOW;

   private:
    // A triangle this many times as long as high costs a depth six bits of its 53, if its normal is not taken with care: rounded
    // but once, in each component, so that its roundings turn it about its length.
    static constexpr double SLENDER = 64, MOST_SLENDER = 0x1p24;
};

// The surface of a mesh where a ray hits it. material: the slot of the object.
inline Interaction triangle_interaction(const TriangleMesh& mesh, const Object& object, const Ray& ray, size_t triangle) {
    TriangleSurface at(mesh, object, triangle, ray);
    Interaction found;
    found.t = at.t;
    found.position = at.corner[0] + at.b1 * at.first + at.b2 * at.second;
    double side = dot(at.normal, ray.direction) > 0 ? -1 : 1, size = std::sqrt(at.normal_squared);
    if (size > 0 && size < INFINITE) {
        found.normal = at.normal * (side / size);
    } else {  // no surface, but what was found there looks at the ray
        side = 1;
        found.normal = -normalize(ray.direction);
    }
    found.cosine = -dot(found.normal, ray.direction) / length(ray.direction);
    found.backside = (side < 0) != object.mirrored;
    found.shading = found.normal;
    if (mesh.corner_normals) {
        // Cycles turns those of a mesh that only one object uses into the world before it interpolates, and normalises them
        // there; those of a shared mesh it interpolates in object space.
        Vec3 corner[3];
        for (int i = 0; i < 3; i++) {
            corner[i] = TriangleMesh::corner_value(mesh.corner_normals, triangle, i);
            if (object.shared) continue;
            corner[i] = object.turned_normal(corner[i]);
            double size = length(corner[i]);
            if (size > 0) corner[i] = corner[i] / size;
        }
        Vec3 smooth = at.interpolate(corner[0], corner[1], corner[2]);
        if (object.shared) smooth = object.turned_normal(smooth);
        double size = length(smooth);
        if (size > 0) found.shading = smooth * (side / size);
    }
    if (mesh.corner_uvs) {
        const float* uv = mesh.corner_uvs + 6 * triangle;
        found.uv = {at.interpolate<double>(uv[0], uv[2], uv[4]), at.interpolate<double>(uv[1], uv[3], uv[5])};
        found.has_uv = true;
    }
    if (mesh.corner_colors)
        found.vertex_color = at.interpolate(TriangleMesh::corner_value(mesh.corner_colors, triangle, 0),
                                            TriangleMesh::corner_value(mesh.corner_colors, triangle, 1),
                                            TriangleMesh::corner_value(mesh.corner_colors, triangle, 2));
    found.offset = at.offset(object);
    found.material = uint32_t(mesh.materials[triangle]);
    return found;
}

// What a renderer's relative rounding applies to at a hit: the largest coordinate in world space, or of the object's place,
// plus the distance of the farthest corner from the ray's origin times the triangle's slenderness. Barycentric coordinates that
// are computed from the eye are off by a rounding of that distance over the height, and move the hit along the longest side.
inline double triangle_magnitude(const TriangleMesh& mesh, const Object& object, const Ray& ray, size_t triangle, Vec3 origin) {
    TriangleSurface at(mesh, object, triangle, ray);
    double largest = max_component(abs(object.to_world.translation() + origin)), farthest = 0;
    for (Vec3 corner : at.corner) {
        largest = max(largest, max_component(abs(corner + origin)));
        farthest = max(farthest, length(corner - ray.origin));
    }
    return largest + farthest * at.slenderness(0x1p24);
}

}  // namespace viewcam::VIEWCAM_ISA
