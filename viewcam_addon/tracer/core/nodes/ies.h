// The light that a lamp sends in each direction, as its maker has measured it.
#pragma once
#include <cstdlib>

#include "../closures/shading_point.h"

namespace viewcam::VIEWCAM_ISA {

// Looked up by the direction that light leaves in: from −z upwards, and about z. Cubic between the angles (Catmull and Rom's), which
// need not stand evenly; 0 beyond them. Cubics are mirrored at the lower pole. At the upper one, and where a turn is closed, they end:
// Cycles means to go on there, and asks for angles above those that float32 has.
struct IESNode {
    static constexpr const char* NAME = "ies";
    static constexpr Gives GIVES = Gives::NUMBER;
    Color vector, strength;
    std::vector<double> across, up, values;  // angles in radians, ascending; a row of values for each angle across

    // text: how many angles there are across and up, these, and the values.
    explicit IESNode(const Inputs& in) : vector(in["vector"]), strength(in["strength"]) {
        const char* text = in.choice("text").c_str();
        auto numbers = [&](size_t count) {
            std::vector<double> row(count);
            for (double& number : row) {
                char* end;
                number = std::strtod(text, &end);
                if (end == text) throw std::invalid_argument("an IES table lacks numbers");
                text = end;
            }
            return row;
        };
        std::vector<double> counts = numbers(2);
        constexpr double MOST = 1 << 20;
        if (!(counts[0] >= 2 && counts[0] <= MOST && counts[1] >= 2 && counts[1] <= MOST)) throw std::invalid_argument("an IES table has no rows");
        across = numbers(size_t(counts[0])), up = numbers(size_t(counts[1])), values = numbers(across.size() * up.size());
    }
    Vec3 eval(const ShadingPoint& at) const {
        Vec3 v = at.value(vector);
        double size = length(v);
        if (!(size > 0 && size < INFINITE)) return {};
        double rise = acos(min(max(-v.z / size, -1.0), 1.0)), turn = atan2(v.x, v.y) + PI;
        size_t column, row;
        double along_column, along_row;
        if (!between(up, rise, column, along_column) || !between(across, turn, row, along_row)) return {};
        bool goes_on = at.version >= CYCLES_5_0;  // true if what lies at an end counts beyond; else that is 0
        auto in_row = [&](size_t i) {
            const double* value = &values[i * up.size()];
            double b = value[column], c = value[column + 1];
            double a = column > 0 ? value[column - 1] : up.front() < TINY ? value[1] : goes_on ? b : 0;
            double d = column + 2 < up.size() ? value[column + 2] : goes_on ? c : 0;
            return cubic(a, b, c, d, along_column);
        };
        double b = in_row(row), c = in_row(row + 1);
        double beyond = goes_on ? b : 0;  // at either end
        double a = row > 0 ? in_row(row - 1) : beyond, d = row + 2 < across.size() ? in_row(row + 2) : beyond;
        return gray(max(cubic(a, b, c, d, along_row), 0.0) * at.number(strength));
    }

   private:
    static constexpr double TINY = 1e-7;

    // The angle before another, and the share of the way from it to the next one.
    static bool between(const std::vector<double>& angles, double angle, size_t& before, double& share) {
        if (!(angle >= angles.front() && angle < angles.back())) return false;
        size_t next = std::upper_bound(angles.begin(), angles.end(), angle) - angles.begin();
        before = next - 1, share = (angle - angles[before]) / (angles[next] - angles[before]);
        return true;
    }
    static double cubic(double a, double b, double c, double d, double x) {
        return b + 0.5 * x * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (d - a + 3 * (b - c))));
    }
};

}  // namespace viewcam::VIEWCAM_ISA
