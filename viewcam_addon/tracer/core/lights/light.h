// A light of any kind.
#pragma once
#include <concepts>
#include <optional>
#include <variant>

#include "environment.h"
#include "mesh.h"

namespace viewcam::VIEWCAM_ISA {

class Light {
   public:
    using Kind = LampOr<MeshLight, EnvironmentLight>;

    // hidden_from: the kinds of rays that don't see it; what a light hides from, it does not light. receivers: a bit that objects have
    // which it lights, Object::lit_by. shadow_rays: the kind of those that are sent to it.
    Light(Kind kind, uint32_t hidden_from, bool casts_shadow, uint64_t receivers = EVERYTHING, RayKind shadow_rays = SHADOW)
        : hidden_from(hidden_from), casts_shadow(casts_shadow), receivers(receivers), shadow_rays(shadow_rays), kind_(std::move(kind)),
          sized_(std::visit([](const auto& light) { return light.is_sized(); }, kind_)) {}

    uint32_t hidden_from;
    bool casts_shadow;
    bool multiple_importance = true;  // true if rays run into it, where it has a size
    uint64_t receivers;
    RayKind shadow_rays;
    uint32_t number = NONE;  // a lamp's, in the scene

    // part: one number more in [0, 1), of those that have parts.
    LightSample sample_li(const Interaction& from, double part, Vec2 u) const {
        LightSample sample = std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.sample_li(from, part, u); })
                    return light.sample_li(from, part, u);
                else
                    return light.sample_li(from, u);
            },
            kind_);
        if (emission_.varies() && !is_black(sample.weight)) sample.weight *= emission(from.position, sample.direction, sample.distance);
        return sample;
    }
    // Samples for some of four points, of which point_of(i) tells all.
    template <class PointOf>
    LightSampleOf<double4> sample_li(const SurfacePoint<double4>& from, const PointOf& point_of, unsigned lanes, double4 part, const Vec2x4& u) const {
        return std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.sample_li(from, u); })
                    if (!emission_.varies()) return light.sample_li(from, u);
                LightSampleOf<double4> samples;
                while (lanes) {
                    int i = take_bit(lanes);
                    samples.set(i, sample_li(point_of(i), part[i], {u.x[i], u.y[i]}));
                }
                return samples;
            },
            kind_);
    }
    // The radiance of a lamp that a ray runs into; surfaces that shine are met as all others are. distance: receives how far
    // away that is, where it is not at infinity.
    Vec3 le(const LightRay& ray, double& distance) const {
        Vec3 radiance = std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.le(ray, distance); })
                    return light.le(ray, distance);
                else
                    return Vec3{};
            },
            kind_);
        return emission_.varies() && !is_black(radiance) ? radiance * emission(ray.origin, ray.direction, distance, ray.start) : radiance;
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        return std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.pdf_li(from, direction); })
                    return light.pdf_li(from, direction);
                else
                    return 0.0;
            },
            kind_);
    }
    // With what nodes make of the light from its middle: all there is of what has no size.
    double estimate(Vec3 position, Vec3 normal) const {
        constexpr double LEAST_OF_SIZED = 0.1;
        double brought = std::visit([&](const auto& light) { return light.estimate(position, normal); }, kind_);
        if (!emission_.varies() || std::holds_alternative<Sun>(kind_)) return brought;
        Vec3 way = middle_ - position;
        double distance = length(way);
        if (!(brought > 0 && distance > 0)) return brought;
        return brought * max(mean(emission(position, way / distance, distance)), is_sized() ? LEAST_OF_SIZED : 0);
    }
    double irradiance() const {
        return std::visit(
            [](const auto& light) {
                if constexpr (requires { light.irradiance(); })
                    return light.irradiance();
                else
                    return 0.0;
            },
            kind_);
    }
    // None of what lies at infinity.
    std::optional<LightBounds> bounds() const {
        return std::visit(
            [](const auto& light) -> std::optional<LightBounds> {
                if constexpr (requires { light.bounds(); })
                    return light.bounds();
                else
                    return {};
            },
            kind_);
    }
    bool is_sized() const { return sized_; }
    const MeshLight* mesh() const { return std::get_if<MeshLight>(&kind_); }
    bool is_environment() const { return std::holds_alternative<EnvironmentLight>(kind_); }
    // The kinds of rays that are scattered all over and find it, too: diffuse ones see no lamps.
    uint32_t hit_by() const { return mesh() || is_environment() ? ~0u : is_sized() && multiple_importance ? ~uint32_t(DIFFUSE) : 0; }

    // Lets nodes change what a lamp gives, at each place of it and in each direction.
    void shine_by(const Color& emission, Vec3 middle, const Scene* scene) { emission_ = emission, middle_ = middle, scene_ = scene; }

   private:
    // The factor that nodes make of a lamp's light at a place that is seen from another, along a unit direction. A sun's place
    // is the way that its light goes, as in Cycles. start: from where on the way counts.
    Vec3 emission(Vec3 from, Vec3 ahead, double distance, double start = 0) const {
        Interaction point;
        point.position = distance < INFINITE ? from + ahead * distance : -ahead - scene_->origin;
        std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.normal(point.position, ahead); }) point.normal = point.shading = light.normal(point.position, ahead);
            },
            kind_);
        const Illumination& light = scene_->illumination;
        return ShadingPoint{point, ahead, light.textures, light.version, &light.nodes, nullptr, scene_->origin, nullptr, {.kind = NO_RAY, .length = distance - start}}.value(emission_);
    }

    Kind kind_;
    bool sized_;
    Color emission_;
    Vec3 middle_;
    const Scene* scene_ = nullptr;
};

// The members of each kind of light. One that rays run into has the density of being sampled there, or nothing would weigh the
// two against each other; one that lies at infinity has an irradiance everywhere, and any other has bounds.
template <class Kind>
concept IsLight = requires(const Kind& light, const Interaction& from, Vec3 v) {
    { light.estimate(v, v) } -> std::same_as<double>;
    { light.is_sized() } -> std::same_as<bool>;
    requires requires(Vec2 u) { { light.sample_li(from, u) } -> std::same_as<LightSample>; } ||
                 requires(double part, Vec2 u) { { light.sample_li(from, part, u) } -> std::same_as<LightSample>; };
    requires !requires(const LightRay& ray, double& distance) { light.le(ray, distance); } || requires { { light.pdf_li(from, v) } -> std::same_as<double>; };
    requires requires { { light.irradiance() } -> std::same_as<double>; } != requires { { light.bounds() } -> std::same_as<LightBounds>; };
};
template <class Kinds> constexpr bool ALL_ARE_LIGHTS = false;
template <class... Kinds> constexpr bool ALL_ARE_LIGHTS<std::variant<Kinds...>> = (IsLight<Kinds> && ...);
static_assert(ALL_ARE_LIGHTS<Light::Kind>);

// scene: whose nodes the lamp's emission is made by.
inline Light light_of(const Lamp& lamp, const Scene* scene = nullptr) {
    auto kind = std::visit([](const auto& alternative) -> Light::Kind { return alternative; }, lamp.kind);
    Light light(kind, lamp.hidden_from, lamp.casts_shadow, lamp.receivers, lamp.shadow_rays);
    light.multiple_importance = lamp.multiple_importance;
    if (scene) light.shine_by(lamp.emission, lamp.middle, scene);
    return light;
}

}  // namespace viewcam::VIEWCAM_ISA
