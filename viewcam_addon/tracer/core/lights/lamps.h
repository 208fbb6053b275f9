// Lamps: what gives light and is no surface. One class a kind, and its place in the list at the end.
//
// Each has a NAME, by which a scene asks for it, and is made of where it stands (its own space to rendering space, whose z a sun is
// seen towards), its color (the irradiance of a sun, the power of all others) and the numbers that its kind has, by their names in
// scene files. What it answers is in light_sample.h.
#pragma once
#include <variant>

#include "../closures/shading_point.h"
#include "light_sample.h"

namespace viewcam::VIEWCAM_ISA {

inline Vec3 column(const Affine& map, int k) { return {map.m[0][k], map.m[1][k], map.m[2][k]}; }

// Suns: discs of directions, or one direction each.
class Sun {
   public:
    static constexpr const char* NAME = "sun";

    // angle: of the disc's diameter, radians.
    Sun(const Affine& to_world, Vec3 irradiance, const Inputs& in) : towards_(column(to_world, 2)), irradiance_(irradiance) {
        double half = not_tiny(in.number("angle") / 2), sine = sin(half);
        half_chord_ = sin(half / 2);
        one_minus_cos_max_ = 2 * half_chord_ * half_chord_;
        radiance_ = half > 0 ? irradiance * (1 / (PI * sine * sine)) : Vec3{};
    }

    bool is_sized() const { return one_minus_cos_max_ > 0; }

    template <class T> LightSampleOf<T> sample_li(const SurfacePoint<T>&, Vec2Of<T> u) const {
        T one_minus_cos;
        Vec3Of<T> direction = splat<T>(towards_);
        if (one_minus_cos_max_ > 0) direction = cone_direction(direction, splat<T>(one_minus_cos_max_), u, one_minus_cos);
        // The weight is the radiance times 2π (1 − cos).
        return {direction, splat<T>(INFINITE), splat<T>(irradiance_ * (2 / (2 - one_minus_cos_max_))), splat<T>(pdf_li())};
    }
    double pdf_li(const Interaction&, Vec3) const { return pdf_li(); }

    Vec3 le(const LightRay& ray, double&) const {
        Vec3 apart = ray.direction - towards_;
        return ray.escaped && dot(apart, apart) <= 4 * half_chord_ * half_chord_ ? radiance_ : Vec3{};
    }

    Vec3 normal(Vec3, Vec3 ahead) const { return -ahead; }

    double estimate(Vec3, Vec3 normal) const {
        return risen(dot(normal, towards_), 1, std::sqrt(one_minus_cos_max_ * (2 - one_minus_cos_max_))) * mean(irradiance_);
    }
    double irradiance() const { return mean(irradiance_); }

   private:
    double pdf_li() const { return one_minus_cos_max_ > 0 ? 1 / (2 * PI * one_minus_cos_max_) : INFINITE; }

    Vec3 towards_, irradiance_, radiance_;
    double half_chord_, one_minus_cos_max_;  // half the disc's diameter
};

// Points: spheres that shine evenly, or, with a soft falloff, discs that face whatever they light.
//
// At the distance d a sphere of the radius R fills a cone of sin θ = R/d, a disc one of tan θ = R/d. Both have the radiance
// P/(4π² R²) and the solid angle 2π (1 − cos θ): R cancels. Inside a sphere light comes evenly from everywhere.
class Point {
   public:
    static constexpr const char* NAME = "point";

    Point(const Affine& to_world, Vec3 power, const Inputs& in)
        : center_(to_world.translation()), power_(power), radius_(not_tiny(in.number("radius"))), soft_(in.flag("soft_falloff")) {
        radiance_ = radius_ > 0 ? power / (4 * PI * PI * radius_ * radius_) : Vec3{};
    }

    bool is_sized() const { return radius_ > 0; }
    Vec3 radiance() const { return radiance_; }

    // True if light comes from everywhere at a place.
    template <class T> Mask<T> is_around(Vec3Of<T> place) const {
        if (soft_ || radius_ == 0) return Mask<T>{};
        Vec3Of<T> way = splat<T>(center_) - place;
        return Mask<T>(sqrt(dot(way, way)) <= radius_);
    }
    // 1 − cos of half the cone that the light fills, seen from outside.
    template <class T> T one_minus_cos_max(Vec3Of<T> place) const {
        Vec3Of<T> way = splat<T>(center_) - place;
        T to_edge = dot(way, way) + (soft_ ? radius_ * radius_ : 0.0);
        return select(Mask<T>(to_edge > 0.0), one_minus_cosine(min(radius_ * radius_ / to_edge, splat<T>(1))), T{});
    }

