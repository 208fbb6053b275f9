// Where in and around its pixel a sample lies: the film's filter, by importance sampling.
//
// Every sample has weight 1 and belongs to one pixel; how often a place is chosen is what the filter weighs it with. On each
// axis a number u in [0, 1) becomes the place up to which the filter's mass is u: numbers that are spread evenly become places
// that are spread evenly over the mass.
//
// BOX is one pixel wide, whatever its width, as in Cycles. BLACKMAN_HARRIS of width f reaches f pixels to either side of the
// center: 0.35875 − 0.48829 cos θ + 0.14128 cos 2θ − 0.01168 cos 3θ, θ = π (x/f + 1) (Harris, Proceedings of the IEEE 66, 1978).
//
// GAUSSIAN of width f is exp(−8 (v/f)²) at v pixels from the center, up to 1.5 f to either side: six standard deviations of f/4
// each (filter_func_gaussian and filter_table there).
//
// A distribution is inverted at 64 numbers to each halving of the mass that is left to the filter's nearer end, and by a cubic
// between them that has the inverse's values and slopes at both ends. Every such step has its exact mass, and the filter is
// symmetric; only how the mass of a step is spread over it differs, altogether by 1.03e-8 of the mass of BLACKMAN_HARRIS (the total variation), and by 5.8e-8 of GAUSSIAN's, whose first step
// is a seventh of its reach. No pixel is off by more than that part of its surroundings' contrast. What most samples need of the table, some kilobytes, stays
// in the processor's nearest cache.
//
// Cycles' table (intern/cycles/scene/film.cpp, 1,024 entries, of which the middle is the 511th of 0 … 1,023) has three faults.
// u = ½, its first sample, misses the center by half a step: 0.25/511 px for BOX, 3.5e-4 f for BLACKMAN_HARRIS. The last entry
// is left at 0, so that one sample of 1,023 is spread evenly from the pixel's lower left corner to the filter's end: that makes
// BOX exact, and moves the mean of BLACKMAN_HARRIS by (f/2 − ¼)/1,023 px, 4.9e-4 px at f = 1.5. And its outer steps are long.
// An edge's pixel is off by no more than 5.8e-4 of the contrast for it (f = 1.5, edges at any angle), one of a smooth surface by
// 4.9e-4 px times the slope. GAUSSIAN reaches farther: 9.7e-4 and 8.6e-4 px. The tracer's own noise of such a pixel, 0.35 N^−3/4 of the contrast, is larger up to 5,000 samples.
//
// Rejected: weighting samples of several pixels (splatting), which makes neighbors' errors depend on one another and their
// variance unknown; Newton's method on each number, whose sines cost ten times as much; lines between 2¹⁶ even steps, half a
// megabyte that other data push out of the cache, and 3.7e-5 of the mass off; and Cycles' table.
#pragma once
#include <bit>
#include <cstdint>
#include <vector>

#include "../math/trig.h"
#include "../math/simd.h"

namespace viewcam::VIEWCAM_ISA {

enum FilterShape { BOX, BLACKMAN_HARRIS, GAUSSIAN };  // native.py numbers film.py FILTERS so

// By the place in parts of the filter's reach, −1 to 1: the density of its mass, and the mass up to there.
struct BlackmanHarris {
    static constexpr double A = 0.35875, B = 0.48829, C = 0.14128, D = 0.01168, REACH = 1;  // in widths

    static double density(double x) {
        SinCos once = sincos_of_turns((x + 1) / 2), twice = sincos_of_turns(x + 1), thrice = sincos_of_turns(1.5 * (x + 1));
        return (A - B * once.cos + C * twice.cos - D * thrice.cos) / (2 * A);
    }
    static double mass(double x) {
        SinCos once = sincos_of_turns((x + 1) / 2), twice = sincos_of_turns(x + 1), thrice = sincos_of_turns(1.5 * (x + 1));
        double theta = PI * (x + 1);
        return (A * theta - B * once.sin + C / 2 * twice.sin - D / 3 * thrice.sin) / (2 * PI * A);
    }
};
struct Gaussian {
    static constexpr double STEEPNESS = 18, REACH = 1.5;  // exp(−18 x²), and its half width

    static double density(double x) { return exp(-STEEPNESS * x * x) / (2 * integral(1)); }
    static double mass(double x) { return 0.5 + integral(x) / (2 * integral(1)); }

