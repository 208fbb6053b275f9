// Images, looked up by a vector.
#pragma once
#include "../shapes/object.h"
#include "math.h"

namespace viewcam::VIEWCAM_ISA {

inline Lookup::Interpolation interpolation_of(const std::string& name) {
    return name == "closest" ? Lookup::CLOSEST : name == "cubic" ? Lookup::CUBIC : Lookup::LINEAR;
}

// The ways an image lies on its object: flat, rolled round, or thrown on it along the object's three axes, from where it looks
// most.
struct ImageNode {
    static constexpr const char* NAME = "image";
    static constexpr Gives GIVES = Gives::COLOR;
    Color image, vector, blend;
    Lookup lookup;
    bool alpha;
    enum { FLAT, SPHERE, TUBE, BOX } projection;

    explicit ImageNode(const Inputs& in)
        : image(in["image"]), vector(in["vector"]), blend(in["blend"]), lookup(lookup_of(in.choice("interpolation"), in.choice("extension"), in.flag("straight"))),
          alpha(in.choice("output") == "alpha"), projection(projection_of(in.choice("projection"))) {}
    bool varies() const { return projection == BOX; }
    Vec3 eval(const ShadingPoint& at) const {
        if (image.image == NONE) return {};
        Vec3 place = at.value(vector);
        const Texture& texture = at.textures[image.image];
        auto color = [&](double x, double y) { return alpha ? gray(texture.alpha({x, y}, lookup)) : texture.at({x, y}, lookup); };
        if (projection == BOX) return from_sides(at, place, color);
        Vec2 flat = projection == FLAT ? Vec2{place.x, place.y} : rolled(place * 2 - gray(1));
        return color(flat.x, flat.y);
    }

   private:
    static Lookup lookup_of(const std::string& interpolation, const std::string& extension, bool straight) {
        return {interpolation_of(interpolation),
                extension == "extend"   ? Lookup::EXTEND
                : extension == "clip"   ? Lookup::CLIP
                : extension == "mirror" ? Lookup::MIRROR
                                        : Lookup::REPEAT,
                straight};
    }
    static decltype(projection) projection_of(const std::string& name) {
        return name == "sphere" ? SPHERE : name == "tube" ? TUBE : name == "box" ? BOX : FLAT;
    }
    // Round z, from −1 to 1.
    Vec2 rolled(Vec3 place) const {
        double round = atan2(place.x, place.y) / (2 * PI), size = length(place);
        if (projection == TUBE) return place.x != 0 || place.y != 0 ? Vec2{0.5 - round, (place.z + 1) / 2} : Vec2{};
        if (!(size > 0)) return {};
        return {place.x != 0 || place.y != 0 ? 0.5 - round : 0, 1 - acos(place.z / size) / PI};
    }
    // The colors that are seen from the three axes, mixed by how the surface is turned: one in the corners of the triangle of
    // all turns, two at its sides, three in its middle.
    template <class LookUp> Vec3 from_sides(const ShadingPoint& at, Vec3 place, LookUp&& color) const {
        Vec3 normal = at.object ? at.object->to_world.transposed(at.point.shading) : at.point.shading, n = abs(normal);
        n = n / (n.x + n.y + n.z);
        double blended = at.number(blend), most = 0.5 * (1 + blended);
        auto share = [&](double a, double b) { return unit_range((a / (a + b) - 0.5 * (1 - blended)) / blended); };
        Vec3 weight{1, 0, 0};
        if (n.x > most * (n.x + n.y) && n.x > most * (n.x + n.z)) {
        } else if (n.y > most * (n.x + n.y) && n.y > most * (n.y + n.z)) {
            weight = {0, 1, 0};
        } else if (n.z > most * (n.x + n.z) && n.z > most * (n.y + n.z)) {
            weight = {0, 0, 1};
        } else if (blended > 0) {
            double rest = 1 - most;
            if (n.z < rest * (n.x + n.y))
                weight.x = share(n.x, n.y), weight.y = 1 - weight.x;
            else if (n.x < rest * (n.y + n.z))
                weight.x = 0, weight.y = share(n.y, n.z), weight.z = 1 - weight.y;
            else if (n.y < rest * (n.x + n.z))
                weight.x = share(n.x, n.z), weight.z = 1 - weight.x;
            else
                weight = (n * (2 - most) + gray(most - 1)) / (2 * most - 1);
        }
        Vec3 sum;
        if (weight.x > 0) sum += color(normal.x < 0 ? 1 - place.y : place.y, place.z) * weight.x;
        if (weight.y > 0) sum += color(normal.y > 0 ? 1 - place.x : place.x, place.z) * weight.y;
        if (weight.z > 0) sum += color(normal.z > 0 ? 1 - place.y : place.y, place.x) * weight.z;
        return sum;
    }
};

// An image of all directions, looked up by one.
struct EnvironmentImageNode {
    static constexpr const char* NAME = "environment";
    static constexpr Gives GIVES = Gives::COLOR;
    Color image, vector;
    Lookup lookup;
    bool ball;

    explicit EnvironmentImageNode(const Inputs& in)
        : image(in["image"]), vector(in["vector"]), lookup{interpolation_of(in.choice("interpolation"))}, ball(in.choice("projection") == "mirror_ball") {}
    Vec3 eval(const ShadingPoint& at) const {
        if (image.image == NONE) return {};
        Vec3 direction = at.value(vector);
        if (is_black(direction)) return at.textures[image.image].at(ball ? Vec2{0.5, 0.5} : Vec2{}, lookup);
        return at.textures[image.image].at(ball ? mirror_ball(direction) : equirectangular(direction), lookup);
    }
};

using ImageNodes = std::variant<ImageNode, EnvironmentImageNode>;

}  // namespace viewcam::VIEWCAM_ISA