    template <class T> LightSampleOf<T> sample_li(const SurfacePoint<T>& from, Vec2Of<T> u) const {
        Vec3Of<T> way = splat<T>(center_) - from.position;
        T squared = dot(way, way), distance = sqrt(squared);
        Mask<T> apart(distance > 0.0);
        Vec3Of<T> axis = select(apart, way / distance, splat<T>(Vec3{0, 0, 1}));
        if (radius_ == 0) return {axis, distance, bounded(select(apart, 1.0 / (4 * PI * squared), T{}))};
        Mask<T> around = is_around(from.position);
        if (!any(around)) return sample_outside(from, u, axis, squared, distance);
        LightSampleOf<T> inside = sample_inside(from, u, way, squared);
        return all(around) ? inside : select<T>(around, inside, sample_outside(from, u, axis, squared, distance));
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        if (radius_ == 0) return INFINITE;
        if (is_around(from.position)) return max(dot(from.shading, direction), 0.0) / PI;
        return 1 / (2 * PI * one_minus_cos_max(from.position));
    }

    // True if a ray runs into the light. leaves: from inside, `only_outside` forbids what lies behind the middle.
    bool intersect(const LightRay& ray, bool only_ahead, double& distance) const {
        Vec3 way = center_ - ray.origin;
        double along = dot(way, ray.direction), squared = dot(way, way);
        if (soft_) {
            distance = squared / along;
            if (!(along > 0 && distance * distance - squared <= radius_ * radius_)) return false;
        } else {
            Vec3 aside = way - ray.direction * along;
            double root = radius_ * radius_ - dot(aside, aside);
            bool inside = squared <= radius_ * radius_;
            if (!(root >= 0 && (along > 0 || (inside && !only_ahead)))) return false;
            distance = along + (inside ? std::sqrt(root) : -std::sqrt(root));
        }
        return distance > ray.nearest && distance < ray.farthest;
    }
    Vec3 le(const LightRay& ray, double& distance) const { return radius_ > 0 && intersect(ray, false, distance) ? radiance_ : Vec3{}; }
    Vec3 normal(Vec3 place, Vec3 ahead) const {
        if (soft_ || radius_ == 0) return -ahead;
        Vec3 outward = normalize(place - center_);
        return dot(outward, ahead) > 0 ? -outward : outward;
    }

    double estimate(Vec3 position, Vec3 normal) const {
        Vec3 way = center_ - position;
        double distance = length(way), close = max(distance, radius_);
        if (!(distance + radius_ > 0)) return 0;
        return mean(power_) / (4 * PI * close * close) * risen(dot(normal, way), distance, radius_);
    }
    LightBounds bounds() const { return {box_around(center_, {radius_, radius_, radius_}), mean(power_) / (4 * PI)}; }

    Vec3 center() const { return center_; }
    double radius() const { return radius_; }
    bool is_soft() const { return soft_; }

   private:
    static constexpr double LEAST_COSINE = 1e-30;

    // way, axis: to the middle, and that of unit length; squared, distance: of the middle.
    template <class T> LightSampleOf<T> sample_inside(const SurfacePoint<T>& from, Vec2Of<T> u, Vec3Of<T> way, T squared) const {
        T cosine;
        Vec3Of<T> ahead = cosine_direction(from.shading, u, cosine);
        T along = dot(way, ahead), reached = along + sqrt(max(radius_ * radius_ - squared + along * along, T{}));
        return {ahead, reached, splat<T>(radiance_) * (PI / max(cosine, splat<T>(LEAST_COSINE))), cosine / PI};
    }
    template <class T> LightSampleOf<T> sample_outside(const SurfacePoint<T>& from, Vec2Of<T> u, Vec3Of<T> axis, T squared, T distance) const {
        T to_edge = squared + (soft_ ? radius_ * radius_ : 0.0), open = one_minus_cos_max(from.position), one_minus_cos;
        Vec3Of<T> ahead = cone_direction(axis, open, u, one_minus_cos);
        T along = distance * (1.0 - one_minus_cos), root = sqrt(max(radius_ * radius_ - squared * one_minus_cos * (2.0 - one_minus_cos), T{}));
        T reached = soft_ ? select(Mask<T>(along > 0.0), squared / along, T{}) : along - root;
        return {ahead, reached, bounded(select(Mask<T>(to_edge > 0.0), 1.0 / ((2.0 - open) * (2 * PI * to_edge)), T{})), 1.0 / (2 * PI * open)};
    }
    template <class T> Vec3Of<T> bounded(T factor) const { return splat<T>(power_) * min(factor, splat<T>(MOST_WEIGHT_OF_LIGHT)); }

