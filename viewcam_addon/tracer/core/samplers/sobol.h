// The numbers that choose: where a sample lies on the film, which light, which direction.
//
// A sample of a pixel is a point in a cube of many dimensions: two for the film and eight for each scattering. The points of a
// pixel are Sobol's, of which any 2ᵐ that follow one another fill the cube evenly, scrambled for each pixel and dimension: every
// number is uniform, pixels are independent, and the error of what is smooth falls as N^−3/2.
//
// Scrambling. X holds a number's binary digits in reverse, the first in the lowest bit. With any s and any odd a of 32 bits,
// Y = a X + s mod 2³², reversed again, is the number scrambled. Of two numbers that agree in k digits and differ in the next, Y
// does the same, since carries go upwards and a is odd; all further digits are independent, since a (X − X′)/2ᵏ takes every
// odd value equally often, and s every value. That is the joint distribution of two numbers under Owen's nested permutations
// (Annals of Statistics 25, 1997), and the variance of a mean depends on pairs only: it is Owen's, for a product and a sum.
//
// Dimensions. Film and first scattering have ten of their own. Those that belong together, two of the film, of a light and of
// a direction, are Sobol's first two, in the order of points that another of Sobol's dimensions gives. So each such pair is as
// good as two dimensions can be, all ten are nearly so together, and what film and light do together converges too. Later
// scatterings have the first one's dimensions, each in an order of its own, by a nested permutation of the points (padding:
// Burley, JCGT 9, 2020).
//
// Any number of samples may be taken. Beside a power of two the last points lack their partners: what is smooth is then off as
// 1/N; edges, off as N^−3/4, lose nothing.
//
// Rejected: hashes that resemble Owen's permutations (Laine and Karras 2011; Burley), three or four multiplications instead of
// one, and noisier; his own, a tree of random bits for each dimension; padding from the start, as in Cycles, with which what
// film and light do together is off as N^−1/2; one shift for all points of a pixel (Cranley and Patterson 1976), off as 1/N;
// blue noise over the picture, which makes pixels depend on one another.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "../math/simd.h"

namespace viewcam::VIEWCAM_ISA {

class SobolSampler {
   public:
    // The numbers of dimensions of the film and of each scattering, and what each of a scattering's is for.
    static constexpr int FILM = 2, SCATTERING = 8, ROWS = FILM + SCATTERING;
    enum Purpose { LIGHT = 0, LIGHT_POINT = 1, DIRECTION = 3, LOBE = 5, ROULETTE = 6, THROUGH = 7 };
    // The dimension of a purpose at the depth-th scattering, from 1.
    static int dimension(int depth, Purpose purpose) { return FILM + SCATTERING * (depth - 1) + purpose; }

    // samples: how many are taken of a pixel at most, 1 to 2²⁴. scatterings: how many are usual; others take longer.
    SobolSampler(uint32_t seed, int samples, int scatterings) : seeds_{mixed(seed), mixed(~seed)} {
        tabulated_ = uint32_t(std::min<int64_t>(samples, 1 << LOW));
        int64_t depths = std::min<int64_t>(std::max(scatterings, 1), std::max<int64_t>(MOST_TABULATED / tabulated_, 1));
        for (int depth = 0; depth < depths; depth++)
            for (int row = 0; row < ROWS; row++)
                for (uint32_t sample = 0; sample < tabulated_; sample++)
                    table_.push_back(product(row, order(depth, sample)));
        depths_ = int(depths);
    }

    // Word: uint32_t for one sample, uint4 for four.

    // All that a pixel's numbers share. pixel: row · width + column.
    template <class Word> Word key(Word pixel) const { return mixed(pixel ^ seeds_[0]); }
    // A number in [0, 1). key: of the pixel.
    template <class Word> auto number(Word key, Word sample, int dimension) const {
        Word shift = mixed(key ^ mixed(uint32_t(dimension) + seeds_[1])), factor = shift * 0x9e3779b1u;
        factor = (factor ^ factor >> 15) | 1u;
        return number_of(reversed(digits(sample, dimension) * factor + shift)) * 0x1p-32;
    }
    template <class Word> auto pair(Word key, Word sample, int dimension) const {
        return Vec2Of<decltype(number(key, sample, dimension))>{number(key, sample, dimension), number(key, sample, dimension + 1)};
    }

    // The digits of Sobol's points in a dimension, before they are scrambled.
    uint32_t digits(uint32_t sample, int dimension) const {
        int depth = dimension < FILM ? 0 : (dimension - FILM) / SCATTERING;
        int row = dimension - depth * SCATTERING;
        uint32_t low = sample & ((1u << LOW) - 1);
        uint32_t value = depth < depths_ && low < tabulated_ ? table_[(size_t(depth) * ROWS + row) * tabulated_ + low]
                                                             : product(row, order(depth, low));
        for (uint32_t bit = LOW; sample >> bit; bit++)
            if (sample >> bit & 1) value ^= matrices()[row][bit];
        return value;
    }
    uint4 digits(uint4 samples, int dimension) const {
        // Dimensions that follow one another stand so in the table.
        int depth = dimension < FILM ? 0 : (dimension - FILM) / SCATTERING;
        if (depth < depths_ && samples[3] < tabulated_ && bits(int4(samples == samples[0] + uint4{0, 1, 2, 3})) == 15)
            return load<uint4>(&table_[(size_t(depth) * ROWS + dimension - depth * SCATTERING) * tabulated_ + samples[0]]);
        return uint4{digits(samples[0], dimension), digits(samples[1], dimension), digits(samples[2], dimension), digits(samples[3], dimension)};
    }

