// Diffuse reflection, rough or Lambert's, and what is let through as evenly.
#pragma once
#include "../bsdf/diffuse.h"
#include "shading_point.h"

namespace viewcam::VIEWCAM_ISA {

// albedo: as of OrenNayar.
template <class At, class T>
[[gnu::always_inline]] inline void add_diffuse(BSDFOf<T>& bsdf, const At& at, const Vec3Of<T>& color, const Vec3Of<T>& normal, T roughness, const Vec3Of<T>& albedo) {
    constexpr double SMOOTH = 1e-5;
    Mask<T> smooth(roughness < SMOOTH);
    if (any(smooth)) bsdf.add(LambertOf<T>{select(smooth, color, Vec3Of<T>{}), normal});
    if (all(smooth)) return;
    bsdf.add(OrenNayarOf<T>(select(smooth, Vec3Of<T>{}, color), normal, -at.incoming, unit_range(roughness), albedo, at.version >= CYCLES_4_3));
}

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

}  // namespace viewcam::VIEWCAM_ISA
