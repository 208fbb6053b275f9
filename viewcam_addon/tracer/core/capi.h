/* The C interface: structures and one table of functions for each instruction set. tracer/native.py is the only one that calls it.
 *
 * Arrays belong to the caller; those of meshes and spheres must outlive their scene, an image's pixels what gives light there, and
 * all others are copied. Functions that return an int return 0, or another number and leave a message: 1 without memory, 2 for what
 * checks.h refuses.
 */
#pragma once
#include <stddef.h>
#include <stdint.h>

/* image: a number of viewcam_add_texture, or −1. node: likewise, of viewcam_add_node. */
typedef struct {
    double rgb[3];
    int32_t image, closest, vertex, node;
} ViewcamColor;

/* An input of a closure or a node by its name in scene files. choice: of what is a word, or null. */
typedef struct {
    const char *name, *choice;
    ViewcamColor color;
} ViewcamInput;

/* A factor of a closure's weight. rest: whether it is 1 less the color's luminance. */
typedef struct {
    ViewcamColor value;
    int32_t rest;
} ViewcamMixFactor;

typedef struct {
    const char* name;
    const ViewcamInput* inputs;
    int32_t input_count;
} ViewcamNode;

typedef struct {
    ViewcamNode node;
    const ViewcamMixFactor* factors;
    int32_t factor_count;
} ViewcamClosure;

/* What an image's numbers are; whole ones are shares of 255 and 65535. RGBE: four bytes a pixel, of three channels. */
enum ViewcamTexel { VIEWCAM_FLOAT, VIEWCAM_HALF, VIEWCAM_BYTE, VIEWCAM_SHORT, VIEWCAM_RGBE };
enum ViewcamFilter { VIEWCAM_BOX, VIEWCAM_BLACKMAN_HARRIS, VIEWCAM_GAUSSIAN };
/* matrix: (3, 4), the lamp's space to the world's; a sun is seen towards its z. color: irradiance of a sun, power of others.
 * kind: its name, and the numbers that such a lamp has. multiple_importance: whether rays run into it.
 * receivers: a bit of ViewcamObject's lit_by, or all. shadow_rays: of which kind, a bit of `visible`. */
typedef struct {
    ViewcamNode kind;
    int32_t casts_shadow, multiple_importance;
    uint32_t hidden_from;
    double matrix[12], color[3];
    uint64_t receivers;
    uint32_t shadow_rays;
} ViewcamLamp;

/* image: a number of viewcam_add_texture, or −1; to_image: (3, 4), directions of the world to its. */
typedef struct {
    double radiance[3];
    int32_t image, closest;
    double to_image[12];
} ViewcamWorld;

/* backdrop: what the camera sees instead of the world, where it has one. version: of Blender, 100 times the first number and the second, whose materials are meant. */
typedef struct {
    ViewcamWorld world, backdrop;
    uint32_t hidden_from;
    int32_t transparent, version, has_backdrop, filter;
    double filter_width, exposure;
} ViewcamFilm;

/* bounces: in all, diffuse, glossy, transmission; surfaces gone straight through. error: 0 for the same number of samples everywhere. coincident: 0 for all light, or of
 * how many roundings of float32 surfaces are in one place, for the light alone that comes by these. */
typedef struct {
    int32_t bounces[5];
    uint32_t seed, samples;
    double error, coincident;
} ViewcamLightSettings;

typedef struct ViewcamScene ViewcamScene;
typedef struct ViewcamLight ViewcamLight;

/* vertices: (vertex_count, 3), object space. triangles: (count, 3). materials: (count,), slots of the object. The rest or null:
 * corner_normals: (count, 3, 3). corner_uvs: (count, 3, 2). corner_colors: (count, 3, 3), linear. attributes: each with values
 * (count, 3, width), width from 1 to 4. */
typedef struct {
    const char* name;
    int32_t width;
    const float* values;
} ViewcamAttribute;
typedef struct {
    size_t vertex_count, count;
    const double* vertices;
    const int32_t *triangles, *materials;
    const float *corner_normals, *corner_uvs, *corner_colors;
    const ViewcamAttribute* attributes;
    size_t attribute_count;
} ViewcamMesh;

typedef struct {
    size_t count;
    const double *centers, *radii;
    const int32_t* materials;
} ViewcamSpheres;

/* So many objects that differ by their matrices alone. geometry: its number, as they were added. visible: to which kinds of rays,
 * and above them to the shadow rays of which lights with blockers of their own. lit_by: which lights' receivers it is among.
 * receivers, shadow_rays: of its own light, as of lamps.
 * info: (count, 5), their colors, alphas and random numbers, or null where they are white and 0.
 * slots: for each material of the geometry, what the Material Index pass shows and the number of a material. */
typedef struct {
    uint32_t geometry, visible, slot_count, count;
    float index;
    const float* slot_indices;
    const uint32_t* slot_materials;
    uint64_t lit_by, receivers;
    uint32_t shadow_rays;
    const float* info;
} ViewcamObject;

/* In rendering space. t_min, t_max: planar depths. */
typedef struct {
    double eye[3], right[3], up[3], forward[3], principal_point[2], distance[2], t_min, t_max;
    uint32_t width, height;
} ViewcamCamera;

