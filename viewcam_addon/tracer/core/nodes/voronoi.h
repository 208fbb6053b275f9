// Voronoi's texture: how far it is to points that stand by chance, one in each cell of a lattice, and which is the nearest.
//
// Up to 4.5 Cycles places the points by lookup3 of float32 numbers; from 5.0 on, but on a line, by PCG of whole ones.
#pragma once
#include "procedural.h"

namespace viewcam::VIEWCAM_ISA {

// From 0 to 1. Jarzynski and Olano, Hash Functions for GPU Rendering, JCGT 9 (2020), with a shift that keeps the sign, as in Cycles.
template <size_t N> inline Place<N> pcg(const std::array<int32_t, N>& keys) {
    std::array<uint32_t, N> v;
    for (size_t i = 0; i < N; i++) v[i] = uint32_t(keys[i]) * 1664525u + 1013904223u;
    auto stir = [&] {
        if constexpr (N == 2)
            v[0] += v[1] * 1664525u, v[1] += v[0] * 1664525u;
        else if constexpr (N == 3)
            v[0] += v[1] * v[2], v[1] += v[2] * v[0], v[2] += v[0] * v[1];
        else
            v[0] += v[1] * v[3], v[1] += v[2] * v[0], v[2] += v[0] * v[1], v[3] += v[1] * v[2];
    };
    stir();
    for (uint32_t& x : v) x ^= uint32_t(int32_t(x) >> 16);
    stir();
    Place<N> numbers;
    for (size_t i = 0; i < N; i++) numbers[i] = (v[i] & 0x7fffffffu) / 2147483648.0;
    return numbers;
}

// The points round a place.
template <size_t N> struct VoronoiPoints {
    using Offset = std::array<int, N>;  // in cells, from the place's own
    enum Metric { EUCLIDEAN, MANHATTAN, CHEBYCHEV, MINKOWSKI } metric = EUCLIDEAN;
    double exponent = 0.5, randomness = 1, smoothness = 0;
    bool by_pcg = true;
    std::array<int32_t, N> cell = {};
    Place<N> local = {};  // the place within its cell

    // The figures of the point that counts. position: from the place's cell on.
    struct Site {
        double distance = 0;
        Vec3 color;
        Place<N> position = {};
    };

    void stand_at(const Place<N>& p) {
        for (size_t i = 0; i < N; i++) cell[i] = whole_number(p[i]), local[i] = p[i] - std::floor(p[i]);
    }
    double size(const Place<N>& v) const {
        if (N == 1) return std::fabs(v[0]);
        double sum = 0, most = 0;
        for (double x : v) {
            most = max(most, std::fabs(x));
            sum += metric == EUCLIDEAN ? x * x : metric == MINKOWSKI ? safe::positive_power(std::fabs(x), exponent) : std::fabs(x);
        }
        if (metric == CHEBYCHEV) return most;
        return metric == EUCLIDEAN ? std::sqrt(sum) : metric == MINKOWSKI ? safe::positive_power(sum, safe::divide(1, exponent)) : sum;
    }

    Site nearest(bool second) const {
        double least = INFINITE, next = INFINITE;
        Offset first = {}, after = {};
        around<1>([&](const Offset& offset) {
            double distance = size(from_place(offset));
            if (distance < least)
                next = least, after = first, least = distance, first = offset;
            else if (distance < next)
                next = distance, after = offset;
        });
        const Offset& offset = second ? after : first;
        return {second ? next : least, color(offset), point(offset)};
    }
    // The points' mean, weighted by how near they are.
    Site blended() const {
        Site sum;
        bool begun = false;
        around<2>([&](const Offset& offset) {
            double distance = size(from_place(offset)), h = 1;
            if (begun) h = unit_range(0.5 + 0.5 * (sum.distance - distance) / smoothness), h = h * h * (3 - 2 * h);
            begun = true;
            double less = smoothness * h * (1 - h);
            sum.distance = mix(sum.distance, distance, h) - less;
            less /= 1 + 3 * smoothness;
            sum.color = mix(sum.color, color(offset), h) - gray(less);
            Place<N> there = point(offset);
            for (size_t i = 0; i < N; i++) sum.position[i] = mix(sum.position[i], there[i], h) - less;
        });
        return sum;
    }
    // To the border of the nearest point's cell.
    double to_edge() const {
        constexpr double SAME = 0.0001;  // points are not nearer to each other, squared
        if constexpr (N == 1) {
            double middle = from_place({0})[0], left = from_place({-1})[0], right = from_place({1})[0];
            return min(std::fabs(middle + left), std::fabs(middle + right)) / 2;
        }
        double least = INFINITE, border = INFINITE;
        Place<N> nearest = {};
        around<1>([&](const Offset& offset) {
            Place<N> there = from_place(offset);
            if (double squared = dot(there, there); squared < least) least = squared, nearest = there;
        });
        around<1>([&](const Offset& offset) {
            Place<N> there = from_place(offset), apart, middle;
            for (size_t i = 0; i < N; i++) apart[i] = there[i] - nearest[i], middle[i] = (there[i] + nearest[i]) / 2;
            if (double squared = dot(apart, apart); squared > SAME) border = min(border, dot(middle, apart) / std::sqrt(squared));
        });
        return border;
    }
    // Half-way from the nearest point to the one that is nearest to that.
    double radius() const {
        double least = INFINITE;
        Offset nearest = {};
        around<1>([&](const Offset& offset) {
            Place<N> there = from_place(offset);
            if (double squared = dot(there, there); squared < least) least = squared, nearest = offset;
        });
        Place<N> middle = point(nearest);
        least = INFINITE;
        around<1>([&](Offset offset) {
            if (offset == Offset{}) return;
            for (size_t i = 0; i < N; i++) offset[i] += nearest[i];
            Place<N> apart = point(offset);
            for (size_t i = 0; i < N; i++) apart[i] -= middle[i];
            least = min(least, dot(apart, apart));
        });
        return std::sqrt(least) / 2;
    }

   private:
    template <int REACH, class Function> static void around(Function&& function) {
        Offset offset;
        offset.fill(-REACH);
        for (size_t axis = 0; axis < N;) {
            function(static_cast<const Offset&>(offset));
            for (axis = 0; axis < N && ++offset[axis] > REACH; axis++) offset[axis] = -REACH;
        }
    }
    static double dot(const Place<N>& a, const Place<N>& b) {
        double sum = 0;
        for (size_t i = 0; i < N; i++) sum += a[i] * b[i];
        return sum;
    }
    std::array<int32_t, N> there(const Offset& offset) const {
        std::array<int32_t, N> of = cell;
        for (size_t i = 0; i < N; i++) of[i] += offset[i];
        return of;
    }
    Place<N> numbers(const Offset& offset) const {
        auto of = there(offset);
        if constexpr (N > 1)
            if (by_pcg) return pcg(of);
        Place<N> p;
        for (size_t i = 0; i < N; i++) p[i] = of[i];
        if constexpr (N == 4)
            return {hashed(p[0], p[1], p[2], p[3]), hashed(p[3], p[0], p[1], p[2]), hashed(p[2], p[3], p[0], p[1]), hashed(p[1], p[2], p[3], p[0])};
        Vec3 three = hashed_color(p);
        for (size_t i = 0; i < N; i++) p[i] = three[int(i)];
        return p;
    }
    Place<N> point(const Offset& offset) const {
        Place<N> at = numbers(offset);
        for (size_t i = 0; i < N; i++) at[i] = offset[i] + at[i] * randomness;
        return at;
    }
    Place<N> from_place(const Offset& offset) const {
        Place<N> at = point(offset);
        for (size_t i = 0; i < N; i++) at[i] -= local[i];
        return at;
    }
    Vec3 color(const Offset& offset) const {
        auto of = there(offset);
        if constexpr (N > 1)
            if (by_pcg) {
                std::array<int32_t, N == 4 ? 4 : 3> keys = {};
                std::copy(of.begin(), of.end(), keys.begin());
                auto numbers = pcg(keys);
                return {numbers[0], numbers[1], numbers[2]};
            }
        Place<N> p;
        for (size_t i = 0; i < N; i++) p[i] = of[i];
        return hashed_color(p);
    }
};

struct VoronoiNode {
    static constexpr const char* NAME = "voronoi";
    static constexpr Gives GIVES = Gives::COLOR;
    static constexpr bool VARIES = true;  // by the version
    Color vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness;
    std::string dimensions, metric;
    enum { F1, F2, SMOOTH_F1, DISTANCE_TO_EDGE, N_SPHERE_RADIUS } feature;
    enum { DISTANCE, COLOR, POSITION, W, RADIUS } output;
    bool normalize;

