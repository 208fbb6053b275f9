// Colors of surfaces: constants, images and the mesh's own colors.
//
// As in Cycles (measured with 4.2, 5.0 and 5.2): of n pixels, that of number i has its center at (i + ½)/n of UV; where images repeat,
// pixels at their border are blended with those on the other side; sRGB is decoded after blending, which makes blends of
// light and dark darker than half-way. Cycles has UV in float32: at 64 pixels, its colors are off by up to 2e-5 of the contrast.
//
// Rejected: decoding images when they are loaded (not what Cycles does, and up to twelve times the memory), and mip maps, which it
// has not; floats rounded to eight bytes a pixel (docs/light.md).
#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "math/trig.h"
#include "ray.h"

namespace viewcam::VIEWCAM_ISA {

// Where images of directions have a direction: wrapped around a sphere by degrees of longitude and latitude, or seen in a ball of
// chrome along y.
inline Vec2 equirectangular(Vec3 direction) {
    return {0.5 - atan2(direction.y, direction.x) / (2 * PI), 1 - acos(direction.z / length(direction)) / PI};
}
inline Vec2 mirror_ball(Vec3 direction) {
    Vec3 half = direction / length(direction) - Vec3{0, 1, 0};
    double size = 2 * std::sqrt(max(-half.y / 2, 0.0));
    return size > 0 ? Vec2{(half.x / size + 1) / 2, (half.z / size + 1) / 2} : Vec2{0.5, 0.5};
}

// The way an image is looked up. straight: whether colors are divided by the alpha that they were multiplied by.
struct Lookup {
    enum Interpolation { LINEAR, CLOSEST, CUBIC } interpolation = LINEAR;
    enum Extension { REPEAT, EXTEND, CLIP, MIRROR } extension = REPEAT;
    bool straight = false;
};

// The type of a pixel's numbers: floats, half floats, or whole numbers that are shares of the largest of their kind, rounded as
// Blender and Cycles round them. RGBE: a byte for each color and one for their exponent (Ward, Real Pixels, Graphics Gems II,
// 1991).
enum class Texel { FLOAT, HALF, BYTE, SHORT, RGBE };

// The number of a finite half float.
inline float half_float(uint16_t bits) {
    uint32_t sign = uint32_t(bits & 0x8000) << 16, rest = bits & 0x7fff;
    float size = rest < 0x400 ? float(rest) * 0x1p-24f : std::bit_cast<float>((rest << 13) + (112u << 23));
    return std::bit_cast<float>(std::bit_cast<uint32_t>(size) | sign);
}

// An image laid out over UV (0, 0) to (1, 1). pixels: somebody else's, as they are encoded, rows from the bottom, RGB or, with that
// many channels, RGBA. Colors that are encoded are multiplied by their alpha in whole bytes, before they are blended.
struct Texture {
    int width, height;
    bool srgb;
    const void* pixels;
    int channels = 3;
    Texel texel = Texel::FLOAT;

    // The linear color at UV; that at 0 where UV is not finite. closest: of the nearest pixel instead of between four.
    Vec3 at(Vec2 uv, bool closest) const { return at(uv, Lookup{closest ? Lookup::CLOSEST : Lookup::LINEAR}); }
    Vec3 at(Vec2 uv, Lookup lookup) const {
        Vec3 rgb = blend<Vec3>(uv, lookup, [&](int column, int row) { return pixel(place(column, row)); });
        if (lookup.straight && channels == 4)
            if (double a = alpha(uv, lookup); a != 0 && a != 1) rgb = rgb / a;
        return decoded(rgb);
    }
    double alpha(Vec2 uv, Lookup lookup) const {
        auto opaque = [&](int column, int row) {
            return channels == 4 ? read<double>([&](auto number) { return number(place(column, row) + 3); }) : 1;
        };
        return blend<double>(uv, lookup, opaque);
    }