typedef struct {
    const char* name;             /* of the instruction set */
    size_t size;                  /* of this table, by which native.py knows a library of another version */
    const char* (*message)(void); /* what went wrong last in this thread */

    ViewcamScene* (*scene_create)(void);
    void (*scene_free)(ViewcamScene*);
    int (*add_mesh)(ViewcamScene*, const ViewcamMesh*);
    int (*add_spheres)(ViewcamScene*, const ViewcamSpheres*);
    int (*add_objects)(ViewcamScene*, const ViewcamObject*);
    /* matrices: (objects, 3, 4), to world space. origin: of rendering space, in the world. */
    int (*commit)(ViewcamScene*, const double* matrices, const double* origin, int threads);
    int (*set_camera)(ViewcamScene*, const ViewcamCamera*);
    size_t (*bytes)(const ViewcamScene*);

    /* planes: of each pass of integrators/geometry.h or null, its channels `stride` numbers apart. stop: or null; what it points to ends the work. */
    int (*render_geometry)(const ViewcamScene*, uint32_t first_row, uint32_t end_row, float* const* planes, size_t stride, const volatile int* stop);
    /* The same, and of each pixel what `closest` tells of a ray as long as the camera's axis. */
    int (*render_hits)(const ViewcamScene*, uint32_t first_row, uint32_t end_row, float* const* planes, size_t stride, double* depth, uint32_t* objects, uint32_t* primitives, const volatile int* stop);
    /* Whether anything is seen through the centers of a camera's pixels, whose axes need not have unit length: 0 or 1 each. */
    int (*silhouette)(const ViewcamScene*, const ViewcamCamera*, uint8_t* covered);
    int (*surface_at)(const ViewcamScene*, size_t count, const double* columns, const double* rows, float* const* planes);
    /* Of each of some places in the picture all surfaces that lie up to `within` times the nearest one's depth beyond it, the
     * nearest first; nothing is one, too. numbers: (count,), how many; written where planes is null, else read: the surfaces of the
     * first place, then those of the next. Each with how much UV and normal change there with each pixel, slopes: (2, stride), and
     * its object. */
    int (*surfaces_at)(const ViewcamScene*, size_t count, const double* columns, const double* rows, double within, uint32_t* numbers, float* const* planes, size_t stride, double* slopes, uint32_t* objects);
    /* rays: (count, 8), origin, direction, t_min, t_max, in rendering space. packets: whether they are traced as such. */
    int (*closest)(const ViewcamScene*, size_t count, const double* rays, uint32_t kind, int packets, double* t, uint32_t* objects, uint32_t* primitives);
    int (*occluded)(const ViewcamScene*, size_t count, const double* rays, int packets, uint8_t* hidden);

    int (*clear_light)(ViewcamScene*);
    /* channels: 3, or 4 with an alpha. */
    int (*add_texture)(ViewcamScene*, int width, int height, int channels, int srgb, int texel, const void* pixels);
    /* Of materials' inputs; it names nodes that were added before. */
    int (*add_node)(ViewcamScene*, const ViewcamNode*);
    /* Whether the last node is the same everywhere; value: receives what it is, and that as a number. */
    int (*constant_node)(const ViewcamScene*, double* value, int* is_constant);
    /* normal: in place of the smooth one; black where there is none. transparent_shadow: whether shadow rays go through it where it is transparent. */
    int (*add_material)(ViewcamScene*, const ViewcamClosure*, int count, const ViewcamColor* normal, int transparent_shadow);
    /* emission: what its light is multiplied by, at each place of the lamp and in each direction. */
    int (*add_lamp)(ViewcamScene*, const ViewcamLamp*, const ViewcamColor* emission);
    int (*set_film)(ViewcamScene*, const ViewcamFilm*);
    /* What is made must be freed before its scene, or what gives light there, changes. */
    int (*light_create)(const ViewcamScene*, const ViewcamLightSettings*, ViewcamLight** light);
    /* Learns where light comes from, if that pays: once, before the first tile. stop: or null; what it points to ends the work. */
    int (*learn_light)(ViewcamLight*, int threads, const volatile int* stop);
    void (*light_free)(ViewcamLight*);
    /* The objects, two and two, that paths have met in one place, and how often: the first `most`. Returns how many there are. */
    size_t (*light_pairs)(const ViewcamLight*, size_t most, uint32_t* objects, uint64_t* counts);
    /* A tile of 32 × 32 pixels, by its lowest row and its first column, until its pixels have so many samples: all, or fewer, to which
     * a later call adds. No two threads may trace the same tile. passes: those of film/film.h, of a whole picture, rows from the
     * bottom; those that nobody wants are null. */
    int (*trace_light)(ViewcamLight*, uint32_t row, uint32_t column, uint32_t samples, float* const* passes, const volatile int* stop);

    /* For tests: instance.cpp says what they are given and return. */
    int (*probe_sobol)(uint32_t seed, uint32_t samples, int scatterings, size_t, const uint32_t*, const uint32_t*, int first, int dimensions, double*);
    int (*probe_filter)(int shape, double width, size_t, const double*, double*);
    int (*probe_function)(int which, size_t, const double*, const double*, double*);
    int (*probe_specular)(double ratio, size_t, const double*, double*);
    int (*probe_sample_light)(const ViewcamLamp*, size_t, const double*, double*);
    int (*probe_light_le)(const ViewcamLamp*, size_t, const double*, double*);
    int (*probe_nodes)(const ViewcamScene*, size_t, const double*, double*);
    int (*probe_bsdf)(const ViewcamClosure*, int version, size_t, const double*, double*);
    int (*probe_leaving)(const ViewcamScene*, size_t, const double*, const double*, double*);
} ViewcamCore;

#ifdef _WIN32
#define VIEWCAM_EXPORT __declspec(dllexport)
#else
#define VIEWCAM_EXPORT __attribute__((visibility("default")))
#endif
#ifdef __cplusplus
extern "C"
#endif
/* The best instance that this processor runs, or that of an instruction set that is named; null if there is none of that name. */
VIEWCAM_EXPORT const ViewcamCore* viewcam_core(const char* name);