    explicit VoronoiNode(const Inputs& in)
        : vector(in["vector"]), w(in["w"]), scale(in["scale"]), detail(in["detail"]), roughness(in["roughness"]), lacunarity(in["lacunarity"]),
          smoothness(in["smoothness"]), exponent(in["exponent"]), randomness(in["randomness"]), dimensions(in.choice("dimensions")),
          metric(in.choice("metric")), feature(feature_of(in.choice("feature"))), output(output_of(in.choice("output"))),
          normalize(in.flag("normalize")) {}
    Gives gives() const { return output == POSITION ? Gives::VECTOR : GIVES; }
    Vec3 eval(const ShadingPoint& at) const {
        double by = at.number(scale);
        return in_dimensions(dimensions, at.value(vector) * by, at.number(w) * by, [&](const auto& p) { return of(p, by, at); });
    }

   private:
    static decltype(feature) feature_of(const std::string& name) {
        return name == "f2" ? F2 : name == "smooth_f1" ? SMOOTH_F1 : name == "distance_to_edge" ? DISTANCE_TO_EDGE : name == "n_sphere_radius" ? N_SPHERE_RADIUS : F1;
    }
    static decltype(output) output_of(const std::string& name) {
        return name == "color" ? COLOR : name == "position" ? POSITION : name == "w" ? W : name == "radius" ? RADIUS : DISTANCE;
    }

