// The samples of a tile's pixels: the same number for each, or as many as a wanted error takes.
//
// A tile is 32 × 32 pixels, counted from the picture's lower left corner; each is computed alone, so that threads change no bit.
// A picture that refines before somebody's eyes takes a few samples of every tile, then a few more. What a pixel has by then is
// kept, 384 bytes, and its samples are added in the same order, so that this changes no bit either.
//
// As many as an error takes: all pixels get the first few samples, then those whose mean is not yet known well enough get twice
// as many with every round. Nothing is shared but the decision: a pixel's mean is that of its own samples, all of equal weight.
//
// A pixel's own samples have no say in how many it gets. What has missed a bright thing looks both darker and quieter than it is,
// and would stop for that very reason, while its neighbor, which met it, would go on and average it away: light would be lost.
// So the variance of a sample, s², is the mean over the pixels around it, without the pixel itself. Measured at a Cornell box with
// a mirror and a light that it shows (level `path`, E = 0.05): pixels that stop by themselves make the picture's tiles too dark by
// 16 of their standard errors, those that stop by the larger of themselves and their neighbors by 1.4, these by 0.5. The price is
// a thing that one pixel alone meets: it keeps the noise that its neighbors have not.
//
// The samples of a pixel share its space out among them, so that s²/N is 3 to 11 times the variance of their mean. The means of
// the two halves of the samples, apart by D, tell more: E[D²]/4 is the variance of the mean where samples are independent, and
// 1.3 to 2 times that where it falls as N^−3/2 (measured: edges, area lights, a sky). But of a single pixel that is one number, and
// as often far too small as too large. So s²/N is multiplied by what D²/4 is in the mean over 8 × 8 pixels, over what s²/N is
// there: again without the pixel itself.
//
// Rejected: means over neighbors (a denoiser is no reference); weighing rounds by their variance, which is bias; four samples first
// and not eight, with which six Suzannes take 0.81 of the time to an error of 0.003 and as long to 0.001, but the pixels that are
// furthest off are twice as far.
#pragma once
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "path.h"

namespace viewcam::VIEWCAM_ISA {

class TileSampler {
   public:
    static constexpr uint32_t TILE = 32;

    // samples: of each pixel, at most. error: the standard error that is wanted of each pixel's Combined, scene-linear: the root
    // of the mean of its channels' variances; 0 for the same number of samples everywhere.
    // coincident: as of PathIntegrator.
    TileSampler(const Scene& scene, const Bounces& bounces, uint32_t seed, uint32_t samples, double error, double coincident)
        : integrator_(scene, bounces, seed, int(samples), coincident), filter_(scene.illumination.filter, scene.illumination.filter_width), film_(scene.illumination.film),
          samples_(samples), error_(error), camera_(scene.camera), under_way_(size_t(tiles(camera_.height)) * tiles(camera_.width)) {}

    const Camera& camera() const { return camera_; }
    const PathIntegrator& integrator() const { return integrator_; }

