// Textures that are formulas of a place.
#pragma once
#include "noise.h"

namespace viewcam::VIEWCAM_ISA {

// So that whole coordinates do not lie on the border of two cells.
inline Vec3 off_the_border(Vec3 p) { return (p + gray(0.000001)) * 0.999999; }
// A number as a whole one; 0 where it is too large for one.
inline int32_t whole_number(double x) { return std::fabs(x) < 2e9 ? int32_t(std::floor(x)) : 0; }

// A place as two or three of its axes and w, by the dimensions that are asked for.
template <class Function> auto in_dimensions(const std::string& dimensions, Vec3 p, double w, Function&& function) {
    if (dimensions == "1d") return function(Place<1>{w});
    if (dimensions == "2d") return function(Place<2>{p.x, p.y});
    if (dimensions == "4d") return function(Place<4>{p.x, p.y, p.z, w});
    return function(Place<3>{p.x, p.y, p.z});
}

struct NoiseNode {
    static constexpr const char* NAME = "noise";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion;
    std::string dimensions;
    Octaves::Sum sum;
    bool normalize, color;

    explicit NoiseNode(const Inputs& in)
        : vector(in["vector"]), w(in["w"]), scale(in["scale"]), detail(in["detail"]), roughness(in["roughness"]), lacunarity(in["lacunarity"]),
          offset(in["offset"]), gain(in["gain"]), distortion(in["distortion"]), dimensions(in.choice("dimensions")),
          sum(Octaves::sum_of(in.choice("kind"))), normalize(in.flag("normalize")), color(in.choice("output") == "color") {}
    Vec3 eval(const ShadingPoint& at) const {
        Octaves octaves{sum,
                        min(max(at.number(detail), 0), 15),
                        max(at.number(roughness), 0),
                        at.number(lacunarity),
                        at.number(offset),
                        at.number(gain),
                        normalize};
        double by = at.number(scale), distorted = at.number(distortion);
        return in_dimensions(dimensions, at.value(vector) * by, at.number(w) * by, [&](auto p) {
            constexpr int N = int(std::tuple_size_v<decltype(p)>);
            if (distorted != 0) {
                auto moved = p;
                for (int i = 0; i < N; i++) moved[i] += signed_noise(shifted(p, i)) * distorted;
                p = moved;
            }
            double value = octaves.at(p);
            return color ? Vec3{value, octaves.at(shifted(p, N)), octaves.at(shifted(p, N + 1))} : gray(value);
        });
    }

   private:
    // To another place, which `seed` gives.
    template <size_t N> static Place<N> shifted(Place<N> p, int seed) {
        for (size_t i = 0; i < N; i++) p[i] += 100 + 100 * (N == 1 ? hashed(seed) : hashed(seed, i));
        return p;
    }
};

struct WhiteNoiseNode {
    static constexpr const char* NAME = "white_noise";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector, w;
    std::string dimensions;
    bool color;

    explicit WhiteNoiseNode(const Inputs& in)
        : vector(in["vector"]), w(in["w"]), dimensions(in.choice("dimensions")), color(in.choice("output") == "color") {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 three = in_dimensions(dimensions, at.value(vector), at.number(w), [](const auto& p) { return hashed_color(p); });
        return color ? three : gray(three.x);
    }
};

struct CheckerNode {
    static constexpr const char* NAME = "checker";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector, color1, color2, scale;
    bool factor;

    explicit CheckerNode(const Inputs& in)
        : vector(in["vector"]), color1(in["color1"]), color2(in["color2"]), scale(in["scale"]), factor(in.choice("output") == "factor") {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 p = off_the_border(at.value(vector) * at.number(scale));
        bool first = (whole_number(p.x) ^ whole_number(p.y) ^ whole_number(p.z)) & 1;
        return factor ? gray(first) : at.value(first ? color1 : color2);
    }
};

struct GradientNode {
    static constexpr const char* NAME = "gradient";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector;
    std::string kind;

    explicit GradientNode(const Inputs& in) : vector(in["vector"]), kind(in.choice("kind")) {}
    Vec3 eval(const ShadingPoint& at) const { return gray(unit_range(value(at.value(vector)))); }

   private:
    double value(Vec3 p) const {
        if (kind == "linear") return p.x;
        if (kind == "quadratic") return max(p.x, 0) * max(p.x, 0);
        if (kind == "diagonal") return (p.x + p.y) / 2;
        if (kind == "radial") return atan2(p.y, p.x) / (2 * PI) + 0.5;
        if (kind == "easing") {
            double t = unit_range(p.x);
            return t * t * (3 - 2 * t);
        }
        double inside = max(0.999999 - length(p), 0);
        return kind == "spherical" ? inside : inside * inside;
    }
};

struct WaveNode {
    static constexpr const char* NAME = "wave";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector, scale, distortion, detail, detail_scale, detail_roughness, phase;
    bool rings;
    std::string direction, profile;

