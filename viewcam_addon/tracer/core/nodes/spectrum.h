// Colors of what glows and of the rainbow, linear, of Rec. 709's primaries.
#pragma once
#include <algorithm>

#include "math.h"

namespace viewcam::VIEWCAM_ISA {

// The color of a black body, its luminance being 1. Planck's law as Cycles has it: fitted piece by piece, the same below 800 K and from 12,000 K on.
struct BlackbodyNode {
    static constexpr const char* NAME = "blackbody";
    static constexpr Gives GIVES = Gives::COLOR;
    Color temperature;

    explicit BlackbodyNode(const Inputs& in) : temperature(in["temperature"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        double kelvin = at.number(temperature);
        Vec3 rgb = kelvin < 800        ? Vec3{5.413294490189271, -0.20319390035873933, -0.0822535242887164}
                   : kelvin >= 12000 ? Vec3{0.8262954810464208, 0.9945080501520986, 1.566307710274283}
                                     : fitted(kelvin);
        return max(rgb, 0);
    }

   private:
    // Below a temperature T red and green are a/T + bT + c, and blue a polynomial.
    struct Piece {
        double below, red[3], green[3], blue[4];
    };
    static constexpr Piece PIECES[] = {
        {965, {1619.19106, -0.00205010916, 5.02995757}, {-488.999748, 0.000604330754, -0.0755807526}, {5.96945309e-11, -4.85742887e-8, -9.70622247e-5, -0.00407936148}},
        {1167, {2488.45471, -0.00111330907, 3.22621544}, {-755.994277, 0.000316730098, 0.478306139}, {2.40430366e-11, 5.55021075e-8, -0.000198503712, 0.0289312858}},
        {1449, {3341.43193, -0.000486551192, 1.76486769}, {-1023.63977, 0.00012022347, 0.936662319}, {-1.40949732e-11, 1.89878968e-7, -0.000356632824, 0.0910767778}},
        {1902, {4094.61742, -0.000127446582, 0.725731635}, {-1265.71316, 4.87340896e-6, 1.27054498}, {-3.61460868e-11, 2.84822009e-7, -0.000493211319, 0.15672344}},
        {3315, {4670.28036, 2.91258199e-5, 0.126703442}, {-1425.29332, -4.01150431e-5, 1.43972784}, {-1.97075738e-11, 1.75359352e-7, -0.000250542825, -0.0222783266}},
        {6365, {4595.09185, 2.87495649e-5, 0.15034502}, {-1175.54822, -2.16378048e-5, 1.30408023}, {-1.61997957e-13, -1.64216008e-8, 0.000386216271, -0.738077418}},
        {INFINITE, {3787.1745, 9.35907826e-6, 0.399075871}, {-500.799571, -4.59832026e-6, 1.09098763}, {6.72650283e-13, -2.73078809e-8, 0.000424098264, -0.752335691}},
    };
    static Vec3 fitted(double kelvin) {
        const Piece* piece = PIECES;
        while (kelvin >= piece->below) piece++;
        auto hyperbola = [&](const double (&fit)[3]) { return fit[0] / kelvin + fit[1] * kelvin + fit[2]; };
        const double* b = piece->blue;
        return {hyperbola(piece->red), hyperbola(piece->green), ((b[0] * kelvin + b[1]) * kelvin + b[2]) * kelvin + b[3]};
    }
};

// The color of a wavelength in nanometers: the CIE's observer of 1931 (2°), every 5 nm from 380 on; straight between, black beyond.
struct WavelengthNode {
    static constexpr const char* NAME = "wavelength";
    static constexpr Gives GIVES = Gives::COLOR;
    Color wavelength;

    explicit WavelengthNode(const Inputs& in) : wavelength(in["wavelength"]) {}
    Vec3 eval(const ShadingPoint& at) const {
        constexpr double FROM_XYZ[3][3] = {{3.2409699419, -1.53738317757, -0.498610760293}, {-0.969243636281, 1.87596750151, 0.0415550574072}, {0.055630079697, -0.203976958889, 1.05697151424}};
        constexpr double SCALE = 2.52;  // so that no color is brighter than 1
        double place = (at.number(wavelength) - 380) / 5;
        if (!(place > -1 && place < 80)) return {};
        auto i = int(place);
        Vec3 first{OBSERVER[i][0], OBSERVER[i][1], OBSERVER[i][2]}, next{OBSERVER[i + 1][0], OBSERVER[i + 1][1], OBSERVER[i + 1][2]};
        Vec3 rgb = product(FROM_XYZ, mix(first, next, place - i)) / SCALE;
        return max(rgb, 0);
    }

