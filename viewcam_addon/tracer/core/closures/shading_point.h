// What closures are told: the point that a path has come to, and how they read the inputs that a scene file gives them.
#pragma once
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "../bsdf/bsdf.h"
#include "../textures.h"

namespace viewcam::VIEWCAM_ISA {

// The versions of Blender whose Cycles computes materials in ways of its own: what is meant is the newest that is not newer.
enum CyclesVersion { CYCLES_4_2 = 402, CYCLES_4_3 = 403, CYCLES_5_0 = 500, CYCLES_5_2 = 502 };

// A point of a surface that a path reaches along `incoming`, and the scene's images.
struct ShadingPoint {
    const Interaction& point;
    Vec3 incoming;
    const std::vector<Texture>& textures;
    int version = CYCLES_5_2;

    Vec3 color(const Color& color) const { return color.at(textures, point); }
    // A number is a colour's luminance, Rec. 709's.
    double number(const Color& color) const {
        if (!color.varies()) return color.rgb.x;
        Vec3 rgb = color.at(textures, point);
        return 0.2126390 * rgb.x + 0.7151687 * rgb.y + 0.0721923 * rgb.z;
    }
    // The index of refraction beyond the surface over that before it. ior: inside over outside.
    double ratio(double ior) const { return point.backside ? 1 / ior : ior; }
    // The smooth normal, bent so that a mirror's ray rises above the surface.
    Vec3 normal() const { return specular_normal(incoming, point); }
    // Whether facets are so small that they are a mirror.
    bool is_smooth(const Microfacets& facets) const {
        return facets.alpha_x * facets.alpha_y <= (version < CYCLES_4_3 ? 5e-7 : 2e-10);
    }
};

// A closure's inputs by the names that scene files have for them. choice: of what is no number.
struct Input {
    std::string name, choice;
    Color color;
};
class Inputs {
   public:
    explicit Inputs(std::vector<Input> inputs) : inputs_(std::move(inputs)) {}
    const Color& operator[](std::string_view name) const { return find(name).color; }
    const std::string& choice(std::string_view name) const { return find(name).choice; }

   private:
    const Input& find(std::string_view name) const {
        for (const Input& input : inputs_)
            if (input.name == name) return input;
        throw std::invalid_argument("no input is called " + std::string(name));
    }
    std::vector<Input> inputs_;
};

}  // namespace viewcam::VIEWCAM_ISA
