// Writes albedo_tables.h: how much light rough surfaces scatter, by quadrature over the facets that a viewer sees.
//
// make_albedo_tables [POINTS] > albedo_tables.h         POINTS: of Gauss and Legendre along each axis; 96 take two minutes.
//
// Half of the facets that a viewer sees, the other half being its mirror image, lie on the stretched hemisphere about him: at
// h = sin b t1 + cos b (cos g t2 + sin g v), with v towards the stretched viewer and t2 in the plane of reflection, by a density
// that is in proportion to cos² b sin g. Along g the integrand has edges, where a reflection meets the horizon and where all is
// reflected: each row is cut there.
//
// The tables' contents and nodes are Cycles' own, so that what lies between them is interpolated alike: roughness and cosine
// i/(n − 1), at least 1e-4, the index of refraction by the fourth root z of its reflectance, at most 0.99. In the tables of
// glass, refractions count even where a facet sends them up; in those of Fresnel curves nothing is hidden.
#define VIEWCAM_ISA tables
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "fresnel.h"
#include "microfacet.h"

using namespace viewcam::tables;

namespace {

struct Quadrature {
    std::vector<double> x, weight;  // on [0, 1]

    explicit Quadrature(int n) : x(n), weight(n) {
        for (int i = 0; i < n; i++) {
            double root = std::cos(PI * (i + 0.75) / (n + 0.5)), slope = 0;
            for (int step = 0; step < 50; step++) {
                double before = 1, value = root;
                for (int k = 2; k <= n; k++) {
                    double next = ((2 * k - 1) * root * value - (k - 1) * before) / k;
                    before = value, value = next;
                }
                slope = n * (root * value - before) / (root * root - 1);
                root -= value / slope;
            }
            x[i] = (1 + root) / 2, weight[i] = 1 / ((1 - root * root) * slope * slope);
        }
    }
};

struct Viewer {
    Microfacets facets;
    Vec3 wi;
};
using Scattered = std::function<double(const Viewer&, Vec3 h)>;

double reflected_rise(Vec3 wi, Vec3 h) { return 2 * dot(wi, h) * h.z - wi.z; }

// The mean of what facets scatter over those that a viewer sees. critical: the cosine at which all begins to be reflected.
double mean(const Quadrature& points, double roughness, double cosine, double critical, const Scattered& scattered) {
    double alpha = roughness * roughness;
    Viewer viewer{{alpha, alpha}, {std::sqrt(std::max(1 - cosine * cosine, 0.0)), 0, cosine}};
    if (alpha * alpha <= 2e-10) return scattered(viewer, {0, 0, 1});
    Vec3 v = normalize(Vec3{alpha * viewer.wi.x, 0, viewer.wi.z}), t1{0, 1, 0}, t2 = cross(v, t1);
    double share = 0.5 * (1 + v.z), most = std::acos(1 - 2 * share), sum = 0;
    int rows = int(points.x.size());
    for (int row = 0; row < rows; row++) {
        double b = points.x[row] * PI / 2, sin_b = std::sin(b), cos_b = std::cos(b), of_row = 0;
        auto facet = [&](double g) {
            Vec3 h = t1 * sin_b + t2 * (cos_b * std::cos(g)) + v * (cos_b * std::sin(g));
            return normalize(Vec3{alpha * h.x, alpha * h.y, std::max(h.z, 1e-300)});
        };
        std::vector<double> cuts{0, most};
        auto cut = [&](auto&& above) {
            int steps = 4 * rows;
            for (int i = 0; i < steps; i++) {
                double low = most * i / steps, high = most * (i + 1) / steps;
                bool start = above(facet(low));
                if (above(facet(high)) == start) continue;
                for (int k = 0; k < 45; k++) {
                    double middle = (low + high) / 2;
                    (above(facet(middle)) == start ? low : high) = middle;
                }
                cuts.push_back((low + high) / 2);
            }
        };
        cut([&](Vec3 h) { return reflected_rise(viewer.wi, h) > 0; });
        if (critical > 0) cut([&](Vec3 h) { return dot(viewer.wi, h) > critical; });
        std::sort(cuts.begin(), cuts.end());
        for (size_t piece = 0; piece + 1 < cuts.size(); piece++) {
            double from = cuts[piece], width = cuts[piece + 1] - from;
            for (int i = 0; i < rows; i++) {
                double g = from + width * points.x[i];
                of_row += width * points.weight[i] * std::sin(g) * scattered(viewer, facet(g));
            }
        }
        sum += points.weight[row] * PI / 2 * cos_b * cos_b * of_row;
    }
    return sum * 2 / (PI * share);
}

// The share of a facet's light that is not hidden on its way out. rise: the sine of that way above or below the surface.
double seen(const Viewer& viewer, double rise) {
    double squared = viewer.facets.alpha_x * viewer.facets.alpha_x * std::max(1 / (rise * rise) - 1, 0.0);
    double in = viewer.facets.lambda(viewer.wi), out = 0.5 * (std::sqrt(1 + squared) - 1);
    return (1 + in) / (1 + in + out);
}

double mirror(const Viewer& viewer, Vec3 h) {
    double rise = reflected_rise(viewer.wi, h);
    return rise > 0 ? seen(viewer, rise) : 0;
}

Scattered glass(double ratio) {
    return [ratio](const Viewer& viewer, Vec3 h) {
        double cosine = dot(viewer.wi, h), reflected = fresnel(cosine, ratio), sum = reflected * mirror(viewer, h);
        if (!(reflected < 1)) return sum;
        double far = std::sqrt(ratio * ratio - 1 + cosine * cosine) / ratio, rise = (cosine / ratio - far) * h.z - viewer.wi.z / ratio;
        return sum + (1 - reflected) * (std::fabs(ratio - 1) < 1e-4 ? 1 : seen(viewer, rise ? rise : 1e-30));
    };
}

Scattered curve(double ior) {
    return [ior](const Viewer& viewer, Vec3 h) {
        if (!(reflected_rise(viewer.wi, h) > 0) || ior == 1) return 0.0;
        return fresnel_progress(fresnel(dot(viewer.wi, h), ior), ior);
    };
}

// Schlick's power of five, as Cycles has it half-way between the neighbors of its table.
double schlick(const Viewer& viewer, Vec3 h) {
    if (!(reflected_rise(viewer.wi, h) > 0)) return 0;
    double sine = 1 - dot(viewer.wi, h), sum = 0;
    for (int node : {7, 8}) {
        double z = node / 15.0;
        sum += std::pow(sine, 5 * (1 - z) / z) / 2;
    }
    return sum;
}

double node(int i, int count, double most = 1) { return std::clamp(i / double(count - 1), 1e-4, most); }
double ior(int i) {
    double z = node(i, 16, 0.99);
    return i ? (1 + z * z) / (1 - z * z) : 1;  // in float32 the first is 1
}
double critical(double ratio) { return ratio < 1 ? std::sqrt(1 - ratio * ratio) : 0; }

void write(const char* name, const char* axes, size_t count, const std::function<double(int)>& value) {
    std::vector<double> values(count);
    std::vector<std::thread> workers;
    unsigned threads = std::max(std::thread::hardware_concurrency(), 1u);
    for (unsigned t = 0; t < threads; t++)
        workers.emplace_back([&, t] {
            for (size_t i = t; i < count; i += threads) values[i] = value(int(i));
        });
    for (std::thread& worker : workers) worker.join();
    std::printf("// %s\nconstexpr float %s[] = {", axes, name);
    for (size_t i = 0; i < count; i++) std::printf("%s%.6ff,", i % 16 ? " " : "\n    ", std::clamp(values[i], 0.0, 1.0));
    std::printf("\n};\n\n");
}

}  // namespace

