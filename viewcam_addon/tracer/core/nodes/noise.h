// Hashes and gradient noise, as the procedural textures of Cycles have them, and sums of noise over octaves.
//
// Hashes are Jenkins' lookup3 of the bits of float32 numbers. The noise is Perlin's (Improving Noise, 2002), in one to four dimensions;
// the sums are Musgrave's (Texturing and Modeling, chapter 16). Cycles computes them in float32: a coordinate p is off by p·2⁻²⁴
// there, and noise by about twice that.
#pragma once
#include <array>
#include <bit>

#include "math.h"

namespace viewcam::VIEWCAM_ISA {

template <size_t N> inline uint32_t hash_of(const std::array<uint32_t, N>& keys) {
    auto turned = [](uint32_t x, int by) { return std::rotl(x, by); };
    uint32_t a = 0xdeadbeefu + (uint32_t(N) << 2) + 13u, b = a, c = a;
    a += keys[0];
    if constexpr (N > 1) b += keys[1];
    if constexpr (N > 2) c += keys[2];
    if constexpr (N > 3) {
        a -= c, a ^= turned(c, 4), c += b;
        b -= a, b ^= turned(a, 6), a += c;
        c -= b, c ^= turned(b, 8), b += a;
        a -= c, a ^= turned(c, 16), c += b;
        b -= a, b ^= turned(a, 19), a += c;
        c -= b, c ^= turned(b, 4), b += a;
        a += keys[3];
    }
    c ^= b, c -= turned(b, 14);
    a ^= c, a -= turned(c, 11);
    b ^= a, b -= turned(a, 25);
    c ^= b, c -= turned(b, 16);
    a ^= c, a -= turned(c, 4);
    b ^= a, b -= turned(a, 14);
    c ^= b, c -= turned(b, 24);
    return c;
}
// From 0 to 1, by the bits of numbers in float32.
template <class... Numbers> inline double hashed(Numbers... numbers) {
    return hash_of(std::array<uint32_t, sizeof...(numbers)>{std::bit_cast<uint32_t>(float(numbers))...}) / double(0xffffffffu);
}

template <size_t N> using Place = std::array<double, N>;

// Three numbers from 0 to 1 of a place.
inline Vec3 hashed_color(const Place<1>& p) { return {hashed(p[0]), hashed(p[0], 1), hashed(p[0], 2)}; }
inline Vec3 hashed_color(const Place<2>& p) { return {hashed(p[0], p[1]), hashed(p[0], p[1], 1), hashed(p[0], p[1], 2)}; }
inline Vec3 hashed_color(const Place<3>& p) { return {hashed(p[0], p[1], p[2]), hashed(p[0], p[1], p[2], 1), hashed(p[0], p[1], p[2], 2)}; }
inline Vec3 hashed_color(const Place<4>& p) {
    return {hashed(p[0], p[1], p[2], p[3]), hashed(p[2], p[0], p[3], p[1]), hashed(p[3], p[2], p[1], p[0])};
}

// The rise of noise from a lattice's corner.
inline double gradient(uint32_t hash, const Place<1>& p) {
    hash &= 15;
    double steep = 1 + (hash & 7);
    return (hash & 8 ? -steep : steep) * p[0];
}
inline double signed_sum(uint32_t hash, double u, double v) { return (hash & 1 ? -u : u) + (hash & 2 ? -v : v); }
inline double gradient(uint32_t hash, const Place<2>& p) {
    hash &= 7;
    return signed_sum(hash, p[hash >= 4], 2 * p[hash < 4]);
}
inline double gradient(uint32_t hash, const Place<3>& p) {
    hash &= 15;
    return signed_sum(hash, p[hash >= 8], hash < 4 ? p[1] : hash == 12 || hash == 14 ? p[0] : p[2]);
}
inline double gradient(uint32_t hash, const Place<4>& p) {
    hash &= 31;
    double s = hash < 8 ? p[2] : p[3];
    return signed_sum(hash, p[hash >= 24], hash < 16 ? p[1] : p[2]) + (hash & 4 ? -s : s);
}

// About from −1 to 1; it repeats after 100,000.
template <size_t N> inline double signed_noise(Place<N> p) {
    constexpr double SCALES[] = {0.25, 0.6616, 0.9820, 0.8344}, PERIOD = 1e5, FAR = 1e6;
    std::array<uint32_t, N> cell;
    Place<N> within, faded;
    for (size_t i = 0; i < N; i++) {
        double size = std::fabs(p[i]), x = (size < PERIOD ? p[i] : std::fmod(p[i], PERIOD)) + (size >= FAR ? 0.5 : 0), low = std::floor(x), t = x - low;
        cell[i] = uint32_t(int32_t(low)), within[i] = t;
        faded[i] = t * t * t * (t * (t * 6 - 15) + 10);
    }
    double sum = 0;
    for (unsigned corner = 0; corner < 1u << N; corner++) {
        std::array<uint32_t, N> at = cell;
        Place<N> from = within;
        double weight = 1;
        for (size_t i = 0; i < N; i++) {
            bool beyond = corner >> i & 1;
            at[i] += beyond, from[i] -= beyond, weight *= beyond ? faded[i] : 1 - faded[i];
        }
        sum += weight * gradient(hash_of(at), from);
    }
    return SCALES[N - 1] * sum;
}

// The sums of noise over octaves, each of which is `lacunarity` times as fine.
struct Octaves {
    enum Sum { FBM, MULTIFRACTAL, HYBRID_MULTIFRACTAL, RIDGED_MULTIFRACTAL, HETERO_TERRAIN } sum = FBM;
    double detail = 0, roughness = 0.5, lacunarity = 2, offset = 0, gain = 1;
    bool normalize = true;