    Vec3 center_, power_, radiance_;
    double radius_;
    bool soft_;
};

// Spots: points that shine into a cone, measured in their own space.
class Spot {
   public:
    static constexpr const char* NAME = "spot";

    // It shines along −z. angle: of the whole cone, radians. blend: 0 to 1, the part of the cone over which the light falls off.
    Spot(const Affine& to_world, Vec3 power, const Inputs& in) : point_(to_world, power, in) {
        constexpr double HARD_EDGE = 1e-30, SHEARED = 1e-9;
        double angle = in.number("angle");
        Vec3 x = column(to_world, 0), y = column(to_world, 1), z = column(to_world, 2);
        double determinant = dot(x, cross(y, z));
        inverse_[0] = cross(y, z) / determinant, inverse_[1] = cross(z, x) / determinant, inverse_[2] = cross(x, y) / determinant;
        axis_ = normalize(z);
        edge_ = cos(angle / 2);
        slope_ = 1 / max((1 - edge_) * in.number("blend"), HARD_EDGE);
        double askew = max(std::fabs(dot(x, y)), max(std::fabs(dot(y, z)), std::fabs(dot(z, x))));
        double longest = max(dot(x, x), max(dot(y, y), dot(z, z)));
        double wider = max(dot(x, x), dot(y, y)) / dot(z, z), tangent = sin(angle / 2) / edge_;
        one_minus_cos_max_ = askew > SHEARED * longest ? UNKNOWN : 1 - 1 / std::sqrt(1 + tangent * tangent * wider);
    }

    bool is_sized() const { return point_.is_sized(); }

    LightSample sample_li(const Interaction& from, Vec2 u) const {
        if (point_.is_around(from.position)) return point_.sample_li(from, u);
        LightSample sample = is_narrow(from.position) ? along_the_beam(from, u) : point_.sample_li(from, u);
        sample.weight *= attenuation(sample.direction);
        return sample;
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        if (is_sized() && !point_.is_around(from.position) && is_narrow(from.position)) return 1 / (2 * PI * one_minus_cos_max_);
        return point_.pdf_li(from, direction);
    }

    Vec3 le(const LightRay& ray, double& distance) const {
        if (!is_sized() || !point_.intersect(ray, true, distance)) return {};
        return point_.is_around(ray.origin) ? point_.radiance() : point_.radiance() * attenuation(ray.direction);
    }

    Vec3 normal(Vec3 place, Vec3 ahead) const { return point_.normal(place, ahead); }

    // Part of a sphere may be seen from where its middle is dark.
    double estimate(Vec3 position, Vec3 normal) const {
        constexpr double LEAST_OF_A_WIDE_SPOT = 0.05;
        Vec3 way = point_.center() - position;
        double distance = length(way), seen = distance > 0 ? attenuation(way / distance) : 0;
        return point_.estimate(position, normal) * max(seen, is_sized() ? LEAST_OF_A_WIDE_SPOT : 0);
    }
    LightBounds bounds() const {
        LightBounds bounds = point_.bounds();
        bounds.axis = -axis_, bounds.cos_normals = max(1 - one_minus_cos_max_, -1.0);
        return bounds;
    }

   private:
    static constexpr double UNKNOWN = 2;  // more than any sphere fills