int main(int argc, char** argv) {
    Quadrature points(argc > 1 ? std::atoi(argv[1]) : 96), few(24), more(48);
    auto average = [](const Quadrature& along, auto&& of) {
        double sum = 0;
        for (size_t i = 0; i < along.x.size(); i++) sum += 2 * along.weight[i] * along.x[i] * of(along.x[i]);
        return sum;
    };
    std::printf("// The share of light that rough surfaces scatter, as make_albedo_tables.cpp computes it: not written by hand.\n#pragma once\n\n"
                "namespace viewcam::VIEWCAM_ISA::albedo_tables {\n\n");
    write("GGX", "32 cosines × 32 roughnesses", 1024, [&](int i) { return mean(points, node(i % 32, 32), node(i / 32, 32), 0, mirror); });
    write("GGX_MEAN", "32 roughnesses", 32, [&](int i) {
        return average(more, [&](double c) { return mean(points, node(i, 32), c, 0, mirror); });
    });
    for (bool inside : {false, true}) {
        auto ratio = [&](int z) { return inside ? 1 / ior(z) : ior(z); };
        std::string name = inside ? "GLASS_INSIDE" : "GLASS";
        write(name.c_str(), "16 indices × 16 cosines × 16 roughnesses", 4096, [&](int i) {
            double r = ratio(i / 256);
            return mean(points, node(i % 16, 16), node(i / 16 % 16, 16), critical(r), glass(r));
        });
        write((name + "_MEAN").c_str(), "16 indices × 16 roughnesses", 256, [&](int i) {
            double r = ratio(i / 16);
            return average(few, [&](double c) { return mean(points, node(i % 16, 16), c, critical(r), glass(r)); });
        });
    }
    write("FRESNEL", "16 indices × 16 cosines × 16 roughnesses", 4096,
          [&](int i) { return mean(points, node(i % 16, 16), node(i / 16 % 16, 16), 0, curve(ior(i / 256))); });
    write("SCHLICK", "16 cosines × 16 roughnesses", 256, [&](int i) { return mean(points, node(i % 16, 16), node(i / 16, 16), 0, schlick); });
    std::printf("}  // namespace viewcam::VIEWCAM_ISA::albedo_tables\n");
}
