// Materials: closures, each with a weight, that become the lobes of a BSDF where a path meets them.
#pragma once
#include <algorithm>
#include <variant>
#include <vector>

#include "closures/closures.h"

namespace viewcam::VIEWCAM_ISA {

// A factor of a closure's weight, from 0 to 1: a mixture's, or what it leaves to the other side.
struct MixFactor {
    Color value;
    bool rest;
};
struct WeightedClosure {
    Closure closure;
    std::vector<MixFactor> factors;
    bool varies = false, on_tangents = false;  // true if its inputs vary; true if they ask for the tangents of a UV map
};

struct Material {
    std::vector<WeightedClosure> closures;
    bool transparent_shadow = true;  // true if shadow rays, too, go through what is transparent
    Color normal;                    // in place of the smooth one, for those of its closures that have none; black: none
    bool normal_on_tangents = false; // true if that asks for the tangents of a UV map

    // The kinds of rays that its lobes scatter.
    uint32_t kinds() const { return kinds_; }
    // The kinds among them that are scattered all over, but not as diffuse light is.
    uint32_t rough_kinds() const { return rough_kinds_; }
    bool scatters() const { return kinds_; }
    bool emits() const { return !is_black(mean_emission_); }
    // True if it may let light straight through.
    bool is_transparent() const { return transparent_; }
    // True if it has normals of its own.
    bool is_bumped() const { return bumped_; }
    // True if the BSDFs of four points can be made at once, and whether the points' own values are needed for that.
    bool is_wide() const { return wide_ && scatters() && !emits() && !transparent_ && !VIEWCAM_ISA::is_bumped(normal); }
    bool varies() const { return varies_; }
    // True if it asks for the tangents of a UV map.
    bool needs_tangents() const {
        return normal_on_tangents || std::any_of(closures.begin(), closures.end(), [](const WeightedClosure& weighted) { return weighted.on_tangents; });
    }
    // About what it gives off, black only where it gives off nothing; and whether that is what it gives off everywhere.
    Vec3 mean_emission() const { return mean_emission_; }
    bool shines_evenly() const { return shines_evenly_; }

    // To be called when all closures are there.
    void prepare(const std::vector<Texture>& textures) {
        for (const WeightedClosure& weighted : closures)
            std::visit(
                [&](const auto& closure) {
                    uint32_t kinds = closure.KINDS;
                    if constexpr (requires { closure.kinds(); }) kinds = closure.kinds();
                    kinds_ |= kinds;
                    if constexpr (requires { closure.is_rough(); })
                        if (closure.is_rough()) rough_kinds_ |= kinds & ~DIFFUSE;
                    if constexpr (requires { closure.normal; }) bumped_ |= VIEWCAM_ISA::is_bumped(closure.normal);
                    if constexpr (requires { closure.coat_normal; }) bumped_ |= VIEWCAM_ISA::is_bumped(closure.coat_normal);
                    if constexpr (requires { closure.is_wide(); }) wide_ &= closure.is_wide(); else wide_ = false;
                    if constexpr (requires { closure.lets_through(); }) transparent_ |= closure.lets_through();
                    if constexpr (requires { closure.mean_emission(textures); }) {
                        mean_emission_ += closure.mean_emission(textures) * mean_weight(weighted, textures);
                        shines_evenly_ &= closure.shines_evenly() && std::none_of(weighted.factors.begin(), weighted.factors.end(), [](const MixFactor& factor) { return factor.value.varies(); });
                    }
                },
                weighted.closure);
        varies_ = bumped_ || std::any_of(closures.begin(), closures.end(), [](const WeightedClosure& weighted) { return weighted.varies; });
    }

    template <class At> BSDFAt<At> bsdf(const At& at) const {
        BSDFAt<At> bsdf;
        // Any surface that is not plainly diffuse has its smooth normals bent, too (specular_normal).
        Mask<NumberOf<At>> bent = VIEWCAM_ISA::is_black(at.point.shading - at.point.normal) == Mask<NumberOf<At>>{};
        if (bumped_) bent = bent == bent;  // everywhere
        if (bumped_ || (kinds_ != DIFFUSE && any(bent))) bsdf.bump(bent, {at.point.shading, at.version >= CYCLES_4_5, at.version >= CYCLES_5_0});
        for (const WeightedClosure& weighted : closures) add(weighted, at, bsdf);
        return bsdf;
    }
    Vec3 emission(const ShadingPoint& at) const {
        BSDF bsdf;
        for (const WeightedClosure& weighted : closures)
            std::visit(
                [&](const auto& closure) {
                    if constexpr (requires { closure.mean_emission(at.textures); }) add(weighted, at, bsdf);
                },
                weighted.closure);
        return bsdf.emission();
    }

   private:
    template <class At> static void add(const WeightedClosure& weighted, const At& at, BSDFAt<At>& bsdf) {
        NumberOf<At> weight = splat<NumberOf<At>>(1);
        for (const MixFactor& factor : weighted.factors) {
            NumberOf<At> value = unit_range(at.number(factor.value));
            weight *= factor.rest ? 1.0 - value : value;
        }
        if (!any(weight > 0.0)) return;
        std::visit([&](const auto& closure) { if constexpr (requires { closure.add_to(bsdf, at, gray(weight)); }) closure.add_to(bsdf, at, gray(weight)); }, weighted.closure);
    }
    // The mean over images, and above 0 where these may be.
    static double mean_weight(const WeightedClosure& weighted, const std::vector<Texture>& textures) {
        constexpr double LEAST = 0.01;
        double weight = 1;
        for (const MixFactor& factor : weighted.factors) {
            double mean = unit_range(factor.value.mean(textures).x), value = factor.rest ? 1 - mean : mean;
            weight *= factor.value.varies() ? max(value, LEAST) : value;
        }
        return weight;
    }

    uint32_t kinds_ = 0, rough_kinds_ = 0;
    Vec3 mean_emission_;
    bool shines_evenly_ = true, transparent_ = false, bumped_ = false, varies_ = false, wide_ = true;
};

}  // namespace viewcam::VIEWCAM_ISA