    // The spot's share in a unit direction towards it.
    double attenuation(Vec3 ahead) const {
        double x = dot(inverse_[0], ahead), y = dot(inverse_[1], ahead), z = dot(inverse_[2], ahead);
        double rise = (z / std::sqrt(x * x + y * y + z * z) - edge_) * slope_;
        rise = rise > 0 ? min(rise, 1.0) : 0;
        return rise * rise * (3 - 2 * rise);
    }
    // True if the sphere is so large, or near, that the spot's cone is narrower than it looks.
    bool is_narrow(Vec3 place) const { return is_sized() && !point_.is_soft() && one_minus_cos_max_ < point_.one_minus_cos_max(place); }
    LightSample along_the_beam(const Interaction& from, Vec2 u) const {
        double one_minus_cos, radius = point_.radius();
        Vec3 way = point_.center() - from.position, ahead = cone_direction(axis_, one_minus_cos_max_, u, one_minus_cos);
        double along = dot(way, ahead), root = radius * radius - (dot(way, way) - along * along);
        Vec3 weight = root >= 0 && along > 0 ? point_.radiance() * (2 * PI * one_minus_cos_max_) : Vec3{};
        return {ahead, along - std::sqrt(max(root, 0.0)), weight, 1 / (2 * PI * one_minus_cos_max_)};
    }

    Point point_;
    Vec3 inverse_[3], axis_;        // axis: against the beam
    double edge_, slope_, one_minus_cos_max_;  // the latter: of half the opening of a cone about the axis that holds all light
};

// A rectangle parallel to the x-y plane, seen from the origin: points of it spread evenly over the solid angle that it fills.
template <class T> class SphericalRectangle {
   public:
    // depth: of the plane, of either sign.
    SphericalRectangle(T x0, T x1, T y0, T y1, T depth)
        : x0_(x0), x1_(x1), y0_(y0), y1_(y1), depth_(depth), squared_(depth * depth) {
        // The depth components of the unit normals of the planes through the origin and each side; the others are 0 in pairs.
        bottom_ = -y0 / sqrt(squared_ + y0 * y0), top_ = y1 / sqrt(squared_ + y1 * y1);
        T right = x1 / sqrt(squared_ + x1 * x1), left = -x0 / sqrt(squared_ + x0 * x0);
        behind_ = asin(top_ * left) + asin(left * bottom_);
        angle_ = asin(bottom_ * right) + asin(right * top_) + behind_;
    }
    T solid_angle() const { return max(angle_, T{}); }
    Vec2Of<T> point(Vec2Of<T> u) const {
        // From here on x, that part of the angle is to the left of it which u asks for.
        SinCosOf<T> turn = sincos_of_turns((u.x * angle_ - behind_) * (0.5 / PI));
        T rest = turn.cos * bottom_ + top_;
        T slope = sqrt(max(rest * rest - turn.sin * turn.sin * (squared_ / (squared_ + y0_ * y0_)), T{}));
        T x = min(max(copysign(depth_, rest) * turn.sin / slope, x0_), x1_);
        // With x known, y spreads as the sine of its elevation.
        T squared = x * x + squared_, low = y0_ / sqrt(squared + y0_ * y0_), high = y1_ / sqrt(squared + y1_ * y1_);
        T elevation = low + u.y * (high - low), y = elevation * sqrt(squared / max(1.0 - elevation * elevation, T{}));
        return {x, min(max(y, y0_), y1_)};
    }

   private:
    T x0_, x1_, y0_, y1_, depth_, squared_, bottom_, top_, behind_, angle_;
};

// Area lights: rectangles and ellipses that shine to one side, into all of it or, as through the slats of a grid, into a cone.
//
// From afar a light is sampled by its area. A rectangle that is near, or seen at a slant, is sampled evenly over the solid angle
// it fills (Ureña, Fajardo and King, An Area-Preserving Parametrization for Spherical Rectangles, 2013), which takes longer and
// is less noisy there. That angle is a sum known to 10⁻¹⁵ only, so rectangles that fill less than 10⁻⁶ are sampled by their area
// again, and so are those that shear has made parallelograms. An ellipse that is near, where sampling its area would be
// unbounded, is sampled as the rectangle round it, of which a fifth is dark.
class Area {
   public:
    static constexpr const char* NAME = "area";

