// Colors computed from others, as Blender's nodes of these names do it, and those of what glows and of the rainbow, linear, of Rec. 709's
// primaries.
#pragma once
#include <algorithm>

#include "math.h"

namespace viewcam::VIEWCAM_ISA {

// Hue, saturation and value, the hue in turns.
inline Vec3 hsv_of(Vec3 rgb) {
    double most = max_component(rgb), range = most - min(rgb.x, min(rgb.y, rgb.z));
    if (!(most != 0 && range > 0)) return {0, 0, most};
    double hue = rgb.x == most ? (rgb.y - rgb.z) / range : rgb.y == most ? 2 + (rgb.z - rgb.x) / range : 4 + (rgb.x - rgb.y) / range;
    return {hue < 0 ? hue / 6 + 1 : hue / 6, range / most, most};
}
inline Vec3 rgb_of_hsv(Vec3 hsv) {
    if (hsv.y == 0) return gray(hsv.z);
    double hue = hsv.x == 1 ? 0 : hsv.x * 6;
    if (hue < 0 || hue >= 6) hue += 5 - std::floor(hue);  // as in Cycles, from magenta to red again and again
    auto channel = [&](double from) {  // 0 where the channel is full, and where it is empty 1
        double apart = std::fabs(hue - from);
        return hsv.z * (1 - hsv.y * unit_range(apart));
    };
    return {channel(hue < 3 ? min(hue, 1) : max(hue, 5)), channel(min(max(hue, 1), 3)), channel(min(max(hue, 3), 5))};
}

// Hue, saturation and lightness.
inline Vec3 hsl_of(Vec3 rgb) {
    double most = max_component(rgb), least = min(rgb.x, min(rgb.y, rgb.z)), light = min((most + least) / 2, 1), range = most - least;
    if (!(range > 0)) return {0, 0, light};
    return {hsv_of(rgb).x, safe::divide(range, light > 0.5 ? 2 - most - least : most + least), light};
}
inline Vec3 rgb_of_hsl(Vec3 hsl) {
    double turns = 6 * hsl.x, range = (1 - std::fabs(2 * hsl.z - 1)) * hsl.y;
    Vec3 pure = unit_range(Vec3{std::fabs(turns - 3) - 1, 2 - std::fabs(turns - 2), 2 - std::fabs(turns - 4)});
    return (pure - gray(0.5)) * range + gray(hsl.z);
}

// A color's red, green and blue, or what another way of writing colors has in their place; and the other way round.
enum class ColorMode { RGB, HSV, HSL };
inline ColorMode color_mode_of(const std::string& name) { return name == "hsv" ? ColorMode::HSV : name == "hsl" ? ColorMode::HSL : ColorMode::RGB; }

struct SeparateColorNode : SeparateNode {
    static constexpr const char* NAME = "separate_color";
    ColorMode mode;

    explicit SeparateColorNode(const Inputs& in) : SeparateNode(in), mode(color_mode_of(in.choice("mode"))) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 rgb = at.value(color);
        return gray((mode == ColorMode::HSV ? hsv_of(rgb) : mode == ColorMode::HSL ? hsl_of(rgb) : rgb)[axis]);
    }
};
struct CombineColorNode : CombineNode {
    static constexpr const char* NAME = "combine_color";
    static constexpr Gives GIVES = Gives::COLOR;
    ColorMode mode;

    explicit CombineColorNode(const Inputs& in) : CombineNode(in), mode(color_mode_of(in.choice("mode"))) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 three = CombineNode::eval(at);
        return mode == ColorMode::HSV ? rgb_of_hsv(three) : mode == ColorMode::HSL ? rgb_of_hsl(three) : three;
    }
};

// A factor from one to the other, by one of the ways of mixing.
struct MixColorNode {
    static constexpr const char* NAME = "mix_color";
    static constexpr Gives GIVES = Gives::COLOR;
    using Blend = Vec3 (*)(Vec3 a, Vec3 b, double t);
    Color factor, a, b;
    Blend blend;
    bool clamp_factor, clamp_result;

