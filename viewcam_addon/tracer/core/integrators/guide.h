// Where diffuse surfaces get their light from, learned from paths that no picture shows: a part of their rays is sent there, as those of
// a room to its window (path guiding: Müller, Gross and Novák, Practical Path Guiding for Efficient Light-Transport Simulation, 2017).
//
// Places are told apart by a grid over all of them, once for each side that a surface may show, of six; neighboring cells are one leaf as
// long as they have few rays. A leaf has a map of directions, the octahedron unfolded to a square of equal bins; a bin is chosen in
// proportion to the root of the mean square of what rays brought along it, since what varies needs rays as much as what is bright (Rath et
// al., Variance-Aware Path Guiding, 2020).
//
// Nothing is biased: all is learned before the first sample of a picture, and a ray is weighted by the density of both ways of sending
// it, the lobe's own and the guide's. It changes no bit, either, how many threads learn: rays are put in the order of their paths.
//
// Rejected: bins of an equal solid angle, which need functions of angles for each ray; a tree to look places up in, with which guided rays
// cost twice as much more; to choose a bin by one number, which spreads the rays of a pixel less evenly; learning from the picture's own
// samples, whose weights would depend on how far it has come.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "../accel/bvh.h"
#include "../bsdf/sampling.h"

namespace viewcam::VIEWCAM_ISA {

class Guide {
   public:
    static constexpr int SIDE = 16, BINS = SIDE * SIDE;
    // A diffuse ray. squared: what it brought, as the square of its share in an integral over the map, over its density there.
    struct LearnedRay {
        Vec3 position;
        uint8_t facing;
        uint16_t bin;
        float squared;
    };
    // The density over the map of each bin; the chance that a row or one before it is chosen, and in each row a bin or one before it.
    struct Leaf {
        float density[BINS], rows[SIDE], columns[SIDE][SIDE];
    };

    explicit Guide(const std::vector<LearnedRay>& rays) : leaf_of_(SIDES * CELLS) {
        Bounds box;
        for (const LearnedRay& ray : rays) box.add(ray.position);
        low_ = box.low;
        Vec3 size = box.high - box.low;
        for (int axis = 0; axis < 3; axis++) set(scale_, axis, size[axis] > 0 ? GRID / size[axis] : 0);
        std::vector<CellRay> of_cells;
        for (const LearnedRay& ray : rays) of_cells.push_back({cell(ray.position, ray.facing), ray.bin, ray.squared});
        std::stable_sort(of_cells.begin(), of_cells.end(), [](const CellRay& a, const CellRay& b) { return a.cell < b.cell; });
        auto begin = of_cells.begin();
        for (uint32_t first = 0; first < SIDES * CELLS; first += CELLS) {
            auto end = std::find_if(begin, of_cells.end(), [&](const CellRay& ray) { return ray.cell >= first + CELLS; });
            add_leaves(first, CELLS, begin, end);
            begin = end;
        }
    }

    const Leaf& at(Vec3 position, Vec3 normal) const { return leaves_[leaf_of_[cell(position, facing(normal))]]; }
    // A diffuse ray along which light has come. pdf, mixed: the density of the lobe and that of both ways.
    static LearnedRay learned(Vec3 position, Vec3 normal, Vec3 direction, double light, double pdf, double mixed) {
        double stretch;
        int bin = bin_of(to_map<double>(direction, stretch));
        return {position, uint8_t(facing(normal)), uint16_t(bin), float(min(light * light * (pdf * pdf * stretch / mixed), 1e30))};
    }

    // Direction → place in the map, [0, 1]². stretch: receives the solid angle over the area of the map there.
    template <class T> static Vec2Of<T> to_map(Vec3Of<T> direction, T& stretch) {
        Vec3Of<T> sizes = abs(direction);
        T size = sizes.x + sizes.y + sizes.z;
        stretch = 4.0 * size * size * size;
        return unfolded<T>(direction.x / size, direction.y / size, Mask<T>(direction.z < 0.0));
    }
    template <class T> static Vec3Of<T> from_map(Vec2Of<T> place) {
        T x = place.x * 2.0 - 1.0, y = place.y * 2.0 - 1.0, z = 1.0 - abs(x) - abs(y);
        Vec2Of<T> folded = unfolded<T>(x, y, Mask<T>(z < 0.0));
        Vec3Of<T> point{folded.x * 2.0 - 1.0, folded.y * 2.0 - 1.0, z};
        return point / length(point);
    }
    static int bin_of(Vec2 place) { return std::min(int(place.y * SIDE), SIDE - 1) * SIDE + std::min(int(place.x * SIDE), SIDE - 1); }

