// What surfaces are made of: what they give off, and closures that become the lobes of a BSDF where a path meets them.
#pragma once
#include <variant>
#include <vector>

#include "bsdf/bsdf.h"
#include "textures.h"

namespace viewcam::VIEWCAM_ISA {

// What a closure's `add_to` is told: the point that a path has come to, along `incoming`, and the scene's images.
struct ShadingPoint {
    const Interaction& point;
    Vec3 incoming;
    const std::vector<Texture>& textures;

    Vec3 color(const Color& color) const { return color.at(textures, point); }
    // The index of refraction beyond the surface over that before it. ior: inside over outside.
    double ratio(double ior) const { return point.backside ? 1 / ior : ior; }
};

struct DiffuseClosure {
    Color color;
    static constexpr uint32_t KINDS = DIFFUSE;  // the kinds of rays that its lobes scatter
    void add_to(BSDF& bsdf, const ShadingPoint& at) const { bsdf.add(Lambert{at.color(color), at.point.shading}); }
};

struct MirrorClosure {
    Color color;
    static constexpr uint32_t KINDS = GLOSSY;
    void add_to(BSDF& bsdf, const ShadingPoint& at) const {
        bsdf.add(SpecularReflection{at.color(color), specular_normal(at.incoming, at.point), at.incoming});
    }
};

struct GlassClosure {
    Color color;
    double ior;
    static constexpr uint32_t KINDS = GLOSSY | TRANSMISSION;
    void add_to(BSDF& bsdf, const ShadingPoint& at) const {
        Vec3 normal = specular_normal(at.incoming, at.point), rgb = at.color(color);
        double ratio = at.ratio(ior), reflectance = fresnel(-dot(normal, at.incoming), ratio);
        bsdf.add(SpecularReflection{rgb * reflectance, normal, at.incoming});
        bsdf.add(SpecularTransmission{rgb * (1 - reflectance), normal, at.incoming, ratio});
    }
};

// Glass that reflects nothing but where all is reflected, and there it is black.
struct RefractionClosure {
    Color color;
    double ior;
    static constexpr uint32_t KINDS = TRANSMISSION;
    void add_to(BSDF& bsdf, const ShadingPoint& at) const {
        Vec3 normal = specular_normal(at.incoming, at.point);
        double ratio = at.ratio(ior);
        if (fresnel(-dot(normal, at.incoming), ratio) < 1)
            bsdf.add(SpecularTransmission{at.color(color), normal, at.incoming, ratio});
    }
};

// One line a closure.
using Closure = std::variant<DiffuseClosure, MirrorClosure, GlassClosure, RefractionClosure>;

struct Material {
    Color emission;  // radiance, of both sides
    std::vector<Closure> closures;

    uint32_t kinds() const {
        uint32_t kinds = 0;
        for (const Closure& closure : closures) kinds |= std::visit([](const auto& closure) { return closure.KINDS; }, closure);
        return kinds;
    }
    BSDF bsdf(const ShadingPoint& at) const {
        BSDF bsdf;
        for (const Closure& closure : closures) std::visit([&](const auto& closure) { closure.add_to(bsdf, at); }, closure);
        return bsdf;
    }
    // The albedo of what is diffuse here, which a pass of its own shows.
    Vec3 diffuse_color(const ShadingPoint& at) const {
        Vec3 sum;
        for (const Closure& closure : closures)
            if (auto* diffuse = std::get_if<DiffuseClosure>(&closure)) sum += at.color(diffuse->color);
        return sum;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