    Vec3 mean() const { return mean(0, width, 0, height); }
    // Over the pixels of some columns and rows, to 1e-6.
    Vec3 mean(int left, int right, int first, int last) const {
        auto over = [&](auto&& color) {
            Vec3 sum;
            for (int row = first; row < last; row++) {
                Vec3 of_row;
                for (size_t i = place(left, row), end = place(right, row); i < end; i += stride()) of_row += color(i);
                sum += of_row;
            }
            return sum / (double(right - left) * (last - first));
        };
        if (!srgb) return read<Vec3>([&](auto number) { return over([&](size_t i) { return Vec3{number(i), number(i + 1), number(i + 2)}; }); });
        if (texel != Texel::BYTE) return over([&](size_t i) { return decoded_bytes(pixel(i)); });
        const std::array<double, 256>& light = linear_bytes();
        return over([&](size_t i) { return Vec3{light[byte(i, 0)], light[byte(i, 1)], light[byte(i, 2)]}; });
    }

   private:
    // Where a pixel's numbers begin.
    size_t place(int column, int row) const { return stride() * (size_t(row) * size_t(width) + size_t(column)); }
    size_t stride() const { return texel == Texel::RGBE ? 4 : size_t(channels); }
    // Calls `use` with a function that reads the number of an index, and returns its result.
    template <class Value, class Use> Value read(Use&& use) const {
        auto bytes = static_cast<const uint8_t*>(pixels);
        auto shorts = static_cast<const uint16_t*>(pixels);
        switch (texel) {
            case Texel::BYTE: return use([bytes](size_t i) { return BYTES[bytes[i]]; });
            case Texel::RGBE: return use([bytes](size_t i) { return bytes[i] * std::bit_cast<double>(uint64_t(bytes[i | 3] + 1023 - 136) << 52); });
            case Texel::SHORT: return use([shorts](size_t i) { return double(float(shorts[i]) * (1 / 65535.0f)); });
            case Texel::HALF: return use([shorts](size_t i) { return double(half_float(shorts[i])); });
            default: return use([floats = static_cast<const float*>(pixels)](size_t i) { return double(floats[i]); });
        }
    }
    Vec3 pixel(size_t first) const {
        if (srgb && channels == 4 && texel == Texel::BYTE) return {BYTES[byte(first, 0)], BYTES[byte(first, 1)], BYTES[byte(first, 2)]};
        return read<Vec3>([&](auto number) -> Vec3 {
            Vec3 rgb{number(first), number(first + 1), number(first + 2)};
            if (!srgb || channels != 4) return rgb;
            double alpha = std::rint(number(first + 3) * 255);
            auto times = [&](double encoded) { return double(float(std::floor(std::rint(encoded * 255) * alpha / 255)) * (1 / 255.0f)); };
            return {times(rgb.x), times(rgb.y), times(rgb.z)};
        });
    }
    // The byte of a color's channel, multiplied by its alpha.
    size_t byte(size_t first, size_t channel) const {
        auto bytes = static_cast<const uint8_t*>(pixels) + first;
        return channels == 4 ? bytes[channel] * bytes[3] / 255u : bytes[channel];
    }
    // The pixel that stands for one beyond the border, −1 for nothing.
    static int within(int64_t i, int64_t count, Lookup::Extension extension) {
        if (i >= 0 && i < count) return int(i);
        if (extension == Lookup::EXTEND) return i < 0 ? 0 : int(count - 1);
        if (extension == Lookup::CLIP) return -1;
        if (extension == Lookup::REPEAT) return int((i % count + count) % count);
        int64_t there = (i % (2 * count) + 2 * count) % (2 * count);
        return int(there < count ? there : 2 * count - 1 - there);
    }
    // Pixels' values at UV, blended.
    template <class Value, class Pixel> Value blend(Vec2 uv, Lookup lookup, Pixel&& pixel) const {
        double u = uv.x, v = uv.y;
        if (lookup.extension == Lookup::REPEAT) {
            u -= std::floor(u), v -= std::floor(v);
            u = u >= 0 ? min(u, LARGEST) : 0;
            v = v >= 0 ? min(v, LARGEST) : 0;
        } else {  // far outside an image all is as it is just outside, or mirrored
            if (!(std::fabs(u) < FARTHEST)) u = 0;
            if (!(std::fabs(v) < FARTHEST)) v = 0;
        }
        auto at = [&](int64_t column, int64_t row) -> Value {
            int x = within(column, width, lookup.extension), y = within(row, height, lookup.extension);
            return x < 0 || y < 0 ? Value{} : pixel(x, y);
        };
        if (lookup.interpolation == Lookup::CLOSEST) return at(int64_t(std::floor(u * width)), int64_t(std::floor(v * height)));
        double column = u * width - 0.5, row = v * height - 0.5, left = std::floor(column), below = std::floor(row);
        double across = column - left, up = row - below;
        auto x = int64_t(left), y = int64_t(below);
        if (lookup.interpolation == Lookup::LINEAR) {
            Value lower = at(x, y) * (1 - across) + at(x + 1, y) * across;
            Value upper = at(x, y + 1) * (1 - across) + at(x + 1, y + 1) * across;
            return lower * (1 - up) + upper * up;
        }
        double columns[4], rows[4];
        spline(across, columns), spline(up, rows);
        Value sum{};
        for (int j = 0; j < 4; j++) {
            Value of_row{};
            for (int i = 0; i < 4; i++) of_row = of_row + at(x - 1 + i, y - 1 + j) * columns[i];
            sum = sum + of_row * rows[j];
        }
        return sum;
    }
    // The weights of a cubic B-spline's four pixels.
    static void spline(double t, double (&weights)[4]) {
        double s = 1 - t;
        weights[0] = s * s * s / 6, weights[3] = t * t * t / 6;
        weights[1] = (3 * t * t * t - 6 * t * t + 4) / 6, weights[2] = (3 * s * s * s - 6 * s * s + 4) / 6;
    }
    static constexpr double FARTHEST = 1e4, LARGEST = 1 - 0x1p-53;

