// How much light rough surfaces scatter: looked up in tables, and what it means for light that is scattered more than once.
//
// A single scattering loses the light that facets catch from each other. Kulla and Conty (Revisiting Physically Based Shading at
// Imageworks, 2017) and Turquin (Practical Multiple Scattering Compensation for Microfacet Models, 2019) give it back: what a lobe
// scatters is multiplied by 1 + F (1 − E)/E, with E the share of light that leaves a surface without Fresnel's losses and F what
// is left of it after many scatterings. As in Cycles, so that the tables' nodes and what lies between are its own.
#pragma once
#include <algorithm>

#include "albedo_tables.h"
#include "fresnel.h"

namespace viewcam::VIEWCAM_ISA {

namespace detail {
struct Place {
    int index;
    double rest;
    Place(double x, int count) {
        double at = unit_range(x) * (count - 1);
        index = std::min(int(at), count - 2), rest = at - index;
    }
};
template <size_t N> double at(const float (&table)[N], Place x) { return mix(table[x.index], table[x.index + 1], x.rest); }
template <size_t N> double at(const float (&table)[N], Place x, Place y, int columns, int first = 0) {
    const float* rows = table + first + x.index * columns + y.index;
    return mix(mix(rows[0], rows[1], y.rest), mix(rows[columns], rows[columns + 1], y.rest), x.rest);
}
template <size_t N> double at(const float (&table)[N], Place z, Place x, Place y) {
    return mix(at(table, x, y, 16, z.index * 256), at(table, x, y, 16, (z.index + 1) * 256), z.rest);
}
// The fourth root of the reflectance: where the tables have an index of refraction.
inline double index_place(double ior) { return std::sqrt(std::fabs((ior - 1) / (ior + 1))); }
}  // namespace detail

// What facets scatter without Fresnel's losses: seen under a cosine, and the mean over all.
struct Albedo {
    double seen, mean;
};
inline Albedo ggx_albedo(double roughness, double cosine) {
    using namespace detail;
    return {at(albedo_tables::GGX, Place(cosine, 32), Place(roughness, 32), 32), at(albedo_tables::GGX_MEAN, Place(roughness, 32))};
}
// ratio: as of `fresnel`.
inline Albedo glass_albedo(double roughness, double cosine, double ratio) {
    using namespace detail;
    Place z(index_place(ratio < 1 ? 1 / ratio : ratio), 16), c(cosine, 16), r(roughness, 16);
    if (ratio < 1) return {at(albedo_tables::GLASS_INSIDE, z, c, r), at(albedo_tables::GLASS_INSIDE_MEAN, z, r, 16)};
    return {at(albedo_tables::GLASS, z, c, r), at(albedo_tables::GLASS_MEAN, z, r, 16)};
}
// The mean of a dielectric's `fresnel_progress`, and of Schlick's (1 − c)⁵, over the facets that are seen.
inline double fresnel_progress_seen(double ior, double roughness, double cosine) {
    using namespace detail;
    return at(albedo_tables::FRESNEL, Place(index_place(ior), 16), Place(cosine, 16), Place(roughness, 16));
}
inline double schlick_seen(double roughness, double cosine) {
    using namespace detail;
    return at(albedo_tables::SCHLICK, Place(cosine, 16), Place(roughness, 16), 16);
}

// What more than one scattering makes of a lobe whose mean Fresnel term is given: its albedo is multiplied by `albedo`, and the
// lobe itself by `lobe` on top of that.
struct MultipleScattering {
    Vec3 albedo = grey(1);
    double lobe = 1;

    static MultipleScattering of(Albedo single, Vec3 fresnel) {
        double lost = (1 - single.seen) / single.seen;
        auto kept = [&](double f) { return f == 1 ? 1 : (1 + f * single.mean / (1 - f * (1 - single.mean)) * lost) * single.seen; };
        return {{kept(fresnel.x), kept(fresnel.y), kept(fresnel.z)}, 1 / single.seen};
    }
};

}  // namespace viewcam::VIEWCAM_ISA
