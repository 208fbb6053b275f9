// A hierarchy of boxes, eight to a node, over anything that has a box: built by the surface area heuristic, the same for any
// number of threads.
//
// Boxes are float32 in units of the hierarchy's own size, about its own center, rounded outward: neither a scene's scale nor its
// place costs a digit. What a ray does not hit is left out without a doubt, since traverse.h rounds to the other side as well.
//
// Rejected: quantized boxes (half the memory of the nodes, which are a quarter of all, for a tenth of the speed), spatial splits
// (a third faster on long thin triangles, twice the memory), and a refit where things move (nothing moves here but the camera).
#pragma once
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "../math/simd.h"
#include "../math/vec.h"
#include "parallel.h"

namespace viewcam::VIEWCAM_ISA {

struct Bounds {
    Vec3 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    Vec3 high = -low;

    bool is_empty() const { return !(low.x <= high.x); }
    void add(Vec3 p) {
        low = {min(low.x, p.x), min(low.y, p.y), min(low.z, p.z)};
        high = {max(high.x, p.x), max(high.y, p.y), max(high.z, p.z)};
    }
    void add(const Bounds& other) {
        add(other.low);
        add(other.high);
    }
};

// A node's child is another node, or a leaf by its number.
constexpr uint32_t LEAF = 0x80000000u, NOTHING = 0xffffffffu;

struct Bvh {
    struct alignas(32) Node {
        float bounds[6][8];  // low x, high x, low y, high y, low z, high z; of what is not there, a box that nothing hits
        uint32_t child[8];
    };
    // No path through the nodes is longer, see Builder::split.
    static constexpr int MAX_DEPTH = 96, STACK = 7 * MAX_DEPTH + 1;

    Array<Node> nodes;
    uint32_t root = NOTHING;
    uint32_t leaf_size = 1;
    Array<uint32_t> leaves;  // leaf_size primitives each, NOTHING where there are fewer
    // Boxes hold (p − center) · scale, scale a power of two, within ±half, which is below 1.
    Vec3 center, half;
    double scale = 1;

    size_t leaf_count() const { return leaves.size() / leaf_size; }
    size_t bytes() const { return nodes.size() * sizeof(Node) + leaves.size() * sizeof(uint32_t); }
};

namespace build {

// A primitive's box; the fourth float of `low` holds its number, plus 2³⁰ so that as a float it is an ordinary one.
struct alignas(32) Reference {
    float4 low, high;

