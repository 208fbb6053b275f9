// Curves that change colors, vectors and numbers: tables, as Cycles has them, straight between their entries.
#pragma once
#include "math.h"

namespace viewcam::VIEWCAM_ISA {

// table: an image of one row, whose columns stand evenly from `least` to `most`. Beyond, it goes on as it ends, or stays as it is.
struct Curves {
    Color factor, table, least, most;
    bool extrapolate;

    explicit Curves(const Inputs& in)
        : factor(in["factor"]), table(in["table"]), least(in["least"]), most(in["most"]), extrapolate(in.flag("extrapolate")) {
        if (table.image == NONE) throw std::invalid_argument("curves have no table");
    }

   protected:
    // Each component by the channel of its own.
    Vec3 changed(const ShadingPoint& at, Vec3 v) const {
        const Texture& texture = at.textures[table.image];
        double low = at.number(least), range = at.number(most) - low;
        auto place = [&](double x) { return safe::divide(x - low, range); };
        Vec3 on_curves{entry(texture, place(v.x)).x, entry(texture, place(v.y)).y, entry(texture, place(v.z)).z};
        return mix(v, on_curves, at.number(factor));
    }

   private:
    // x: from 0 to 1 over the table.
    Vec3 entry(const Texture& texture, double x) const {
        double last = texture.width - 1;
        auto at = [&](double column) { return texture.at({(column + 0.5) / texture.width, 0.5}, {Lookup::LINEAR, Lookup::EXTEND}); };
        if (extrapolate && x < 0) return at(0) + (at(0) - at(1)) * (-x * last);
        if (extrapolate && x > 1) return at(last) + (at(last) - at(last - 1)) * ((x - 1) * last);
        return at(unit_range(x) * last);
    }
};
struct RGBCurvesNode : Curves {
    static constexpr const char* NAME = "rgb_curves";
    static constexpr Gives GIVES = Gives::COLOR;
    Color color;
    explicit RGBCurvesNode(const Inputs& in) : Curves(in), color(in["color"]) {}
    Vec3 eval(const ShadingPoint& at) const { return changed(at, at.value(color)); }
};
struct VectorCurvesNode : Curves {
    static constexpr const char* NAME = "vector_curves";
    static constexpr Gives GIVES = Gives::VECTOR;
    Color vector;
    explicit VectorCurvesNode(const Inputs& in) : Curves(in), vector(in["vector"]) {}
    Vec3 eval(const ShadingPoint& at) const { return changed(at, at.value(vector)); }
};
struct FloatCurveNode : Curves {
    static constexpr const char* NAME = "float_curve";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color value;
    explicit FloatCurveNode(const Inputs& in) : Curves(in), value(in["value"]) {}
    Vec3 eval(const ShadingPoint& at) const { return changed(at, gray(at.number(value))); }
};

using CurveNodes = std::variant<RGBCurvesNode, VectorCurvesNode, FloatCurveNode>;

}  // namespace viewcam::VIEWCAM_ISA