   private:
    static constexpr int BITS = 24, LOW = 16;  // LOW: bits of a sample's number that its scattering's order changes
    static constexpr int64_t MOST_TABULATED = 1 << 16;
    using Matrix = std::array<uint32_t, BITS>;

    // A permutation of all words that looks random (Wellons, Prospecting for Hash Functions, 2018: lowbias32).
    template <class Word> static Word mixed(Word word) {
        word ^= word >> 16;
        word *= 0x7feb352du;
        word ^= word >> 15;
        word *= 0x846ca68bu;
        return word ^ word >> 16;
    }
    template <class Word> static Word reversed(Word word) {
        word = (word >> 1 & 0x55555555u) | (word & 0x55555555u) << 1;
        word = (word >> 2 & 0x33333333u) | (word & 0x33333333u) << 2;
        word = (word >> 4 & 0x0f0f0f0fu) | (word & 0x0f0f0f0fu) << 4;
        word = (word >> 8 & 0x00ff00ffu) | (word & 0x00ff00ffu) << 8;
        return word >> 16 | word << 16;
    }

    static uint4 reversed(uint4 word) {
        word = (word >> 1 & 0x55555555u) | (word & 0x55555555u) << 1;
        word = (word >> 2 & 0x33333333u) | (word & 0x33333333u) << 2;
        auto bytes = (byte16)((word >> 4 & 0x0f0f0f0fu) | (word & 0x0f0f0f0fu) << 4);
        return (uint4)__builtin_shufflevector(bytes, bytes, 3, 2, 1, 0, 7, 6, 5, 4, 11, 10, 9, 8, 15, 14, 13, 12);
    }

    // The number of Sobol's point that a sample has at a scattering: Owen's permutation, each bit flipped, or not, by those
    // above it.
    uint32_t order(int depth, uint32_t sample) const {
        if (depth == 0) return sample;
        uint32_t order = sample;
        for (uint32_t bit = 0; bit < LOW; bit++)
            order ^= (mixed((sample >> (bit + 1)) ^ mixed(uint32_t(depth) * LOW + bit + seeds_[0])) & 1) << bit;
        return order;
    }

    static uint32_t product(int row, uint32_t vector) { return product(matrices()[row], vector); }
    static uint32_t product(const Matrix& matrix, uint32_t vector) {
        uint32_t sum = 0;
        for (int bit = 0; bit < BITS; bit++)
            if (vector >> bit & 1) sum ^= matrix[bit];
        return sum;
    }

    // The columns of the matrix of one of Sobol's dimensions, their digits in reverse order. Its direction numbers follow from
    // the first ones by the polynomial's recurrence (Bratley and Fox, ACM TOMS 14, 1988).
    static Matrix sobol(int degree, uint32_t coefficients, std::initializer_list<uint32_t> start) {
        std::array<uint32_t, BITS> numbers{};
        std::copy(start.begin(), start.end(), numbers.begin());
        for (int k = degree; k < BITS; k++) {
            numbers[k] = numbers[k - degree] ^ numbers[k - degree] << degree;
            for (int i = 1; i < degree; i++)
                if (coefficients >> (degree - 1 - i) & 1) numbers[k] ^= numbers[k - i] << i;
        }
        Matrix columns;
        for (int k = 0; k < BITS; k++) columns[k] = reversed(numbers[k] << (31 - k));
        return columns;
    }

    // Sobol's dimensions, as in Joe and Kuo's table: the degree of a primitive polynomial, its inner coefficients as bits, and
    // the first direction numbers. Polynomials and the second dimension are theirs (SIAM J. Sci. Comput. 30, 2008). The other
    // direction numbers are the best of some thousand random ones of each, by the t-values of all pairs of the ten dimensions,
    // of film and light, film and direction, and so on as they meet in integrals; theirs are made for pairs alone.
    static std::array<Matrix, ROWS> all_matrices() {
        Matrix first, second = sobol(1, 0, {1});
        for (int bit = 0; bit < BITS; bit++) first[bit] = 1u << bit;
        Matrix which = sobol(6, 13, {1, 3, 3, 15, 1, 19}), light = sobol(6, 22, {1, 3, 3, 9, 31, 21});
        Matrix direction = sobol(5, 11, {1, 1, 3, 15, 29}), lobe = sobol(5, 14, {1, 1, 3, 11, 7});
        Matrix roulette = sobol(5, 2, {1, 1, 5, 13, 11}), spare = sobol(6, 1, {1, 3, 7, 5, 19, 39});
        // A word's bits in reverse are the number of a point: so Sobol's second dimension takes another's order.
        auto reordered = [&](const Matrix& by) {
            Matrix columns;
            for (int bit = 0; bit < BITS; bit++) columns[bit] = product(second, by[bit]);
            return columns;
        };
        return {first, second, which, light, reordered(light), direction, reordered(direction), lobe, roulette, spare};
    }
    static const std::array<Matrix, ROWS>& matrices() {
        static const std::array<Matrix, ROWS> matrices = all_matrices();
        return matrices;
    }

    std::array<uint32_t, 2> seeds_;
    uint32_t tabulated_;  // samples
    int depths_;
    std::vector<uint32_t> table_;  // [depth][row][sample]
};

}  // namespace viewcam::VIEWCAM_ISA