   private:
    static constexpr uint32_t SIDES = 6, BITS = 5, GRID = 1 << BITS, CELLS = 1 << 3 * BITS;
    static constexpr ptrdiff_t FEW = 500;  // rays of a leaf, at least
    // cell: the bits of the three coordinates in turn, the highest first, so that halves of a range of cells are boxes.
    struct CellRay {
        uint32_t cell;
        uint16_t bin;
        float squared;
    };
    using Rays = std::vector<CellRay>::const_iterator;

    static void set(Vec3& v, int axis, double value) { (axis == 0 ? v.x : axis == 1 ? v.y : v.z) = value; }
    static uint32_t spread(uint32_t bits) {  // abcde → a00b00c00d00e
        bits = (bits | bits << 8) & 0x100f;
        bits = (bits | bits << 4) & 0x10c3;
        return (bits | bits << 2) & 0x1249;
    }
    uint32_t cell(Vec3 position, uint32_t facing) const {
        auto coordinate = [&](int axis) { return spread(uint32_t(min(max((position[axis] - low_[axis]) * scale_[axis], 0.0), GRID - 1.0))); };
        return facing * CELLS + (coordinate(0) << 2 | coordinate(1) << 1 | coordinate(2));
    }
    // The side of a box that a surface shows.
    static int facing(Vec3 normal) {
        Vec3 sizes = abs(normal);
        int axis = sizes.x >= sizes.y && sizes.x >= sizes.z ? 0 : sizes.y >= sizes.z ? 1 : 2;
        return 2 * axis + (normal[axis] < 0);
    }
    // The lower half of the octahedron lies outside the upper one's square, in the map's corners; the way back is the same.
    template <class T> static Vec2Of<T> unfolded(T x, T y, Mask<T> lower) {
        T over = copysign(1.0 - abs(y), x), up = copysign(1.0 - abs(x), y);
        return {select(lower, over, x) * 0.5 + 0.5, select(lower, up, y) * 0.5 + 0.5};
    }

    // Leaves for a range of cells. Those of a half that has too few rays of its own learn from all of the range.
    void add_leaves(uint32_t first, uint32_t count, Rays begin, Rays end) {
        if (count == 1 || end - begin < 2 * FEW) return add_leaf(first, count, begin, end);
        Rays middle = std::find_if(begin, end, [&](const CellRay& ray) { return ray.cell >= first + count / 2; });
        if (middle - begin < FEW) add_leaf(first, count / 2, begin, end); else add_leaves(first, count / 2, begin, middle);
        if (end - middle < FEW) add_leaf(first + count / 2, count / 2, begin, end); else add_leaves(first + count / 2, count / 2, middle, end);
    }
    void add_leaf(uint32_t first, uint32_t count, Rays begin, Rays end) {
        std::fill_n(leaf_of_.begin() + first, count, uint16_t(leaves_.size()));
        leaves_.push_back(leaf(begin, end));
    }

    // Neighbors lend a bin of what they have learned: half of a bin or so is how far apart a leaf's places see the same thing.
    static Leaf leaf(Rays begin, Rays end) {
        constexpr double NEXT = 0.25;
        double sums[BINS] = {}, roots[BINS], total = 0;
        for (auto ray = begin; ray != end; ++ray) sums[ray->bin] += ray->squared;
        for (int bin = 0; bin < BINS; bin++) {
            double sum = 0, weights = 0;
            for (int row = std::max(bin / SIDE - 1, 0); row <= std::min(bin / SIDE + 1, SIDE - 1); row++)
                for (int column = std::max(bin % SIDE - 1, 0); column <= std::min(bin % SIDE + 1, SIDE - 1); column++) {
                    double weight = (row == bin / SIDE ? 1 : NEXT) * (column == bin % SIDE ? 1 : NEXT);
                    sum += weight * sums[row * SIDE + column], weights += weight;
                }
            total += roots[bin] = std::sqrt(sum / weights);
        }
        if (!(total > 0)) std::fill_n(roots, BINS, 1.0), total = BINS;
        Leaf leaf;
        double of_rows[SIDE] = {};
        for (int bin = 0; bin < BINS; bin++) of_rows[bin / SIDE] += roots[bin];
        add_up(of_rows, leaf.rows);
        for (int row = 0; row < SIDE; row++) {
            add_up(roots + row * SIDE, leaf.columns[row]);
            for (int column = 0; column < SIDE; column++)  // from the chances as they are stored, by which bins are chosen
                leaf.density[row * SIDE + column] = float(BINS * (leaf.rows[row] - (row ? leaf.rows[row - 1] : 0.0)) * (leaf.columns[row][column] - (column ? leaf.columns[row][column - 1] : 0.0)));
        }
        return leaf;
    }
    // The chances that something or one before it is chosen, in proportion to some numbers; all are alike where these are 0.
    static void add_up(const double* numbers, float* reached) {
        double total = 0, sum = 0;
        for (int i = 0; i < SIDE; i++) total += numbers[i];
        for (int i = 0; i < SIDE; i++) reached[i] = total > 0 ? float((sum += numbers[i]) / total) : float(i + 1) / SIDE;
        reached[SIDE - 1] = 1;
    }

