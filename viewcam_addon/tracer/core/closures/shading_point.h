// The point that closures are told of: the one that a path has come to, and how they read the inputs that a scene file gives
// them.
#pragma once
#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "../bsdf/bsdf.h"
#include "../textures.h"

namespace viewcam::VIEWCAM_ISA {

// The versions of Blender whose Cycles computes materials in ways of its own: what is meant is the newest that is not newer.
enum CyclesVersion { CYCLES_4_2 = 402, CYCLES_4_3 = 403, CYCLES_4_5 = 405, CYCLES_5_0 = 500, CYCLES_5_1 = 501, CYCLES_5_2 = 502 };

// The types of values: as a number, a color counts by its luminance and a vector by its mean.
enum class Gives { NUMBER, COLOR, VECTOR };

// Luminance by Rec. 709's primaries.
inline double luminance(Vec3 rgb) { return 0.2126390 * rgb.x + 0.7151687 * rgb.y + 0.0721923 * rgb.z; }

inline double number_of(Vec3 rgb) { return rgb.x == rgb.y && rgb.y == rgb.z ? rgb.x : luminance(rgb); }

// True if facets are so small that they are a mirror.
template <class T> inline Mask<T> is_mirror(const MicrofacetsOf<T>& facets, int version) {
    return Mask<T>(facets.alpha_x * facets.alpha_y <= (version < CYCLES_4_3 ? 5e-7 : 2e-10));
}

struct Object;
struct ValueNodes;
class Scene;

// A point of a surface that a path reaches along `incoming`, and the scene's images and nodes. object: that has the surface.
// origin: of rendering space, in the world. ray: what has come along.
struct ShadingPoint {
    const Interaction& point;
    Vec3 incoming;
    const std::vector<Texture>& textures;
    int version = CYCLES_5_2;
    const ValueNodes* nodes = nullptr;
    const Object* object = nullptr;
    Vec3 origin;
    const Scene* scene = nullptr;
    RayState ray;

    // An input's value here; as light; and of a color the luminance.
    Vec3 value(const Color& color) const { return color.node == NONE ? color.at(textures, point) : value_of_node(color.node); }
    Vec3 color(const Color& color) const {
        if (color.node == NONE) return color.at(textures, point);
        Vec3 rgb = value_of_node(color.node);
        return {max(rgb.x, 0), max(rgb.y, 0), max(rgb.z, 0)};
    }
    double number(const Color& color) const {
        if (!color.varies()) return number_of(color.rgb);
        return color.node == NONE ? luminance(color.at(textures, point)) : number_of_node(color.node);
    }
    // The index of refraction beyond the surface over that before it. ior: inside over outside.
    double ratio(double ior) const { return point.backside ? 1 / ior : ior; }
    // The normal that an input asks for, unit: the smooth one where it asks for none.
    Vec3 normal(const Color& input) const {
        Vec3 requested = input.node == NONE ? input.rgb : value_of_node(input.node);
        double size = length(requested);
        return size > 0 && size < INFINITE ? requested / size : point.shading;
    }
    // That normal of whatever length it has, as nodes compute with it.
    Vec3 unscaled_normal(const Color& input) const {
        if (input.node != NONE) return value_of_node(input.node);
        return is_black(input.rgb) ? point.shading : input.rgb;
    }
    // A normal, bent so that a mirror's ray rises above the surface; and that which an input asks for.
    Vec3 specular(Vec3 normal) const { return VIEWCAM_ISA::specular_normal(incoming, point.normal, normal); }
    Vec3 specular_normal(const Color& input) const { return specular(normal(input)); }
    bool is_smooth(const Microfacets& facets) const { return is_mirror(facets, version); }

    // The mesh's attribute of a name here, up to four numbers; {0, 0, 0, 1} where it has nothing. Defined in scene.h.
    struct Values {
        Vec3 first;
        double fourth = 1;
        int width = 0;
    };
    Values attribute(const std::string& name) const;
    // The frame that a normal map stands on, in the object's space, interpolated and not of unit length. side: the map's side,
    // 0 where the mesh has no UV map of that name. Defined in scene.h.
    struct TangentFrame {
        Vec3 normal, tangent;
        double side = 0;
    };
    TangentFrame tangent_frame(const std::string& uv) const;
    // Directions in the smooth surface, unit: round an axis (0 x, 1 y, 2 z) through the middle of the generated coordinates; in which
    // the u of a UV map grows, 0 where the mesh has none of that name. Defined in scene.h.
    Vec3 tangent_round(int axis) const;
    Vec3 tangent_along(const std::string& uv) const;
    // The tangent that an input asks for: round z where it asks for none.
    Vec3 tangent(const Color& input) const { return input.node == NONE ? tangent_round(2) : value_of_node(input.node); }
    // A normal of the object's space, of any length.
    Vec3 to_world_normal(Vec3 normal) const;
    // Where this is in the box round the mesh's vertices, from 0 to 1; ½ along what has no extent.
    Vec3 generated() const;
    // The point in the node Camera's space: to the right, up and ahead; and in the picture, from 0 to 1.
    Vec3 in_camera() const;
    Vec3 in_window() const;
    // Where the camera is, in the world, and directions along its axes: those of the world where there is none.
    Vec3 camera_eye() const;
    Vec3 to_camera(Vec3 direction) const;
    Vec3 from_camera(Vec3 direction) const;
    // The index of the surface's material, which passes show. Defined in scene.h.
    double material_index() const;
    // The length of the ray that has come along: from where it left a surface, or from the camera's clip start.
    double ray_length() const;
    // The width here of the pixel that the path belongs to, world units.
    double footprint() const;
    // The distance of the nearest line along an edge of the triangle, world units; infinite where there is none. Defined in
    // scene.h.
    double edge_distance() const;
    // A number's value a little beside, in the surface's own plane. away: the step there, in rendering space. Defined in
    // scene.h.
    double height_beside(const Color& height, Vec3 away) const;

