// Suns: discs of directions, or one direction each.
#pragma once
#include "light_sample.h"

namespace viewcam::VIEWCAM_ISA {

class Sun {
   public:
    // towards: unit. angle: diameter, radians.
    Sun(Vec3 towards, Vec3 irradiance, double angle) : towards_(towards), irradiance_(irradiance) {
        double half = not_tiny(angle / 2), sine = sin(half);
        half_chord_ = sin(half / 2);
        spread_ = 2 * half_chord_ * half_chord_;
        radiance_ = half > 0 ? irradiance * (1 / (PI * sine * sine)) : Vec3{};
    }

    bool is_sized() const { return spread_ > 0; }

    LightSample sample_li(const Interaction&, Vec2 u) const {
        double short_of;
        Vec3 direction = spread_ > 0 ? cone_direction(towards_, spread_, u, short_of) : towards_;
        return {direction, INFINITE, irradiance_ * (2 / (2 - spread_)), pdf_li()};  // the radiance times 2π (1 − cos)
    }
    double pdf_li(const Interaction&, Vec3) const { return pdf_li(); }

    Vec3 le(const LightRay& ray, double&) const {
        Vec3 apart = ray.direction - towards_;
        return ray.escaped && dot(apart, apart) <= 4 * half_chord_ * half_chord_ ? radiance_ : Vec3{};
    }

    Vec3 normal(Vec3, Vec3 ahead) const { return -ahead; }

    double estimate(Vec3, Vec3 normal) const {
        return risen(dot(normal, towards_), 1, std::sqrt(spread_ * (2 - spread_))) * mean(irradiance_);
    }
    double irradiance() const { return mean(irradiance_); }

   private:
    double pdf_li() const { return spread_ > 0 ? 1 / (2 * PI * spread_) : INFINITE; }

    Vec3 towards_, irradiance_, radiance_;
    double half_chord_, spread_;  // of half the disc's diameter; spread: 1 − cos
};

}  // namespace viewcam::VIEWCAM_ISA
