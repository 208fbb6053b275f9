// Normals that heights make.
#pragma once
#include "../closures/shading_point.h"

namespace viewcam::VIEWCAM_ISA {

// The slope of a height between here and two places beside, filter_width pixels away (Cycles' kernel/svm/displace.h): bumps are
// part of the picture, and change with its resolution. Where no pixel is known, as where a light is sampled, there are none.
struct BumpNode {
    static constexpr const char* NAME = "bump";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    Color height, strength, distance, filter_width, normal;
    bool inwards;

    explicit BumpNode(const Inputs& in)
        : height(in["height"]), strength(in["strength"]), distance(in["distance"]), filter_width(in["filter_width"]), normal(in["normal"]),
          inwards(in.flag("invert")) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 before = is_bumped(normal) ? at.value(normal) : at.point.shading;
        double away = at.footprint() * at.number(filter_width);
        if (!height.varies() || !(away > 0)) return before;
        Vec3 x = along_plane(at.point.normal), y = cross(at.point.normal, x), across_x = cross(y, before), across_y = cross(before, x);
        double here = at.number(height), scale = at.number(distance) * (inwards ? -1 : 1), much = max(at.number(strength), 0.0);
        Vec3 slope = across_x * (at.height_beside(height, x * away) - here) + across_y * (at.height_beside(height, y * away) - here);
        double area = dot(x, across_x);
        Vec3 bumped = before * (std::fabs(area) * away) - slope * (area < 0 ? -scale : scale);
        double size = length(bumped);
        if (!(size > 0 && size < INFINITE)) return before;
        Vec3 mixed = bumped * (much / size) + before * (1 - much);
        double mixed_size = length(mixed);
        return mixed_size > 0 && mixed_size < INFINITE ? mixed / mixed_size : before;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
