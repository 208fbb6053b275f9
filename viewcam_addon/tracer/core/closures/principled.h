// The principled surface: as much of it as its alpha tells, in layers, from the top sheen, a coat, then emission, metal, glass, a specular reflection and what is diffuse.
//
// A layer leaves to those below it what its albedo does not take. As in Cycles (measured with 4.2, 4.5, 5.0 and 5.2 under a sun
// without a size). Subsurface scattering and thin films have no lobes here.
#pragma once
#include "lobes.h"

namespace viewcam::VIEWCAM_ISA {

struct PrincipledClosure {
    static constexpr const char* NAME = "principled";
    static constexpr uint32_t KINDS = DIFFUSE | GLOSSY | TRANSMISSION;
    Color base_color, metallic, roughness, ior, diffuse_roughness, specular_level, specular_tint, transmission, coat_weight, coat_roughness, coat_ior,
        coat_tint, sheen_weight, sheen_roughness, sheen_tint, emission_color, emission_strength, alpha, normal, coat_normal;
    Anisotropy anisotropy;
    Distribution distribution;

    explicit PrincipledClosure(const Inputs& in)
        : base_color(in["base_color"]), metallic(in["metallic"]), roughness(in["roughness"]), ior(in["ior"]),
          diffuse_roughness(in["diffuse_roughness"]), specular_level(in["specular_ior_level"]), specular_tint(in["specular_tint"]),
          transmission(in["transmission_weight"]), coat_weight(in["coat_weight"]), coat_roughness(in["coat_roughness"]),
          coat_ior(in["coat_ior"]), coat_tint(in["coat_tint"]), sheen_weight(in["sheen_weight"]),
          sheen_roughness(in["sheen_roughness"]), sheen_tint(in["sheen_tint"]), emission_color(in["emission_color"]),
          emission_strength(in["emission_strength"]), alpha(in["alpha"]), normal(in["normal"]), coat_normal(in["coat_normal"]),
          anisotropy{in["anisotropic"], in["anisotropic_rotation"], in["tangent"]}, distribution(in.choice("distribution")) {}

    uint32_t kinds() const { return transmission.is_black() ? DIFFUSE | GLOSSY : KINDS; }
    bool is_rough() const { return true; }
    bool lets_through() const { return alpha.varies() || alpha.rgb.x < 1; }
    bool shines_evenly() const {
        bool layered = !(sheen_weight.is_black() && coat_weight.is_black());  // they leave less of it toward where it grazes
        return emits_nothing() || !(layered || emission_color.varies() || emission_strength.varies() || alpha.varies());
    }
    Vec3 mean_emission(const std::vector<Texture>& textures) const {
        double share = alpha.varies() ? 1 : unit_range(alpha.rgb.x);
        return emission_color.mean(textures) * emission_strength.mean(textures) * share;
    }

    // Four points of it at once have no sheen, emission or glass.
    bool is_wide() const {
        bool plain = sheen_weight.is_black() && emits_nothing() && transmission.is_black();
        return plain && !lets_through() && anisotropy.is_none() && !distribution.beckmann;
    }
    template <class At> void add_to(BSDFAt<At>& bsdf, const At& at, Vec3Of<NumberOf<At>> weight) const {
        using T = NumberOf<At>;
        Vec3Of<T> base = max(at.color(base_color), 0), tint = max(at.color(specular_tint), 0), clamped = unit_range(base), none;
        Vec3Of<T> shading = at.normal(this->normal), normal = at.specular(shading), white = gray(splat<T>(1));
        T cosine = -dot(normal, at.incoming), index = max(at.number(ior), splat<T>(LEAST_IOR));
        FacetsOf<T> round = distribution.facets(at.number(roughness)), facets = anisotropy.of(at, shading, round);

        if constexpr (IS_ONE<At>) {
            if (double share = unit_range(at.number(alpha)); share < 1) {
                bsdf.let_through(weight * (1 - share));
                weight *= share;
            }
            weight = below_sheen(bsdf, at, weight, shading);
        }
        weight = below_coat(bsdf, at, weight);
        if constexpr (IS_ONE<At>) bsdf.emit(weight * at.value(emission_color) * at.number(emission_strength));
        if (T share = unit_range(at.number(metallic)); any(share > NEGLIGIBLE)) {
            Mask<T> metal(share > NEGLIGIBLE);
            auto fresnel = F82Of<T>::of(clamped, unit_range(tint));
            add_reflection(bsdf, at, select(metal, weight * share * more(at, normal, facets, fresnel.mean()).lobe, none), normal, facets, fresnel);
            weight = select(metal, weight * (1.0 - share), weight);
        }
        if constexpr (IS_ONE<At>)
            if (double share = unit_range(at.number(transmission)); share > NEGLIGIBLE) {
                Vec3 through{std::sqrt(clamped.x), std::sqrt(clamped.y), std::sqrt(clamped.z)};  // it is gone through twice
                double ratio = at.ratio(index);
                ScaledDielectric fresnel{ratio, unit_range(tint * f0_of(index))};
                add_glass(bsdf, at, weight * share, normal, round, ratio, fresnel, gray(1), through, distribution.multiple);
                weight *= 1 - share;
            }
        T level = max(at.number(specular_level), T{}), f0 = f0_of(index), eta = index;
        if (Mask<T> leveled(level != 0.5); any(leveled)) {
            f0 = select(leveled, f0 * (2.0 * level), f0);
            eta = select(leveled, select(Mask<T>(index < 1.0), 1.0 / ior_of_f0(f0), ior_of_f0(f0)), eta);
        }
        if (Mask<T> reflects = Mask<T>(eta != 1.0) & Mask<T>(weight.x + weight.y + weight.z >= 3 * NEGLIGIBLE); any(reflects)) {
            ScaledDielectricOf<T> fresnel{eta, unit_range(tint * f0)};
            Scattering<T> scattered = more(at, normal, facets, mix(fresnel.f0, white, fresnel_progress(mean_fresnel(eta), eta)));
            add_reflection(bsdf, at, select(reflects, weight * scattered.lobe, none), normal, facets, fresnel);
            Vec3Of<T> albedo = mix(fresnel.f0, white, fresnel_progress_seen<T>(eta, roughness_of(facets), cosine));
            weight = select(reflects, below(weight, weight * scattered.albedo * albedo), weight);
        }
        add_diffuse(bsdf, at, weight * base, shading, at.number(diffuse_roughness), base);
    }