    // It lies in its x-y plane and shines along −z. size: of its sides there. spread: the angle of the cone, radians; π where there
    // is no grid.
    Area(const Affine& to_world, Vec3 power, const Inputs& in) : center_(to_world.translation()), power_(power), ellipse_(in.flag("ellipse")) {
        constexpr double ASKEW = 1e-9, NARROW = 0.05;
        double spread = in.number("spread");
        Vec3 size = in["size"].rgb;
        if (spread < PI) {
            double half = spread / 2;
            cos_spread_ = cos(half), tan_spread_ = sin(half) / cos_spread_;
            focus_ = half > NARROW ? 1 / (tan_spread_ - half) : 3 / (half * half * half);  // as Cycles has it: 0.1 % apart where they meet
        }
        Vec3 x = column(to_world, 0) * (size.x / 2), y = column(to_world, 1) * (size.y / 2);
        double area = 4 * length(cross(x, y)) * (ellipse_ ? PI / 4 : 1);
        if (ellipse_) find_half_axes(x, y);
        lengths_[0] = length(x), lengths_[1] = length(y);
        first_ = x / lengths_[0], second_ = y / lengths_[1];
        Vec3 normal = cross(first_, second_);
        sine_ = length(normal);
        normal_ = normal * std::copysign(1 / sine_, -dot(normal, column(to_world, 2)));
        radiance_ = power / (PI * area), area_ = area;
        reach_ = std::sqrt(lengths_[0] * lengths_[0] + lengths_[1] * lengths_[1]);
        askew_ = !ellipse_ && std::fabs(dot(first_, second_)) > ASKEW;
    }

    bool is_sized() const { return true; }

    template <class T> LightSampleOf<T> sample_li(const SurfacePoint<T>& from, Vec2Of<T> u) const {
        Vec3Of<T> way = splat<T>(center_) - from.position;
        Mask<T> near = is_near(way);
        if (!any(near)) return sample_area(way, u);
        SphericalRectangle<T> seen = rectangle(way);
        T angle = seen.solid_angle();
        if (!ellipse_) near = Mask<T>(near & Mask<T>(angle >= SMALLEST_ANGLE));
        LightSampleOf<T> sample = sample_angle(way, seen.point(u), angle);
        return all(near) ? sample : select<T>(near, sample, sample_area(way, u));
    }
    double pdf_li(const Interaction& from, Vec3 direction) const {
        Vec3 way = center_ - from.position;
        if (is_near(way)) {
            double angle = rectangle(way).solid_angle();
            if (ellipse_ || angle >= SMALLEST_ANGLE) return 1 / angle;
        }
        double cosine = -dot(normal_, direction), distance = -dot(normal_, way) / cosine;
        return cosine > 0 ? distance * distance / (cosine * area_) : 0;
    }

    Vec3 le(const LightRay& ray, double& distance) const {
        double facing = dot(normal_, ray.direction);
        Vec3 way = center_ - ray.origin;
        distance = dot(normal_, way) / facing;
        if (!(facing < 0 && distance > ray.nearest && distance < ray.farthest)) return {};
        // Each coordinate along the direction that the other side is perpendicular to: the sides may be askew.
        Vec3 place = ray.direction * distance - way, plane = cross(first_, second_) / (sine_ * sine_);
        double across = dot(cross(second_, plane), place) / lengths_[0], along = dot(cross(plane, first_), place) / lengths_[1];
        return covers(across, along) ? radiance_ * through_grid(-facing) : Vec3{};
    }

    Vec3 normal(Vec3, Vec3) const { return normal_; }

    double estimate(Vec3 position, Vec3 normal) const {
        Vec3 way = center_ - position;
        double before = -dot(way, normal_), squared = dot(way, way), farthest = std::sqrt(squared) + reach_;
        if (!(before > 0)) return 0;
        double light = max(dot(normal, way) + reach_, 0.0) * (before + reach_);  // two cosines, as of `risen`
        double aside = max(std::sqrt(max(squared - before * before, 0.0)) - reach_, 0.0);  // the least distance aside of any part of it
        double most = through_grid(before / std::sqrt(before * before + aside * aside));
        return light * most * (mean(power_) / PI / (farthest * farthest * (squared + reach_ * reach_ / 2)));
    }
    LightBounds bounds() const {
        double most = mean(power_) / PI * through_grid(1.0);
        return {box_around(center_, abs(first_) * lengths_[0] + abs(second_) * lengths_[1]), most, normal_, 1, cos_spread_};
    }

   private:
    // FAR: how many times its longer half axis a light is away where cos/distance² varies less over it than an ellipse's dark
    // fifth costs. SLANT: by which part of its distance the ends of a rectangle may be farther off than its middle there.
    static constexpr double SMALLEST_ANGLE = 1e-6, FAR = 3, SLANT = 0.2;

    // The half axes of a circle that a map with these columns has made an ellipse, the longer one first: Jacobi's rotation.
    static void find_half_axes(Vec3& x, Vec3& y) {
        double angle = 0.5 * atan2(2 * dot(x, y), dot(x, x) - dot(y, y));
        Vec3 first = x * cos(angle) + y * sin(angle), second = y * cos(angle) - x * sin(angle);
        x = first, y = second;
    }

