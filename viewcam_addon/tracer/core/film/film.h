// Light that paths bring to the eye, sorted by the pass that shows it, and the passes that become of all samples of a pixel.
//
// A pixel's samples are added one after the other, in order, so that a sum is the same, bit for bit, whatever the tile. Colors
// are summed as differences from the pixel's first sample: where all are equal the variance is 0, and not a rounding.
//
// Variance of a mean is that of the means of batches, some 16 of as many samples that follow one another, over their number.
// The samples of a pixel share its space out among them (sobol.h), so that their own variance over their number is 3 to 11
// times too large at 64 to 256 samples. So are batches among themselves, but less: by 1.7 to 3.2, with 16 of them, and their
// estimate is off by a third (24 seeds of an area light with a world, at 0 and 4 bounces). Below 32 samples each is a batch.
// Rejected: batches that are scrambled each on its own, which makes the estimate right by making the picture noisier.
#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>

#include "../capi.h"
#include "../math/simd.h"

namespace viewcam::VIEWCAM_ISA {

// The color of diffuse surfaces that the eye sees, and what it sees of lights; of the world behind all; after one diffuse
// scattering; after more, the first of them diffuse; and what mirrors and glass show. All light is the picture.
enum Category : uint8_t { COLOR, EMISSION, ENVIRONMENT, DIRECT, INDIRECT, OTHER, CATEGORIES };

// The light that one path brings. covered: how much of the world behind all it hides from the eye.
struct PathLight {
    double4 of[CATEGORIES];  // the channels, and 0
    double covered;
    uint8_t brought;  // categories that anything was added to, as bits: the others hold nothing yet

    void clear() { covered = 1, brought = 0; }  // nothing yet of a path that has not left the scene
    void add(Category category, double4 rgb) {
        of[category] = brought >> category & 1 ? of[category] + rgb : rgb;
        brought |= uint8_t(1 << category);
    }
    void add(Category category, Vec3 rgb) { add(category, double4{rgb.x, rgb.y, rgb.z, 0}); }
    // All of it.
    Vec3 combined() const {
        double4 sum{};
        for (unsigned left = brought & ~(1u << COLOR); left;) sum += of[take_bit(left)];
        return {sum[0], sum[1], sum[2]};
    }
};

// The settings by which samples become pixels.
struct FilmSettings {
    bool transparent = false;  // true if the world behind the scene leaves pixels see-through
    double exposure = 1;
};

// Where the passes' values go, of a whole picture, its rows from the bottom; nullptr is not wanted, but Combined always is.
struct LightPasses {
    enum Pass { COMBINED, EMISSION, ENVIRONMENT, DIFFUSE_DIRECT, DIFFUSE_INDIRECT, DIFFUSE_COLOR, VARIANCE, SAMPLE_COUNT };  // as image.py lists them

    float* const* plane;
};

// The sums over the samples of one pixel.
class Pixel {
   public:
    // Samples of a batch: a power of two, since that is how many points together fill their space.
    static uint32_t batch_size(uint32_t samples) { return std::bit_floor(std::max(samples / BATCHES, 1u)); }

    uint32_t count() const { return count_; }

    // Adds samples, one after the other; a few at a time, so that sums stay in registers. batch_size: a power of two.
    void add(const PathLight* samples, uint32_t count, const FilmSettings& film, uint32_t batch_size) {
        for (; count >= FEW; samples += FEW, count -= FEW) add_few(samples, FEW, film, batch_size);
        if (count > 0) add_few(samples, count, film, batch_size);
    }

    // The sum of all samples' differences from the first one, and the variance of one sample; without exposure.
    Vec3 differences() const { return rgb(differences_); }
    Vec3 sample_variance() const { return rgb(max((squared_differences_ - differences_ * differences_ / double(count_)) / (count_ - 1.0), double4{})); }

    Vec3 combined(const FilmSettings& film) const { return rgb((first_ + differences_ / double(count_)) * film.exposure); }
    // The variance of `combined`: that of the batches' means over their number, as if one that has begun had ended.
    Vec3 variance(const FilmSettings& film, uint32_t batch_size) const {
        uint32_t batches = count_ / batch_size;
        double4 sums = (squares_ - before_ * before_ / double(batches)) / double(batches - 1);
        return rgb(max(sums, double4{}) / double(batch_size) / double(count_) * (film.exposure * film.exposure));
    }