    template <size_t N> Vec3 of(const Place<N>& p, double by, const ShadingPoint& at) const {
        using Points = VoronoiPoints<N>;
        Points points;
        points.metric = metric == "manhattan" ? Points::MANHATTAN : metric == "chebychev" ? Points::CHEBYCHEV : metric == "minkowski" ? Points::MINKOWSKI : Points::EUCLIDEAN;
        points.exponent = at.number(exponent);
        points.randomness = unit_range(at.number(randomness));
        points.smoothness = unit_range(at.number(smoothness)) / 2;
        points.by_pcg = at.version >= CYCLES_5_0;
        if (feature == N_SPHERE_RADIUS) {
            points.stand_at(p);
            return output == RADIUS ? gray(points.radius()) : Vec3{};
        }
        if (output == RADIUS) return {};
        double octaves = min(max(at.number(detail), 0), 15), finer = at.number(lacunarity), weaker = unit_range(at.number(roughness));
        if (feature == DISTANCE_TO_EDGE) return output == DISTANCE ? gray(edges(points, p, octaves, weaker, finer)) : Vec3{};
        typename Points::Site site = sum(points, p, octaves, weaker, finer);
        if (output == DISTANCE) return gray(site.distance);
        if (output == COLOR) return site.color;
        std::array<double, 4> place = {};
        for (size_t i = 0; i < N; i++) place[N == 1 ? 3 : i] = safe::divide(site.position[i], by);
        return output == W ? gray(place[3]) : Vec3{place[0], place[1], place[2]};
    }

    // Octaves' sums of distances and colors, and mixtures of positions.
    template <size_t N>
    typename VoronoiPoints<N>::Site sum(VoronoiPoints<N>& points, const Place<N>& p, double octaves, double weaker, double finer) const {
        using Site = typename VoronoiPoints<N>::Site;
        Site total;
        double weight = 1, weights = 0, fine = 1;
        for (int i = 0; i <= std::ceil(octaves); i++) {
            Place<N> there = p;
            for (double& x : there) x *= fine;
            points.stand_at(there);
            Site octave = feature == SMOOTH_F1 && points.smoothness != 0 ? points.blended() : points.nearest(feature == F2);
            for (size_t k = 0; k < N; k++) octave.position[k] = safe::divide(octave.position[k] + std::floor(there[k]), fine);
            if (octaves == 0 || weaker == 0) {
                total = octave, weights = 1;
                break;
            }
            double share = i <= octaves ? 1 : octaves - std::floor(octaves);
            weights += share * weight;
            total.distance += share * weight * octave.distance;
            total.color += octave.color * (share * weight);
            for (size_t k = 0; k < N; k++) total.position[k] = mix(total.position[k], octave.position[k], share * weight);
            fine *= finer, weight *= weaker;
        }
        if (normalize) {
            Place<N> farthest;
            farthest.fill(0.5 + 0.5 * points.randomness);
            total.distance = safe::divide(total.distance, weights * points.size(farthest) * (feature == F2 ? 2 : 1));
            total.color = total.color / weights;
        }
        return total;
    }
    template <size_t N> double edges(VoronoiPoints<N>& points, const Place<N>& p, double octaves, double weaker, double finer) const {
        constexpr double FAR = 8;  // than any border
        double farthest = 0.5 + 0.5 * points.randomness, most = farthest, distance = FAR, weight = 1, fine = 1;
        for (int i = 0; i <= std::ceil(octaves); i++) {
            Place<N> there = p;
            for (double& x : there) x *= fine;
            points.stand_at(there);
            double octave = points.to_edge();
            if (octaves == 0 || weaker == 0) {
                distance = octave;
                break;
            }
            double share = i <= octaves ? 1 : octaves - std::floor(octaves);
            most = mix(most, safe::divide(farthest, fine), share * weight);
            distance = mix(distance, min(distance, safe::divide(octave, fine)), share * weight);
            fine *= finer, weight *= weaker;
        }
        return normalize ? safe::divide(distance, most) : distance;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
