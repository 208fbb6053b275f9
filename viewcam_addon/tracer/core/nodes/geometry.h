// Geometry at a point of a surface, the ray that has come there, and coordinates that images are looked up by.
#pragma once
#include "../shapes/object.h"
#include "math.h"

namespace viewcam::VIEWCAM_ISA {

// A place or a direction. In rendering space, whose axes are the world's, places are the world's less the scene's origin.
struct TextureCoordinateNode {
    static constexpr const char* NAME = "texture_coordinate";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    enum { UV, OBJECT, NORMAL, REFLECTION, GENERATED, CAMERA, WINDOW } output;

    explicit TextureCoordinateNode(const Inputs& in) : output(output_of(in.choice("output"))) {}
    Vec3 eval(const ShadingPoint& at) const {
        const Interaction& point = at.point;
        switch (output) {
            case UV: return {point.uv.x, point.uv.y, 0};
            case OBJECT: return at.object ? at.object->to_object(point.position - at.object->to_world.translation()) : point.position;
            case NORMAL: return at.object ? safe::normalized(at.object->to_world.transposed(point.shading)) : point.shading;
            case GENERATED: return at.generated();
            case CAMERA: return at.in_camera();
            case WINDOW: return at.in_window();
            default: return reflected(at.incoming, point.shading);
        }
    }

   private:
    static decltype(output) output_of(const std::string& name) {
        return name == "uv" ? UV : name == "object" ? OBJECT : name == "normal" ? NORMAL : name == "generated" ? GENERATED : name == "camera" ? CAMERA : name == "window" ? WINDOW : REFLECTION;
    }
};

// A mesh's attribute of a name: a color, a vector, their mean, or the fourth number, which is 1 where there is none, and 0 as Cycles' node
// of vertex colors has it on meshes without the attribute.
struct AttributeNode {
    static constexpr const char* NAME = "attribute";
    static constexpr Gives GIVES = Gives::COLOR;
    static constexpr bool VARIES = true;
    std::string name;
    enum { COLOR, VECTOR, NUMBER, ALPHA, VERTEX_ALPHA } output;

    explicit AttributeNode(const Inputs& in)
        : name(in.choice("name")),
          output(output_of(in.choice("output"))) {}
    Gives gives() const { return output == VECTOR ? Gives::VECTOR : GIVES; }
    Vec3 eval(const ShadingPoint& at) const {
        ShadingPoint::Values values = at.attribute(name);
        if (output == ALPHA || output == VERTEX_ALPHA) return gray(output == VERTEX_ALPHA && !values.width ? 0 : values.fourth);
        Vec3 value = values.width == 1 ? gray(values.first.x) : values.first;
        if (output == NUMBER && values.width == 2) return gray(value.x);  // as in Cycles
        return output == NUMBER ? gray((value.x + value.y + value.z) / 3) : value;
    }

   private:
    static decltype(output) output_of(const std::string& name) {
        return name == "color" ? COLOR : name == "vector" ? VECTOR : name == "number" ? NUMBER : name == "alpha" ? ALPHA : VERTEX_ALPHA;
    }
};

// In the plane of two axes.
inline void turn(double& x, double& y, double angle) {
    double s = safe::sine(angle), c = safe::cosine(angle), along = c * x - s * y;
    y = s * x + c * y, x = along;
}
// About x, then y, then z; and back.
inline Vec3 turned(Vec3 v, Vec3 angles) {
    turn(v.y, v.z, angles.x), turn(v.z, v.x, angles.y), turn(v.x, v.y, angles.z);
    return v;
}
inline Vec3 turned_back(Vec3 v, Vec3 angles) {
    turn(v.x, v.y, -angles.z), turn(v.z, v.x, -angles.y), turn(v.y, v.z, -angles.x);
    return v;
}

// A vector that is scaled, turned and moved; as a texture, point, vector or normal is.
struct MappingNode {
    static constexpr const char* NAME = "mapping";
    static constexpr Gives GIVES = Gives::VECTOR;
    Color vector, location, rotation, scale;
    enum { POINT, TEXTURE, DIRECTION, NORMAL } kind;

    explicit MappingNode(const Inputs& in)
        : vector(in["vector"]), location(in["location"]), rotation(in["rotation"]), scale(in["scale"]), kind(kind_of(in.choice("kind"))) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 v = at.value(vector), by = at.value(scale), angles = at.value(rotation);
        auto over = [](Vec3 a, Vec3 b) { return safe::each([](double a, double b, double) { return safe::divide(a, b); }, a, b); };
        switch (kind) {
            case POINT: return turned(v * by, angles) + at.value(location);
            case TEXTURE: return over(turned_back(v - at.value(location), angles), by);
            case DIRECTION: return turned(v * by, angles);
            default: return safe::normalized(turned(over(v, by), angles));
        }
    }

