// The kind of ray that has come to a surface, and the way it came.
#pragma once
#include "math.h"

namespace viewcam::VIEWCAM_ISA {

// The kinds are those of the last scattering; going straight through a surface is none. When light is sampled (NO_RAY), none holds.
struct LightPathNode {
    static constexpr const char* NAME = "light_path";
    static constexpr Gives GIVES = Gives::NUMBER;
    static constexpr bool VARIES = true;
    using Answer = double (*)(const ShadingPoint&);
    Answer answer;

    explicit LightPathNode(const Inputs& in) : answer(answer_of(in.choice("output"))) {}
    Vec3 eval(const ShadingPoint& at) const { return gray(answer(at)); }

   private:
    static constexpr uint32_t SCATTERED = DIFFUSE | GLOSSY | TRANSMISSION;
    static Answer answer_of(const std::string& name) {
        struct Named {
            const char* name;
            Answer answer;
        };
        static constexpr Named ANSWERS[] = {
            {"is_camera_ray", [](const ShadingPoint& at) { return at.ray.kind == CAMERA ? 1.0 : 0; }},
            {"is_shadow_ray", [](const ShadingPoint& at) { return at.ray.kind == SHADOW ? 1.0 : 0; }},
            {"is_diffuse_ray", [](const ShadingPoint& at) { return at.ray.kind & SCATTERED && at.ray.diffuse ? 1.0 : 0; }},
            {"is_glossy_ray", [](const ShadingPoint& at) { return at.ray.kind & SCATTERED && !at.ray.diffuse ? 1.0 : 0; }},
            {"is_singular_ray", [](const ShadingPoint& at) { return at.ray.singular ? 1.0 : 0; }},
            {"is_reflection_ray", [](const ShadingPoint& at) { return at.ray.kind & (DIFFUSE | GLOSSY) ? 1.0 : 0; }},
            {"is_transmission_ray", [](const ShadingPoint& at) { return at.ray.kind == TRANSMISSION ? 1.0 : 0; }},
            {"ray_length", [](const ShadingPoint& at) { return at.ray_length(); }},
            {"ray_depth", [](const ShadingPoint& at) { return double(at.ray.depth); }},
            {"diffuse_depth", [](const ShadingPoint& at) { return double(at.ray.scattered[0]); }},
            {"glossy_depth", [](const ShadingPoint& at) { return double(at.ray.scattered[1]); }},
            {"transmission_depth", [](const ShadingPoint& at) { return double(at.ray.scattered[2]); }},
            {"transparent_depth", [](const ShadingPoint& at) { return double(at.ray.passed); }},
        };
        for (const Named& each : ANSWERS)
            if (name == each.name) return each.answer;
        throw std::invalid_argument("a light path has no " + name);
    }
};

}  // namespace viewcam::VIEWCAM_ISA