    explicit WaveNode(const Inputs& in)
        : vector(in["vector"]), scale(in["scale"]), distortion(in["distortion"]), detail(in["detail"]), detail_scale(in["detail_scale"]),
          detail_roughness(in["detail_roughness"]), phase(in["phase_offset"]), rings(in.choice("kind") == "rings"),
          direction(in.choice(rings ? "rings" : "bands")), profile(in.choice("profile")) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 p = off_the_border(at.value(vector) * at.number(scale));
        double n = 20 * (rings ? ring(p) : band(p)) + at.number(phase), distorted = at.number(distortion);
        if (distorted != 0) {
            Octaves octaves{Octaves::FBM, min(max(at.number(detail), 0), 15), max(at.number(detail_roughness), 0)};
            double finer = at.number(detail_scale);
            n += distorted * (2 * octaves.at(Place<3>{p.x * finer, p.y * finer, p.z * finer}) - 1);
        }
        if (profile == "sin") return gray(0.5 + 0.5 * safe::sine(n - PI / 2));
        double turns = n / (2 * PI);
        return gray(profile == "saw" ? turns - std::floor(turns) : 2 * std::fabs(turns - std::floor(turns + 0.5)));
    }

   private:
    double band(Vec3 p) const { return direction == "x" ? p.x : direction == "y" ? p.y : direction == "z" ? p.z : (p.x + p.y + p.z) / 2; }
    double ring(Vec3 p) const {
        (direction == "x" ? p.x : direction == "y" ? p.y : p.z) *= direction == "spherical";
        return length(p);
    }
};

struct MagicNode {
    static constexpr const char* NAME = "magic";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector, scale, distortion, depth;
    bool factor;

    explicit MagicNode(const Inputs& in)
        : vector(in["vector"]), scale(in["scale"]), distortion(in["distortion"]), depth(in["depth"]), factor(in.choice("output") == "factor") {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 p = at.value(vector) * at.number(scale);
        auto turned = [](double x) { return std::fmod(x, 2 * PI); };
        p = {turned(p.x), turned(p.y), turned(p.z)};
        double by = at.number(distortion), x = sin((p.x + p.y + p.z) * 5), y = cos((-p.x + p.y - p.z) * 5), z = -cos((-p.x - p.y + p.z) * 5);
        int steps = int(min(max(at.number(depth), 0), 10));
        if (steps > 0) x *= by, y *= by, z *= by;
        using safe::cosine, safe::sine;
        for (int step = 1; step <= steps; step++) switch (step) {
                case 1: y = by * -cosine(x - y + z); break;
                case 2: x = by * cosine(x - y - z); break;
                case 3: z = by * sine(-x - y - z); break;
                case 4: x = by * -cosine(-x + y - z); break;
                case 5: y = by * -sine(-x + y + z); break;
                case 6: y = by * -cosine(-x + y + z); break;
                case 7: x = by * cosine(x + y + z); break;
                case 8: z = by * sine(x + y - z); break;
                case 9: x = by * -cosine(-x - y + z); break;
                case 10: y = by * -sine(x - y + z); break;
            }
        if (by != 0) x /= 2 * by, y /= 2 * by, z /= 2 * by;
        Vec3 color{0.5 - x, 0.5 - y, 0.5 - z};
        return factor ? gray((color.x + color.y + color.z) / 3) : color;
    }
};

struct BrickNode {
    static constexpr const char* NAME = "brick";
    static constexpr Gives GIVES = Gives::COLOR;
    Color vector, color1, color2, mortar, scale, mortar_size, mortar_smooth, bias, width, height, offset, offset_frequency, squash, squash_frequency;
    bool factor;

    explicit BrickNode(const Inputs& in)
        : vector(in["vector"]), color1(in["color1"]), color2(in["color2"]), mortar(in["mortar"]), scale(in["scale"]),
          mortar_size(in["mortar_size"]), mortar_smooth(in["mortar_smooth"]), bias(in["bias"]), width(in["brick_width"]),
          height(in["row_height"]), offset(in["offset"]), offset_frequency(in["offset_frequency"]), squash(in["squash"]),
          squash_frequency(in["squash_frequency"]), factor(in.choice("output") == "factor") {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 p = at.value(vector) * at.number(scale);
        double wide = at.number(width), high = at.number(height), moved = 0;
        int32_t row = whole_number(safe::divide(p.y, high)), every = whole_number(at.number(offset_frequency)),
                every_squashed = whole_number(at.number(squash_frequency));
        if (every > 0 && every_squashed > 0) {
            if (row % every_squashed == 0) wide *= at.number(squash);
            if (row % every == 0) moved = wide * at.number(offset);
        }
        int32_t brick = whole_number(safe::divide(p.x + moved, wide));
        double x = p.x + moved - wide * brick, y = p.y - high * row;
        double size = at.number(mortar_size), nearest = min(y, high - y), share = 0;
        // In 5.2 bricks without a width have no mortar beside them.
        if (wide != 0 || high == 0 || at.version < CYCLES_5_2) nearest = min(nearest, min(x, wide - x));
        if (nearest < size) {
            double smooth = at.number(mortar_smooth), t = smooth == 0 ? 1 : unit_range((1 - nearest / size) / smooth);
            share = t * t * (3 - 2 * t);
        }
        if (factor) return gray(share);
        double tint = unit_range(shade((uint32_t(row) << 16) + (uint32_t(brick) & 0xffff)) + at.number(bias));
        return mix(mix(at.value(color1), at.value(color2), tint), at.value(mortar), share);
    }

   private:
    // A number from 0 to 1 of a brick's.
    static double shade(uint32_t n) {
        n = (n + 1013) & 0x7fffffff;
        n = n >> 13 ^ n;
        return ((n * (n * n * 60493 + 19990303) + 1376312589) & 0x7fffffff) / 2147483648.0;
    }
};

using ProceduralNodes = std::variant<NoiseNode, WhiteNoiseNode, CheckerNode, GradientNode, WaveNode, MagicNode, BrickNode>;

}  // namespace viewcam::VIEWCAM_ISA