   private:
    static constexpr double NEGLIGIBLE = 1e-5, MOST_TINT = 1e40;

    bool emits_nothing() const { return emission_color.is_black() || emission_strength.is_black(); }
    // The factors of an albedo and of a lobe by scattering more than once.
    template <class T> struct Scattering {
        Vec3Of<T> albedo = gray(splat<T>(1)), lobe = gray(splat<T>(1));

        static Scattering of(const MultipleScatteringOf<T>& more) { return {more.albedo, more.albedo * more.lobe}; }
    };
    template <class At, class T> Scattering<T> more(const At& at, Vec3Of<T> normal, const MicrofacetsOf<T>& facets, Vec3Of<T> mean) const {
        return distribution.multiple ? Scattering<T>::of(multiple_reflection(at, normal, facets, mean)) : Scattering<T>{};
    }

    // Adds the sheen, which stands on the coat where there is one; what it leaves to the layers below. shading: the base's normal.
    Vec3 below_sheen(BSDF& bsdf, const ShadingPoint& at, Vec3 weight, Vec3 shading) const {
        double share = max(at.number(sheen_weight), 0.0);
        if (!(share > NEGLIGIBLE)) return weight;
        Vec3 mixed = mix(shading, at.normal(coat_normal), unit_range(at.number(coat_weight)));
        double size = length(mixed);
        SheenLobe lobe(max(at.color(sheen_tint), 0) * weight * share, size > 0 ? mixed / size : at.point.shading, -at.incoming,
                       unit_range(at.number(sheen_roughness)));
        bsdf.add(lobe);
        return below(weight, lobe.color);
    }
    // Adds the coat; what it leaves to the layers below.
    template <class At> Vec3Of<NumberOf<At>> below_coat(BSDFAt<At>& bsdf, const At& at, Vec3Of<NumberOf<At>> weight) const {
        using T = NumberOf<At>;
        T share = max(at.number(coat_weight), T{});
        Mask<T> coated(share > NEGLIGIBLE);
        if (!any(coated)) return weight;
        Vec3Of<T> normal = at.specular_normal(coat_normal);  // not the base's where it has none
        T cosine = -dot(normal, at.incoming), eta = max(at.number(coat_ior), splat<T>(1)), reflected = fresnel(cosine, eta);
        FacetsOf<T> facets = facets_of(at.number(coat_roughness));
        Scattering<T> scattered;
        if (at.version >= CYCLES_4_5) {
            scattered = Scattering<T>::of(multiple_reflection(at, normal, facets, gray(mean_fresnel(eta))));
            T seen = mix(f0_of(eta), splat<T>(1), fresnel_progress_seen<T>(eta, roughness_of(facets), cosine));
            reflected = select(Mask<T>(eta > 1.0), seen, reflected);
        }
        add_reflection(bsdf, at, select(coated, weight * share * scattered.lobe, Vec3Of<T>{}), normal, facets, DielectricFresnelOf<T>{eta});
        Vec3Of<T> left = below(weight, weight * share * scattered.albedo * reflected), tint = max(at.color(coat_tint), 0);
        if (all(Mask<T>(tint.x == 1.0) & Mask<T>(tint.y == 1.0) & Mask<T>(tint.z == 1.0))) return select(coated, left, weight);
        // The way through it, both ways as one: without end along a coat that does not bend light.
        T depth = 1.0 / sqrt(max(1.0 - (1.0 - cosine * cosine) / (eta * eta), splat<T>(1e-300)));
        auto power = [](double t, double depth) { return t > 0 ? min(pow(t, depth), MOST_TINT) : 0; };
        auto absorbed = [&](T t) {
            if constexpr (IS_ONE<At>)
                return mix(1, power(t, depth), share);
            else
                return mix(splat<T>(1), gather4([&](int i) { return power(t[i], depth[i]); }), share);
        };
        return select(coated, left * Vec3Of<T>{absorbed(tint.x), absorbed(tint.y), absorbed(tint.z)}, weight);
    }

    // The weight that a layer leaves to what is below it, the same share of all channels.
    template <class T> static Vec3Of<T> below(Vec3Of<T> weight, Vec3Of<T> albedo) {
        auto part = [](T taken, T of) { return select(Mask<T>(of != 0.0), taken / of, T{}); };
        T most = max(part(albedo.x, weight.x), max(part(albedo.y, weight.y), part(albedo.z, weight.z)));
        return weight * unit_range(1.0 - most);
    }
};

}  // namespace viewcam::VIEWCAM_ISA