   private:
    static constexpr double OBSERVER[81][3] = {
        {0.0014, 0, 0.0065}, {0.0022, 0.0001, 0.0105}, {0.0042, 0.0001, 0.0201}, {0.0076, 0.0002, 0.0362},
        {0.0143, 0.0004, 0.0679}, {0.0232, 0.0006, 0.1102}, {0.0435, 0.0012, 0.2074}, {0.0776, 0.0022, 0.3713},
        {0.1344, 0.004, 0.6456}, {0.2148, 0.0073, 1.0391}, {0.2839, 0.0116, 1.3856}, {0.3285, 0.0168, 1.623},
        {0.3483, 0.023, 1.7471}, {0.3481, 0.0298, 1.7826}, {0.3362, 0.038, 1.7721}, {0.3187, 0.048, 1.7441},
        {0.2908, 0.06, 1.6692}, {0.2511, 0.0739, 1.5281}, {0.1954, 0.091, 1.2876}, {0.1421, 0.1126, 1.0419},
        {0.0956, 0.139, 0.813}, {0.058, 0.1693, 0.6162}, {0.032, 0.208, 0.4652}, {0.0147, 0.2586, 0.3533},
        {0.0049, 0.323, 0.272}, {0.0024, 0.4073, 0.2123}, {0.0093, 0.503, 0.1582}, {0.0291, 0.6082, 0.1117},
        {0.0633, 0.71, 0.0782}, {0.1096, 0.7932, 0.0573}, {0.1655, 0.862, 0.0422}, {0.2257, 0.9149, 0.0298},
        {0.2904, 0.954, 0.0203}, {0.3597, 0.9803, 0.0134}, {0.4334, 0.995, 0.0087}, {0.5121, 1, 0.0057},
        {0.5945, 0.995, 0.0039}, {0.6784, 0.9786, 0.0027}, {0.7621, 0.952, 0.0021}, {0.8425, 0.9154, 0.0018},
        {0.9163, 0.87, 0.0017}, {0.9786, 0.8163, 0.0014}, {1.0263, 0.757, 0.0011}, {1.0567, 0.6949, 0.001},
        {1.0622, 0.631, 0.0008}, {1.0456, 0.5668, 0.0006}, {1.0026, 0.503, 0.0003}, {0.9384, 0.4412, 0.0002},
        {0.8544, 0.381, 0.0002}, {0.7514, 0.321, 0.0001}, {0.6424, 0.265, 0}, {0.5419, 0.217, 0}, {0.4479, 0.175, 0},
        {0.3608, 0.1382, 0}, {0.2835, 0.107, 0}, {0.2187, 0.0816, 0}, {0.1649, 0.061, 0}, {0.1212, 0.0446, 0},
        {0.0874, 0.032, 0}, {0.0636, 0.0232, 0}, {0.0468, 0.017, 0}, {0.0329, 0.0119, 0}, {0.0227, 0.0082, 0},
        {0.0158, 0.0057, 0}, {0.0114, 0.0041, 0}, {0.0081, 0.0029, 0}, {0.0058, 0.0021, 0}, {0.0041, 0.0015, 0},
        {0.0029, 0.001, 0}, {0.002, 0.0007, 0}, {0.0014, 0.0005, 0}, {0.001, 0.0004, 0}, {0.0007, 0.0002, 0},
        {0.0005, 0.0002, 0}, {0.0003, 0.0001, 0}, {0.0002, 0.0001, 0}, {0.0002, 0.0001, 0}, {0.0001, 0, 0}, {0.0001, 0, 0},
        {0.0001, 0, 0}, {0, 0, 0},
    };
};

using SpectrumNodes = std::variant<BlackbodyNode, WavelengthNode>;

}  // namespace viewcam::VIEWCAM_ISA
