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
    bool any() const {
        return std::any_of(plane, plane + VIEWCAM_PASSES, [](const float* each) { return each; });
    }
};

// Where, and on what, the rays of the pixels end, in float64; null is not wanted. Where nothing is: infinity and NO_HIT twice.
struct GeometryHits {
    double* depth;
    uint32_t *object, *primitive;
};

// What up to 64 rays met, written as Cycles writes it, also where that is nothing. pixels: where in the planes.
inline void write_geometry(const Scene& scene, const Ray* rays, const Hit* hits, int count, const GeometryPasses& passes, const size_t* pixels) {
    constexpr double BACKGROUND_DEPTH = 1e10;
    const Ray* met_by[PACKET];
    Hit met[PACKET];
    size_t to[PACKET];
    Interaction found[PACKET];
    double magnitudes[PACKET];
    int some = 0;
    for (int i = 0; i < count; i++) {
        if (hits[i]) {
            met_by[some] = &rays[i], met[some] = hits[i], to[some++] = pixels[i];
            continue;
        }
        passes.write(VIEWCAM_DEPTH, pixels[i], BACKGROUND_DEPTH);
        for (ViewcamPass pass : {VIEWCAM_POSITION, VIEWCAM_NORMAL, VIEWCAM_UV}) passes.write(pass, pixels[i], 0, 0, 0);
        for (ViewcamPass pass : {VIEWCAM_OBJECT_INDEX, VIEWCAM_MATERIAL_INDEX, VIEWCAM_MAGNITUDE, VIEWCAM_FACING})
            passes.write(pass, pixels[i], 0);
    }
    scene.interactions(met_by, met, some, found, passes.plane[VIEWCAM_MAGNITUDE] ? magnitudes : nullptr);
    for (int i = 0; i < some; i++) {
        const Interaction& at = found[i];
        const Ray& ray = *met_by[i];
        passes.write(VIEWCAM_DEPTH, to[i], at.t);
        passes.write(VIEWCAM_POSITION, to[i], ray.direction * at.t + (scene.origin + ray.origin));
        passes.write(VIEWCAM_NORMAL, to[i], at.shading);
        passes.write(VIEWCAM_UV, to[i], at.uv.x, at.uv.y, at.has_uv ? 1 : 0);
        passes.write(VIEWCAM_OBJECT_INDEX, to[i], scene.objects[at.object].index);
        passes.write(VIEWCAM_MATERIAL_INDEX, to[i], scene.slots[at.slot].index);
        passes.write(VIEWCAM_FACING, to[i], max(0.0, min(at.cosine, 1.0)));
        if (passes.plane[VIEWCAM_MAGNITUDE])
            passes.write(VIEWCAM_MAGNITUDE, to[i], max(max_component(abs(scene.origin + ray.origin)), magnitudes[i]));
    }
}

// The pixel centres of some rows, from the bottom, in blocks of 16 × 4, as many columns as fill the cache lines of the passes;
// `*stop`, if there is one, ends it early.
inline void render_geometry(
    const Scene& scene, uint32_t begin, uint32_t end, const GeometryPasses& passes, const GeometryHits& ends, const volatile int* stop
) {
    constexpr uint32_t WIDTH = 16, HEIGHT = 4;
    const Camera& camera = scene.camera;
    const bool has_passes = passes.any();
    Ray rays[WIDTH * HEIGHT];
    Hit hits[WIDTH * HEIGHT];
    size_t pixels[WIDTH * HEIGHT];
    for (uint32_t first_row = begin; first_row < end; first_row += HEIGHT)
        for (uint32_t first_column = 0; first_column < camera.width; first_column += WIDTH) {
            if (stop && *stop) return;
            int count = 0;
            for (uint32_t row = first_row; row < std::min(first_row + HEIGHT, end); row++)
                for (uint32_t column = first_column; column < std::min(first_column + WIDTH, camera.width); column++) {
                    pixels[count] = size_t(row) * camera.width + column;
                    rays[count++] = camera.ray(column + 0.5, row + 0.5);
                }
            scene.closest(rays, count, CAMERA, hits);
            if (has_passes) write_geometry(scene, rays, hits, count, passes, pixels);
            for (int i = 0; ends.depth && i < count; i++)
                ends.depth[pixels[i]] = hits[i].t, ends.object[pixels[i]] = hits[i].object, ends.primitive[pixels[i]] = hits[i].primitive;
        }
}

}  // namespace viewcam::VIEWCAM_ISA