    template <class T> Mask<T> is_near(Vec3Of<T> way) const {
        if (askew_) return Mask<T>{};
        double longest = FAR * max(lengths_[0], lengths_[1]);
        T squared = dot(way, way);
        Mask<T> close(squared < longest * longest);
        if (ellipse_ || all(close)) return close;
        T across = dot(splat<T>(first_), way), along = dot(splat<T>(second_), way);
        return Mask<T>(close | Mask<T>(abs(across) * lengths_[0] + abs(along) * lengths_[1] > SLANT * squared));
    }
    template <class T> SphericalRectangle<T> rectangle(Vec3Of<T> way) const {
        T x = dot(splat<T>(first_), way), y = dot(splat<T>(second_), way);
        return {x - lengths_[0], x + lengths_[0], y - lengths_[1], y + lengths_[1], dot(splat<T>(normal_), way)};
    }
    // place: in the plane of the light, from below the point, as its solid angle was sampled.
    template <class T> LightSampleOf<T> sample_angle(Vec3Of<T> way, Vec2Of<T> place, T angle) const {
        T depth = dot(splat<T>(normal_), way), distance = sqrt(place.x * place.x + place.y * place.y + depth * depth);
        Vec3Of<T> ahead = (splat<T>(first_) * place.x + splat<T>(second_) * place.y + splat<T>(normal_) * depth) / distance;
        T across = (place.x - dot(splat<T>(first_), way)) / lengths_[0], along = (place.y - dot(splat<T>(second_), way)) / lengths_[1];
        Mask<T> lit(depth < 0.0);
        if (ellipse_) lit = Mask<T>(lit & covers(across, along));
        T cosine = -dot(splat<T>(normal_), ahead);
        return {ahead, distance, select(lit, splat<T>(radiance_) * (angle * through_grid(cosine)), Vec3Of<T>{}), 1.0 / angle, cosine};
    }
    template <class T> LightSampleOf<T> sample_area(Vec3Of<T> way, Vec2Of<T> u) const {
        T across = 2.0 * u.x - 1.0, along = 2.0 * u.y - 1.0;
        if (ellipse_) {
            SinCosOf<T> turn = sincos_of_turns(u.y);
            T radius = sqrt(u.x);
            across = radius * turn.cos, along = radius * turn.sin;
        }
        Vec3Of<T> to = way + splat<T>(first_) * (lengths_[0] * across) + splat<T>(second_) * (lengths_[1] * along);
        T squared = dot(to, to), distance = sqrt(squared);
        Vec3Of<T> ahead = to / distance;
        T cosine = max(-dot(splat<T>(normal_), ahead), T{});
        T weight = min(cosine / (PI * squared), splat<T>(MOST_WEIGHT_OF_LIGHT)) * through_grid(cosine);
        return {ahead, distance, splat<T>(power_) * weight, squared / (cosine * area_), cosine};
    }
    // The share of the light by the cosine of the angle at which it leaves: it falls off as the part that the grid's slats leave free, and
    // all of it together stays what it is without a grid (Blender D10594).
    template <class T> T through_grid(T cosine) const {
        if (focus_ == 0) return splat<T>(1);
        T free = max(tan_spread_ - sqrt(max(1.0 - cosine * cosine, T{})) / cosine, T{}) * focus_;
        return select(Mask<T>(cosine > cos_spread_), free, T{});
    }
    // Coordinates −1 to 1 along the half sides.
    template <class T> Mask<T> covers(T across, T along) const {
        return ellipse_ ? Mask<T>(across * across + along * along <= 1.0) : Mask<T>(Mask<T>(abs(across) <= 1.0) & Mask<T>(abs(along) <= 1.0));
    }

    Vec3 center_, power_, radiance_, first_, second_, normal_;  // half sides, unit; normal: to where it shines
    double lengths_[2], sine_, reach_, area_;
    double cos_spread_ = 0, tan_spread_ = 0, focus_ = 0;  // half the cone; focus: 0 without a grid
    bool ellipse_, askew_;
};

// A lamp of any kind, or one of other lights.
template <class... Others> using LampOr = std::variant<Sun, Point, Spot, Area, Others...>;

}  // namespace viewcam::VIEWCAM_ISA
