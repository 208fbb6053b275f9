// Colors computed from others, as Blender's nodes of these names do it.
#pragma once
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
        Vec3 rgb = at.value(given);
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

using ColorNodes = std::variant<SeparateColorNode, CombineColorNode, MixColorNode, MixNumberNode, MixVectorNode,
                                MixComponentsNode, GammaNode, BrightContrastNode, HueSaturationNode, InvertNode, LuminanceNode>;

}  // namespace viewcam::VIEWCAM_ISA
