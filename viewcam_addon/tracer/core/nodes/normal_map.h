// Normals that images hold.
#pragma once
#include "../closures/shading_point.h"

namespace viewcam::VIEWCAM_ISA {

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