    // Learns where diffuse surfaces get their light from, before the first tile. `*stop`, if there is one, ends that early.
    //
    // In two lessons of the same samples: the first without a guide, the second with what that has taught. If its pixels have less noise by
    // more than guided rays cost, those of the picture follow what the second has taught. Nobody measures time: bits would depend on it.
    void learn(int threads, const volatile int* stop) {
        // EXPECTED: samples of a pixel where an error is wanted. SHARE: of the picture's paths are traced to learn, FEWEST to MOST. WORTH:
        // the noise, squared, that is left of what it was, times rays, where guided ones pay, which takes up to 1.4 times as long each.
        constexpr double EXPECTED = 64, SHARE = 1.0 / 32, FEWEST = 0x1p13, MOST = 0x1p17, WORTH = 0.6;
        double expected = error_ > 0 ? std::min(double(samples_), EXPECTED) : samples_;
        double paths = std::min(SHARE * expected * camera_.height * camera_.width, MOST);
        if (paths < FEWEST || !integrator_.may_be_guided()) return;
        double noise[2], rays[2];
        for (int i = 0; i < 2; i++) {
            Lesson lesson = take_lesson(size_t(paths / 2 / PathIntegrator::MOST), threads, stop);
            if ((stop && *stop) || lesson.rays.empty()) return;
            noise[i] = lesson.apart, rays[i] = paths / 2 + double(lesson.rays.size());
            guide_ = std::make_unique<Guide>(lesson.rays);
            integrator_.set_guide(guide_.get());
        }
        if (noise[1] * noise[1] * rays[1] < WORTH * noise[0] * noise[0] * rays[0]) return;
        integrator_.set_guide(nullptr);
        guide_.reset();
    }
    uint32_t samples() const { return samples_; }
    // Traces the tile whose lowest row and first column are given, until its pixels have so many samples: all of them, or fewer,
    // to which a later call adds. `*stop`, if there is one, ends it early, and then the tile can't be gone on with.
    void trace(uint32_t row, uint32_t column, uint32_t samples, const LightPasses& passes, const volatile int* stop) {
        std::vector<Pixel>& kept = under_way_[size_t(row / TILE) * tiles(camera_.width) + column / TILE];
        Tile tile{row, column, std::min(TILE, camera_.height - row), std::min(TILE, camera_.width - column), std::exchange(kept, {})};
        auto& spare = of_this_thread<std::vector<Pixel>>();  // the memory of the tile before
        if (tile.pixels.empty()) tile.pixels = std::move(spare), tile.pixels.assign(TILE * TILE, {});
        uint32_t taken = tile.pixels[0].count();
        if (samples <= taken) throw std::invalid_argument("a tile has that many samples already");
        if (error_ > 0 && samples_ > 1) {
            if (samples != samples_) throw std::invalid_argument("samples that an error asks for are taken all at once");
            trace_until_known(tile, passes, stop);
        } else {
            uint32_t batch = Pixel::batch_size(samples_);
            sample(tile, all(tile), taken, samples, samples, batch, stop);
            if (stop && *stop) return;
            for (uint32_t place : all(tile)) tile.pixels[place].write(passes, pixel(tile, place), film_, batch, integrator_.is_random());
        }
        (samples < samples_ ? kept : spare) = std::move(tile.pixels);
    }

   private:
    // FIRST: samples of every pixel. AROUND: pixels to either side that tell what a pixel's variance is. BLOCK: rows and columns
    // over which the efficiency of samples is measured; SHARED: the weight in each block of what is measured over the whole tile.
    static constexpr uint32_t FIRST = 8, BLOCK = 8;
    static constexpr int AROUND = 2;
    static constexpr double SHARED = 0.1;

    struct Tile {
        uint32_t row, column, height, width;
        std::vector<Pixel> pixels;  // place: row · TILE + column
        std::vector<Vec3> halves{};  // each pixel's differences when it had half of its samples, where an error is wanted
    };
    // A few samples of each of some pixels, and what they bring.
    struct Group {
        CameraSamples samples;
        double columns[PathIntegrator::MOST], rows[PathIntegrator::MOST];  // on the film
        PathLight light[PathIntegrator::MOST];
    };
    // The variance of one sample of a pixel, s², and that of their mean as samples tell it, s²/N, and as halves do, D²/4: the mean of
    // the channels.
    struct VarianceEstimate {
        double of_sample = 0, by_samples = 0, by_halves = 0;
    };

    // The diffuse rays of some paths, and how far apart two means of the same pixel are, in sum.
    struct Lesson {
        std::vector<Guide::LearnedRay> rays;
        double apart = 0;
    };
    // Traces paths all over the picture. They have other numbers than its own: those of pixels beyond its last one. As many samples are a mean
    // as stratify well: two at random would say nothing of what 64 of them do.
    Lesson take_lesson(size_t blocks, int threads, const volatile int* stop) const {
        constexpr size_t SET = 16, SETS = PathIntegrator::MOST / SET;
        uint64_t pixels = uint64_t(camera_.height) * camera_.width;
        std::vector<Lesson> lessons(blocks);
        parallel_for(threads, blocks, [&](size_t block) {
            if (stop && *stop) return;
            auto& [samples, columns, rows, light] = of_this_thread<Group>();
            for (size_t i = 0; i < PathIntegrator::MOST; i++) {
                size_t set = block * SETS + i / SET;
                uint64_t pixel = (set / 2) * pixels / (blocks * SETS / 2);
                samples.pixel[i] = uint32_t(pixels + set), samples.number[i] = uint32_t(i % SET);
                columns[i] = double(pixel % camera_.width), rows[i] = double(pixel / camera_.width);
            }
            offset(samples, PathIntegrator::MOST, columns, rows);
            camera_.rays(columns, rows, PathIntegrator::MOST, samples.rays);
            integrator_.trace(samples, PathIntegrator::MOST, light, &lessons[block].rays);
            for (size_t i = 0; i < PathIntegrator::MOST; i += 2 * SET) {
                Vec3 apart;
                for (size_t k = i; k < i + SET; k++) apart += (light[k].combined() - light[k + SET].combined()) / double(SET);
                lessons[block].apart += std::sqrt(mean(apart * apart));
            }
        });
        Lesson all;
        for (const Lesson& lesson : lessons) all.rays.insert(all.rays.end(), lesson.rays.begin(), lesson.rays.end()), all.apart += lesson.apart;
        return all;
    }