    explicit MixColorNode(const Inputs& in)
        : factor(in["factor"]), a(in["a"]), b(in["b"]), blend(blend_of(in.choice("blend"))), clamp_factor(in.flag("clamp_factor")),
          clamp_result(in.flag("clamp_result")) {}
    Vec3 eval(const ShadingPoint& at) const {
        double t = at.number(factor);
        Vec3 mixed = blend(at.value(a), at.value(b), clamp_factor ? unit_range(t) : t);
        return clamp_result ? unit_range(mixed) : mixed;
    }

   private:
    // By channels. t: the factor.
    template <auto CHANNEL> static Vec3 channels(Vec3 a, Vec3 b, double t) {
        return {CHANNEL(a.x, b.x, t), CHANNEL(a.y, b.y, t), CHANNEL(a.z, b.z, t)};
    }
    static double screen(double a, double b, double t) { return 1 - (1 - t + t * (1 - b)) * (1 - a); }
    static double overlay(double a, double b, double t) {
        return a < 0.5 ? a * (1 - t + 2 * t * b) : 1 - (1 - t + 2 * t * (1 - b)) * (1 - a);
    }
    static double soft_light(double a, double b, double t) {
        return (1 - t) * a + t * ((1 - a) * b * a + a * (1 - (1 - b) * (1 - a)));
    }
    static double divide(double a, double b, double t) { return b != 0 ? (1 - t) * a + t * a / b : a; }
    static double dodge(double a, double b, double t) {
        if (a == 0) return 0;
        double left = 1 - t * b;
        return left <= 0 ? 1 : min(a / left, 1.0);
    }
    static double burn(double a, double b, double t) {
        double left = 1 - t + t * b;
        return left <= 0 ? 0 : unit_range(1 - (1 - a) / left);
    }
    static Vec3 hue(Vec3 a, Vec3 b, double t) {
        Vec3 other = hsv_of(b), own = hsv_of(a);
        return other.y != 0 ? mix(a, rgb_of_hsv({other.x, own.y, own.z}), t) : a;
    }
    static Vec3 saturation(Vec3 a, Vec3 b, double t) {
        Vec3 own = hsv_of(a);
        return own.y != 0 ? rgb_of_hsv({own.x, (1 - t) * own.y + t * hsv_of(b).y, own.z}) : a;
    }
    static Vec3 value(Vec3 a, Vec3 b, double t) {
        Vec3 own = hsv_of(a);
        return rgb_of_hsv({own.x, own.y, (1 - t) * own.z + t * hsv_of(b).z});
    }
    static Vec3 tint(Vec3 a, Vec3 b, double t) {
        Vec3 other = hsv_of(b);
        return other.y != 0 ? mix(a, rgb_of_hsv({other.x, other.y, hsv_of(a).z}), t) : a;
    }
    static Blend blend_of(const std::string& name) {
        struct Named {
            const char* name;
            Blend blend;
        };
        static constexpr Named BLENDS[] = {
            {"mix", [](Vec3 a, Vec3 b, double t) { return viewcam::VIEWCAM_ISA::mix(a, b, t); }},
            {"darken", channels<[](double a, double b, double t) { return a + (min(a, b) - a) * t; }>},
            {"lighten", channels<[](double a, double b, double t) { return a + (max(a, b) - a) * t; }>},
            {"multiply", channels<[](double a, double b, double t) { return a + (a * b - a) * t; }>},
            {"add", channels<[](double a, double b, double t) { return a + t * b; }>},
            {"subtract", channels<[](double a, double b, double t) { return a - t * b; }>},
            {"difference", channels<[](double a, double b, double t) { return a + (std::fabs(a - b) - a) * t; }>},
            {"exclusion", channels<[](double a, double b, double t) { return max(a + (b - 2 * a * b) * t, 0.0); }>},
            {"screen", channels<screen>},
            {"overlay", channels<overlay>},
            {"soft_light", channels<soft_light>},
            {"linear_light", channels<[](double a, double b, double t) { return a + t * (2 * b - 1); }>},
            {"divide", channels<divide>},
            {"dodge", channels<dodge>},
            {"burn", channels<burn>},
            {"hue", hue},
            {"saturation", saturation},
            {"value", value},
            {"color", tint},
        };
        for (const Named& each : BLENDS)
            if (name == each.name) return each.blend;
        throw std::invalid_argument("colors are not mixed by " + name);
    }
};

