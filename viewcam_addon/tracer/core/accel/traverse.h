// Takes a ray through a hierarchy, near boxes first; in any order where it only asks whether it meets anything.
//
// A ray as the boxes of a hierarchy see it: in float32, everything rounded so that no box is missed that the ray meets.
//
// The ray is moved, in float64, to where it enters the hierarchy's own box, and counted in units of that box; its largest
// direction becomes 1. A plane is met at plane · reciprocal − start, where `start` is origin · reciprocal. Near and far planes have
// a start and a reciprocal each: of the near ones they err forward, so that boxes begin too early, of the far ones backward. With
// U = 2⁻²⁴ and the hierarchy's half size h < 1:
// - the origin's rounding to float is U (h + its own error), and a plane's to float is outward already (bvh.h); start's own rounding
//   moves a plane by U h more, and that of plane · reciprocal, where it is not fused with the difference, by U h again: `error` has
//   4 U h, the rest being room for the float64 arithmetic before, some 8 · 2⁻⁵³ of what was subtracted;
// - of the reciprocal and the difference each has rounded once, 2 U; the reciprocals stand off by 6 U.
// A direction component below 1e-12 has the reciprocal 1e12: the near plane comes earlier, and the far one, U h · 1e12 away or
// farther for whatever runs between the planes, lies behind the box all the same.
#pragma once
#include "../ray.h"
#include "bvh.h"

namespace viewcam::VIEWCAM_ISA {

constexpr float FLOAT_ROUNDING = 0x1p-24f;

// Rounds a distance of at least 0 up to a float.
inline float round_up(double distance) { return float(distance * (1 + 2.5e-7) + 1e-37); }

// The number of a direction's largest component, given their sizes. No branch, which rays from surfaces would take at random.
inline int dominant_axis(double x, double y, double z) {
    int axis = !(x > y);
    return max(x, y) > z ? axis : 2;
}

// The largest components of four directions, given their sizes.
struct DominantAxis {
    long4 x, y;  // true if it is that one

    explicit DominantAxis(const Vec3x4& size)
        : x(long4(size.x > size.y) & long4(size.x > size.z)), y(~long4(size.x > size.y) & long4(size.y > size.z)) {}
    double4 of(const Vec3x4& v) const { return select(x, v.x, select(y, v.y, v.z)); }
};

struct BoxRay {
    float near_start[4], far_start[4], near_reciprocal[4], far_reciprocal[4];
    bool backward[3];     // true of a component that is negative
    int axis;             // the dominant one
    double start, unit;   // t · unit − start is the distance that boxes count from the entry
    double axis_factor;   // 1 / direction[axis]
    float far;

    // Nothing farther than t is asked for any more.
    void limit(double t) { far = std::min(far, round_up(max(t * unit - start, 0.0))); }
};

// The ray, no farther than t_max, for the boxes of `bvh`; false where it misses them all. origin_error: see LocalRay.
inline bool enter(const Bvh& bvh, const Ray& ray, double t_max, double origin_error, BoxRay& box) {
    // The fourth of all these is what comes next in memory, and no matter.
    double4 direction = load<double4>(&ray.direction.x), origin = load<double4>(&ray.origin.x);
    double4 size = abs(direction);
    int axis = dominant_axis(size[0], size[1], size[2]);
    double longest = max(max(size[0], size[1]), size[2]);
    if (!(longest > 0) || !(longest < 1e300)) return false;
    double inverse = 1 / longest;
    double4 unit = direction * splat4(inverse), reciprocal = splat4(longest) * (splat4(1.0) / direction);
    reciprocal = copysign(min(abs(reciprocal), splat4(1e200)), unit);
    double4 center = load<double4>(&bvh.center.x), half = load<double4>(&bvh.half.x), scale = splat4(bvh.scale);
    double4 from = (origin - center) * scale;
    double4 edge = half * splat4(1 + 1e-9) + splat4(4e-16) * abs(from) + splat4(origin_error * bvh.scale + 1e-300);
    double4 to_low = (-edge - from) * reciprocal, to_high = (edge - from) * reciprocal, first = min(to_low, to_high), last = max(to_low, to_high);
    first -= abs(first) * splat4(4e-15);
    last += abs(last) * splat4(4e-15);
    box.unit = longest * bvh.scale;
    double start = ray.t_min * box.unit, end = t_max * box.unit;
    start = max(max(start, first[0]), max(first[1], first[2]));
    end = min(min(end, last[0]), min(last[1], last[2]));
    if (!(start <= end)) return false;

    double largest = max(half[0], max(half[1], half[2]));
    double away = max(std::fabs(from[0]), max(std::fabs(from[1]), std::fabs(from[2])));
    double error = largest * (4 * FLOAT_ROUNDING + 2e-12) + 8 * DOUBLE_ROUNDING * (away + std::fabs(start)) +
                   origin_error * bvh.scale;
    double4 entry = from + splat4(start) * unit, forward = copysign(splat4(error), unit);
    double4 bounded = copysign(min(abs(reciprocal), splat4(1e12)), reciprocal);
    float4 near = __builtin_convertvector(bounded * splat4(1.0 - 6 * FLOAT_ROUNDING), float4);
    float4 far = __builtin_convertvector(bounded * splat4(1.0 + 6 * FLOAT_ROUNDING), float4);
    store(box.near_reciprocal, near);
    store(box.far_reciprocal, far);
    store(box.near_start, __builtin_convertvector(entry + forward, float4) * near);
    store(box.far_start, __builtin_convertvector(entry - forward, float4) * far);
    for (int i = 0; i < 3; i++) box.backward[i] = std::signbit(unit[i]);
    box.start = start;
    box.axis = axis;
    box.axis_factor = std::copysign(inverse, (&ray.direction.x)[axis]);
    box.far = round_up(end - start);
    return true;
}

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