    static uint32_t tiles(uint32_t pixels) { return (pixels + TILE - 1) / TILE; }
    uint32_t pixel(const Tile& tile, uint32_t place) const {
        return (tile.row + place / TILE) * camera_.width + tile.column + place % TILE;
    }
    // The places of all pixels, those that lie close together one after the other.
    static std::vector<uint16_t> all(const Tile& tile) {
        constexpr uint32_t CLOSE = 4;
        std::vector<uint16_t> places;
        for (uint32_t y = 0; y < tile.height; y += CLOSE)
            for (uint32_t x = 0; x < tile.width; x += CLOSE)
                for (uint32_t row = y; row < std::min(y + CLOSE, tile.height); row++)
                    for (uint32_t column = x; column < std::min(x + CLOSE, tile.width); column++)
                        places.push_back(uint16_t(row * TILE + column));
        return places;
    }

    // Takes samples begin … end of some pixels, and notes their halves when each has `half` samples, unless these are all. They go in
    // groups that fill a block with some samples of each: the closer together the rays of a block lie, the fewer boxes and triangles it
    // meets. 378,000 triangles under a sun take 0.9 of the time with 16 of each of four pixels, and not 4 of 16, and 0.98 of that with 64
    // of one. Where so many would leave blocks half empty, fewer do: 20 of three pixels for 40 each.
    void sample(Tile& tile, const std::vector<uint16_t>& places, uint32_t begin, uint32_t half, uint32_t end, uint32_t batch,
                const volatile int* stop) const {
        constexpr size_t MOST = PathIntegrator::MOST, CLOSE_ENOUGH = 16;
        size_t count = end - begin, rounds = (count + MOST - 1) / MOST, at_a_time, size;
        for (;; rounds++) {
            at_a_time = (count + rounds - 1) / rounds, size = MOST / at_a_time;
            if (at_a_time <= CLOSE_ENOUGH || 8 * count * size >= 7 * rounds * MOST) break;
        }
        for (size_t i = 0; i < places.size(); i += size)
            sample_group(tile, &places[i], uint32_t(std::min(size, places.size() - i)), begin, half, end, batch, stop);
    }
    void sample_group(Tile& tile, const uint16_t* group, uint32_t size, uint32_t begin, uint32_t half, uint32_t end, uint32_t batch,
                      const volatile int* stop) const {
        auto& [samples, columns, rows, light] = of_this_thread<Group>();
        uint32_t at_a_time = PathIntegrator::MOST / size;
        for (uint32_t first = begin; first < end && !(stop && *stop); first += at_a_time) {
            uint32_t last = std::min(first + at_a_time, end);
            int count = 0;
            for (uint32_t k = 0; k < size; k++)
                for (uint32_t i = first; i < last; i++) {
                    samples.pixel[count] = pixel(tile, group[k]), samples.number[count] = i;
                    columns[count] = tile.column + group[k] % TILE, rows[count++] = tile.row + group[k] / TILE;
                }
            offset(samples, count, columns, rows);
            camera_.rays(columns, rows, count, samples.rays);
            integrator_.trace(samples, count, light);
            uint32_t before = std::clamp(half, first, last) - first;
            for (uint32_t k = 0; k < size; k++) {
                Pixel& sums = tile.pixels[group[k]];
                const PathLight* of_pixel = light + k * (last - first);
                sums.add(of_pixel, before, film_, batch);
                if (before == last - first) continue;
                if (first + before == half) tile.halves[group[k]] = sums.differences();
                sums.add(of_pixel + before, last - first - before, film_, batch);
            }
        }
    }

    // Moves samples from the corners of their pixels to where the filter has them, and makes their keys.
    void offset(CameraSamples& samples, int count, double* columns, double* rows) const {
        const SobolSampler& sampler = integrator_.sampler();
        for (int i = 0; i < count; i += 4) {
            uint4 key = sampler.key(load<uint4>(samples.pixel + i));
            store(samples.key + i, key);
            Vec2x4 offset{splat4(0.5), splat4(0.5)};
            if (samples_ > 1) offset = filter_.offset(sampler.pair(key, load<uint4>(samples.number + i), 0));
            store(columns + i, load<double4>(columns + i) + offset.x);
            store(rows + i, load<double4>(rows + i) + offset.y);
        }
    }

