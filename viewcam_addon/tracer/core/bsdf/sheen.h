// Sheen, what stands off from cloth: microfibers, and Ashikhmin's older velvet.
//
// Microfibers scatter a cosine that is transformed by a matrix of two numbers (Zeltner, Burley and Chiang, Practical
// Multiple-Scattering Sheen Using Linearly Transformed Cosines, 2022). Velvet: Ashikhmin and Premoze, Distribution-based BRDFs (2007),
// with the shadowing of Ashikhmin, Premoze and Shirley (2000), as Cycles has it.
#pragma once
#include "albedo.h"
#include "microfacet.h"
#include "sheen_table.h"

namespace viewcam::VIEWCAM_ISA {

struct SheenLobe {
    static constexpr RayKind KIND = DIFFUSE;
    static constexpr bool DELTA = false, IS_DIFFUSE = true;
    Vec3 color;  // the albedo
    Frame frame; // x towards the viewer
    double a, b;

    // tint: of all that is scattered. A normal that is turned away from the viewer scatters as one that is seen edge-on.
    SheenLobe(Vec3 tint, Vec3 normal, Vec3 to_viewer, double roughness) : frame(frame_along(normal, to_viewer)) {
        constexpr double LEAST = 1e-5, SMOOTHEST = 1e-3;
        detail::PlaceOf<double> r(max(roughness, SMOOTHEST), 32), c(dot(normal, to_viewer), 32);
        a = detail::at(sheen_table::A, r, c, 32), b = detail::at(sheen_table::B, r, c, 32);
        double albedo = detail::at(sheen_table::ALBEDO, r, c, 32);
        color = std::fabs(a) < LEAST || albedo < LEAST ? Vec3{} : tint * albedo;
    }

    Vec3 eval(Vec3 to_light) const { return color * pdf(to_light); }
    double pdf(Vec3 to_light) const {
        Vec3 wo = frame.to_local(to_light);
        if (!(wo.z > 0)) return 0;
        double x = a * wo.x + b * wo.z, y = a * wo.y, size = x * x + y * y + wo.z * wo.z;
        return wo.z / PI * (a / size) * (a / size);
    }
    LobeSample sample(Vec2 u) const {
        double cosine;
        Vec3 plain = cosine_direction({0, 0, 1}, u, cosine);
        Vec3 direction = frame.to_world(normalize(Vec3{(plain.x - plain.z * b) / a, plain.y / a, plain.z}));
        return {direction, color, pdf(direction)};
    }
};

struct VelvetLobe {
    static constexpr RayKind KIND = DIFFUSE;  // and its light is glossy: so Cycles has it
    static constexpr bool DELTA = false, IS_DIFFUSE = false;
    Vec3 color, normal, to_viewer;
    double squared_slope;  // the fibers'

    VelvetLobe(Vec3 color, Vec3 normal, Vec3 to_viewer, double roughness) : color(color), normal(normal), to_viewer(to_viewer) {
        squared_slope = max(roughness, 0.01) * max(roughness, 0.01);
    }

    Vec3 eval(Vec3 to_light) const {
        constexpr double ALIKE = 1e-5;
        double in = dot(normal, to_viewer), out = dot(normal, to_light);
        if (!(in > 0 && out > 0)) return {};
        Vec3 h = normalize(to_viewer + to_light);
        double up = dot(normal, h), seen = std::fabs(dot(to_viewer, h));
        if (!(up < 1 - ALIKE && seen > ALIKE)) return {};
        double sine = 1 - up * up, d = exp(-up * up / sine / squared_slope) / (squared_slope * PI * sine * sine);
        double shadow = min(1.0, 2 * max(up / seen, ALIKE) * min(in, out));
        return color * (0.25 * d * shadow / in);
    }
    double pdf(Vec3 to_light) const { return dot(normal, to_light) > 0 ? 0.5 / PI : 0; }
    LobeSample sample(Vec2 u) const {
        double one_minus_cos;
        Vec3 direction = cone_direction(normal, 1, u, one_minus_cos);
        return {direction, eval(direction) * (2 * PI), 0.5 / PI};
    }
};

}  // namespace viewcam::VIEWCAM_ISA