   private:
    static decltype(kind) kind_of(const std::string& name) {
        return name == "point" ? POINT : name == "texture" ? TEXTURE : name == "vector" ? DIRECTION : NORMAL;
    }
};

// A vector that is turned about a place: by three angles, or by one about an axis.
struct VectorRotateNode {
    static constexpr const char* NAME = "vector_rotate";
    static constexpr Gives GIVES = Gives::VECTOR;
    Color vector, center, axis, angle, rotation;
    std::string kind;
    bool back;

    explicit VectorRotateNode(const Inputs& in)
        : vector(in["vector"]), center(in["center"]), axis(in["axis"]), angle(in["angle"]), rotation(in["rotation"]), kind(in.choice("kind")),
          back(in.flag("invert")) {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 about = at.value(center), v = at.value(vector) - about;
        if (kind == "euler_xyz") return about + (back ? turned_back : turned)(v, at.value(rotation));
        Vec3 n = kind == "x_axis" ? Vec3{1, 0, 0} : kind == "y_axis" ? Vec3{0, 1, 0} : kind == "z_axis" ? Vec3{0, 0, 1} : safe::normalized(at.value(axis));
        if (is_black(n)) return about + v;
        double by = at.number(angle) * (back ? -1 : 1);
        return about + turned_about(n, v, {safe::sine(by), safe::cosine(by)});
    }
};

// A place, a direction or a normal of one space in another. A surface without an object is in the world's.
struct VectorTransformNode {
    static constexpr const char* NAME = "vector_transform";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    Color vector;
    enum Space { WORLD, OBJECT, CAMERA } from, to;
    bool is_point, is_normal;

    explicit VectorTransformNode(const Inputs& in)
        : vector(in["vector"]), from(space_of(in.choice("from"))), to(space_of(in.choice("to"))), is_point(in.choice("kind") == "point"),
          is_normal(in.choice("kind") == "normal") {}
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 v = at.value(vector);
        if (from == to) return v;
        v = out_of(to, at, into_world(at, v));
        return is_normal ? safe::normalized(v) : v;
    }

   private:
    static Space space_of(const std::string& name) { return name == "object" ? OBJECT : name == "camera" ? CAMERA : WORLD; }
    Vec3 into_world(const ShadingPoint& at, Vec3 v) const {
        if (from == CAMERA) return at.from_camera(v) + (is_point ? at.camera_eye() : Vec3{});
        if (from == WORLD || !at.object) return v;
        if (is_normal) return safe::normalized(transposed_product(at.object->inverse, v));
        return at.object->to_world.vector(v) + (is_point ? at.object->to_world.translation() + at.origin : Vec3{});
    }
    Vec3 out_of(Space space, const ShadingPoint& at, Vec3 v) const {
        if (space == CAMERA) return at.to_camera(is_point ? v - at.camera_eye() : v);
        if (space == WORLD || !at.object) return v;
        if (is_normal) return at.object->to_world.transposed(v);
        return at.object->to_object(is_point ? v - at.origin - at.object->to_world.translation() : v);
    }
};

struct GeometryNode {
    static constexpr const char* NAME = "geometry";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    enum { POSITION, NORMAL, TRUE_NORMAL, INCOMING, BACKFACING, TANGENT, PARAMETRIC } output;

    explicit GeometryNode(const Inputs& in) : output(output_of(in.choice("output"))) {}
    Vec3 eval(const ShadingPoint& at) const {
        switch (output) {
            case POSITION: return at.point.position + at.origin;
            case NORMAL: return at.point.shading;
            case TRUE_NORMAL: return at.point.normal;
            case INCOMING: return -at.incoming;
            case TANGENT: return at.tangent_round(2);
            case PARAMETRIC: return {1 - at.point.barycentric.x - at.point.barycentric.y, at.point.barycentric.x, 0};
            default: return gray(at.point.backside);
        }
    }

   private:
    static decltype(output) output_of(const std::string& name) {
        return name == "position"      ? POSITION
               : name == "normal"      ? NORMAL
               : name == "true_normal" ? TRUE_NORMAL
               : name == "incoming"    ? INCOMING
               : name == "tangent"     ? TANGENT
               : name == "parametric"  ? PARAMETRIC
                                       : BACKFACING;
    }
};

