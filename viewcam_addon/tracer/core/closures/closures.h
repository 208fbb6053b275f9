// The closures but for the principled one, and at the end the list of all.
#pragma once
#include <concepts>
#include <string_view>

#include "principled.h"

namespace viewcam::VIEWCAM_ISA {

// Diffuse reflection, rough or Lambert's.
struct DiffuseClosure {
    static constexpr const char* NAME = "diffuse";
    static constexpr uint32_t KINDS = DIFFUSE;  // the kinds of rays that its lobes scatter
    Color color, roughness, normal;

    explicit DiffuseClosure(const Inputs& in) : color(in["color"]), roughness(in["roughness"]), normal(in["normal"]) {}
    bool is_wide() const { return true; }
    template <class At> void add_to(BSDFAt<At>& bsdf, const At& at, Vec3Of<NumberOf<At>> weight) const {
        Vec3Of<NumberOf<At>> rgb = at.color(color);
        add_diffuse(bsdf, at, rgb * weight, at.normal(normal), at.number(roughness), rgb);
    }
};

// Light that is let through and spread as evenly as by diffuse reflection.
struct TranslucentClosure {
    static constexpr const char* NAME = "translucent";
    static constexpr uint32_t KINDS = TRANSMISSION;
    Color color, normal;

    explicit TranslucentClosure(const Inputs& in) : color(in["color"]), normal(in["normal"]) {}
    bool is_rough() const { return true; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        bsdf.add(Translucent{at.color(color) * weight, at.specular_normal(normal)});
    }
};

// Dielectrics, smooth and rough.
struct GlassClosure {
    static constexpr const char* NAME = "glass";
    static constexpr uint32_t KINDS = GLOSSY | TRANSMISSION;
    Color color, ior, roughness, normal;
    Distribution distribution;

    explicit GlassClosure(const Inputs& in)
        : color(in["color"]), ior(in["ior"]), roughness(in["roughness"]), normal(in["normal"]), distribution(in.choice("distribution")) {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        Vec3 rgb = at.color(color);
        double ratio = at.ratio(max(at.number(ior), LEAST_IOR));
        add_glass(bsdf, at, weight, at.specular_normal(normal), distribution.facets(at.number(roughness)), ratio, DielectricFresnel{ratio}, rgb, rgb,
                  distribution.multiple);
    }
};

// Surfaces that refract only. They reflect nothing but where all is reflected, and there they are black.
struct RefractionClosure {
    static constexpr const char* NAME = "refraction";
    static constexpr uint32_t KINDS = TRANSMISSION;
    Color color, ior, roughness, normal;
    Distribution distribution;

    explicit RefractionClosure(const Inputs& in)
        : color(in["color"]), ior(in["ior"]), roughness(in["roughness"]), normal(in["normal"]), distribution(in.choice("distribution")) {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        double ratio = at.ratio(max(at.number(ior), LEAST_IOR));
        add_refraction(bsdf, at, at.color(color) * weight, at.specular_normal(normal), distribution.facets(at.number(roughness)), TotalReflection{ratio},
                       ratio);
    }
};

// Light that a surface gives off, to both sides: below 0, too, where nodes make it so.
struct EmissionClosure {
    static constexpr const char* NAME = "emission";
    static constexpr uint32_t KINDS = 0;
    Color color, strength;

    explicit EmissionClosure(const Inputs& in) : color(in["color"]), strength(in["strength"]) {}
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const { bsdf.emit(weight * at.value(color) * at.number(strength)); }
    bool shines_evenly() const { return !color.varies() && !strength.varies(); }
    // In the mean over the images of its inputs.
    Vec3 mean_emission(const std::vector<Texture>& textures) const { return color.mean(textures) * strength.mean(textures); }
};

// Surfaces, or parts of them, that light goes straight through: the path goes on as if they were not there, but for a color.
struct TransparentClosure {
    static constexpr const char* NAME = "transparent";
    static constexpr uint32_t KINDS = 0;
    Color color;

    explicit TransparentClosure(const Inputs& in) : color(in["color"]) {}
    bool lets_through() const { return !color.is_black(); }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const { bsdf.let_through(weight * at.value(color)); }
};

// Reflection of one color by facets without a Fresnel term: a mirror where it is not rough.
struct GlossyClosure {
    static constexpr const char* NAME = "glossy";
    static constexpr uint32_t KINDS = GLOSSY;
    Color color, roughness, normal;
    Anisotropy anisotropy;
    Distribution distribution;

