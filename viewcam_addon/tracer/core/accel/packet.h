// Up to 64 rays through a hierarchy at once, where they lie close together: what each meets is what traverse.h finds for it.
//
// Rays of one packet have the same signs of direction and the same dominant axis; eight that follow each other are a group. A
// node's eight boxes are first tested for all rays in one interval; each that is met, for all groups, an interval each, and then for
// the eight rays of the first group that is left. Rays that meet a leaf's own box are tested against its triangles one by one.
// Rejected: intervals alone, without rays (a fifth of the speed to a sun, where some groups' origins lie far apart), frusta (no
// better where rays come from surfaces), packets of 16 (a fifth slower here), and sorting rays of bounces into packets (0.77 of
// single rays' speed before the sorting).
#pragma once
#include <bit>

#include "traverse.h"

namespace viewcam::VIEWCAM_ISA {

// The map that shears a ray's direction to the unit vector of its dominant axis.
struct Shear {
    int x = 0, y = 1, z = 2;
    double by_x = 0, by_y = 0, by_z = 1;

    Shear() = default;
    Shear(const Vec3& direction, const BoxRay& box)
        : x(NEXT[box.axis]), y(NEXT[x]), z(box.axis), by_x((&direction.x)[x] * box.axis_factor),
          by_y((&direction.x)[y] * box.axis_factor), by_z(box.axis_factor) {}

   private:
    static constexpr int NEXT[] = {1, 2, 0};
};

// Four triangles and a ray, or four rays and a triangle; corners relative to the rays' origins, in the order of a shear's axes.
// The triangles that are hit, on either side, however far along; t · determinant, and the determinant.
[[gnu::always_inline]] inline long4 intersect_triangle(double4 ax, double4 ay, double4 az, double4 bx, double4 by, double4 bz, double4 cx, double4 cy, double4 cz,
                                double4 by_x, double4 by_y, double4 by_z, double4& t, double4& determinant) {
    ax -= by_x * az, ay -= by_y * az, bx -= by_x * bz, by -= by_y * bz, cx -= by_x * cz, cy -= by_y * cz;
    double4 u = cx * by - cy * bx, v = ax * cy - ay * cx, w = bx * ay - by * ax, zero = splat4(0.0);
    long4 inside = (long4(u >= zero) & long4(v >= zero) & long4(w >= zero)) | (long4(u <= zero) & long4(v <= zero) & long4(w <= zero));
    determinant = u + v + w;
    t = (u * az + v * bz + w * cz) * by_z;
    return inside & long4(determinant != zero);
}

// N rays, or sets of rays, as traverse.h explains them, but for the origin, which is no product yet.
template <int N> struct alignas(64) BoxRays {
    float near_origin[3][N], far_origin[3][N], near_reciprocal[3][N], far_reciprocal[3][N], far[N];
};

struct alignas(64) Packet : BoxRays<PACKET> {
    double origin[3][PACKET], by_x[PACKET], by_y[PACKET], by_z[PACKET], t_min[PACKET], start[PACKET], unit[PACKET], t[PACKET];
    uint64_t name[PACKET];
    int key[PACKET];     // axis · 8 + signs; −1 misses the hierarchy
    int source[PACKET];  // the ray's number
    int count = 0;
    bool backward[3];
    Shear shear;  // its axes; the factors are by_x …

    // See Nearest. Whether it is nearer.
    template <bool ANY> bool offer(int ray, double distance, uint32_t object, uint32_t primitive) {
        uint64_t other = uint64_t(object) << 32 | primitive;
        if (!(distance < t[ray] || (distance == t[ray] && other < name[ray]))) return false;
        name[ray] = other;
        t[ray] = ANY ? -INFINITE : distance;
        far[ray] = ANY ? -1 : std::min(far[ray], round_up(max(distance * unit[ray] - start[ray], 0.0)));
        return true;
    }

    // Takes over one ray of another packet.
    void add(const Packet& other, int ray) {
        int i = count++;
        for (int axis = 0; axis < 3; axis++) {
            near_origin[axis][i] = other.near_origin[axis][ray];
            far_origin[axis][i] = other.far_origin[axis][ray];
            near_reciprocal[axis][i] = other.near_reciprocal[axis][ray];
            far_reciprocal[axis][i] = other.far_reciprocal[axis][ray];
            origin[axis][i] = other.origin[axis][ray];
        }
        far[i] = other.far[ray];
        by_x[i] = other.by_x[ray];
        by_y[i] = other.by_y[ray];
        by_z[i] = other.by_z[ray];
        t_min[i] = other.t_min[ray];
        start[i] = other.start[ray];
        unit[i] = other.unit[ray];
        t[i] = other.t[ray];
        name[i] = other.name[ray];
        key[i] = other.key[ray];
        source[i] = other.source[ray];
    }

