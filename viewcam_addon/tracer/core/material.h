// What surfaces are made of: closures, each with a weight, that become the lobes of a BSDF where a path meets them.
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
    bool on_tangents = false;  // whether its inputs ask for the tangents of a UV map
};

struct Material {
    std::vector<WeightedClosure> closures;
    bool transparent_shadow = true;  // whether shadow rays, too, go through what is transparent
    Color normal;                    // what it has in place of the smooth one, on which those of its closures stand; black: none
    bool normal_on_tangents = false; // whether that asks for the tangents of a UV map

    // The kinds of rays that its lobes scatter.
    uint32_t kinds() const { return kinds_; }
    // Those among them that are scattered all over, but not as diffuse light is.
    uint32_t rough_kinds() const { return rough_kinds_; }
    bool scatters() const { return kinds_; }
    bool emits() const { return !is_black(mean_emission_); }
    // Whether it may let light straight through.
    bool is_transparent() const { return transparent_; }
    // Whether it has normals of its own.
    bool is_bumped() const { return bumped_; }
    // The colour of what is nothing but Lambert's reflection of one colour, else black.
    Vec3 matte_color() const {
        auto diffuse = closures.size() == 1 ? std::get_if<DiffuseClosure>(&closures[0].closure) : nullptr;
        bool is_matte = diffuse && closures[0].factors.empty() && !bumped_ && !VIEWCAM_ISA::is_bumped(normal) && !diffuse->color.varies() && diffuse->roughness.is_black();
        return is_matte ? diffuse->color.rgb : Vec3{};
    }
    // Whether it asks for the tangents of a UV map.
    bool needs_tangents() const {
        return normal_on_tangents || std::any_of(closures.begin(), closures.end(), [](const WeightedClosure& one) { return one.on_tangents; });
    }
    // About what it gives off, black only where it gives off nothing; and whether that is what it gives off everywhere.
    Vec3 mean_emission() const { return mean_emission_; }
    bool shines_evenly() const { return shines_evenly_; }

    // To be called when all closures are there.
    void prepare(const std::vector<Texture>& textures) {
        for (const WeightedClosure& one : closures)
            std::visit(
                [&](const auto& closure) {
                    uint32_t kinds = closure.KINDS;
                    if constexpr (requires { closure.kinds(); }) kinds = closure.kinds();
                    kinds_ |= kinds;
                    if constexpr (requires { closure.is_rough(); })
                        if (closure.is_rough()) rough_kinds_ |= kinds & ~DIFFUSE;
                    if constexpr (requires { closure.normal; }) bumped_ |= VIEWCAM_ISA::is_bumped(closure.normal);
                    if constexpr (requires { closure.coat_normal; }) bumped_ |= VIEWCAM_ISA::is_bumped(closure.coat_normal);
                    if constexpr (requires { closure.lets_through(); }) transparent_ |= closure.lets_through();
                    if constexpr (requires { closure.mean_emission(textures); }) {
                        mean_emission_ += closure.mean_emission(textures) * mean_weight(one, textures);
                        shines_evenly_ &= closure.shines_evenly() && std::none_of(one.factors.begin(), one.factors.end(), [](const MixFactor& factor) { return factor.value.varies(); });
                    }
                },
                one.closure);
    }

    BSDF bsdf(const ShadingPoint& at) const {
        BSDF bsdf;
        // What is no plain diffuse surface has its smooth normals bent, too (specular_normal).
        if (bumped_ || (kinds_ != DIFFUSE && !is_black(at.point.shading - at.point.normal))) bsdf.bump({at.point.shading, at.version >= CYCLES_4_3, at.version >= CYCLES_5_0});
        for (const WeightedClosure& one : closures) add(one, at, bsdf);
        return bsdf;
    }
    Vec3 emission(const ShadingPoint& at) const {
        BSDF bsdf;
        for (const WeightedClosure& one : closures)
            std::visit(
                [&](const auto& closure) {
                    if constexpr (requires { closure.mean_emission(at.textures); }) add(one, at, bsdf);
                },
                one.closure);
        return bsdf.emission();
    }

   private:
    static void add(const WeightedClosure& one, const ShadingPoint& at, BSDF& bsdf) {
        Vec3 weight{1, 1, 1};
        for (const MixFactor& factor : one.factors) {
            double value = unit_range(at.number(factor.value));
            weight *= factor.rest ? 1 - value : value;
        }
        if (weight.x > 0) std::visit([&](const auto& closure) { closure.add_to(bsdf, at, weight); }, one.closure);
    }
    // The mean over images, and above 0 where these may be.
    static double mean_weight(const WeightedClosure& one, const std::vector<Texture>& textures) {
        constexpr double LEAST = 0.01;
        double weight = 1;
        for (const MixFactor& factor : one.factors) {
            double mean = unit_range(factor.value.mean(textures).x), value = factor.rest ? 1 - mean : mean;
            weight *= factor.value.varies() ? max(value, LEAST) : value;
        }
        return weight;
    }

    uint32_t kinds_ = 0, rough_kinds_ = 0;
    Vec3 mean_emission_;
    bool shines_evenly_ = true, transparent_ = false, bumped_ = false;
};

}  // namespace viewcam::VIEWCAM_ISA