struct MixNumberNode {
    static constexpr const char* NAME = "mix_number";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color factor, a, b;
    bool clamp_factor;

    explicit MixNumberNode(const Inputs& in) : factor(in["factor"]), a(in["a"]), b(in["b"]), clamp_factor(in.flag("clamp_factor")) {}
    Vec3 eval(const ShadingPoint& at) const {
        double t = at.number(factor);
        return gray(mix(at.number(a), at.number(b), clamp_factor ? unit_range(t) : t));
    }
};

struct MixVectorNode {
    static constexpr const char* NAME = "mix_vector";
    static constexpr Gives GIVES = Gives::VECTOR;
    Color factor, a, b;
    bool clamp_factor;

    explicit MixVectorNode(const Inputs& in) : factor(in["factor"]), a(in["a"]), b(in["b"]), clamp_factor(in.flag("clamp_factor")) {}
    Vec3 eval(const ShadingPoint& at) const { return mixed(at, gray(at.number(factor))); }

   protected:
    Vec3 mixed(const ShadingPoint& at, Vec3 t) const {
        Vec3 first = at.value(a);
        return first + (at.value(b) - first) * (clamp_factor ? unit_range(t) : t);
    }
};
// With a factor for each component.
struct MixComponentsNode : MixVectorNode {
    static constexpr const char* NAME = "mix_components";
    using MixVectorNode::MixVectorNode;
    Vec3 eval(const ShadingPoint& at) const { return mixed(at, at.value(factor)); }
};

struct GammaNode {
    static constexpr const char* NAME = "gamma";
    static constexpr Gives GIVES = Gives::COLOR;
    Color color, gamma;

    explicit GammaNode(const Inputs& in) : color(in["color"]), gamma(in["gamma"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        double power = at.number(gamma);
        if (power == 0) return gray(1);
        return safe::each([&](double x, double, double) { return x > 0 ? safe::power(x, power) : x; }, at.value(color));
    }
};

struct BrightContrastNode {
    static constexpr const char* NAME = "bright_contrast";
    static constexpr Gives GIVES = Gives::COLOR;
    Color color, bright, contrast;

    explicit BrightContrastNode(const Inputs& in) : color(in["color"]), bright(in["bright"]), contrast(in["contrast"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        double steep = at.number(contrast), more = at.number(bright) - steep / 2;
        return safe::each([&](double x, double, double) { return max((1 + steep) * x + more, 0.0); }, at.value(color));
    }
};

struct HueSaturationNode {
    static constexpr const char* NAME = "hue_saturation";
    static constexpr Gives GIVES = Gives::COLOR;
    Color color, hue, saturation, brightness, factor;

    explicit HueSaturationNode(const Inputs& in)
        : color(in["color"]), hue(in["hue"]), saturation(in["saturation"]), brightness(in["value"]), factor(in["factor"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 rgb = at.value(color), hsv = hsv_of(rgb);
        double turned = hsv.x + at.number(hue) + 0.5;
        Vec3 changed = rgb_of_hsv({turned - std::floor(turned), unit_range(hsv.y * at.number(saturation)), hsv.z * at.number(brightness)});
        return safe::each([&](double x, double, double) { return max(x, 0.0); }, mix(rgb, changed, at.number(factor)));
    }
};

struct InvertNode {
    static constexpr const char* NAME = "invert";
    static constexpr Gives GIVES = Gives::COLOR;
    Color factor, color;

    explicit InvertNode(const Inputs& in) : factor(in["factor"]), color(in["color"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 rgb = at.value(color);
        return mix(rgb, gray(1) - rgb, at.number(factor));
    }
};

struct LuminanceNode {
    static constexpr const char* NAME = "rgb_to_bw";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color color;