    // random: whether another seed would give another picture; if so, the variance of a single batch is infinite.
    void write(const LightPasses& passes, size_t pixel, const FilmSettings& film, uint32_t batch_size, bool random) const {
        Vec3 unknown;
        if (random) unknown.x = unknown.y = unknown.z = std::numeric_limits<double>::infinity();
        write(passes, pixel, film, count_ >= 2 * batch_size ? variance(film, batch_size) : unknown);
    }
    void write(const LightPasses& passes, size_t pixel, const FilmSettings& film, Vec3 variance) const {
        Vec3 color = rgb(totals_[COLOR]) / count_;
        float* rgba = passes.plane[LightPasses::COMBINED] + 4 * pixel;
        store(rgba, combined(film));
        rgba[3] = film.transparent ? float(covered_ / count_) : 1.0f;
        auto show = [&](LightPasses::Pass pass, Vec3 value) {
            if (float* to = passes.plane[pass]) store(to + 3 * pixel, value);
        };
        show(LightPasses::DIFFUSE_COLOR, color);
        show(LightPasses::EMISSION, mean(EMISSION, film));
        show(LightPasses::ENVIRONMENT, mean(ENVIRONMENT, film));
        show(LightPasses::DIFFUSE_DIRECT, without_color(mean(DIRECT, film), color));
        show(LightPasses::DIFFUSE_INDIRECT, without_color(mean(INDIRECT, film), color));
        float* variances = passes.plane[LightPasses::VARIANCE];
        for (int channel = 0; variances && channel < 3; channel++) variances[3 * pixel + channel] = float(variance[channel]);
        if (float* counts = passes.plane[LightPasses::SAMPLE_COUNT]) counts[pixel] = float(count_);
    }

   private:
    static constexpr uint32_t BATCHES = 16, FEW = 4;

    [[gnu::always_inline]] void add_few(const PathLight* samples, uint32_t count, const FilmSettings& film, uint32_t batch_size) {
        double4 combined[FEW] = {};
        unsigned brought = 0, by_all = ~0u;
        for (uint32_t i = 0; i < count; i++) brought |= samples[i].brought, by_all &= samples[i].brought;
        while (brought) {
            int category = take_bit(brought);
            bool in_combined = category != COLOR && !(film.transparent && category == ENVIRONMENT);
            double4 total = totals_[category];
            for (uint32_t i = 0; i < count; i++) {
                if (!(by_all >> category & 1) && !(samples[i].brought >> category & 1)) continue;
                total += samples[i].of[category];
                if (in_combined) combined[i] += samples[i].of[category];
            }
            totals_[category] = total;
        }
        if (count_ == 0) first_ = combined[0];
        double4 first = first_, differences = differences_, squared_differences = squared_differences_;
        double covered = covered_;
        for (uint32_t i = 0; i < count; i++) {
            double4 difference = combined[i] - first;
            differences += difference;
            squared_differences += difference * difference;
            covered += samples[i].covered;
            if ((++count_ & (batch_size - 1)) == 0) {
                double4 batch = differences - before_;
                squares_ += batch * batch;
                before_ = differences;
            }
        }
        differences_ = differences, squared_differences_ = squared_differences, covered_ = covered;
    }

    static Vec3 rgb(double4 channels) { return {channels[0], channels[1], channels[2]}; }
    // No pixel is infinite: float32's largest number is the most.
    static float held(double value) { return value < std::numeric_limits<float>::max() ? float(value) : std::numeric_limits<float>::max(); }
    static void store(float* target, Vec3 rgb) { target[0] = held(rgb.x), target[1] = held(rgb.y), target[2] = held(rgb.z); }

    Vec3 mean(Category category, const FilmSettings& film) const { return rgb(totals_[category]) / count_ * film.exposure; }

    // Light divided by the color that it fell on; where a channel is black, the mean of the others, as in Cycles.
    static Vec3 without_color(Vec3 light, Vec3 color) {
        double divided[3], sum = 0;
        int colored = 0;
        for (int channel = 0; channel < 3; channel++)
            if (color[channel] != 0) sum += divided[channel] = light[channel] / color[channel], colored++;
        for (int channel = 0; channel < 3; channel++)
            if (color[channel] == 0) divided[channel] = colored ? sum / colored : 0;
        return {divided[0], divided[1], divided[2]};
    }

    double4 totals_[CATEGORIES] = {};
    double4 first_{}, differences_{};  // the first sample, and the sum of all differences from it
    double4 squared_differences_{};    // and of their squares
    double4 before_{}, squares_{};     // the sum of differences when the last batch began, and the batches' own sums, squared
    double covered_ = 0;
    uint32_t count_ = 0;
};

}  // namespace viewcam::VIEWCAM_ISA