    // Computes what the rays have in common, and fills up the last eight with rays that meet nothing.
    void close() {
        shear.z = key[0] >> 3;
        shear.x = (shear.z + 1) % 3;
        shear.y = (shear.z + 2) % 3;
        for (int axis = 0; axis < 3; axis++) backward[axis] = key[0] >> axis & 1;
        int last = count - 1, full = (count + 7) / 8 * 8;
        while (count < full) {
            int i = count;
            add(*this, last);
            far[i] = -1;
            t[i] = -INFINITE;
        }
        count = last + 1;
    }
};

// enter() of four rays at a time: `packet` of all of them, each with its key. The origin is taken from planes before the product,
// since what all rays have in common needs it; so `error` has 2 U h.
inline void enter(const Bvh& bvh, const Rays& rays, const Hits& nearest, int count, Packet& packet) {
    packet.count = count;
    double largest = max_component(bvh.half);
    for (int i = 0; i < count; i += 4) {
        double4 origin[3], d[3], t_min = load<double4>(rays.t_min + i), size[3], unit[3], from[3], reciprocal[3];
        store(packet.t + i, load<double4>(nearest.t + i));
        store(packet.name + i, load<long4>(nearest.name + i));
        store(packet.source + i, int4{i, i + 1, i + 2, i + 3});
        for (int axis = 0; axis < 3; axis++) {
            origin[axis] = load<double4>(rays.origin[axis] + i), d[axis] = load<double4>(rays.direction[axis] + i);
            store(packet.origin[axis] + i, origin[axis]);
            size[axis] = abs(d[axis]);
        }
        store(packet.t_min + i, t_min);
        double4 longest = max(size[0], max(size[1], size[2])), inverse = splat4(INFINITE), per = longest * splat4(bvh.scale);
        for (int axis = 0; axis < 3; axis++) {
            reciprocal[axis] = splat4(1.0) / d[axis];
            inverse = min(abs(reciprocal[axis]), inverse);  // the longest's reciprocal, to the bit
        }
        double4 start = t_min * per, end = load<double4>(packet.t + i) * per, far = splat4(0.0);
        for (int axis = 0; axis < 3; axis++) {
            unit[axis] = d[axis] * inverse;
            reciprocal[axis] = with_sign(min(abs(longest * reciprocal[axis]), splat4(1e200)), unit[axis]);
            from[axis] = (origin[axis] - splat4(bvh.center[axis])) * splat4(bvh.scale);
            double4 edge = splat4(bvh.half[axis] * (1 + 1e-9) + 1e-300) + splat4(4e-16) * abs(from[axis]);
            double4 to_low = (-edge - from[axis]) * reciprocal[axis], to_high = (edge - from[axis]) * reciprocal[axis];
            double4 first = min(to_low, to_high), last = max(to_low, to_high);
            start = max(start, first - abs(first) * splat4(4e-15));
            end = min(end, last + abs(last) * splat4(4e-15));
            far = max(far, abs(from[axis]));
        }
        long4 meets = long4(start <= end) & long4(longest > splat4(0.0)) & long4(longest < splat4(1e300));
        double4 error = splat4(largest * (2 * FLOAT_ROUNDING + 2e-12)) + splat4(8 * DOUBLE_ROUNDING) * (far + abs(start));
        DominantAxis dominant({size[0], size[1], size[2]});
        long4 key = ~dominant.x & ((dominant.y & splat4(int64_t(1) << 3)) | (~dominant.y & splat4(int64_t(2) << 3)));
        for (int axis = 0; axis < 3; axis++) {
            double4 entry = from[axis] + start * unit[axis], forward = with_sign(error, unit[axis]);
            double4 bounded = with_sign(min(abs(reciprocal[axis]), splat4(1e12)), reciprocal[axis]);
            store(packet.near_origin[axis] + i, __builtin_convertvector(entry + forward, float4));
            store(packet.far_origin[axis] + i, __builtin_convertvector(entry - forward, float4));
            store(packet.near_reciprocal[axis] + i, __builtin_convertvector(bounded * splat4(1.0 - 6 * FLOAT_ROUNDING), float4));
            store(packet.far_reciprocal[axis] + i, __builtin_convertvector(bounded * splat4(1.0 + 6 * FLOAT_ROUNDING), float4));
            key |= ((long4)unit[axis] >> 63) & splat4(int64_t(1) << axis);
        }
        double4 along = dominant.of({d[0], d[1], d[2]}), next = dominant.of({d[1], d[2], d[0]}), after = dominant.of({d[2], d[0], d[1]});
        double4 by_z = with_sign(inverse, along);
        store(packet.by_x + i, next * by_z);
        store(packet.by_y + i, after * by_z);
        store(packet.by_z + i, by_z);
        store(packet.start + i, start);
        store(packet.unit + i, per);
        store(packet.far + i, __builtin_convertvector((end - start) * splat4(1 + 2.5e-7) + splat4(1e-37), float4));
        store(packet.key + i, __builtin_convertvector((meets & key) | ~meets, int4));
    }
}

// Calls visit(leaf, first of eight rays, which of them may meet it) for the leaves that any ray may meet; it tells whether any of
// them met something nearer.
template <bool ANY, class Visit> inline void traverse_packet(const Bvh& bvh, Packet& packet, const Visit& visit) {
    const int groups = (packet.count + 7) / 8;
    int near[3], far[3];
    // Bounds of each group's rays together, and of all: near planes from the origin farthest along, by the reciprocal of least size; far
    // planes the other way. Where there is no group, those of the last one, with an end before the start.
    BoxRays<8> each, all;
    int from[8];
    for (int g = 0; g < 8; g++) from[g] = 8 * std::min(g, groups - 1);
    auto reduce = [&](const float* values, bool most, float* of_each, float* of_all) {
        float8 group[8];
        for (int g = 0; g < 8; g++) group[g] = load<float8>(values + from[g]);
        float8 extremes = most ? reduce_eight<true>(group) : reduce_eight<false>(group);
        store(of_each, extremes);
        store(of_all, splat8(most ? reduce_max(extremes) : reduce_min(extremes)));
    };
    for (int axis = 0; axis < 3; axis++) {
        bool backward = packet.backward[axis];
        near[axis] = 2 * axis + backward;
        far[axis] = near[axis] ^ 1;
        reduce(packet.near_origin[axis], !backward, each.near_origin[axis], all.near_origin[axis]);
        reduce(packet.far_origin[axis], backward, each.far_origin[axis], all.far_origin[axis]);
        reduce(packet.near_reciprocal[axis], backward, each.near_reciprocal[axis], all.near_reciprocal[axis]);
        reduce(packet.far_reciprocal[axis], !backward, each.far_reciprocal[axis], all.far_reciprocal[axis]);
    }
    reduce(packet.far, true, each.far, all.far);
    for (int g = groups; g < 8; g++) each.far[g] = -1;
    // True where eight rays, from i on, meet planes, eight of them or one eight times; `first`: how far along.
    auto meets = [&](const auto& plane, const auto& rays, int i, float8& first) {
        auto enters = [&](int a) { return (plane(near[a]) - load<float8>(rays.near_origin[a] + i)) * load<float8>(rays.near_reciprocal[a] + i); };
        auto leaves = [&](int a) { return (plane(far[a]) - load<float8>(rays.far_origin[a] + i)) * load<float8>(rays.far_reciprocal[a] + i); };
        first = max(max(enters(0), enters(1)), max(enters(2), splat8(0)));
        return bits(int8(first <= min(min(leaves(0), leaves(1)), min(leaves(2), load<float8>(rays.far + i)))));
    };
    struct Entry {
        uint32_t child, parent;
        float distance;
        uint16_t slot, groups;  // the parent's slot; the groups that may meet the parent
    } stack[Bvh::STACK], entry{bvh.root, NOTHING, 0, 0, uint16_t((1u << groups) - 1)};
    int size = 0;
    for (;;) {
        float8 first;
        auto own_plane = [&](int i) { return splat8(bvh.nodes[entry.parent].bounds[i][entry.slot]); };
        auto rays_of = [&](int group) { return entry.parent == NOTHING ? 255 : meets(own_plane, packet, 8 * group, first); };
        unsigned met_by = entry.groups, rays = 0;
        if (entry.parent != NOTHING) met_by &= meets(own_plane, each, 0, first);
        while (met_by && !(rays = rays_of(std::countr_zero(met_by)))) met_by &= met_by - 1;
        if (met_by && !(entry.child & LEAF)) {
            const Bvh::Node& node = bvh.nodes[entry.child];
            unsigned met = meets([&](int i) { return load<float8>(node.bounds[i]); }, all, 0, first);
            float distance[8];
            store(distance, first);
            for (int base = size; met;) {
                int i = take_bit(met), at = size++;
                for (; !ANY && at > base && stack[at - 1].distance < distance[i]; at--) stack[at] = stack[at - 1];
                stack[at] = {node.child[i], entry.child, distance[i], uint16_t(i), uint16_t(met_by)};
            }
        } else if (met_by && entry.child != NOTHING) {  // see traverse
            bool nearer = false;
            for (;;) {
                int group = take_bit(met_by);
                if (rays && visit(entry.child & ~LEAF, 8 * group, rays)) {
                    each.far[group] = reduce_max(load<float8>(packet.far + 8 * group));
                    nearer = true;
                }
                if (!met_by) break;
                rays = rays_of(std::countr_zero(met_by));
            }
            if (nearer) {
                store(all.far, splat8(reduce_max(load<float8>(each.far))));
                if (ANY && all.far[0] < 0) return;
            }
        }
        do {
            if (!size) return;
            size--;
        } while (stack[size].distance > all.far[0]);
        entry = stack[size];
    }
}

}  // namespace viewcam::VIEWCAM_ISA
