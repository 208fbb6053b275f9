// Diffuse reflection, Lambert's and rough; and light that is let through and spread as evenly on the other side.
//
// Rough surfaces are Oren and Nayar's, by Fujii's formulas, with what is reflected more than once (Portsmouth et al., EON: A Practical
// Energy-Preserving Rough Diffuse BRDF, JCGT 14, 2025).
#pragma once
#include "../textures.h"
#include "fresnel.h"
#include "sampling.h"

namespace viewcam::VIEWCAM_ISA {

template <class T> struct LambertOf {
    static constexpr RayKind KIND = DIFFUSE;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3Of<T> color, normal;

    // The share of light from a unit direction that is sent on, cosine included.
    Vec3Of<T> eval(Vec3Of<T> to_light) const { return color * pdf(to_light); }
    T pdf(Vec3Of<T> to_light) const { return max(dot(normal, to_light), T{}) / PI; }
    LobeSampleOf<T> sample(Vec2Of<T> u) const {
        T cosine;
        Vec3Of<T> direction = cosine_direction(normal, u, cosine);
        return {direction, color, cosine / PI};
    }
};
using Lambert = LambertOf<double>;

struct Translucent {
    static constexpr RayKind KIND = TRANSMISSION;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3 color, normal;

    double importance() const { return color.x + color.y + color.z; }
    Vec3 eval(Vec3 to_light) const { return color * pdf(to_light); }
    double pdf(Vec3 to_light) const { return max(-dot(normal, to_light), 0.0) / PI; }
    LobeSample sample(Vec2 u) const {
        double cosine;
        Vec3 direction = cosine_direction(-normal, u, cosine);
        return {direction, color, cosine / PI};
    }
};

template <class T> struct OrenNayarOf {
    static constexpr RayKind KIND = DIFFUSE;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3Of<T> color, normal, to_viewer;
    T a, b;
    Vec3Of<T> multiple;  // light that is reflected more than once, but for its factors of direction

    // albedo: of what is reflected once, which is not `color` where that has other factors. multiple: whether more counts.
    OrenNayarOf(Vec3Of<T> color, Vec3Of<T> normal, Vec3Of<T> to_viewer, T roughness, Vec3Of<T> albedo, bool multiple)
        : color(color), normal(normal), to_viewer(to_viewer) {
        a = 1.0 / (PI + roughness * (PI / 2 - 2.0 / 3)), b = roughness * a;
        if (!multiple) return;
        T mean = a * PI + (2 * PI - 5.6) / 3 * b, lost = (1.0 - albedo_under(max(dot(normal, to_viewer), T{}))) * mean / (1.0 - mean) / PI;
        auto kept = [&](T rho) -> T { return lost * rho * rho / (1.0 - rho * (1.0 - mean)); };
        Vec3Of<T> rho = unit_range(albedo);
        this->multiple = {kept(rho.x), kept(rho.y), kept(rho.z)};
    }

    T importance() const { return color.x + color.y + color.z; }
    Vec3Of<T> eval(Vec3Of<T> to_light) const {
        T light = max(dot(normal, to_light), T{}), viewer = max(dot(normal, to_viewer), T{});
        Mask<T> lit(light > 0.0);
        if (!any(lit)) return {};
        T t = dot(to_viewer, to_light) - light * viewer;
        t = select(Mask<T>(t > 0.0), t / max(light, viewer), t);
        return select(lit, color * ((gray(a + b * t) + multiple * (1.0 - albedo_under(light))) * light), Vec3Of<T>{});
    }
    T pdf(Vec3Of<T> to_light) const { return max(dot(normal, to_light), T{}) / PI; }
    LobeSampleOf<T> sample(Vec2Of<T> u) const {
        T cosine;
        Vec3Of<T> direction = cosine_direction(normal, u, cosine);
        return {direction, eval(direction) * (PI / cosine), cosine / PI};
    }

   private:
    // The share of light that comes under a cosine and is reflected once.
    T albedo_under(T cosine) const {
        T sine = sqrt(max(1.0 - cosine * cosine, T{}));
        T g = sine * (acos(cosine) - 2.0 / 3 - sine * cosine) + 2.0 / 3 * (sine / cosine) * (1.0 - sine * sine * sine);
        return select(Mask<T>(cosine < 1e-6), a * PI + b * (PI / 2 - 2.0 / 3 - cosine), a * PI + b * g);
    }
};
using OrenNayar = OrenNayarOf<double>;

}  // namespace viewcam::VIEWCAM_ISA