    void set_number(uint32_t number) {
        number |= 1u << 30;
        std::memcpy(reinterpret_cast<char*>(&low) + 12, &number, 4);
    }
    uint32_t number() const {
        uint32_t number;
        std::memcpy(&number, reinterpret_cast<const char*>(&low) + 12, 4);
        return number & ~(1u << 30);
    }
};

struct BinaryNode {
    float4 low, high;
    uint32_t left, right;        // nodes
    uint32_t first, count;       // references of a leaf; count is 0 elsewhere
};

inline float half_area(float4 low, float4 high) {
    float4 d = high - low;
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

constexpr float FAR = std::numeric_limits<float>::infinity();
constexpr float4 EMPTY_LOW = {FAR, FAR, FAR, FAR}, EMPTY_HIGH = {-FAR, -FAR, -FAR, -FAR};

class Builder {
   public:
    Array<Reference> references;
    Array<BinaryNode> nodes;
    std::atomic<uint32_t> used{1};

    Builder(size_t count, uint32_t leaf_size, int threads)
        : references(count), nodes(2 * count + 1), leaf_size_(leaf_size), spare_(threads - 1) {}

    void run() { split(0, 0, references.size(), 0); }

   private:
    static constexpr int BINS = 16;
    static constexpr size_t WORTH_A_THREAD = 20000, WORTH_MANY = 200000;
    // Below this the surface area heuristic ends and halves are split, so that no path is longer than Bvh::MAX_DEPTH.
    static constexpr int DEEP = 60;

    // Boxes and numbers of what has its center in each of a node's bins, along all axes.
    struct Bins {
        float4 low[BINS][3], high[BINS][3];
        uint4 count[BINS];

        void clear() {
            for (int bin = 0; bin < BINS; bin++) {
                for (int axis = 0; axis < 3; axis++) low[bin][axis] = EMPTY_LOW, high[bin][axis] = EMPTY_HIGH;
                count[bin] = uint4{};
            }
        }
        void add(const Bins& other) {
            for (int bin = 0; bin < BINS; bin++) {
                for (int axis = 0; axis < 3; axis++) {
                    low[bin][axis] = min(low[bin][axis], other.low[bin][axis]);
                    high[bin][axis] = max(high[bin][axis], other.high[bin][axis]);
                }
                count[bin] += other.count[bin];
            }
        }
    };
    struct Extent {  // boxes together, and their doubled centers
        float4 low = EMPTY_LOW, high = EMPTY_HIGH, center_low = EMPTY_LOW, center_high = EMPTY_HIGH;
    };
    struct Place {
        int axis = -1, bin = 0;
    };

    void split(uint32_t me, size_t begin, size_t end, int depth) {
        BinaryNode& node = nodes[me];
        size_t count = end - begin;
        int parts = count > WORTH_MANY ? std::min(spare_.load(), 7) + 1 : 1;
        auto part = [&](int i) { return begin + count * size_t(i) / size_t(parts); };

        Extent extents[8];
        parallel_for(parts, size_t(parts), [&](size_t i) {
            Extent e;
            for (size_t k = part(int(i)); k < part(int(i) + 1); k++) {
                float4 low = references[k].low, high = references[k].high, center = low + high;
                e.low = min(e.low, low);
                e.high = max(e.high, high);
                e.center_low = min(e.center_low, center);
                e.center_high = max(e.center_high, center);
            }
            extents[i] = e;
        });
        Extent all = extents[0];
        for (int i = 1; i < parts; i++) {
            all.low = min(all.low, extents[i].low);
            all.high = max(all.high, extents[i].high);
            all.center_low = min(all.center_low, extents[i].center_low);
            all.center_high = max(all.center_high, extents[i].center_high);
        }
        node.low = all.low;
        node.high = all.high;
        node.count = 0;
        if (count <= leaf_size_) {
            node.first = uint32_t(begin);
            node.count = uint32_t(count);
            return;
        }

        size_t middle = begin + count / 2;
        float4 size = all.center_high - all.center_low, factor{};
        for (int axis = 0; axis < 3; axis++) {
            float f = float(BINS) * (1 - 1e-6f) / size[axis];  // times a part of it less than BINS, however that is rounded
            factor[axis] = size[axis] > 0 && f < FAR ? f : 0;
        }
        if (depth < DEEP && (factor[0] > 0 || factor[1] > 0 || factor[2] > 0)) {
            Bins few;
            std::vector<Bins> many(parts > 1 ? size_t(parts) : 0);
            Bins* bins = parts > 1 ? many.data() : &few;
            parallel_for(parts, size_t(parts), [&](size_t i) {
                Bins& mine = bins[i];
                mine.clear();
                for (size_t k = part(int(i)); k < part(int(i) + 1); k++) {
                    float4 low = references[k].low, high = references[k].high;
                    int4 bin = __builtin_convertvector((low + high - all.center_low) * factor, int4);
                    for (int axis = 0; axis < 3; axis++) {
                        mine.low[bin[axis]][axis] = min(mine.low[bin[axis]][axis], low);
                        mine.high[bin[axis]][axis] = max(mine.high[bin[axis]][axis], high);
                        mine.count[bin[axis]][axis] += 1;
                    }
                }
            });
            for (int i = 1; i < parts; i++) bins[0].add(bins[i]);
            Place best = cheapest(bins[0]);
            if (best.axis >= 0) {
                float low = all.center_low[best.axis], f = factor[best.axis], first_right = float(best.bin);
                auto is_left = [&](const Reference& r) { return (r.low[best.axis] + r.high[best.axis] - low) * f < first_right; };
                middle = size_t(std::partition(&references[begin], &references[begin] + count, is_left) - references.begin());
                if (middle == begin || middle == end) middle = begin + count / 2;
            }
        }

        uint32_t children = used.fetch_add(2);
        node.left = children;
        node.right = children + 1;
        if (count > WORTH_A_THREAD && take_thread()) {
            parallel_for(2, 2, [&](size_t i) {
                i ? split(children, begin, middle, depth + 1) : split(children + 1, middle, end, depth + 1);
                spare_++;  // whoever is ready first helps others
            });
            spare_--;
            return;
        }
        split(children, begin, middle, depth + 1);
        split(children + 1, middle, end, depth + 1);
    }

    // Where both sides' areas, each times its leaves, are least; all axes at a time.
    Place cheapest(const Bins& bins) const {
        float4 right_area[BINS];
        uint4 right_count[BINS], count{};
        float4 low[3] = {EMPTY_LOW, EMPTY_LOW, EMPTY_LOW}, high[3] = {EMPTY_HIGH, EMPTY_HIGH, EMPTY_HIGH};
        auto add = [&](int bin) {
            float4 area{};
            for (int axis = 0; axis < 3; axis++) {
                low[axis] = min(low[axis], bins.low[bin][axis]);
                high[axis] = max(high[axis], bins.high[bin][axis]);
                area[axis] = half_area(low[axis], high[axis]);
            }
            count += bins.count[bin];
            return area;
        };
        auto leaves = [&](uint4 count) { return __builtin_convertvector(int4((count + splat4(leaf_size_ - 1)) >> splat4(leaf_shift_)), float4); };
        for (int bin = BINS - 1; bin > 0; bin--) right_area[bin] = add(bin), right_count[bin] = count;
        std::fill(low, low + 3, EMPTY_LOW), std::fill(high, high + 3, EMPTY_HIGH), count = uint4{};
        float4 least = {FAR, FAR, FAR, FAR};
        int4 best{};
        for (int bin = 1; bin < BINS; bin++) {
            float4 cost = add(bin - 1) * leaves(count) + right_area[bin] * leaves(right_count[bin]);
            int4 better = int4(count != uint4{}) & int4(right_count[bin] != uint4{}) & int4(cost < least);
            least = better ? cost : least;
            best = better ? int4{bin, bin, bin, bin} : best;
        }
        Place place;
        for (int axis = 0; axis < 3; axis++)
            if (least[axis] < (place.axis < 0 ? FAR : least[place.axis])) place = {axis, best[axis]};
        return place;
    }

    bool take_thread() {
        int spare = spare_.load();
        while (spare > 0 && !spare_.compare_exchange_weak(spare, spare - 1)) {}
        return spare > 0;
    }

    uint32_t leaf_size_;  // a power of two
    uint32_t leaf_shift_ = uint32_t(std::countr_zero(leaf_size_));
    std::atomic<int> spare_;
};

// A binary tree's nodes become nodes of eight: the children of largest area are opened until there are eight.
inline void collapse(const Builder& builder, Bvh& bvh) {
    const Array<BinaryNode>& binary = builder.nodes;
    size_t leaf_count = 0;
    for (uint32_t i = 0; i < builder.used; i++) leaf_count += binary[i].count > 0;
    // A node of fewer than eight has leaves only, two at least: there are no more nodes than this.
    Array<Bvh::Node> nodes(leaf_count * 4 / 7 + 2);
    bvh.leaves = Array<uint32_t>(leaf_count * bvh.leaf_size);
    size_t node_count = 0, leaf = 0;
    struct Todo {
        uint32_t node, *reference;
    };
    std::vector<Todo> todo;
    auto refer = [&](uint32_t node, uint32_t* reference) {
        if (!binary[node].count) {
            todo.push_back({node, reference});
            return;
        }
        for (uint32_t i = 0; i < bvh.leaf_size; i++)
            bvh.leaves[leaf * bvh.leaf_size + i] =
                i < binary[node].count ? builder.references[binary[node].first + i].number() : NOTHING;
        *reference = LEAF | uint32_t(leaf++);
    };
    refer(0, &bvh.root);
    while (!todo.empty()) {
        auto [top, reference] = todo.back();
        todo.pop_back();
        *reference = uint32_t(node_count);
        Bvh::Node& node = nodes[node_count++];
        uint32_t children[8] = {binary[top].left, binary[top].right};
        int count = 2;
        while (count < 8) {
            int widest = -1;
            float area = -1;
            for (int i = 0; i < count; i++) {
                const BinaryNode& child = binary[children[i]];
                float a = half_area(child.low, child.high);
                if (!child.count && a > area) area = a, widest = i;
            }
            if (widest < 0) break;
            uint32_t opened = children[widest];
            children[widest] = binary[opened].left;
            children[count++] = binary[opened].right;
        }
        for (int i = 0; i < 8; i++) {
            for (int axis = 0; axis < 3; axis++) {
                node.bounds[2 * axis][i] = i < count ? binary[children[i]].low[axis] : FAR;
                node.bounds[2 * axis + 1][i] = i < count ? binary[children[i]].high[axis] : -FAR;
            }
            node.child[i] = NOTHING;
        }
        for (int i = count - 1; i >= 0; i--) refer(children[i], &node.child[i]);
    }
    bvh.nodes = Array<Bvh::Node>(node_count);
    std::copy(nodes.begin(), nodes.begin() + node_count, bvh.nodes.begin());
}

}  // namespace build

// The hierarchy over `count` primitives of which box_of(i) → Bounds has the boxes; empty ones are left out.
template <class BoxOf> Bvh build_bvh(size_t count, const BoxOf& box_of, uint32_t leaf_size, int threads) {
    constexpr size_t PIECE = 16384;
    if (count >= 1u << 30) throw std::length_error("a hierarchy holds no more than 2^30 primitives");
    Bvh bvh;
    bvh.leaf_size = leaf_size;
    std::vector<Bounds> extents((count + PIECE - 1) / PIECE);
    std::vector<size_t> present(extents.size());
    parallel_pieces(threads, count, PIECE, [&](size_t begin, size_t end) {
        Bounds extent;
        size_t solid = 0;
        for (size_t i = begin; i < end; i++) {
            Bounds box = box_of(i);
            if (box.is_empty()) continue;
            extent.add(box);
            solid++;
        }
        extents[begin / PIECE] = extent;
        present[begin / PIECE] = solid;
    });
    Bounds extent;
    size_t solid = 0;
    for (size_t i = 0; i < extents.size(); i++) {
        if (present[i]) extent.add(extents[i]);
        size_t before = solid;
        solid += present[i];
        present[i] = before;  // where its boxes go
    }
    if (!solid) return bvh;

    bvh.center = extent.low * 0.5 + extent.high * 0.5;
    Vec3 up = extent.high - bvh.center, down = bvh.center - extent.low;
    bvh.half = {max(up.x, down.x), max(up.y, down.y), max(up.z, down.z)};
    double largest = max_component(bvh.half);
    if (largest > 0) bvh.scale = std::ldexp(1.0, -std::max(std::ilogb(largest), -1000) - 2);
    bvh.half = bvh.half * bvh.scale;

    build::Builder builder(solid, leaf_size, threads);
    parallel_pieces(threads, count, PIECE, [&](size_t begin, size_t end) {
        size_t to = present[begin / PIECE];
        for (size_t i = begin; i < end; i++) {
            Bounds box = box_of(i);
            if (box.is_empty()) continue;
            build::Reference& reference = builder.references[to++];
            for (int axis = 0; axis < 3; axis++) {
                // One float beyond the rounded value covers the rounding of the difference as well as that to float.
                float low = float((box.low[axis] - bvh.center[axis]) * bvh.scale);
                float high = float((box.high[axis] - bvh.center[axis]) * bvh.scale);
                reference.low[axis] = std::nextafterf(low, -build::FAR);
                reference.high[axis] = std::nextafterf(high, build::FAR);
            }
            reference.high[3] = 0;
            reference.set_number(uint32_t(i));
        }
    });
    builder.run();
    build::collapse(builder, bvh);
    return bvh;
}

}  // namespace viewcam::VIEWCAM_ISA