    static Sum sum_of(const std::string& name) {
        return name == "multifractal"          ? MULTIFRACTAL
               : name == "hybrid_multifractal" ? HYBRID_MULTIFRACTAL
               : name == "ridged_multifractal" ? RIDGED_MULTIFRACTAL
               : name == "hetero_terrain"      ? HETERO_TERRAIN
                                               : FBM;
    }

    template <size_t N> double at(Place<N> p) const {
        int whole = int(detail);
        double rest = detail - whole, power = 1, value = 0, weight = 1;
        auto finer = [&] {
            for (double& x : p) x *= lacunarity;
            power *= roughness;
        };
        switch (sum) {
            case FBM: {
                double most = 0;
                for (int i = 0; i <= whole; i++, finer()) value += power * signed_noise(p), most += power;
                auto normalized = [&](double value, double most) { return normalize ? 0.5 * value / most + 0.5 : value; };
                if (rest == 0) return normalized(value, most);
                return mix(normalized(value, most), normalized(value + power * signed_noise(p), most + power), rest);
            }
            case MULTIFRACTAL:
                value = 1;
                for (int i = 0; i <= whole; i++, finer()) value *= power * signed_noise(p) + 1;
                return rest == 0 ? value : value * (rest * power * signed_noise(p) + 1);
            case HETERO_TERRAIN:
                value = offset + signed_noise(p);
                finer();
                for (int i = 1; i <= whole; i++, finer()) value += (signed_noise(p) + offset) * power * value;
                return rest == 0 ? value : value + rest * (signed_noise(p) + offset) * power * value;
            case HYBRID_MULTIFRACTAL: {
                constexpr double LEAST = 0.001;
                for (int i = 0; weight > LEAST && i <= whole; i++) {
                    weight = min(weight, 1.0);
                    double signal = (signed_noise(p) + offset) * power;
                    value += weight * signal;
                    weight *= gain * signal;
                    finer();
                }
                if (rest == 0 || !(weight > LEAST)) return value;
                return value + rest * min(weight, 1.0) * (signed_noise(p) + offset) * power;
            }
            default: {
                auto ridge = [&] {
                    double signal = offset - std::fabs(signed_noise(p));
                    return signal * signal;
                };
                double signal = value = ridge();
                for (int i = 1; i <= whole; i++) {
                    finer();
                    signal = unit_range(signal * gain) * ridge();
                    value += signal * power;
                }
                return value;
            }
        }
    }
};

}  // namespace viewcam::VIEWCAM_ISA
