// The arguments that the C interface refuses, with a sentence for each: whatever would be read or written outside of an array,
// or never come to an end.
//
// native.py gives none of it, so that who sees these sentences has found a fault in it. What a scene means is Python's to check.
#pragma once
#include <cmath>
#include <stdexcept>

#include "capi.h"
#include "integrators/adaptive.h"
#include "scene.h"

namespace viewcam::VIEWCAM_ISA::check {

constexpr double LARGEST = 1e18;  // the largest coordinate: squares of products with matrices are still numbers

inline void that(bool holds, const char* otherwise) {
    if (!holds) throw std::invalid_argument(otherwise);
}
// Also false of NaN.
inline bool all_within(const double* values, size_t count, double least, double most) {
    bool within = true;
    for (size_t i = 0; i < count; i++) within &= values[i] >= least && values[i] <= most;
    return within;
}
inline bool all_finite(const double* values, size_t count) {
    return all_within(values, count, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max());
}
// One more than the largest of some numbers of materials.
inline uint32_t materials(const int32_t* values, size_t count) {
    int32_t least = 0, most = 0;
    for (size_t i = 0; i < count; i++) least = std::min(least, values[i]), most = std::max(most, values[i]);
    that(least >= 0, "a geometry has a material below 0");
    return uint32_t(most) + 1;
}

inline void mesh(const ViewcamMesh& mesh) {
    that(mesh.count < LEAF && mesh.vertex_count < LEAF, "a mesh has too many triangles or vertices");
    that(!mesh.count || (mesh.vertices && mesh.triangles && mesh.materials), "a mesh lacks an array");
    that(all_within(mesh.vertices, 3 * mesh.vertex_count, -LARGEST, LARGEST), "a mesh has a vertex that is too far away or nowhere");
    bool within = true;
    for (size_t i = 0; i < 3 * mesh.count; i++) within &= uint32_t(mesh.triangles[i]) < mesh.vertex_count;
    that(within, "a mesh has a triangle that names no vertex");
    that(!mesh.attribute_count || mesh.attributes, "a mesh lacks its attributes");
    for (size_t i = 0; i < mesh.attribute_count; i++) {
        const ViewcamAttribute& attribute = mesh.attributes[i];
        that(attribute.name && attribute.width >= 1 && attribute.width <= 4 && (attribute.values || !mesh.count), "a mesh has an attribute without a name or values");
    }
}
inline void spheres(const ViewcamSpheres& spheres) {
    that(spheres.count < LEAF, "there are too many spheres");
    that(!spheres.count || (spheres.centers && spheres.radii && spheres.materials), "spheres lack an array");
    that(all_within(spheres.centers, 3 * spheres.count, -LARGEST, LARGEST), "a sphere is too far away or nowhere");
    that(all_within(spheres.radii, spheres.count, 0, LARGEST), "a sphere has a radius below 0, or too large a one");
}
inline void objects(const Scene& scene, const ViewcamObject& object) {
    that(object.geometry < scene.geometries.size(), "an object names no geometry");
    that(object.slot_count >= scene.material_counts[object.geometry], "an object has fewer materials than its geometry");
    that(object.slot_indices && object.slot_materials, "an object lacks an array");
    that(object.count < LEAF - scene.objects.size(), "there are too many objects");
}
inline void placement(const Scene& scene, const double* matrices, const double* origin, int threads) {
    that(!scene.objects.size() || matrices, "objects have no matrices");
    that(all_within(matrices, 12 * scene.objects.size(), -LARGEST, LARGEST), "an object has a matrix with too large a number, or none");
    that(all_within(origin, 3, -LARGEST, LARGEST), "the origin is too far away or nowhere");
    that(threads >= 1 && threads <= 4096, "the number of threads is not between 1 and 4096");
}
inline void camera(const ViewcamCamera& camera) {
    for (const double* axis : {camera.eye, camera.right, camera.up, camera.forward})
        that(all_within(axis, 3, -LARGEST, LARGEST), "the camera is too far away or nowhere");
    that(all_finite(camera.principal_point, 2) && all_finite(camera.distance, 2), "the camera's view plane is nowhere");
    that(camera.distance[0] != 0 && camera.distance[1] != 0, "the camera's view plane is at its eye");
    that(camera.t_min < camera.t_max, "the camera's clip range is empty");
    that(camera.width < LEAF && camera.height < LEAF, "the picture is too large");
}
inline void rows(const Scene& scene, uint32_t first, uint32_t end) {
    that(first <= end && end <= scene.camera.height, "rows are asked for that the picture does not have");
}
inline void texture(int width, int height, int channels, int texel, const void* pixels) {
    that(width > 0 && height > 0 && pixels && (channels == 3 || channels == 4), "an image has no pixels");
    that(channels == 3 || texel != VIEWCAM_RGBE, "an image of RGBE has an alpha");
    that(texel >= VIEWCAM_FLOAT && texel <= VIEWCAM_RGBE, "an image has pixels of no kind");
}
inline void color(const Scene& scene, const ViewcamColor& color) {
    that(color.image < int64_t(scene.illumination.textures.size()), "a color is that of an image that the scene does not have");
}
inline void node(const Scene& scene, const ViewcamNode& node) {
    for (int i = 0; i < node.input_count; i++) color(scene, node.inputs[i].color);
}
inline void material(const Scene& scene, const ViewcamClosure* closures, int count, const ViewcamColor& normal) {
    color(scene, normal);
    for (int i = 0; i < count; i++) {
        node(scene, closures[i].node);
        for (int j = 0; j < closures[i].factor_count; j++) color(scene, closures[i].factors[j].value);
    }
}
inline void lamp(const ViewcamLamp& lamp) {
    that(all_within(lamp.matrix, 12, -LARGEST, LARGEST), "a lamp has a matrix with too large a number, or none");
    that(all_finite(lamp.color, 3), "a lamp has a color that is no number");
    for (int i = 0; i < lamp.kind.input_count; i++) {
        const ViewcamColor& input = lamp.kind.inputs[i].color;
        that(all_within(input.rgb, 3, 0, LARGEST) && input.node < 0, "a lamp has a size that is no number");
    }
}
inline void film(const ViewcamFilm& film) {
    for (const ViewcamWorld& world : {film.world, film.backdrop}) {
        that(all_finite(world.radiance, 3), "the world's light is no number");
        that(all_finite(world.to_image, 12), "the world is turned by what is no number");
    }
    that(film.filter >= VIEWCAM_BOX && film.filter <= VIEWCAM_GAUSSIAN, "the film's filter is of no shape");
    that(film.filter_width >= 0 && film.filter_width <= LARGEST && std::isfinite(film.exposure), "the film's numbers are none");
}
inline void light(const Scene& scene, const ViewcamLightSettings& settings) {
    for (const Scene::Slot& slot : scene.slots)
        that(slot.material < scene.illumination.materials.size(), "an object has a material that the scene does not have");
    for (int bounces : settings.bounces) that(bounces >= 0, "the number of bounces is below 0");
    that(settings.samples >= 1 && settings.samples <= 1 << 24, "the number of samples is not between 1 and 2^24");
    that(settings.coincident >= 0 && settings.coincident <= LARGEST, "surfaces in one place are less than 0 roundings apart, or too many");
    that(settings.error >= 0 && std::isfinite(settings.error), "the error is below 0, or no number");
}
inline void tile(const TileSampler& light, uint32_t row, uint32_t column, uint32_t samples, const LightPasses& to) {
    that(row < light.camera().height && column < light.camera().width && row % light.TILE == 0 && column % light.TILE == 0, "a tile is asked for that the picture does not have");
    that(samples >= 1 && samples <= light.samples(), "a tile is asked for more samples than there are");
    that(to.plane[LightPasses::COMBINED], "the pass Combined has no place to go");
}

}  // namespace viewcam::VIEWCAM_ISA::check
