// What colours surfaces have: constants, images and the mesh's own colours.
//
// As in Cycles (measured with 4.2, 5.0 and 5.2): of n pixels, that of number i has its centre at (i + ½)/n of UV; images repeat,
// and at their border pixels are blended with those on the other side; sRGB is decoded after blending, which makes blends of
// light and dark darker than half-way. Cycles has UV in float32: at 64 pixels, its colours are off by up to 2e-5 of the contrast.
//
// Rejected: decoding images when they are loaded (not what Cycles does), and mip maps, which it has not.
#pragma once
#include <cstdint>
#include <vector>

#include "math/trig.h"
#include "ray.h"

namespace viewcam::VIEWCAM_ISA {

// An image laid out over UV (0, 0) to (1, 1) and repeated beyond. pixels: rows from the bottom, RGB, as they are encoded.
struct Texture {
    int width, height;
    bool srgb;
    std::vector<float> pixels;

    // The linear colour at UV; that at 0 where UV is not finite. closest: of the nearest pixel instead of between four.
    Vec3 at(Vec2 uv, bool closest) const {
        double u = uv.x - std::floor(uv.x), v = uv.y - std::floor(uv.y);
        if (!(u >= 0 && u <= 1)) u = 0;
        if (!(v >= 0 && v <= 1)) v = 0;
        if (closest) return decoded(pixel(std::min(int(u * width), width - 1), std::min(int(v * height), height - 1)));
        double column = u * width - 0.5, row = v * height - 0.5, left = std::floor(column), below = std::floor(row);
        double across = column - left, up = row - below;
        int x0 = left < 0 ? width - 1 : int(left), x1 = int(left) + 1 >= width ? 0 : int(left) + 1;
        int y0 = below < 0 ? height - 1 : int(below), y1 = int(below) + 1 >= height ? 0 : int(below) + 1;
        Vec3 lower = pixel(x0, y0) * (1 - across) + pixel(x1, y0) * across;
        Vec3 upper = pixel(x0, y1) * (1 - across) + pixel(x1, y1) * across;
        return decoded(lower * (1 - up) + upper * up);
    }

    Vec3 mean() const { return mean(0, width, 0, height); }
    // Over the pixels of some columns and rows.
    Vec3 mean(int left, int right, int first, int last) const {
        Vec3 sum;
        for (int row = first; row < last; row++) {
            Vec3 of_row;
            for (int column = left; column < right; column++) of_row += decoded(pixel(column, row));
            sum += of_row;
        }
        return sum / (double(right - left) * (last - first));
    }

   private:
    Vec3 pixel(int column, int row) const {
        const float* rgb = &pixels[3 * (size_t(row) * width + column)];
        return {rgb[0], rgb[1], rgb[2]};
    }
    Vec3 decoded(Vec3 rgb) const { return srgb ? Vec3{linear(rgb.x), linear(rgb.y), linear(rgb.z)} : rgb; }
    // sRGB (IEC 61966-2-1).
    static double linear(double encoded) { return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4); }
};

// A colour, the same everywhere or times what an image or the mesh's own colours say. image: in the scene's textures, or NONE.
struct Color {
    Vec3 rgb;
    uint32_t image = NONE;
    bool closest = false, vertex = false;

    bool is_black() const { return viewcam::VIEWCAM_ISA::is_black(rgb); }
    bool varies() const { return image != NONE || vertex; }

    Vec3 at(const std::vector<Texture>& textures, const Interaction& point) const {
        Vec3 color = rgb;
        if (image != NONE) color *= textures[image].at(point.uv, closest);
        if (vertex) color *= point.vertex_color;
        return color;
    }
    // Over its image, as if vertex colours were white.
    Vec3 mean(const std::vector<Texture>& textures) const { return image == NONE ? rgb : rgb * textures[image].mean(); }
};

}  // namespace viewcam::VIEWCAM_ISA
