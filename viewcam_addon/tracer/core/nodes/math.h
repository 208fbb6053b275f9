// Numbers and vectors computed from others. What has no result is 0, as in Cycles: a division by 0, a root of what is negative.
#pragma once
#include "../bsdf/fresnel.h"
#include "../closures/shading_point.h"

namespace viewcam::VIEWCAM_ISA {

namespace safe {
// The powers that are finite: what lies beyond float64's range counts as its end.
inline double positive_power(double x, double power) {
    constexpr double MOST = 980;  // the largest binary logarithm of the result
    if (!(x > 1e-300)) return x < 0 ? 0 : power > 0 ? 0 : power == 0 ? 1 : 1e300;
    double x_bounded = min(x, 1e300), exponent = log2(x_bounded);
    if (std::fabs(exponent * power) > MOST) return exponent * power > 0 ? 1e300 : 0;
    return pow(x_bounded, power);
}
inline double power(double x, double power) {
    if (power == 0) return 1;
    if (x >= 0) return positive_power(x, power);
    if (power != std::trunc(power)) return 0;
    double size = positive_power(-x, power);
    return std::fmod(power, 2) == 0 ? size : -size;
}
inline double exponential(double x) { return exp(min(x, 680)); }
inline double logarithm(double x) { return x > 1e-300 ? log(min(x, 1e300)) : 0; }
inline double divide(double a, double b) { return b != 0 ? a / b : 0; }
inline double modulo(double a, double b) { return b != 0 ? std::fmod(a, b) : 0; }
inline double root(double a) { return a > 0 ? std::sqrt(a) : 0; }
inline double sine(double angle) { return std::fabs(angle) < 1e9 ? sin(angle) : 0; }
inline double cosine(double angle) { return std::fabs(angle) < 1e9 ? cos(angle) : 0; }
inline Vec3 normalized(Vec3 v) {
    double size = length(v);
    return size > 0 ? v / size : Vec3{};
}
template <class Function> Vec3 each(Function function, Vec3 a, Vec3 b = {}, Vec3 c = {}) {
    return {function(a.x, b.x, c.x), function(a.y, b.y, c.y), function(a.z, b.z, c.z)};
}
}  // namespace safe

inline double sign_of(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }
inline double smooth_minimum(double a, double b, double c) {
    if (c == 0) return min(a, b);
    double h = max(c - std::fabs(a - b), 0.0) / c;
    return min(a, b) - h * h * h * c / 6;
}
inline double wrapped(double x, double most, double least) {
    double range = most - least;
    return range != 0 ? x - range * std::floor((x - least) / range) : least;
}
inline double snapped(double a, double b) { return std::floor(safe::divide(a, b)) * b; }

// By their names in scene files; what has no entry is unknown.
using Operation = double (*)(double, double, double);
struct NamedOperation {
    const char* name;
    Operation of;
};
inline constexpr NamedOperation OPERATIONS[] = {
    {"add", [](double a, double b, double) { return a + b; }},
    {"subtract", [](double a, double b, double) { return a - b; }},
    {"multiply", [](double a, double b, double) { return a * b; }},
    {"divide", [](double a, double b, double) { return safe::divide(a, b); }},
    {"multiply_add", [](double a, double b, double c) { return a * b + c; }},
    {"power", [](double a, double b, double) { return safe::power(a, b); }},
    {"logarithm", [](double a, double b, double) { return a > 0 && b > 0 ? safe::divide(safe::logarithm(a), safe::logarithm(b)) : 0; }},
    {"sqrt", [](double a, double, double) { return safe::root(a); }},
    {"inverse_sqrt", [](double a, double, double) { return a > 0 ? 1 / std::sqrt(a) : 0; }},
    {"absolute", [](double a, double, double) { return std::fabs(a); }},
    {"exponent", [](double a, double, double) { return safe::exponential(a); }},
    {"minimum", [](double a, double b, double) { return min(a, b); }},
    {"maximum", [](double a, double b, double) { return max(a, b); }},
    {"less_than", [](double a, double b, double) { return a < b ? 1.0 : 0.0; }},
    {"greater_than", [](double a, double b, double) { return a > b ? 1.0 : 0.0; }},
    {"sign", [](double a, double, double) { return sign_of(a); }},
    {"compare", [](double a, double b, double c) { return a == b || std::fabs(a - b) <= max(c, 1e-5) ? 1.0 : 0.0; }},
    {"smooth_min", smooth_minimum},
    {"smooth_max", [](double a, double b, double c) { return -smooth_minimum(-a, -b, c); }},
    {"round", [](double a, double, double) { return std::floor(a + 0.5); }},
    {"floor", [](double a, double, double) { return std::floor(a); }},
    {"ceil", [](double a, double, double) { return std::ceil(a); }},
    {"trunc", [](double a, double, double) { return std::trunc(a); }},
    {"fract", [](double a, double, double) { return a - std::floor(a); }},
    {"modulo", [](double a, double b, double) { return safe::modulo(a, b); }},
    {"floored_modulo", [](double a, double b, double) { return b != 0 ? a - std::floor(a / b) * b : 0; }},
    {"wrap", wrapped},
    {"snap", [](double a, double b, double) { return snapped(a, b); }},
    {"pingpong",
     [](double a, double b, double) {
         double turns = b != 0 ? (a - b) / (b * 2) : 0;
         return std::fabs((turns - std::floor(turns)) * b * 2 - b);
     }},
    {"sine", [](double a, double, double) { return safe::sine(a); }},
    {"cosine", [](double a, double, double) { return safe::cosine(a); }},
    {"tangent", [](double a, double, double) { return safe::divide(safe::sine(a), safe::cosine(a)); }},
    {"arcsine", [](double a, double, double) { return asin(min(max(a, -1.0), 1.0)); }},
    {"arccosine", [](double a, double, double) { return acos(min(max(a, -1.0), 1.0)); }},
    {"arctangent", [](double a, double, double) { return atan2(a, 1); }},
    {"arctan2", [](double a, double b, double) { return atan2(a, b); }},
    {"sinh", [](double a, double, double) { return (safe::exponential(a) - safe::exponential(-a)) / 2; }},
    {"cosh", [](double a, double, double) { return (safe::exponential(a) + safe::exponential(-a)) / 2; }},
    {"tanh",
     [](double a, double, double) {
         double rest = safe::exponential(-2 * std::fabs(a));
         return std::copysign((1 - rest) / (1 + rest), a);
     }},
    {"radians", [](double a, double, double) { return a * (PI / 180); }},
    {"degrees", [](double a, double, double) { return a * (180 / PI); }},
};
inline Operation operation_of(const std::string& name) {
    for (const NamedOperation& each : OPERATIONS)
        if (name == each.name) return each.of;
    return nullptr;
}

struct MathNode {
    static constexpr const char* NAME = "math";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color a, b, c;
    Operation operation;
    bool clamp;

