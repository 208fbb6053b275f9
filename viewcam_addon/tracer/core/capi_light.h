/* The part of the C interface that is about light: see capi.h. tracer/native.py has the same structures. */
#pragma once
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