    explicit GlossyClosure(const Inputs& in)
        : color(in["color"]), roughness(in["roughness"]), normal(in["normal"]), anisotropy{in["anisotropy"], in["rotation"], in["tangent"]},
          distribution(in.choice("distribution")) {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    bool is_wide() const { return anisotropy.is_none() && !distribution.beckmann; }
    template <class At> void add_to(BSDFAt<At>& bsdf, const At& at, Vec3Of<NumberOf<At>> weight) const {
        using T = NumberOf<At>;
        Vec3Of<T> rgb = at.color(color), normal = at.specular_normal(this->normal);
        FacetsOf<T> facets = anisotropy.of_glossy(at, normal, distribution.facets(at.number(roughness)));
        weight = weight * rgb;
        if (distribution.multiple) {
            MultipleScatteringOf<T> more = multiple_reflection(at, normal, facets, rgb);
            weight = weight * more.albedo * more.lobe;
        }
        add_reflection(bsdf, at, weight, normal, facets, NoFresnel{});
    }
};

// Rough conductors.
struct MetallicClosure {
    static constexpr const char* NAME = "metallic";
    static constexpr uint32_t KINDS = GLOSSY;
    Color color, edge_tint, ior, extinction, roughness, normal;
    Anisotropy anisotropy;
    Distribution distribution;
    bool physical;  // by index of refraction and extinction instead of two colors

    explicit MetallicClosure(const Inputs& in)
        : color(in["color"]), edge_tint(in["edge_tint"]), ior(in["ior"]), extinction(in["extinction"]), roughness(in["roughness"]), normal(in["normal"]),
          anisotropy{in["anisotropy"], in["rotation"], in["tangent"]}, distribution(in.choice("distribution")), physical(in.choice("fresnel") == "physical_conductor") {}
    bool is_rough() const { return roughness.varies() || roughness.rgb.x > 0; }
    bool is_wide() const { return anisotropy.is_none() && !distribution.beckmann; }
    template <class At> void add_to(BSDFAt<At>& bsdf, const At& at, Vec3Of<NumberOf<At>> weight) const {
        using T = NumberOf<At>;
        Vec3Of<T> shading = at.normal(this->normal), normal = at.specular(shading);
        FacetsOf<T> facets = anisotropy.of(at, shading, distribution.facets(at.number(roughness)));
        auto add = [&](const auto& fresnel) {
            if (distribution.multiple) {
                MultipleScatteringOf<T> more = multiple_reflection(at, normal, facets, fresnel.mean());
                weight = weight * more.albedo * more.lobe;
            }
            add_reflection(bsdf, at, weight, normal, facets, fresnel);
        };
        if (physical)
            add(ConductorFresnelOf<T>{at.color(ior), at.color(extinction), at.version >= CYCLES_5_0});
        else
            add(F82Of<T>::of(unit_range(at.color(color)), unit_range(at.color(edge_tint))));
    }
};

// Sheen of cloth.
struct SheenClosure {
    static constexpr const char* NAME = "sheen";
    static constexpr uint32_t KINDS = DIFFUSE;
    Color color, roughness, normal;
    bool fibers;  // or Ashikhmin's velvet

    explicit SheenClosure(const Inputs& in)
        : color(in["color"]), roughness(in["roughness"]), normal(in["normal"]), fibers(in.choice("distribution") == "microfiber") {}
    bool is_rough() const { return true; }
    void add_to(BSDF& bsdf, const ShadingPoint& at, Vec3 weight) const {
        Vec3 tint = at.color(color) * weight, normal = at.normal(this->normal);
        if (fibers)
            bsdf.add(SheenLobe(tint, normal, -at.incoming, unit_range(at.number(roughness))));
        else
            bsdf.add(VelvetLobe(tint, normal, -at.incoming, unit_range(at.number(roughness))));
    }
};

// Each has a NAME, by which a scene asks for it, KINDS, the kinds of rays that its lobes scatter, and `add_to`;
// `kinds` where its inputs leave some of them out, `is_rough` where it may spread light otherwise than diffuse surfaces do,
// `mean_emission` and `shines_evenly` where it shines, `lets_through` where light may go straight through it.
using Closure = std::variant<DiffuseClosure, GlossyClosure, GlassClosure, RefractionClosure, EmissionClosure, TranslucentClosure, MetallicClosure,
                             PrincipledClosure, SheenClosure, TransparentClosure>;
template <class Kind>
concept IsClosure = std::constructible_from<Kind, const Inputs&> && requires(const Kind& closure, BSDF& bsdf, const ShadingPoint& at, const std::vector<Texture>& textures) {
    { Kind::NAME } -> std::convertible_to<std::string_view>;
    { Kind::KINDS } -> std::convertible_to<uint32_t>;
    closure.add_to(bsdf, at, Vec3{});
    requires requires { { closure.mean_emission(textures) } -> std::same_as<Vec3>; } == requires { { closure.shines_evenly() } -> std::same_as<bool>; };
};
template <class Kinds> constexpr bool ALL_ARE_CLOSURES = false;
template <class... Kinds> constexpr bool ALL_ARE_CLOSURES<std::variant<Kinds...>> = (IsClosure<Kinds> && ...);
static_assert(ALL_ARE_CLOSURES<Closure>);

}  // namespace viewcam::VIEWCAM_ISA