    void trace_until_known(Tile& tile, const LightPasses& passes, const volatile int* stop) const {
        std::vector<VarianceEstimate> estimates(TILE * TILE);
        std::vector<double> efficiencies;
        std::vector<uint16_t> active = all(tile), going;
        tile.halves.resize(TILE * TILE);
        for (uint32_t taken = 0; !active.empty() && !(stop && *stop);) {
            uint32_t goal = std::min(std::max(2 * taken, FIRST), samples_), half = taken ? taken : goal / 2;
            sample(tile, active, taken, half, goal, 1, stop);
            if (stop && *stop) return;
            for (uint16_t place : active) estimates[place] = estimate(tile.pixels[place], tile.halves[place], half);
            taken = goal;
            efficiencies = efficiency(tile, estimates);
            going.clear();
            if (taken < samples_)
                for (uint16_t place : active)
                    if (around(tile, estimates, place) / taken * efficiencies[place] > error_ * error_) going.push_back(place);
            active.swap(going);
        }
        for (uint16_t place : all(tile)) {
            const Pixel& sums = tile.pixels[place];
            Vec3 variance = sums.sample_variance() / sums.count() * (efficiencies[place] * film_.exposure * film_.exposure);
            sums.write(passes, pixel(tile, place), film_, variance);
        }
    }

    VarianceEstimate estimate(const Pixel& pixel, Vec3 of_half, uint32_t half) const {
        double exposure = film_.exposure * film_.exposure, sample = mean(pixel.sample_variance()) * exposure;
        Vec3 apart = (pixel.differences() - of_half) / (pixel.count() - half) - of_half / half;
        return {sample, sample / pixel.count(), mean(apart * apart) / 4 * exposure};
    }

    // For each pixel, the variance of its mean over s²/N, 1 at most.
    static std::vector<double> efficiency(const Tile& tile, const std::vector<VarianceEstimate>& estimates) {
        constexpr uint32_t BLOCKS = TILE / BLOCK;
        VarianceEstimate total, block[BLOCKS * BLOCKS];
        double known = 0;
        std::vector<double> efficiencies(TILE * TILE, 1.0);
        for (uint16_t place : all(tile)) {
            VarianceEstimate& here = block[place / TILE / BLOCK * BLOCKS + place % TILE / BLOCK];
            here.by_samples += estimates[place].by_samples, here.by_halves += estimates[place].by_halves;
            total.by_samples += estimates[place].by_samples, total.by_halves += estimates[place].by_halves;
            known += estimates[place].by_samples > 0;
        }
        if (!(total.by_samples > 0)) return efficiencies;
        double weight = SHARED * BLOCK * BLOCK * total.by_samples / known;
        for (uint16_t place : all(tile)) {
            const VarianceEstimate &here = block[place / TILE / BLOCK * BLOCKS + place % TILE / BLOCK], &pixel = estimates[place];
            double others = total.by_samples - pixel.by_samples, ratio = others > 0 ? (total.by_halves - pixel.by_halves) / others : 1;
            double share = (here.by_halves - pixel.by_halves + weight * ratio) / (here.by_samples - pixel.by_samples + weight);
            efficiencies[place] = std::clamp(share, 0.0, 1.0);
        }
        return efficiencies;
    }

    // The variance of a sample in the mean over the pixels around one.
    static double around(const Tile& tile, const std::vector<VarianceEstimate>& estimates, uint16_t place) {
        int y = place / TILE, x = place % TILE, count = 0;
        double sum = 0;
        for (int row = std::max(y - AROUND, 0); row <= std::min(y + AROUND, int(tile.height) - 1); row++)
            for (int column = std::max(x - AROUND, 0); column <= std::min(x + AROUND, int(tile.width) - 1); column++)
                if (row != y || column != x) sum += estimates[row * int(TILE) + column].of_sample, count++;
        return count ? sum / count : INFINITE;
    }

    PathIntegrator integrator_;
    std::unique_ptr<Guide> guide_;  // that the integrator follows
    Filter filter_;
    FilmSettings film_;
    uint32_t samples_;
    double error_;
    Camera camera_;
    std::vector<std::vector<Pixel>> under_way_;  // by tile, while it has some of its samples
};

}  // namespace viewcam::VIEWCAM_ISA