    explicit LuminanceNode(const Inputs& in) : color(in["color"]) {}
    Vec3 eval(const ShadingPoint& at) const { return gray(luminance(at.value(color))); }
};

// The color of a black body, its luminance being 1. Planck's law as Cycles has it: fitted piece by piece, the same below 800 K and from 12,000 K on.
struct BlackbodyNode {
    static constexpr const char* NAME = "blackbody";
    static constexpr Gives GIVES = Gives::COLOR;
    Color temperature;

    explicit BlackbodyNode(const Inputs& in) : temperature(in["temperature"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        double kelvin = at.number(temperature);
        Vec3 rgb = kelvin < 800        ? Vec3{5.413294490189271, -0.20319390035873933, -0.0822535242887164}
                   : kelvin >= 12000 ? Vec3{0.8262954810464208, 0.9945080501520986, 1.566307710274283}
                                     : fitted(kelvin);
        return max(rgb, 0);
    }

   private:
    // Below a temperature T red and green are a/T + bT + c, and blue a polynomial.
    struct Piece {
        double below, red[3], green[3], blue[4];
    };
    static constexpr Piece PIECES[] = {
        {965, {1619.19106, -0.00205010916, 5.02995757}, {-488.999748, 0.000604330754, -0.0755807526}, {5.96945309e-11, -4.85742887e-8, -9.70622247e-5, -0.00407936148}},
        {1167, {2488.45471, -0.00111330907, 3.22621544}, {-755.994277, 0.000316730098, 0.478306139}, {2.40430366e-11, 5.55021075e-8, -0.000198503712, 0.0289312858}},
        {1449, {3341.43193, -0.000486551192, 1.76486769}, {-1023.63977, 0.00012022347, 0.936662319}, {-1.40949732e-11, 1.89878968e-7, -0.000356632824, 0.0910767778}},
        {1902, {4094.61742, -0.000127446582, 0.725731635}, {-1265.71316, 4.87340896e-6, 1.27054498}, {-3.61460868e-11, 2.84822009e-7, -0.000493211319, 0.15672344}},
        {3315, {4670.28036, 2.91258199e-5, 0.126703442}, {-1425.29332, -4.01150431e-5, 1.43972784}, {-1.97075738e-11, 1.75359352e-7, -0.000250542825, -0.0222783266}},
        {6365, {4595.09185, 2.87495649e-5, 0.15034502}, {-1175.54822, -2.16378048e-5, 1.30408023}, {-1.61997957e-13, -1.64216008e-8, 0.000386216271, -0.738077418}},
        {INFINITE, {3787.1745, 9.35907826e-6, 0.399075871}, {-500.799571, -4.59832026e-6, 1.09098763}, {6.72650283e-13, -2.73078809e-8, 0.000424098264, -0.752335691}},
    };
    static Vec3 fitted(double kelvin) {
        const Piece* piece = PIECES;
        while (kelvin >= piece->below) piece++;
        auto hyperbola = [&](const double (&fit)[3]) { return fit[0] / kelvin + fit[1] * kelvin + fit[2]; };
        const double* b = piece->blue;
        return {hyperbola(piece->red), hyperbola(piece->green), ((b[0] * kelvin + b[1]) * kelvin + b[2]) * kelvin + b[3]};
    }
};

// The color of a wavelength in nanometers: the CIE's observer of 1931 (2°), every 5 nm from 380 on; straight between, black beyond.
struct WavelengthNode {
    static constexpr const char* NAME = "wavelength";
    static constexpr Gives GIVES = Gives::COLOR;
    Color wavelength;