    static constexpr std::array<double, 256> BYTES = [] {
        std::array<double, 256> table{};
        for (size_t i = 0; i < table.size(); i++) table[i] = double(float(i) * (1 / 255.0f));
        return table;
    }();
    static const std::array<double, 256>& linear_bytes() {
        static const std::array<double, 256> LINEAR = [] {
            std::array<double, 256> table;
            for (size_t i = 0; i < table.size(); i++) table[i] = linear(double(i) / 255);
            return table;
        }();
        return LINEAR;
    }
    // The linear color of what is often made of bytes: looked up, which takes an eighth of the time.
    static Vec3 decoded_bytes(Vec3 rgb) {
        const std::array<double, 256>& light = linear_bytes();
        auto of = [&](double encoded) {
            double level = encoded * 255, nearest = std::rint(level);
            return std::fabs(level - nearest) < 0x1p-14 && nearest >= 0 && nearest <= 255 ? light[size_t(nearest)] : linear(encoded);
        };
        return {of(rgb.x), of(rgb.y), of(rgb.z)};
    }
    Vec3 decoded(Vec3 rgb) const { return srgb ? Vec3{linear(rgb.x), linear(rgb.y), linear(rgb.z)} : rgb; }
    // sRGB (IEC 61966-2-1).
    static double linear(double encoded) { return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4); }
};

// A color, the same everywhere or times what an image or the mesh's own colors say; or what a node makes (nodes/value_node.h),
// the rest then being white. image: in the scene's textures, or NONE. node: likewise, in its nodes.
struct Color {
    Vec3 rgb;
    uint32_t image = NONE, node = NONE;
    bool closest = false, vertex = false;

    bool is_black() const { return viewcam::VIEWCAM_ISA::is_black(rgb); }
    bool varies() const { return image != NONE || vertex || node != NONE; }

    Vec3 at(const std::vector<Texture>& textures, const Interaction& point) const {
        Vec3 color = rgb;
        if (image != NONE) color *= textures[image].at(point.uv, closest);
        if (vertex) color *= point.vertex_color;
        return color;
    }
    // Over its image, as if vertex colors and what a node makes were white.
    Vec3 mean(const std::vector<Texture>& textures) const { return image == NONE ? rgb : rgb * textures[image].mean(); }
};

}  // namespace viewcam::VIEWCAM_ISA
