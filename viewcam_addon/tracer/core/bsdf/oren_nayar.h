// Rough diffuse reflection: Oren and Nayar's, by Fujii's formulas, with what is reflected more than once (Portsmouth et al., EON: A
// Practical Energy-Preserving Rough Diffuse BRDF, JCGT 14, 2025).
#pragma once
#include "fresnel.h"
#include "lambert.h"

namespace viewcam::VIEWCAM_ISA {

struct OrenNayar {
    static constexpr RayKind KIND = DIFFUSE;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3 color, normal, to_viewer;
    double a, b;
    Vec3 multiple;  // of light that is reflected more than once, what depends on no direction

    // albedo: of what is reflected once, which is not `color` where that has other factors. multiple: whether more counts.
    OrenNayar(Vec3 color, Vec3 normal, Vec3 to_viewer, double roughness, Vec3 albedo, bool multiple)
        : color(color), normal(normal), to_viewer(to_viewer) {
        a = 1 / (PI + roughness * (PI / 2 - 2.0 / 3)), b = roughness * a;
        if (!multiple) return;
        double mean = a * PI + (2 * PI - 5.6) / 3 * b, lost = (1 - albedo_under(max(dot(normal, to_viewer), 0.0))) * mean / (1 - mean) / PI;
        auto kept = [&](double rho) { return lost * rho * rho / (1 - rho * (1 - mean)); };
        Vec3 rho = unit_range(albedo);
        this->multiple = {kept(rho.x), kept(rho.y), kept(rho.z)};
    }

    double importance() const { return color.x + color.y + color.z; }
    Vec3 eval(Vec3 to_light) const {
        double light = max(dot(normal, to_light), 0.0), viewer = max(dot(normal, to_viewer), 0.0);
        if (!(light > 0)) return {};
        double t = dot(to_viewer, to_light) - light * viewer;
        if (t > 0) t /= max(light, viewer);
        return color * ((grey(a + b * t) + multiple * (1 - albedo_under(light))) * light);
    }
    double pdf(Vec3 to_light) const { return max(dot(normal, to_light), 0.0) / PI; }
    LobeSample sample(Vec2 u) const {
        double cosine;
        Vec3 direction = cosine_direction(normal, u, cosine);
        return {direction, eval(direction) * (PI / cosine), cosine / PI};
    }

   private:
    // What is reflected once of light that comes under a cosine.
    double albedo_under(double cosine) const {
        if (cosine < 1e-6) return a * PI + b * (PI / 2 - 2.0 / 3 - cosine);
        double sine = std::sqrt(max(1 - cosine * cosine, 0.0));
        double g = sine * (acos(cosine) - 2.0 / 3 - sine * cosine) + 2.0 / 3 * (sine / cosine) * (1 - sine * sine * sine);
        return a * PI + b * g;
    }
};

}  // namespace viewcam::VIEWCAM_ISA
