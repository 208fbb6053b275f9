// A light of any kind: one line a kind in the variant.
#pragma once
#include <optional>
#include <variant>

#include "area.h"
#include "environment.h"
#include "mesh.h"
#include "point.h"
#include "spot.h"
#include "sun.h"

namespace viewcam::VIEWCAM_ISA {

class Light {
   public:
    using Kind = std::variant<Sun, Point, Spot, Area, MeshLight, EnvironmentLight>;

    // hidden_from: the kinds of rays that don't see it; what a light hides from, it does not light. receivers: a bit that objects have
    // which it lights, Object::lit_by. shadow_rays: the kind of those that are sent to it.
    Light(Kind kind, uint32_t hidden_from, bool casts_shadow, uint64_t receivers = ~0ull, RayKind shadow_rays = SHADOW)
        : hidden_from(hidden_from), casts_shadow(casts_shadow), receivers(receivers), shadow_rays(shadow_rays), kind_(std::move(kind)) {}

    uint32_t hidden_from;
    bool casts_shadow;
    uint64_t receivers;
    RayKind shadow_rays;

    // part: one number more in [0, 1), of those that have parts.
    LightSample sample_li(const Interaction& from, double part, Vec2 u) const {
        return std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.sample_li(from, part, u); })
                    return light.sample_li(from, part, u);
                else
                    return light.sample_li(from, u);
            },
            kind_);
    }
    // What a ray sees of a lamp that it runs into; surfaces are met as all others are.
    Vec3 le(const LightRay& ray) const {
        return std::visit(
            [&](const auto& light) {
                if constexpr (requires { light.le(ray); })
                    return light.le(ray);
                else
                    return Vec3{};
            },
            kind_);
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
    double estimate(Vec3 position, Vec3 normal) const {
        return std::visit([&](const auto& light) { return light.estimate(position, normal); }, kind_);
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
    bool is_sized() const {
        return std::visit([](const auto& light) { return light.is_sized(); }, kind_);
    }
    const MeshLight* mesh() const { return std::get_if<MeshLight>(&kind_); }
    bool is_environment() const { return std::holds_alternative<EnvironmentLight>(kind_); }
    // Whether rays of a kind that are scattered all over find it, too: diffuse ones see no lamps.
    bool is_found_by(RayKind kind) const { return mesh() || is_environment() || (kind != DIFFUSE && is_sized()); }

   private:
    Kind kind_;
};

// A lamp in rendering space, whose origin is given in the world's. It must shine.
inline Light light_of(const Lamp& lamp, Vec3 origin) {
    Affine placed = lamp.to_world;
    placed.m[0][3] -= origin.x, placed.m[1][3] -= origin.y, placed.m[2][3] -= origin.z;
    auto kind = [&]() -> Light::Kind {
        switch (lamp.kind) {
            case Lamp::SUN: return Sun({placed.m[0][2], placed.m[1][2], placed.m[2][2]}, lamp.color, lamp.angle);
            case Lamp::POINT: return Point(placed.translation(), lamp.color, lamp.radius, lamp.soft);
            case Lamp::SPOT: return Spot(placed, lamp.color, lamp.radius, lamp.soft, lamp.angle, lamp.blend);
            default: return Area(placed, lamp.color, lamp.size, lamp.kind == Lamp::ELLIPSE, lamp.angle);
        }
    };
    return {kind(), lamp.hidden_from, lamp.casts_shadow, lamp.receivers, lamp.shadow_rays};
}

}  // namespace viewcam::VIEWCAM_ISA