    explicit MathNode(const Inputs& in)
        : a(in["a"]), b(in["b"]), c(in["c"]), operation(operation_of(in.choice("operation"))), clamp(in.flag("clamp")) {
        if (!operation) throw std::invalid_argument("no operation is called " + in.choice("operation"));
    }
    Vec3 eval(const ShadingPoint& at) const {
        double value = operation(at.number(a), at.number(b), at.number(c));
        return gray(clamp ? unit_range(value) : value);
    }
};

// Component by component as numbers are, or what only vectors have.
struct VectorMathNode {
    static constexpr const char* NAME = "vector_math";
    static constexpr Gives GIVES = Gives::VECTOR;
    Color a, b, c, scale;
    std::string name;
    Operation operation;

    explicit VectorMathNode(const Inputs& in)
        : a(in["a"]), b(in["b"]), c(in["c"]), scale(in["scale"]), name(in.choice("operation")), operation(operation_of(name)) {
        for (const char* own : {"cross_product", "project", "reflect", "refract", "faceforward", "dot_product", "distance", "length", "scale",
                                "normalize"})
            if (name == own) return;
        if (!operation) throw std::invalid_argument("no operation is called " + name);
    }
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 a = at.value(this->a);
        if (name == "length") return gray(length(a));
        if (name == "normalize") return safe::normalized(a);
        if (name == "scale") return a * at.number(scale);
        Vec3 b = at.value(this->b);
        if (name == "cross_product") return cross(a, b);
        if (name == "dot_product") return gray(dot(a, b));
        if (name == "distance") return gray(length(a - b));
        if (name == "project") return b * safe::divide(dot(a, b), dot(b, b));
        if (name == "reflect") {
            Vec3 normal = safe::normalized(b);
            return a - normal * (2 * dot(a, normal));
        }
        if (name == "refract") {
            Vec3 normal = safe::normalized(b);
            double ratio = at.number(scale), cosine = dot(a, normal), left = 1 - ratio * ratio * (1 - cosine * cosine);
            return left < 0 ? Vec3{} : a * ratio - normal * (ratio * cosine + std::sqrt(left));
        }
        if (name == "faceforward") return dot(at.value(c), b) < 0 ? a : -a;
        return safe::each(operation, a, b, at.value(c));
    }
};

