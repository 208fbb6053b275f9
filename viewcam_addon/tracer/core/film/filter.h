// Where in and around its pixel a sample lies: the film's filter, by importance sampling.
//
// Every sample has weight 1 and belongs to one pixel; how often a place is chosen is what the filter weighs it with. On each
// axis a number u in [0, 1) becomes the place up to which the filter's mass is u: numbers that are spread evenly become places
// that are spread evenly over the mass.
//
// BOX is one pixel wide, whatever its width, as in Cycles. BLACKMAN_HARRIS of width f reaches f pixels to either side of the
// centre: 0.35875 − 0.48829 cos θ + 0.14128 cos 2θ − 0.01168 cos 3θ, θ = π (x/f + 1) (Harris, Proceedings of the IEEE 66, 1978).
//
// Its distribution is inverted exactly at 2¹⁶ + 1 numbers and linearly between them. Every such step has its exact mass, and
// the filter is symmetric; only how the 2⁻¹⁶ of a step is spread over it differs, altogether by 3.6e-5 of the mass (the
// total variation), nearly all of it in the outermost steps. No pixel is off by more than that part of its surroundings' contrast.
//
// Cycles' table (intern/cycles/scene/film.cpp, 1,024 entries, of which the middle is the 511th of 0 … 1,023) has three faults.
// u = ½, its first sample, misses the centre by half a step: 0.25/511 px for BOX, 3.5e-4 f for BLACKMAN_HARRIS. The last entry
// is left at 0, so that one sample of 1,023 is spread evenly from the pixel's lower left corner to the filter's end: that makes
// BOX exact, and moves the mean of BLACKMAN_HARRIS by (f/2 − ¼)/1,023 px, 4.9e-4 px at f = 1.5. And its outer steps are long.
// An edge's pixel is off by no more than 5.8e-4 of the contrast for it (f = 1.5, edges at any angle), one of a smooth surface by
// 4.9e-4 px times the slope. The tracer's own noise of such a pixel, 0.35 N^−3/4 of the contrast, is larger up to 5,000 samples.
//
// Rejected: weighting samples of several pixels (splatting), which makes neighbours' errors depend on one another and their
// variance unknown; Newton's method on each number, whose sines cost ten times as much; and Cycles' table.
#pragma once
#include <vector>

#include "../math/trig.h"
#include "../math/vec.h"

namespace viewcam::VIEWCAM_ISA {

class Filter {
   public:
    // width: pixels, of BLACKMAN_HARRIS; 0 is BOX.
    explicit Filter(double width = 0) : width_(width), places_(width > 0 ? &inverse() : nullptr) {}

    // Pixels from a pixel's lower left corner, ½ being its centre. u: in [0, 1).
    Vec2 offset(Vec2 u) const { return width_ > 0 ? Vec2{offset(u.x), offset(u.y)} : u; }

   private:
    static constexpr int STEPS = 1 << 16;
    static constexpr double A = 0.35875, B = 0.48829, C = 0.14128, D = 0.01168;

    double offset(double u) const {
        double scaled = u * STEPS;
        auto step = int(scaled);
        double begin = (*places_)[step];
        return (begin + ((*places_)[step + 1] - begin) * (scaled - step)) * width_ + 0.5;
    }

    // Where each step of the mass begins, and the last one ends, in widths.
    static const std::vector<double>& inverse() {
        static const std::vector<double> made = inverted();
        return made;
    }
    static std::vector<double> inverted() {
        std::vector<double> places(STEPS + 1);
        double x = -1;
        places[0] = -1;
        for (int step = 1; step < STEPS / 2; step++) {
            double wanted = double(step) / STEPS, low = x, high = 0;
            for (int round = 0; round < 60 && high > low; round++) {  // Newton's method, kept between bounds
                SinCos once = sincos_of_turns((x + 1) / 2), twice = sincos_of_turns(x + 1), thrice = sincos_of_turns(1.5 * (x + 1));
                double theta = PI * (x + 1);
                double mass = (A * theta - B * once.sin + C / 2 * twice.sin - D / 3 * thrice.sin) / (2 * PI * A);
                double density = (A - B * once.cos + C * twice.cos - D * thrice.cos) / (2 * A);
                (mass < wanted ? low : high) = x;
                double next = x - (mass - wanted) / density;
                if (!(next > low && next < high)) next = (low + high) / 2;
                if (next == x || std::fabs(next - x) < 1e-16) break;
                x = next;
            }
            places[step] = x;
        }
        places[STEPS / 2] = 0;
        for (int step = 0; step < STEPS / 2; step++) places[STEPS - step] = -places[step];
        return places;
    }

    double width_;
    const std::vector<double>* places_;
};

}  // namespace viewcam::VIEWCAM_ISA