   private:
    Vec3 value_of_node(uint32_t node) const;
    double number_of_node(uint32_t node) const;
};

// Four points of one material. each: all that is known of a point, or null where all inputs are the same everywhere and ask for no normal.
struct ShadingPoints {
    const SurfacePoint<double4>& point;
    Vec3x4 incoming;
    int version;
    const ShadingPoint* each;

    Vec3x4 color(const Color& color) const {
        return color.varies() ? gather4([&](int i) { return each[i].color(color); }) : splat4(color.rgb);
    }
    double4 number(const Color& color) const {
        return color.varies() ? gather4([&](int i) { return each[i].number(color); }) : splat4(number_of(color.rgb));
    }
    Vec3x4 normal(const Color& input) const {
        return each ? gather4([&](int i) { return each[i].normal(input); }) : point.shading;
    }
    Vec3x4 specular(const Vec3x4& normal) const { return VIEWCAM_ISA::specular_normal(incoming, point.normal, normal); }
    Vec3x4 specular_normal(const Color& input) const { return specular(normal(input)); }
    long4 is_smooth(const MicrofacetsOf<double4>& facets) const { return is_mirror(facets, version); }
};

// The number type that one point, or four, are computed in, and the BSDF there.
template <class At> constexpr bool IS_ONE = std::is_same_v<At, ShadingPoint>;
template <class At> using NumberOf = std::conditional_t<IS_ONE<At>, double, double4>;
template <class At> using BSDFAt = BSDFOf<NumberOf<At>>;

// A unit vector in the plane at a right angle to a normal, the one that Cycles takes.
inline Vec3 along_plane(Vec3 n) {
    Vec3 along = n.x != n.y || n.x != n.z ? Vec3{n.z - n.y, n.x - n.z, n.y - n.x} : Vec3{n.z - n.y, n.x + n.z, -n.y - n.x};
    return normalize(along);
}

// The inputs of a closure or a node by the names that scene files have for them. choice: of what is no number; of what holds or
// does not, "true" or "false".
struct Input {
    std::string name, choice;
    Color color;
};
inline bool is_bumped(const Color& normal) { return normal.node != NONE || !is_black(normal.rgb); }

class Inputs {
   public:
    explicit Inputs(std::vector<Input> inputs) : inputs_(std::move(inputs)) {}
    const Color& operator[](std::string_view name) const { return find(name).color; }
    const std::string& choice(std::string_view name) const { return find(name).choice; }
    bool flag(std::string_view name) const { return choice(name) == "true"; }
    // The number of an input that is the same everywhere.
    double number(std::string_view name) const { return find(name).color.rgb.x; }
    // True if any is made by a node of which that holds.
    template <class Holds> bool any_node(Holds&& holds) const {
        return std::any_of(inputs_.begin(), inputs_.end(), [&](const Input& input) { return input.color.node != NONE && holds(input.color.node); });
    }
    bool all_constant() const {
        return std::none_of(inputs_.begin(), inputs_.end(), [](const Input& input) { return input.color.varies(); });
    }

   private:
    const Input& find(std::string_view name) const {
        for (const Input& input : inputs_)
            if (input.name == name) return input;
        throw std::invalid_argument("no input is called " + std::string(name));
    }
    std::vector<Input> inputs_;
};

// The alternative of a variant that has this NAME, made of `from`; std::invalid_argument if none has. what: they are.
template <class Kinds, size_t I = 0, class... From> Kinds of_name(const char* what, std::string_view name, const From&... from) {
    if constexpr (I == std::variant_size_v<Kinds>) {
        throw std::invalid_argument("no " + std::string(what) + " is called " + std::string(name));
    } else {
        using Kind = std::variant_alternative_t<I, Kinds>;
        return name == Kind::NAME ? Kinds(Kind(from...)) : of_name<Kinds, I + 1>(what, name, from...);
    }
}

}  // namespace viewcam::VIEWCAM_ISA
