// The functions behind the part of the C interface that is about light.
#pragma once
#include "capi.h"
#include "integrators/adaptive.h"

namespace viewcam::VIEWCAM_ISA {

inline Vec3 vector(const double* v) { return {v[0], v[1], v[2]}; }

inline void add_texture(Scene& scene, int width, int height, int channels, bool srgb, int texel, const void* pixels) {
    scene.illumination.textures.push_back({width, height, srgb, pixels, channels, Texel(texel)});
}

inline Color color_of(const ViewcamColor& given, const ValueNodes& nodes) {
    Vec3 rgb{given.rgb[0], given.rgb[1], given.rgb[2]};
    auto number = [](int32_t n) { return n < 0 ? NONE : uint32_t(n); };
    return nodes.resolved({rgb, number(given.image), number(given.node), bool(given.closest), bool(given.vertex)});
}
inline Inputs inputs_of(const ViewcamNode& given, const ValueNodes& nodes) {
    std::vector<Input> inputs;
    for (int i = 0; i < given.input_count; i++)
        inputs.push_back({given.inputs[i].name, given.inputs[i].choice ? given.inputs[i].choice : "", color_of(given.inputs[i].color, nodes)});
    return Inputs(std::move(inputs));
}
inline void add_node(Scene& scene, const ViewcamNode& given) {
    Illumination& light = scene.illumination;
    light.nodes.add(given.name, inputs_of(given, light.nodes), light.textures);
}
inline WeightedClosure closure_of(const ViewcamClosure& given, const ValueNodes& nodes) {
    Inputs inputs = inputs_of(given.node, nodes);
    WeightedClosure made{of_name<Closure>("closure", given.node.name, inputs), {}, !inputs.all_constant(), nodes.need_tangents(inputs)};
    for (int i = 0; i < given.factor_count; i++) {
        made.factors.push_back({color_of(given.factors[i].value, nodes), bool(given.factors[i].rest)});
        made.varies |= made.factors.back().value.varies();
        made.on_tangents |= nodes.need_tangents(Inputs({{"", "", made.factors.back().value}}));
    }
    return made;
}
inline void add_material(Scene& scene, const ViewcamClosure* closures, int count, const ViewcamColor& normal, bool transparent_shadow) {
    const ValueNodes& nodes = scene.illumination.nodes;
    Material material;
    material.transparent_shadow = transparent_shadow;
    material.normal = color_of(normal, nodes), material.normal_on_tangents = nodes.need_tangents(Inputs({{"", "", material.normal}}));
    for (int i = 0; i < count; i++) material.closures.push_back(closure_of(closures[i], nodes));
    material.prepare(scene.illumination.textures);
    scene.illumination.materials.push_back(std::move(material));
}

// In rendering space, whose origin is given in the world's.
inline Lamp lamp_of(const ViewcamLamp& given, Vec3 color, Vec3 origin) {
    Affine placed;
    for (int i = 0; i < 12; i++) placed.m[i / 4][i % 4] = given.matrix[i];
    placed.m[0][3] -= origin.x, placed.m[1][3] -= origin.y, placed.m[2][3] -= origin.z;
    Lamp lamp{of_name<LampOr<>>("lamp", given.kind.name, placed, color, inputs_of(given.kind, {})), placed.translation()};
    lamp.casts_shadow = given.casts_shadow, lamp.multiple_importance = given.multiple_importance, lamp.hidden_from = given.hidden_from;
    lamp.receivers = given.receivers, lamp.shadow_rays = RayKind(given.shadow_rays);
    return lamp;
}
inline void add_lamp(Scene& scene, const ViewcamLamp& given, const ViewcamColor& emission) {
    Vec3 color = vector(given.color);
    Color factor = color_of(emission, scene.illumination.nodes);
    if (!factor.varies()) color *= max(factor.rgb, 0);
    if (is_black(color)) return;
    scene.illumination.lamps.push_back(lamp_of(given, color, scene.origin));
    scene.illumination.lamps.back().emission = factor;
}

inline Environment environment_of(const ViewcamWorld& given, uint32_t hidden_from, const std::vector<Texture>& textures, int threads) {
    Environment world;
    world.radiance = {given.radiance[0], given.radiance[1], given.radiance[2]}, world.hidden_from = hidden_from;
    world.image = given.image < 0 ? NONE : uint32_t(given.image), world.closest = given.closest;
    for (int i = 0; i < 12; i++) world.to_image.m[i / 4][i % 4] = given.to_image[i];
    if (world.image != NONE && world.image >= textures.size()) throw std::invalid_argument("the world has an image that the scene does not have");
    world.prepare(textures, threads);
    return world;
}
inline void set_film(Scene& scene, const ViewcamFilm& given) {
    Illumination& light = scene.illumination;
    light.environment = environment_of(given.world, given.hidden_from, light.textures, scene.threads);
    light.backdrop.reset();
    if (given.has_backdrop) light.backdrop = environment_of(given.backdrop, given.hidden_from, light.textures, scene.threads);
    light.film = {bool(given.transparent), given.exposure};
    light.filter = FilterShape(given.filter), light.filter_width = given.filter_width, light.version = given.version;
    scene.make_tangents();
}
inline void clear_light(Scene& scene) { scene.illumination = {}; }

inline TileSampler* create_light(const Scene& scene, const ViewcamLightSettings& given) {
    Bounces bounces{given.bounces[0], given.bounces[1], given.bounces[2], given.bounces[3], given.bounces[4]};
    return new TileSampler(scene, bounces, given.seed, given.samples, given.error, given.coincident);
}
// Probes: the formulas one by one, for tests. All arrays are rows of so many numbers.
namespace probe {

inline void sobol(uint32_t seed, uint32_t samples, int scatterings, size_t count, const uint32_t* pixels, const uint32_t* numbers, int first,
                  int dimensions, double* out) {
    SobolSampler sampler(seed, int(samples), scatterings);
    for (size_t i = 0; i < count; i++)
        for (int d = 0; d < dimensions; d++) out[i * size_t(dimensions) + d] = sampler.number(sampler.key(pixels[i]), numbers[i], first + d);
}
// u, out: (count, 2).
inline void filter(int shape, double width, size_t count, const double* u, double* out) {
    Filter filter(FilterShape(shape), width);
    for (size_t i = 0; i < count; i++) {
        Vec2x4 offset = filter.offset({splat4(u[2 * i]), splat4(u[2 * i + 1])});
        out[2 * i] = offset.x[0], out[2 * i + 1] = offset.y[0];
    }
}
// name: "asin", …; b: of atan2 and pow.
inline void function(int which, size_t count, const double* a, const double* b, double* out) {
    for (size_t i = 0; i < count; i++) switch (which) {
            case 0: out[i] = sincos_of_turns(a[i]).sin; break;
            case 1: out[i] = sincos_of_turns(a[i]).cos; break;
            case 2: out[i] = asin(a[i]); break;
            case 3: out[i] = acos(a[i]); break;
            case 4: out[i] = atan2(a[i], b[i]); break;
            case 5: out[i] = pow(a[i], b[i]); break;
            case 6: out[i] = fresnel(a[i], b[i]); break;
        }
}
// given: (count, 9), incoming, normal, shading. out: (count, 9), the bent normal, where a mirror and where a surface of that ratio
// sends the ray.
inline void specular(double ratio, size_t count, const double* given, double* out) {
    for (size_t i = 0; i < count; i++) {
        Interaction point;
        Vec3 incoming = vector(given + 9 * i);
        point.normal = vector(given + 9 * i + 3), point.shading = vector(given + 9 * i + 6);
        Vec3 normal = specular_normal(incoming, point.normal, point.shading), found[3] = {normal, reflected(incoming, normal), refracted(incoming, normal, ratio)};
        for (int k = 0; k < 3; k++)
            for (int axis = 0; axis < 3; axis++) out[9 * i + 3 * k + axis] = found[k][axis];
    }
}
// given: (count, 8), position, normal, u. out: (count, 11), direction, distance, weight, pdf, pdf_li of the direction, cosine,
// estimate.
inline void sample_light(const ViewcamLamp& lamp, size_t count, const double* given, double* out) {
    Light light = light_of(lamp_of(lamp, vector(lamp.color), {}));
    for (size_t i = 0; i < count; i++, given += 8, out += 11) {
        Interaction from;
        from.position = {given[0], given[1], given[2]};
        from.normal = from.shading = {given[3], given[4], given[5]};
        LightSample sample = light.sample_li(from, 0, {given[6], given[7]});
        double row[11] = {sample.direction.x, sample.direction.y, sample.direction.z, sample.distance, sample.weight.x, sample.weight.y,
                          sample.weight.z, sample.pdf, light.pdf_li(from, sample.direction), sample.cosine,
                          light.estimate(from.position, from.normal)};
        std::copy(row, row + 11, out);
    }
}
// given: (count, 9), origin, direction, nearest and farthest distance, whether the ray escapes. out: (count, 3).
inline void light_le(const ViewcamLamp& lamp, size_t count, const double* given, double* out) {
    Light light = light_of(lamp_of(lamp, vector(lamp.color), {}));
    for (size_t i = 0; i < count; i++, given += 9, out += 3) {
        double distance;
        Vec3 radiance = light.le({{given[0], given[1], given[2]}, {given[3], given[4], given[5]}, given[6], given[7], given[8] != 0}, distance);
        out[0] = radiance.x, out[1] = radiance.y, out[2] = radiance.z;
    }
}
// Rays that leave what others meet. rays: (count, 8), from the eye. lights: (count, 5), of each a light's direction, its distance and
// its cosine. out: (count, 11), position, normal, t, where the ray to the light starts, and how far it goes; nan where nothing is met.
inline void leaving(const Scene& scene, size_t count, const double* rays, const double* lights, double* out) {
    for (size_t i = 0; i < count; i++, rays += 8, lights += 5, out += 11) {
        Ray ray{{rays[0], rays[1], rays[2]}, {rays[3], rays[4], rays[5]}, rays[6], rays[7]};
        std::fill(out, out + 11, std::numeric_limits<double>::quiet_NaN());
        Hit hit = scene.closest(ray, CAMERA);
        if (!hit) continue;
        Interaction point = scene.interaction(ray, hit);
        LightSample light;
        light.direction = {lights[0], lights[1], lights[2]}, light.distance = lights[3], light.cosine = lights[4];
        Ray onwards = shadow_ray(point, light);
        for (int axis = 0; axis < 3; axis++)
            out[axis] = point.position[axis], out[3 + axis] = point.normal[axis], out[7 + axis] = onwards.origin[axis];
        out[6] = point.t, out[10] = onwards.t_max;
    }
}
// A closure on a floor, z up. given: (count, 10), the unit way that a path came along, a unit direction to a light, whether the
// floor is met from behind, and three numbers. out: (count, 12), eval and pdf of the direction; of what is sampled the direction,
// weight, pdf and the kind of ray.
inline void bsdf(const ViewcamClosure& closure, int version, size_t count, const double* given, double* out) {
    Material material;
    material.closures.push_back(closure_of(closure, {}));
    std::vector<Texture> none;
    for (size_t i = 0; i < count; i++, given += 10, out += 12) {
        Interaction point;
        point.normal = point.shading = {0, 0, 1}, point.backside = given[6] != 0;
        Vec3 direction{given[3], given[4], given[5]};
        BSDF bsdf = material.bsdf(ShadingPoint{point, {given[0], given[1], given[2]}, none, version});
        double pdf = 0;
        ScatteredLight light = bsdf.eval(direction, direction.z > 0 ? DIFFUSE | GLOSSY : TRANSMISSION, [&](RayKind, auto&& of_lobe) {
            pdf += of_lobe();
            return 1;
        });
        Vec3 sum = light.diffuse + light.other;
        BSDFSample sample;
        if (!bsdf.is_black()) sample = bsdf.sample(given[7], [&] { return Vec2{given[8], given[9]}; });
        double row[12] = {sum.x, sum.y, sum.z, pdf, sample.direction.x, sample.direction.y, sample.direction.z, sample.weight.x, sample.weight.y,
                          sample.weight.z, sample.pdf, double(sample.kind)};
        std::copy(row, row + 12, out);
    }
}
// The value of the last of some nodes on a floor, z up, whose UV is (u, v). given: (count, 6), the unit way that a path came
// along, u, v, and whether the floor is met from behind. out: (count, 4), a color or vector, and the number that it is.
inline void nodes(const Scene& scene, size_t count, const double* given, double* out) {
    const Illumination& light = scene.illumination;
    if (light.nodes.all.empty()) throw std::invalid_argument("there is no node");
    auto last = uint32_t(light.nodes.all.size() - 1);
    for (size_t i = 0; i < count; i++, given += 6, out += 4) {
        Interaction point;
        point.normal = point.shading = {0, 0, 1}, point.uv = {given[3], given[4]}, point.backside = given[5] != 0;
        ShadingPoint at{point, {given[0], given[1], given[2]}, light.textures, light.version, &light.nodes};
        Vec3 value = light.nodes.value(last, at);
        double row[4] = {value.x, value.y, value.z, light.nodes.number(last, at)};
        std::copy(row, row + 4, out);
    }
}

}  // namespace probe

}  // namespace viewcam::VIEWCAM_ISA
