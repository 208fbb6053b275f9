// All of a scene that gives or scatters light, as it was described: images, materials, lights, the world and the film.
#pragma once
#include <optional>
#include <vector>

#include "film/film.h"
#include "film/filter.h"
#include "lights/environment.h"
#include "lights/lamps.h"
#include "material.h"
#include "nodes/value_node.h"

namespace viewcam::VIEWCAM_ISA {

struct Lamp {
    LampOr<> kind;  // in rendering space
    Vec3 middle;
    Color emission{{1, 1, 1}};  // what its light is multiplied by, at each place of the lamp and in each direction
    bool casts_shadow = true, multiple_importance = true;
    uint32_t hidden_from = 0;
    uint64_t receivers = EVERYTHING;    // which of the sets that objects are in it lights
    RayKind shadow_rays = SHADOW;  // of its own blockers, where it has such
};

// The most scatterings of light before it must reach a lamp: in all, and by each kind of surface; and how often it may go
// straight through a surface. Cycles' own counting.
struct Bounces {
    int total = 0, diffuse = 0, glossy = 0, transmission = 0, transparent = 0;
};

struct Illumination {
    std::vector<Texture> textures;
    ValueNodes nodes;
    std::vector<Material> materials;
    std::vector<Lamp> lamps;
    Environment environment;
    std::optional<Environment> backdrop;  // what the camera sees instead
    FilmSettings film;
    FilterShape filter = BOX;
    double filter_width = 1;  // pixels
    Bounces bounces;
    int version = CYCLES_5_2;  // whose Cycles computes materials so
};

}  // namespace viewcam::VIEWCAM_ISA
