// Level `geometry`: the surfaces that rays of the camera meet, as passes. What a tolerance applies to is computed in float64 and
// rounded once, to the pass's float32.
#pragma once
#include "../capi.h"
#include "../scene.h"

namespace viewcam::VIEWCAM_ISA {

// Where the passes' values go: channel c of the pass p and the pixel i to plane[p][c · stride + i]; nullptr is not wanted.
struct GeometryPasses {
    float* const* plane;
    size_t stride;

    template <class... Values> void write(ViewcamPass pass, size_t pixel, Values... values) const {
        float* to = plane[pass];
        if (!to) return;
        size_t at = pixel;
        ((to[at] = float(values), at += stride), ...);
    }
    void write(ViewcamPass pass, size_t pixel, Vec3 v) const { write(pass, pixel, v.x, v.y, v.z); }
};

// What one ray met, written as Cycles writes it, also where that is nothing.
inline void write_geometry(const Scene& scene, const Ray& ray, const Hit& hit, const GeometryPasses& passes, size_t pixel) {
    constexpr double BACKGROUND_DEPTH = 1e10;
    if (!hit) {
        passes.write(VIEWCAM_DEPTH, pixel, BACKGROUND_DEPTH);
        for (ViewcamPass pass : {VIEWCAM_POSITION, VIEWCAM_NORMAL, VIEWCAM_UV}) passes.write(pass, pixel, 0, 0, 0);
        for (ViewcamPass pass : {VIEWCAM_OBJECT_INDEX, VIEWCAM_MATERIAL_INDEX, VIEWCAM_MAGNITUDE, VIEWCAM_FACING})
            passes.write(pass, pixel, 0);
        return;
    }
    Interaction at = scene.interaction(ray, hit);
    passes.write(VIEWCAM_DEPTH, pixel, at.t);
    passes.write(VIEWCAM_POSITION, pixel, ray.direction * at.t + (scene.origin + ray.origin));
    passes.write(VIEWCAM_NORMAL, pixel, at.shading);
    passes.write(VIEWCAM_UV, pixel, at.uv.x, at.uv.y, at.has_uv ? 1 : 0);
    passes.write(VIEWCAM_OBJECT_INDEX, pixel, scene.objects[hit.object].index);
    passes.write(VIEWCAM_MATERIAL_INDEX, pixel, scene.slots[at.slot].index);
    passes.write(VIEWCAM_FACING, pixel, max(0.0, min(at.cosine, 1.0)));
    if (passes.plane[VIEWCAM_MAGNITUDE]) {
        double eye = max_component(abs(scene.origin + ray.origin));
        passes.write(VIEWCAM_MAGNITUDE, pixel, max(eye, scene.magnitude(ray, hit)));
    }
}

// The pixel centres of some rows, from the bottom, in blocks of 8 × 8; `*stop`, if there is one, ends it early.
inline void render_geometry(const Scene& scene, uint32_t begin, uint32_t end, const GeometryPasses& passes, const volatile int* stop) {
    constexpr uint32_t SIDE = 8;
    const Camera& camera = scene.camera;
    Ray rays[SIDE * SIDE];
    Hit hits[SIDE * SIDE];
    for (uint32_t row = begin; row < end; row += SIDE)
        for (uint32_t column = 0; column < camera.width; column += SIDE) {
            if (stop && *stop) return;
            uint32_t width = std::min(SIDE, camera.width - column), height = std::min(SIDE, end - row);
            int count = int(width * height);
            for (int i = 0; i < count; i++) rays[i] = camera.ray(column + uint32_t(i) % width + 0.5, row + uint32_t(i) / width + 0.5);
            scene.closest(rays, count, CAMERA, hits);
            for (int i = 0; i < count; i++) {
                size_t pixel = size_t(row + uint32_t(i) / width) * camera.width + column + uint32_t(i) % width;
                write_geometry(scene, rays[i], hits[i], passes, pixel);
            }
        }
}

}  // namespace viewcam::VIEWCAM_ISA
