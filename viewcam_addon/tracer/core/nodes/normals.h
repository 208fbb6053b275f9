// Normals that heights make or that images hold.
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

// The normal that an image holds.
struct NormalMapNode {
    static constexpr const char* NAME = "normal_map";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    Color color, strength;
    std::string uv;  // the map that tangents follow, "" the mesh's own
    enum { TANGENT, OBJECT, WORLD } space;
    bool blender, downwards;  // y and z run backwards, as Blender once baked them; green points down

    explicit NormalMapNode(const Inputs& in)
        : color(in["color"]), strength(in["strength"]), uv(in.choice("uv")), space(space_of(in.choice("space"))),
          blender(in.choice("space").starts_with("blender")), downwards(in.choice("convention") == "directx") {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 v = at.value(color) * 2 - gray(1), smooth = at.point.shading;
        double much = at.number(strength), side = at.point.backside ? -1 : 1;
        if (downwards) v.y = -v.y;
        if (blender) v.y = -v.y, v.z = -v.z;
        if (space == TANGENT) {
            ShadingPoint::TangentFrame frame = at.tangent_frame(uv);
            if (frame.side == 0) return smooth;
            Vec3 across = cross(frame.normal, frame.tangent) * frame.side;
            Vec3 sum = frame.tangent * (v.x * much) + across * (v.y * much) + frame.normal * (1 + (v.z - 1) * unit_range(much));
            return or_smooth(at.to_world_normal(sum) * side, smooth);
        }
        Vec3 normal = or_smooth((space == OBJECT ? at.to_world_normal(v) : v) * side, smooth);
        return much == 1 ? normal : or_smooth(smooth + (normal - smooth) * max(much, 0.0), smooth);
    }

   private:
    static decltype(space) space_of(const std::string& name) {
        return name == "tangent" ? TANGENT : name.ends_with("object") ? OBJECT : WORLD;
    }
    static Vec3 or_smooth(Vec3 v, Vec3 smooth) {
        double size = length(v);
        return size > 0 && size < INFINITE ? v / size : smooth;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
