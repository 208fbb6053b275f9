// The world: light from everywhere beyond the scene, the same everywhere or as an image that is wrapped around it.
//
// A world that is the same everywhere is found best by rays that are scattered: none are aimed at it. An image is sampled as a
// light, too: a cell of a table of at most 2048 × 1024 is picked by the light that it gives, and a direction of it evenly.
//
// As in Cycles (measured with 4.2, 4.5, 5.0 and 5.2): of an equirectangular image u is ½ − atan2(y, x)/2π and v is 1 − acos(z)/π,
// and blends wrap around it both ways, at the poles, too.
#pragma once
#include <algorithm>
#include <vector>

#include "../accel/parallel.h"
#include "../textures.h"
#include "light_sample.h"

namespace viewcam::VIEWCAM_ISA {

class Environment {
   public:
    Vec3 radiance{};           // or what the image is multiplied by
    uint32_t hidden_from = 0;  // kinds of rays
    uint32_t image = NONE;     // in the scene's textures
    bool closest = false;
    Affine to_image;  // directions of the world to the image's

    // To be called when all images are there.
    void prepare(const std::vector<Texture>& textures, int threads) {
        texture_ = image == NONE ? nullptr : &textures[image];
        mean_ = radiance;
        if (!texture_) return;
        columns_ = std::min(texture_->width, MOST_COLUMNS), rows_ = std::min(texture_->height, MOST_COLUMNS / 2);
        heights_.resize(size_t(rows_) + 1);
        for (int row = 0; row <= rows_; row++) heights_[row] = row == 0 ? -1 : row == rows_ ? 1 : sin(PI * (double(row) / rows_ - 0.5));
        reached_.assign(size_t(rows_) * columns_, 0), rows_reached_.assign(rows_, 0);
        std::vector<Vec3> of_rows(rows_);
        parallel_for(threads, size_t(rows_), [&](size_t row) { of_rows[row] = cells(int(row), &reached_[row * columns_]); });
        mean_ = {};
        double total = 0;
        for (int row = 0; row < rows_; row++) {
            double part = (heights_[row + 1] - heights_[row]) / 2;  // share of the sphere
            mean_ += of_rows[row] * (part / columns_);
            rows_reached_[row] = total += reached_[size_t(row + 1) * columns_ - 1] * part;
        }
        mean_ = mean_ * radiance;
        if (!(total > 0)) texture_ = nullptr, radiance = mean_ = {};
    }

    Vec3 le(Vec3 direction, RayKind kind) const {
        if (hidden_from & kind) return {};
        return texture_ ? radiance * texture_->at(place(to_image.vector(direction)), closest) : radiance;
    }
    bool lights(RayKind kind) const { return !(hidden_from & kind) && !is_black(mean_); }
    Vec3 mean_radiance() const { return mean_; }
    bool has_image() const { return texture_; }

    LightSample sample_li(Vec2 u) const {
        auto pick = [](const double* reached, int count, double& u) {
            double wanted = u * reached[count - 1];
            int index = std::min(int(std::upper_bound(reached, reached + count, wanted) - reached), count - 1);
            double before = index ? reached[index - 1] : 0, share = reached[index] - before;
            u = share > 0 ? std::clamp((wanted - before) / share, 0.0, 1 - 0x1p-53) : 0.5;
            return index;
        };
        int row = pick(rows_reached_.data(), rows_, u.y);
        int column = pick(&reached_[size_t(row) * columns_], columns_, u.x);
        double z = mix(heights_[row], heights_[row + 1], u.y), across = std::sqrt(max(1 - z * z, 0.0));
        SinCos turn = sincos_of_turns(0.5 - (column + u.x) / columns_);
        Vec3 direction = to_image.transposed({across * turn.cos, across * turn.sin, z});
        double pdf = pdf_of(row, column);
        LightSample sample;
        sample.direction = direction, sample.pdf = pdf;
        sample.weight = pdf > 0 ? radiance * texture_->at(place(to_image.vector(direction)), closest) / pdf : Vec3{};
        return sample;
    }
    double pdf_li(Vec3 direction) const {
        Vec2 at = place(to_image.vector(direction));
        double z = to_image.vector(direction).z;
        int row = std::clamp(int(at.y * rows_), 0, rows_ - 1);
        while (row > 0 && z < heights_[row]) row--;
        while (row < rows_ - 1 && z > heights_[row + 1]) row++;
        return pdf_of(row, std::clamp(int(at.x * columns_), 0, columns_ - 1));
    }

   private:
    static constexpr int MOST_COLUMNS = 2048;

    static double mix(double a, double b, double t) { return a + (b - a) * t; }
    static Vec2 place(Vec3 direction) { return equirectangular(direction); }
    // The sum of the cells of a row, each the mean over its pixels; reached: receives their light, summed up.
    Vec3 cells(int row, double* reached) const {
        Vec3 sum;
        double light = 0;
        int first = int(int64_t(row) * texture_->height / rows_), last = int(int64_t(row + 1) * texture_->height / rows_);
        for (int column = 0; column < columns_; column++) {
            int left = int(int64_t(column) * texture_->width / columns_), right = int(int64_t(column + 1) * texture_->width / columns_);
            Vec3 cell = texture_->mean(left, right, first, last);
            sum += cell;
            reached[column] = light += max(mean(cell * radiance), 0.0);
        }
        return sum;
    }
    double pdf_of(int row, int column) const {
        const double* of_row = &reached_[size_t(row) * columns_];
        double light = of_row[column] - (column ? of_row[column - 1] : 0);
        return light * columns_ / (rows_reached_.back() * 4 * PI);
    }

    const Texture* texture_ = nullptr;
    Vec3 mean_{};
    int columns_ = 0, rows_ = 0;
    std::vector<double> heights_;                 // the rows' edges on the unit sphere
    std::vector<double> reached_, rows_reached_;  // light summed up along each row, and over the rows
};

// The world's image, as a light that shadow rays are sent to.
class EnvironmentLight {
   public:
    explicit EnvironmentLight(const Environment& environment) : environment_(&environment) {}
    bool is_sized() const { return true; }
    LightSample sample_li(const Interaction&, Vec2 u) const { return environment_->sample_li(u); }
    double pdf_li(const Interaction&, Vec3 direction) const { return environment_->pdf_li(direction); }
    double estimate(Vec3, Vec3) const { return irradiance(); }
    double irradiance() const { return PI * mean(environment_->mean_radiance()); }

   private:
    const Environment* environment_;
};

}  // namespace viewcam::VIEWCAM_ISA