    explicit WavelengthNode(const Inputs& in) : wavelength(in["wavelength"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        constexpr double FROM_XYZ[3][3] = {{3.2409699419, -1.53738317757, -0.498610760293}, {-0.969243636281, 1.87596750151, 0.0415550574072}, {0.055630079697, -0.203976958889, 1.05697151424}};
        constexpr double SCALE = 2.52;  // so that no color is brighter than 1
        double place = (at.number(wavelength) - 380) / 5;
        if (!(place > -1 && place < 80)) return {};
        auto i = int(place);
        Vec3 first{OBSERVER[i][0], OBSERVER[i][1], OBSERVER[i][2]}, next{OBSERVER[i + 1][0], OBSERVER[i + 1][1], OBSERVER[i + 1][2]};
        Vec3 rgb = product(FROM_XYZ, mix(first, next, place - i)) / SCALE;
        return max(rgb, 0);
    }

   private:
    static constexpr double OBSERVER[81][3] = {
        {0.0014, 0, 0.0065}, {0.0022, 0.0001, 0.0105}, {0.0042, 0.0001, 0.0201}, {0.0076, 0.0002, 0.0362},
        {0.0143, 0.0004, 0.0679}, {0.0232, 0.0006, 0.1102}, {0.0435, 0.0012, 0.2074}, {0.0776, 0.0022, 0.3713},
        {0.1344, 0.004, 0.6456}, {0.2148, 0.0073, 1.0391}, {0.2839, 0.0116, 1.3856}, {0.3285, 0.0168, 1.623},
        {0.3483, 0.023, 1.7471}, {0.3481, 0.0298, 1.7826}, {0.3362, 0.038, 1.7721}, {0.3187, 0.048, 1.7441},
        {0.2908, 0.06, 1.6692}, {0.2511, 0.0739, 1.5281}, {0.1954, 0.091, 1.2876}, {0.1421, 0.1126, 1.0419},
        {0.0956, 0.139, 0.813}, {0.058, 0.1693, 0.6162}, {0.032, 0.208, 0.4652}, {0.0147, 0.2586, 0.3533},
        {0.0049, 0.323, 0.272}, {0.0024, 0.4073, 0.2123}, {0.0093, 0.503, 0.1582}, {0.0291, 0.6082, 0.1117},
        {0.0633, 0.71, 0.0782}, {0.1096, 0.7932, 0.0573}, {0.1655, 0.862, 0.0422}, {0.2257, 0.9149, 0.0298},
        {0.2904, 0.954, 0.0203}, {0.3597, 0.9803, 0.0134}, {0.4334, 0.995, 0.0087}, {0.5121, 1, 0.0057},
        {0.5945, 0.995, 0.0039}, {0.6784, 0.9786, 0.0027}, {0.7621, 0.952, 0.0021}, {0.8425, 0.9154, 0.0018},
        {0.9163, 0.87, 0.0017}, {0.9786, 0.8163, 0.0014}, {1.0263, 0.757, 0.0011}, {1.0567, 0.6949, 0.001},
        {1.0622, 0.631, 0.0008}, {1.0456, 0.5668, 0.0006}, {1.0026, 0.503, 0.0003}, {0.9384, 0.4412, 0.0002},
        {0.8544, 0.381, 0.0002}, {0.7514, 0.321, 0.0001}, {0.6424, 0.265, 0}, {0.5419, 0.217, 0}, {0.4479, 0.175, 0},
        {0.3608, 0.1382, 0}, {0.2835, 0.107, 0}, {0.2187, 0.0816, 0}, {0.1649, 0.061, 0}, {0.1212, 0.0446, 0},
        {0.0874, 0.032, 0}, {0.0636, 0.0232, 0}, {0.0468, 0.017, 0}, {0.0329, 0.0119, 0}, {0.0227, 0.0082, 0},
        {0.0158, 0.0057, 0}, {0.0114, 0.0041, 0}, {0.0081, 0.0029, 0}, {0.0058, 0.0021, 0}, {0.0041, 0.0015, 0},
        {0.0029, 0.001, 0}, {0.002, 0.0007, 0}, {0.0014, 0.0005, 0}, {0.001, 0.0004, 0}, {0.0007, 0.0002, 0},
        {0.0005, 0.0002, 0}, {0.0003, 0.0001, 0}, {0.0002, 0.0001, 0}, {0.0002, 0.0001, 0}, {0.0001, 0, 0}, {0.0001, 0, 0},
        {0.0001, 0, 0}, {0, 0, 0},
    };
};

using ColorNodes = std::variant<SeparateColorNode, CombineColorNode, MixColorNode, MixNumberNode, MixVectorNode,
                                MixComponentsNode, GammaNode, BrightContrastNode, HueSaturationNode, InvertNode, LuminanceNode,
                                BlackbodyNode, WavelengthNode>;

}  // namespace viewcam::VIEWCAM_ISA