// A direction in the surface, of which rough closures are stretched: round an axis, or in which the u of a UV map grows.
struct TangentNode {
    static constexpr const char* NAME = "tangent";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    bool radial;
    int axis;
    std::string uv;  // "" the mesh's own

    explicit TangentNode(const Inputs& in)
        : radial(in.choice("kind") == "radial"), axis(in.choice("axis")[0] - 'x'), uv(in.choice("uv")) {}
    Vec3 eval(const ShadingPoint& at) const { return radial ? at.tangent_round(axis) : at.tangent_along(uv); }
};

// 1 within half a width of the edges of triangles, else 0. pixels: what the width is counted in, of those in front of the ray.
struct WireframeNode {
    static constexpr const char* NAME = "wireframe";
    static constexpr Gives GIVES = Gives::NUMBER;
    static constexpr bool VARIES = true;
    Color size;
    bool pixels;

    explicit WireframeNode(const Inputs& in) : size(in["size"]), pixels(in.flag("pixel_size")) {}
    Vec3 eval(const ShadingPoint& at) const {
        double width = std::fabs(at.number(size));
        if (pixels) {
            Vec3 x = along_plane(at.point.normal), y = cross(at.point.normal, x);
            auto across = [&](Vec3 v) { return length(v - at.incoming * dot(v, at.incoming)); };
            width *= at.footprint() * (across(x) + across(y)) / 2;
        }
        return gray(at.edge_distance() < width / 2);
    }
};

struct ObjectInfoNode {
    static constexpr const char* NAME = "object_info";
    static constexpr Gives GIVES = Gives::VECTOR;
    static constexpr bool VARIES = true;
    enum { LOCATION, COLOR, ALPHA, OBJECT_INDEX, MATERIAL_INDEX, RANDOM } output;

    explicit ObjectInfoNode(const Inputs& in) : output(output_of(in.choice("output"))) {}
    Gives gives() const { return output == COLOR ? Gives::COLOR : GIVES; }
    Vec3 eval(const ShadingPoint& at) const {
        if (!at.object) return {};
        static constexpr float PLAIN[] = {1, 1, 1, 1, 0};
        const float* info = at.object->info ? at.object->info : PLAIN;
        switch (output) {
            case LOCATION: return at.object->to_world.translation() + at.origin;
            case COLOR: return {info[0], info[1], info[2]};
            case ALPHA: return gray(info[3]);
            case OBJECT_INDEX: return gray(at.object->index);
            case MATERIAL_INDEX: return gray(at.material_index());
            default: return gray(info[4]);
        }
    }

   private:
    static decltype(output) output_of(const std::string& name) {
        return name == "location"         ? LOCATION
               : name == "color"          ? COLOR
               : name == "alpha"          ? ALPHA
               : name == "object_index"   ? OBJECT_INDEX
               : name == "material_index" ? MATERIAL_INDEX
                                          : RANDOM;
    }
};

struct FresnelNode {
    static constexpr const char* NAME = "fresnel";
    static constexpr Gives GIVES = Gives::NUMBER;
    static constexpr bool VARIES = true;
    Color ior, normal;

    explicit FresnelNode(const Inputs& in) : ior(in["ior"]), normal(in["normal"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        return gray(fresnel(std::fabs(dot(at.incoming, at.unscaled_normal(normal))), at.ratio(max(at.number(ior), 1e-5))));
    }
};

struct LayerWeightNode {
    static constexpr const char* NAME = "layer_weight";
    static constexpr Gives GIVES = Gives::NUMBER;
    static constexpr bool VARIES = true;
    Color blend, normal;
    bool facing;

    explicit LayerWeightNode(const Inputs& in) : blend(in["blend"]), normal(in["normal"]), facing(in.choice("output") == "facing") {}
    Vec3 eval(const ShadingPoint& at) const {
        double cosine = std::fabs(dot(at.incoming, at.unscaled_normal(normal))), blended = at.number(blend);
        if (!facing) {
            double left = max(1 - blended, 1e-5);
            return gray(fresnel(cosine, at.point.backside ? left : 1 / left));
        }
        if (blended != 0.5) {
            blended = min(max(blended, 0.0), 1 - 1e-5);
            cosine = safe::power(cosine, blended < 0.5 ? 2 * blended : 0.5 / (1 - blended));
        }
        return gray(1 - cosine);
    }
};

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

using GeometryNodes = std::variant<TextureCoordinateNode, AttributeNode, MappingNode, VectorRotateNode, VectorTransformNode,
                                   GeometryNode, TangentNode, WireframeNode, ObjectInfoNode, FresnelNode, LayerWeightNode,
                                   LightPathNode>;

}  // namespace viewcam::VIEWCAM_ISA
