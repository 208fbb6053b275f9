// The share of light that rough surfaces scatter, looked up in tables, and from it the light that is scattered more than once.
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
// Where numbers from 0 to 1 lie between the entries of a table.
template <class T> struct PlaceOf {
    std::conditional_t<std::is_same_v<T, double4>, int4, int> index;
    T rest;
    PlaceOf(T x, int count) {
        T at = unit_range(x) * double(count - 1);
        if constexpr (std::is_same_v<T, double4>) {
            index = __builtin_convertvector(at, int4);
            index = index < count - 2 ? index : int4{} + (count - 2);
            rest = at - __builtin_convertvector(index, double4);
        } else {
            index = std::min(int(at), count - 2), rest = at - index;
        }
    }
};
inline double entry(const float* table, int i) { return table[i]; }
inline double4 entry(const float* table, int4 i) { return double4{table[i[0]], table[i[1]], table[i[2]], table[i[3]]}; }
template <class T> T at(const float* table, const PlaceOf<T>& x) { return mix(entry(table, x.index), entry(table + 1, x.index), x.rest); }
// columns: of a table of two dimensions, or of each layer of one of three.
template <class T, class Index> T at(const float* table, const PlaceOf<T>& x, const PlaceOf<T>& y, int columns, Index first) {
    auto place = first + x.index * columns + y.index;
    return mix(mix(entry(table, place), entry(table + 1, place), y.rest), mix(entry(table + columns, place), entry(table + columns + 1, place), y.rest), x.rest);
}
template <class T> T at(const float* table, const PlaceOf<T>& x, const PlaceOf<T>& y, int columns) { return at(table, x, y, columns, decltype(x.index){}); }
template <class T> T at(const float* table, const PlaceOf<T>& z, const PlaceOf<T>& x, const PlaceOf<T>& y) {
    auto layer = z.index * 256;
    return mix(at(table, x, y, 16, layer), at(table + 256, x, y, 16, layer), z.rest);
}
// The fourth root of the reflectance: where the tables have an index of refraction.
template <class T> inline T index_place(T ior) { return sqrt(abs((ior - 1.0) / (ior + 1.0))); }
}  // namespace detail

// The albedo of facets without Fresnel's losses: seen under a cosine, and the mean over all.
template <class T> struct AlbedoOf {
    T seen, mean;
};
template <class T> inline AlbedoOf<T> ggx_albedo(T roughness, T cosine) {
    using namespace detail;
    PlaceOf<T> r(roughness, 32);
    return {at(albedo_tables::GGX, PlaceOf<T>(cosine, 32), r, 32), at(albedo_tables::GGX_MEAN, r)};
}
// ratio: as of `fresnel`.
inline AlbedoOf<double> glass_albedo(double roughness, double cosine, double ratio) {
    using namespace detail;
    PlaceOf<double> z(index_place(ratio < 1 ? 1 / ratio : ratio), 16), c(cosine, 16), r(roughness, 16);
    if (ratio < 1) return {at(albedo_tables::GLASS_INSIDE, z, c, r), at(albedo_tables::GLASS_INSIDE_MEAN, z, r, 16)};
    return {at(albedo_tables::GLASS, z, c, r), at(albedo_tables::GLASS_MEAN, z, r, 16)};
}
// The mean of a dielectric's `fresnel_progress`, and of Schlick's (1 − c)⁵, over the facets that are seen.
template <class T> inline T fresnel_progress_seen(T ior, T roughness, T cosine) {
    using namespace detail;
    return at(albedo_tables::FRESNEL, PlaceOf<T>(index_place(ior), 16), PlaceOf<T>(cosine, 16), PlaceOf<T>(roughness, 16));
}
inline double schlick_seen(double roughness, double cosine) {
    using namespace detail;
    return at(albedo_tables::SCHLICK, PlaceOf<double>(cosine, 16), PlaceOf<double>(roughness, 16), 16);
}

// The gain of a lobe by further scatterings, from its mean Fresnel term: its albedo is multiplied by `albedo`, and the lobe
// itself by `lobe` on top of that.
template <class T> struct MultipleScatteringOf {
    Vec3Of<T> albedo = gray(splat<T>(1));
    T lobe = splat<T>(1);

    static MultipleScatteringOf of(AlbedoOf<T> single, Vec3Of<T> fresnel) {
        T lost = (1.0 - single.seen) / single.seen;
        auto kept = [&](T f) {
            return select(Mask<T>(f == 1.0), splat<T>(1), (1.0 + f * single.mean / (1.0 - f * (1.0 - single.mean)) * lost) * single.seen);
        };
        return {{kept(fresnel.x), kept(fresnel.y), kept(fresnel.z)}, 1.0 / single.seen};
    }
};
using MultipleScattering = MultipleScatteringOf<double>;

}  // namespace viewcam::VIEWCAM_ISA
