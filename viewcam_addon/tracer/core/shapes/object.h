// An object: a geometry of the scene, placed in rendering space.
#pragma once
#include "../accel/bvh.h"
#include "../math/exact.h"
#include "../ray.h"

namespace viewcam::VIEWCAM_ISA {

struct Object {
    uint32_t geometry = 0;
    uint32_t visible = 0;       // to which kinds of rays, RayKind's bits
    uint64_t lit_by = 0;        // a bit for each set of receivers that it is in
    uint64_t receivers = EVERYTHING;  // the sets of objects that its own light reaches: a bit of their lit_by
    uint32_t first_slot = 0;    // an index into Scene::slots, one for each of the geometry's materials
    float index = 0;            // shown by the Object Index pass
    const float* info = nullptr;  // its color, alpha and random number, where a material may ask for them
    RayKind shadow_rays = SHADOW;  // the kind of those that are sent to it
    bool shared = false;        // true if other objects place the same geometry
    bool flat = false;          // true if the matrix has no inverse to speak of
    bool mirrored = false;      // true if corners that run counter-clockwise in object space run clockwise in the world
    double condition = 1;       // the matrix's: by how much its inverse may enlarge a rounding
    Affine to_world;            // object space to rendering space
    double inverse[3][3] = {};  // the linear part's
    Vec3 translation_low;       // the rest that the translation's rounding took away
    double translation_error = 0;  // the largest such rest in object space, in each coordinate

    Vec3 to_object(Vec3 v) const { return product(inverse, v); }
    // The ray in object space; t stays what it is.
    LocalRay to_object(const Ray& ray) const {
        Vec3 apart = ray.origin - to_world.translation(), sizes = abs(apart);
        LocalRay local{{to_object(apart), to_object(ray.direction), ray.t_min, ray.t_max}};
        for (int row = 0; row < 3; row++)
            local.origin_error = max(local.origin_error, std::fabs(inverse[row][0]) * sizes.x + std::fabs(inverse[row][1]) * sizes.y +
                                                                   std::fabs(inverse[row][2]) * sizes.z);
        local.origin_error = 8 * DOUBLE_ROUNDING * local.origin_error + translation_error;
        return local;
    }
    // The largest coordinate that the linear part makes of coordinates up to `size`.
    double stretched(double size) const {
        double most = 0;
        for (auto& row : to_world.m) most = max(most, std::fabs(row[0]) + std::fabs(row[1]) + std::fabs(row[2]));
        return most * size;
    }
    Vec3 column(int i) const { return {to_world.m[0][i], to_world.m[1][i], to_world.m[2][i]}; }
    // A vertex's normal as the sides of a triangle turn the triangle's own, of any length: by the matrix's cofactors, the inverse's
    // transpose but for a factor.
    Vec3 turned_normal(Vec3 n) const {
        if (flat) return turned_by_cofactors(n);
        Vec3 turned = transposed_product(inverse, n);
        return mirrored ? -turned : turned;
    }

    // Places the object. matrix: (3, 4), rows first, to world space. origin: rendering space's, in the world.
    void place(const double* matrix, Vec3 origin) {
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++) to_world.m[row][column] = matrix[4 * row + column];
            Pair translation = two_sum(matrix[4 * row + 3], -origin[row]);
            to_world.m[row][3] = translation.high;
            (row == 0 ? translation_low.x : row == 1 ? translation_low.y : translation_low.z) = translation.low;
        }
        Vec3 a = column(0), b = column(1), c = column(2), bc = exact_cross(b, c), ca = exact_cross(c, a), ab = exact_cross(a, b);
        double determinant = dot(a, bc), largest = 0, largest_inverse = 0;
        Vec3 rows[3] = {bc / determinant, ca / determinant, ab / determinant};
        for (int row = 0; row < 3; row++) {
            largest = max(largest, std::fabs(to_world.m[row][0]) + std::fabs(to_world.m[row][1]) + std::fabs(to_world.m[row][2]));
            largest_inverse = max(largest_inverse, std::fabs(rows[row].x) + std::fabs(rows[row].y) + std::fabs(rows[row].z));
            for (int i = 0; i < 3; i++) inverse[row][i] = rows[row][i];
        }
        condition = largest * largest_inverse;
        translation_error = 2 * largest_inverse * max_component(abs(translation_low));
        flat = !(condition < 0x1p50);
        if (flat) condition = 0x1p50;
        mirrored = flat ? dot(a, cross(b, c)) < 0 : determinant < 0;
    }

   private:
    Vec3 turned_by_cofactors(Vec3 n) const {
        Vec3 a = column(0), b = column(1), c = column(2), cofactors[3] = {cross(b, c), cross(c, a), cross(a, b)};
        double largest = max(max_component(abs(cofactors[0])), max(max_component(abs(cofactors[1])), max_component(abs(cofactors[2]))));
        return largest > 0 ? (cofactors[0] * n.x + cofactors[1] * n.y + cofactors[2] * n.z) / largest : Vec3{};
    }
};

}  // namespace viewcam::VIEWCAM_ISA