// From one range to another. A range without extent makes 0 of a number; of a vector's components, where the other begins.
struct MapRange {
    Color value, from_min, from_max, to_min, to_max, steps;
    std::string interpolation;
    bool clamp;

    explicit MapRange(const Inputs& in)
        : value(in["value"]), from_min(in["from_min"]), from_max(in["from_max"]), to_min(in["to_min"]), to_max(in["to_max"]), steps(in["steps"]),
          interpolation(in.choice("interpolation")), clamp(in.flag("clamp")) {}

   protected:
    double mapped(double value, double first, double last, double low, double high, double count) const {
        double x = safe::divide(value - first, last - first);
        if (interpolation == "stepped") {
            x = count > 0 ? std::floor(x * (count + 1)) / count : 0;
        } else if (interpolation == "smoothstep") {
            x = unit_range(x), x = x * x * (3 - 2 * x);
        } else if (interpolation == "smootherstep") {
            x = unit_range(x), x = x * x * x * (x * (x * 6 - 15) + 10);
        }
        return within(low + x * (high - low), low, high);
    }
    double within(double value, double low, double high) const { return clamp ? max(min(value, max(low, high)), min(low, high)) : value; }
};
struct MapRangeNode : MapRange {
    static constexpr const char* NAME = "map_range";
    static constexpr Gives GIVES = Gives::NUMBER;
    using MapRange::MapRange;
    Vec3 eval(const ShadingPoint& at) const {
        double first = at.number(from_min), last = at.number(from_max), low = at.number(to_min), high = at.number(to_max);
        return gray(first == last ? within(0, low, high) : mapped(at.number(value), first, last, low, high, at.number(steps)));
    }
};
struct MapRangeVectorNode : MapRange {
    static constexpr const char* NAME = "map_range_vector";
    static constexpr Gives GIVES = Gives::VECTOR;
    using MapRange::MapRange;
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 from = at.value(value), first = at.value(from_min), last = at.value(from_max), low = at.value(to_min), high = at.value(to_max),
             count = at.value(steps);
        return {mapped(from.x, first.x, last.x, low.x, high.x, count.x), mapped(from.y, first.y, last.y, low.y, high.y, count.y),
                mapped(from.z, first.z, last.z, low.z, high.z, count.z)};
    }
};

struct ClampNode {
    static constexpr const char* NAME = "clamp";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color value, least, most;
    bool either_way;  // true if the two ends may be swapped

    explicit ClampNode(const Inputs& in) : value(in["value"]), least(in["min"]), most(in["max"]), either_way(in.choice("kind") == "range") {}
    Vec3 eval(const ShadingPoint& at) const {
        double low = at.number(least), high = at.number(most);
        if (either_way && low > high) std::swap(low, high);
        return gray(min(max(at.number(value), low), high));
    }
};

// A component, or three to one.
struct SeparateNode {
    static constexpr const char* NAME = "separate";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color color;
    int axis;

    explicit SeparateNode(const Inputs& in) : color(in["color"]), axis(in.choice("output") == "x" ? 0 : in.choice("output") == "y" ? 1 : 2) {}
    Vec3 eval(const ShadingPoint& at) const { return gray(at.value(color)[axis]); }
};
struct CombineNode {
    Color x, y, z;

    explicit CombineNode(const Inputs& in) : x(in["x"]), y(in["y"]), z(in["z"]) {}
    Vec3 eval(const ShadingPoint& at) const { return {at.number(x), at.number(y), at.number(z)}; }
};
struct CombineXYZNode : CombineNode {
    static constexpr const char* NAME = "combine_xyz";
    static constexpr Gives GIVES = Gives::VECTOR;
    using CombineNode::CombineNode;
};

using MathNodes = std::variant<MathNode, VectorMathNode, MapRangeNode, MapRangeVectorNode, ClampNode, SeparateNode, CombineXYZNode>;

}  // namespace viewcam::VIEWCAM_ISA
