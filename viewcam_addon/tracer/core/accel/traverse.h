// Takes a ray through a hierarchy, near boxes first; in any order where it only asks whether it meets anything.
#pragma once
#include "box_ray.h"

namespace viewcam::VIEWCAM_ISA {

// Calls visit(leaf) for the leaves whose boxes the ray meets before ray.far, which `visit` may lower, until one gives true.
template <bool ANY, class Visit> inline bool traverse(const Bvh& bvh, BoxRay& ray, const Visit& visit) {
    float8 near_start[3], far_start[3], near_reciprocal[3], far_reciprocal[3];
    int near[3], far[3];
    for (int axis = 0; axis < 3; axis++) {
        near_start[axis] = splat8(ray.near_start[axis]);
        far_start[axis] = splat8(ray.far_start[axis]);
        near_reciprocal[axis] = splat8(ray.near_reciprocal[axis]);
        far_reciprocal[axis] = splat8(ray.far_reciprocal[axis]);
        near[axis] = 2 * axis + ray.backward[axis];
        far[axis] = near[axis] ^ 1;
    }
    struct Entry {
        uint32_t child;
        float distance;
    } stack[Bvh::STACK];
    int size = 0;
    uint32_t current = bvh.root;
    for (;;) {
        bool missed = false;
        while (!(current & LEAF)) {
            const Bvh::Node& node = bvh.nodes[current];
            auto enters = [&](int a) { return multiply_subtract(load<float8>(node.bounds[near[a]]), near_reciprocal[a], near_start[a]); };
            auto leaves = [&](int a) { return multiply_subtract(load<float8>(node.bounds[far[a]]), far_reciprocal[a], far_start[a]); };
            float8 first = max(max(enters(0), enters(1)), max(enters(2), splat8(0)));
            float8 last = min(min(leaves(0), leaves(1)), min(leaves(2), splat8(ray.far)));
            unsigned met = bits(int8(first <= last));
            if (!met) {
                missed = true;
                break;
            }
            int i = take_bit(met);
            if (!met) {
                current = node.child[i];
                continue;
            }
            float distance[8];
            store(distance, first);
            int j = take_bit(met);
            if (!met) {
                if (!ANY && distance[j] < distance[i]) std::swap(i, j);
                stack[size++] = {node.child[j], distance[j]};
                current = node.child[i];
                continue;
            }
            int base = size;
            auto push = [&](int k) {  // farthest first
                Entry entry{node.child[k], distance[k]};
                int at = size++;
                for (; !ANY && at > base && stack[at - 1].distance < entry.distance; at--) stack[at] = stack[at - 1];
                stack[at] = entry;
            };
            push(i);
            push(j);
            while (met) push(take_bit(met));
            current = stack[--size].child;
        }
        // NOTHING is met by a ray that comes from so far that its place is no number.
        if (!missed && current != NOTHING && visit(current & ~LEAF)) return true;
        do {
            if (!size) return false;
            size--;
        } while (stack[size].distance > ray.far);
        current = stack[size].child;
    }
}

// A ray as it comes, no farther than t_max. origin_error: see LocalRay.
template <bool ANY, class Visit>
inline bool traverse(const Bvh& bvh, const Ray& ray, double t_max, double origin_error, const Visit& visit) {
    BoxRay box;
    if (bvh.root == NOTHING || !enter(bvh, ray, t_max, origin_error, box)) return false;
    return traverse<ANY>(bvh, box, [&](uint32_t leaf) { return visit(leaf, box); });
}

}  // namespace viewcam::VIEWCAM_ISA
