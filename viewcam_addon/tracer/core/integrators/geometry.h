// Level `geometry`: the surfaces that rays of the camera meet, as passes. What a tolerance applies to is computed in float64 and
// rounded once, to the pass's float32.
#pragma once
#include "../capi.h"
#include "../scene.h"

namespace viewcam::VIEWCAM_ISA {

// Where the passes' values go: channel c of the pass p and the pixel i to plane[p][c · stride + i]; nullptr is not wanted.
struct GeometryPasses {
    enum Pass { DEPTH, POSITION, NORMAL, UV, OBJECT_INDEX, MATERIAL_INDEX, MAGNITUDE, FACING, COUNT };  // as image.py lists them

    float* const* plane;
    size_t stride;

    // The pass of some pixels, value_of(i) → a number or a Vec3 each.
    template <class ValueOf> void write(Pass pass, const size_t* pixels, int count, const ValueOf& value_of) const {
        float* to = plane[pass];
        for (int i = 0; to && i < count; i++) {
            if constexpr (std::is_same_v<decltype(value_of(0)), Vec3>) {
                Vec3 value = value_of(i);
                to[pixels[i]] = float(value.x), to[stride + pixels[i]] = float(value.y), to[2 * stride + pixels[i]] = float(value.z);
            } else {
                to[pixels[i]] = float(value_of(i));
            }
        }
    }
    bool any() const {
        return std::any_of(plane, plane + COUNT, [](const float* each) { return each; });
    }
};

// Where, and on what, the rays of the pixels end, in float64; null is not wanted. Where nothing is: infinity and NO_HIT twice.
struct GeometryHits {
    double* depth;
    uint32_t *object, *primitive;
};

// Writes what up to 64 rays met as Cycles writes it, also where that is nothing. ray_of(i), hit_of(i): each. pixels: their
// places in the planes.
template <class RayOf, class HitOf>
inline void write_geometry(const Scene& scene, const RayOf& ray_of, const HitOf& hit_of, int count, const GeometryPasses& passes, const size_t* pixels) {
    using enum GeometryPasses::Pass;
    static constexpr double BACKGROUND_DEPTH = 1e10;
    Ray rays[PACKET];
    const Ray* met_by[PACKET];
    Hit met[PACKET];
    size_t at[PACKET], beside[PACKET];
    Interaction points[PACKET];
    double magnitudes[PACKET];
    int hit_count = 0, miss_count = 0;
    for (int i = 0; i < count; i++) {
        if (Hit hit = hit_of(i))
            rays[hit_count] = ray_of(i), met_by[hit_count] = &rays[hit_count], met[hit_count] = hit, at[hit_count++] = pixels[i];
        else
            beside[miss_count++] = pixels[i];
    }
    passes.write(DEPTH, beside, miss_count, [](int) { return BACKGROUND_DEPTH; });
    for (GeometryPasses::Pass pass : {POSITION, NORMAL, UV}) passes.write(pass, beside, miss_count, [](int) { return Vec3{}; });
    for (GeometryPasses::Pass pass : {OBJECT_INDEX, MATERIAL_INDEX, MAGNITUDE, FACING})
        passes.write(pass, beside, miss_count, [](int) { return 0.0; });
    if (!hit_count) return;

    scene.interactions(met_by, met, hit_count, points, passes.plane[MAGNITUDE] ? magnitudes : nullptr);
    passes.write(DEPTH, at, hit_count, [&](int i) { return points[i].t; });
    passes.write(POSITION, at, hit_count, [&](int i) { return met_by[i]->direction * points[i].t + (scene.origin + met_by[i]->origin); });
    passes.write(NORMAL, at, hit_count, [&](int i) { return points[i].shading; });
    passes.write(UV, at, hit_count, [&](int i) { return Vec3{points[i].uv.x, points[i].uv.y, points[i].has_uv ? 1.0 : 0.0}; });
    passes.write(OBJECT_INDEX, at, hit_count, [&](int i) { return scene.objects[points[i].object].index; });
    passes.write(MATERIAL_INDEX, at, hit_count, [&](int i) { return scene.slots[points[i].slot].index; });
    passes.write(FACING, at, hit_count, [&](int i) { return max(0.0, min(points[i].cosine, 1.0)); });
    passes.write(MAGNITUDE, at, hit_count, [&](int i) { return max(max_component(abs(scene.origin + met_by[i]->origin)), magnitudes[i]); });
}

// The change with each pixel of the UV and the normal of what the eye's ray through a place in the picture meets: of its own
// plane, triangle or sphere, whatever lies beside it. The root of the sum of both axes' squares, which no direction exceeds. Of
// a flat triangle the rounding of its corners turns the normal, too, by what a shift of the picture is of its height in pixels.
inline void slopes_at(const Scene& scene, double column, double row, const Hit& hit, double& uv, double& normal) {
    constexpr double STEP = 0x1p-16, FLAT = 1e-6;  // no triangle that shows is so small, and float64 has 20 digits to spare
    const Ray rays[] = {scene.camera.ray(column, row), scene.camera.ray(column - STEP, row), scene.camera.ray(column + STEP, row),
                        scene.camera.ray(column, row - STEP), scene.camera.ray(column, row + STEP)};
    const Ray* met_by[] = {&rays[0], &rays[1], &rays[2], &rays[3], &rays[4]};
    const Hit hits[] = {hit, hit, hit, hit, hit};
    Interaction points[5];
    scene.interactions(met_by, hits, 5, points);
    uv = normal = 0;
    for (int axis = 0; axis < 2; axis++) {
        double of_uv = 0, of_normal = 0;
        for (int side = 1; side < 3; side++) {
            const Interaction& beside = points[2 * axis + side];
            Vec2 moved{beside.uv.x - points[0].uv.x, beside.uv.y - points[0].uv.y};
            of_uv = max(of_uv, moved.x * moved.x + moved.y * moved.y);
            Vec3 turned = beside.shading - points[0].shading;
            if (beside.t < INFINITE) of_normal = max(of_normal, dot(turned, turned));  // not of a ray that a sphere's rim is beside
        }
        uv += of_uv, normal += of_normal;
    }
    uv = std::sqrt(uv) / STEP, normal = std::sqrt(normal) / STEP;
    Vec3 smooth = points[0].shading - points[0].normal;
    if (scene.triangle_count(hit.object) && dot(smooth, smooth) < FLAT * FLAT) {
        Vec3 corner[3];
        scene.corners(hit.object, hit.primitive, corner);
        Vec3 first = corner[1] - corner[0], second = corner[2] - corner[0], third = corner[2] - corner[1];
        double longest = max(length(first), max(length(second), length(third)));
        normal += longest / length(cross(first, second)) * hit.t / max(scene.camera.distance.x, scene.camera.distance.y);
    }
}

// trace(rays, pixels, count) for the pixel centers of some rows, from the bottom, in blocks of 16 × 4, as many columns as fill the
// cache lines of the passes; `*stop`, if there is one, ends it early.
template <class Trace> void for_pixel_centers(const Camera& camera, uint32_t begin, uint32_t end, const volatile int* stop, const Trace& trace) {
    constexpr uint32_t WIDTH = 16, HEIGHT = 4;
    static_assert(WIDTH * HEIGHT <= PACKET);
    Rays& rays = of_this_thread<Rays>();
    double columns[WIDTH * HEIGHT] = {}, rows[WIDTH * HEIGHT] = {};
    size_t pixels[WIDTH * HEIGHT];
    for (uint32_t first_row = begin; first_row < end; first_row += HEIGHT)
        for (uint32_t first_column = 0; first_column < camera.width; first_column += WIDTH) {
            if (stop && *stop) return;
            int count = 0;
            for (uint32_t row = first_row; row < std::min(first_row + HEIGHT, end); row++)
                for (uint32_t column = first_column; column < std::min(first_column + WIDTH, camera.width); column++) {
                    pixels[count] = size_t(row) * camera.width + column;
                    columns[count] = column + 0.5, rows[count++] = row + 0.5;
                }
            camera.rays(columns, rows, count, rays);
            trace(rays, pixels, count);
        }
}

inline void render_geometry(
    const Scene& scene, uint32_t begin, uint32_t end, const GeometryPasses& passes, const GeometryHits& ends, const volatile int* stop
) {
    const bool has_passes = passes.any();
    for_pixel_centers(scene.camera, begin, end, stop, [&](const Rays& rays, const size_t* pixels, int count) {
        Hits& hits = of_this_thread<Hits>();
        scene.closest(rays, count, CAMERA, hits);
        if (has_passes) write_geometry(scene, [&](int i) { return rays.ray(i); }, [&](int i) { return hits.hit(i); }, count, passes, pixels);
        for (int i = 0; ends.depth && i < count; i++) {
            Hit hit = hits.hit(i);
            ends.depth[pixels[i]] = hit.t, ends.object[pixels[i]] = hit.object, ends.primitive[pixels[i]] = hit.primitive;
        }
    });
}

// Notes for each pixel of a camera whether its center shows anything at all.
inline void silhouette(const Scene& scene, const Camera& camera, uint8_t* covered) {
    for_pixel_centers(camera, 0, camera.height, nullptr, [&](const Rays& rays, const size_t* pixels, int count) {
        bool hidden[PACKET];
        scene.occluded(rays, count, hidden);
        for (int i = 0; i < count; i++) covered[pixels[i]] = hidden[i];
    });
}

}  // namespace viewcam::VIEWCAM_ISA