   private:
    // From 0 to x, of exp(−18 x²): its series, whose terms have one sign (Abramowitz and Stegun, 7.1.6).
    static double integral(double x) {
        double sum = 0, term = x, squared = STEEPNESS * x * x;
        for (int n = 0; sum + term != sum; n++) sum += term, term *= squared / (n + 1.5);
        return sum * exp(-squared);
    }
};

class Filter {
   public:
    // width: pixels; of BOX it does not matter.
    explicit Filter(FilterShape shape = BOX, double width = 1)
        : reach_(width * (shape == GAUSSIAN ? Gaussian::REACH : BlackmanHarris::REACH)),
          places_(shape == BOX ? nullptr : shape == GAUSSIAN ? &inverse<Gaussian>() : &inverse<BlackmanHarris>()) {}

    // Pixels from a pixel's lower left corner, ½ being its center, of four samples. u: in [0, 1).
    Vec2x4 offset(const Vec2x4& u) const { return places_ ? Vec2x4{offset(u.x), offset(u.y)} : u; }

   private:
    // The first binary digits of the mass to the nearer end, plus LEAST, tell the step.
    static constexpr int DIGITS = 6, HALVINGS = 16, STEPS = (HALVINGS << DIGITS) + 1, DROPPED = 52 - DIGITS;
    static constexpr double LEAST = 0x1p-17;

    // The place, in parts of the reach, at a part t of the step, from 0 to 1: a + b t + c t² + d t³.
    struct alignas(32) Cubic {
        double a, b, c, d;
    };

    double4 offset(double4 u) const {
        auto bits = (ulong4)(min(u, 1.0 - u) + LEAST);
        ulong4 step = (bits >> DROPPED) - (std::bit_cast<uint64_t>(LEAST) >> DROPPED);
        auto cubic = [&](int lane) { return load<double4>(&(*places_)[step[lane]]); };
        double4 a = cubic(0), b = cubic(1), c = cubic(2), d = cubic(3);
        transpose(a, b, c, d);
        ulong4 rest = bits & ((uint64_t(1) << DROPPED) - 1);
        double4 t = ((double4)(rest | std::bit_cast<uint64_t>(1.0)) - 1.0) * double(1 << DIGITS);
        double4 place = a + t * (b + t * (c + t * d));
        ulong4 turn = (ulong4)(0.5 - u) & uint64_t(1) << 63;  // its sign, beyond the center
        return (double4)((ulong4)place ^ turn) * reach_ + 0.5;
    }

    template <class Shape> static const std::vector<Cubic>& inverse() {
        static const std::vector<Cubic> cubics = inverted<Shape>();
        return cubics;
    }
    template <class Shape> static std::vector<Cubic> inverted() {
        std::vector<Cubic> steps(STEPS);
        double x = -1, slope = 1 / Shape::density(x), begin = 0;
        for (int step = 0; step < STEPS - 1; step++) {
            double end = std::ldexp(1 + ((step + 1) % (1 << DIGITS)) / double(1 << DIGITS), (step + 1) / (1 << DIGITS)) * LEAST - LEAST;
            double next = place<Shape>(end), next_slope = 1 / Shape::density(next);
            double size = end - begin, rise = next - x;
            double first = min(slope * size, 3 * rise), last = min(next_slope * size, 3 * rise);  // so that places keep their order
            steps[step] = {x, first, 3 * rise - 2 * first - last, first + last - 2 * rise};
            x = next, slope = next_slope, begin = end;
        }
        steps.back() = {x, -x * (0.5 / LEAST / (1 << DIGITS)), 0, 0};  // at the center, soon after it began, just 0
        return steps;
    }

    // Up to which the mass is `wanted`, 0 to ½: Newton's method, kept between bounds.
    template <class Shape> static double place(double wanted) {
        double low = -1, high = 0, x = -0.5;
        for (int round = 0; round < 100 && high > low; round++) {
            double mass = Shape::mass(x);
            (mass < wanted ? low : high) = x;
            double next = x - (mass - wanted) / Shape::density(x);
            if (!(next > low && next < high)) next = (low + high) / 2;
            if (next == x || std::fabs(next - x) < 1e-16) break;
            x = next;
        }
        return x;
    }

    double reach_;
    const std::vector<Cubic>* places_;  // by the mass to the nearer end
};

}  // namespace viewcam::VIEWCAM_ISA