    Vec3 low_, scale_;
    std::vector<uint16_t> leaf_of_;  // by cell
    std::vector<Leaf> leaves_;
};

// The guide of one point, or of four.
template <class T> class GuideAt {
   public:
    static constexpr double SHARE = 0.5;  // the share of diffuse rays that follow the guide
    static constexpr int LANES = std::is_same_v<T, double> ? 1 : 4;

    // point(i): position and normal.
    template <class Point> GuideAt(const Guide& guide, const Point& point) {
        for (int i = 0; i < LANES; i++) {
            auto [position, normal] = point(i);
            leaves_[i] = &guide.at(position, normal);
        }
    }

    // A direction of a diffuse lobe; its weight is that of both ways of finding it, and its density the lobe's own, as lights weigh it.
    template <class Lobe> LobeSampleOf<T> sample(const Lobe& lobe, Vec2Of<T> u) const {
        Mask<T> guided(u.x < SHARE);
        Vec2Of<T> rest{select(guided, u.x / SHARE, (u.x - SHARE) / (1 - SHARE)), u.y};
        LobeSampleOf<T> sample = lobe.sample(rest);
        if (any(guided)) {
            Vec3Of<T> direction = Guide::from_map<T>(place(rest));
            T pdf = lobe.pdf(direction);
            Mask<T> above(pdf > 0.0);
            sample.direction = select(guided, direction, sample.direction);
            sample.weight = select(guided, select(above, lobe.eval(direction) / pdf, Vec3Of<T>{}), sample.weight);
            sample.pdf = select(guided, pdf, sample.pdf);
        }
        sample.weight = sample.weight * select(Mask<T>(sample.pdf > 0.0), sample.pdf / mixed(sample.pdf, sample.direction), T{});
        return sample;
    }
    // The density of both ways. pdf: the lobe's.
    T mixed(T pdf, Vec3Of<T> direction) const {
        T stretch;
        Vec2Of<T> place = Guide::to_map<T>(direction, stretch);
        T density = each([&](int i) { return leaves_[i]->density[Guide::bin_of(lane(place, i))]; });
        return (1 - SHARE) * pdf + SHARE * (density / stretch);
    }

   private:
    static Vec2 lane(Vec2Of<T> v, int i) {
        if constexpr (LANES == 1) return v; else return {v.x[i], v.y[i]};
    }
    template <class Of> static T each(const Of& of) {
        if constexpr (LANES == 1) return of(0); else return double4{double(of(0)), double(of(1)), double(of(2)), double(of(3))};
    }
    // The place in [0, 1] that a number has in what is reached step by step; `step`: receives in which.
    static double stepped(const float* reached, double u, int& step) {
        step = 0;
        for (int half = Guide::SIDE / 2; half > 0; half /= 2) step += reached[step + half - 1] <= u ? half : 0;  // no branches: nobody could predict them
        double before = step > 0 ? reached[step - 1] : 0, chance = reached[step] - before;
        return (step + (chance > 0 ? std::clamp((u - before) / chance, 0.0, 1.0) : 0.5)) / Guide::SIDE;
    }
    // A place of the map: a row and then a bin in it, so that numbers that are spread evenly over a square stay so.
    Vec2Of<T> place(Vec2Of<T> u) const {
        Vec2 places[LANES];
        for (int i = 0; i < LANES; i++) {
            int row, column;
            Vec2 numbers = lane(u, i);
            places[i].y = stepped(leaves_[i]->rows, numbers.y, row);
            places[i].x = stepped(leaves_[i]->columns[row], numbers.x, column);
        }
        return {each([&](int i) { return places[i].x; }), each([&](int i) { return places[i].y; })};
    }

    const Guide::Leaf* leaves_[LANES];
};

}  // namespace viewcam::VIEWCAM_ISA
