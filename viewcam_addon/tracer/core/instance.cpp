// All of the core, compiled for one instruction set, VIEWCAM_ISA, as the table of functions that capi.h describes.
#include <exception>
#include <new>
#include <string>

#include "capi.h"
#include "checks.h"
#include "integrators/adaptive.h"
#include "integrators/geometry.h"

#define VIEWCAM_NAME_OF(x) #x
#define VIEWCAM_NAME(x) VIEWCAM_NAME_OF(x)

namespace viewcam::VIEWCAM_ISA {
namespace {

std::string& message() {
    static thread_local std::string text;
    return text;
}

// 0, or what an exception becomes: no C++ exception leaves the library. 1: there is no memory left. 2: anything else.
template <class Work> int guarded(const Work& work) {
    try {
        work();
        return 0;
    } catch (const std::bad_alloc&) {
        message() = "there is not enough memory";
        return 1;
    } catch (const std::exception& error) {
        message() = error.what();
        return 2;
    }
}

Scene& scene_of(ViewcamScene* scene) { return *reinterpret_cast<Scene*>(scene); }
const Scene& scene_of(const ViewcamScene* scene) { return *reinterpret_cast<const Scene*>(scene); }
const TileSampler& light_of(const ViewcamLight* light) { return *reinterpret_cast<const TileSampler*>(light); }
TileSampler& light_of(ViewcamLight* light) { return *reinterpret_cast<TileSampler*>(light); }

// (n, 8): origins, directions, t_min, t_max.
const Ray* rays_of(const double* rows) {
    static_assert(sizeof(Ray) == 8 * sizeof(double) && offsetof(Ray, t_max) == 7 * sizeof(double));
    return reinterpret_cast<const Ray*>(rows);
}
const Rays& packet_of(const Ray* rays, int count) {
    Rays& packet = of_this_thread<Rays>();
    for (int i = 0; i < count; i++) packet.set(i, rays[i]);
    packet.fill(count);
    return packet;
}
Vec3 vector(const double* v) { return {v[0], v[1], v[2]}; }
Camera camera_of(const ViewcamCamera& source) {
    Camera camera;
    camera.eye = vector(source.eye), camera.right = vector(source.right), camera.up = vector(source.up), camera.forward = vector(source.forward);
    camera.principal_point = {source.principal_point[0], source.principal_point[1]};
    camera.distance = {source.distance[0], source.distance[1]};
    camera.t_min = source.t_min, camera.t_max = source.t_max, camera.width = source.width, camera.height = source.height;
    return camera;
}

void add_texture(Scene& scene, int width, int height, int channels, bool srgb, int texel, const void* pixels) {
    scene.illumination.textures.push_back({width, height, srgb, pixels, channels, Texel(texel)});
}

Color color_of(const ViewcamColor& color, const ValueNodes& nodes) {
    Vec3 rgb{color.rgb[0], color.rgb[1], color.rgb[2]};
    auto number = [](int32_t n) { return n < 0 ? NONE : uint32_t(n); };
    return nodes.resolved({rgb, number(color.image), number(color.node), bool(color.closest), bool(color.vertex)});
}
Inputs inputs_of(const ViewcamNode& node, const ValueNodes& nodes) {
    std::vector<Input> inputs;
    for (int i = 0; i < node.input_count; i++)
        inputs.push_back({node.inputs[i].name, node.inputs[i].choice ? node.inputs[i].choice : "", color_of(node.inputs[i].color, nodes)});
    return Inputs(std::move(inputs));
}
void add_node(Scene& scene, const ViewcamNode& node) {
    Illumination& light = scene.illumination;
    light.nodes.add(node.name, inputs_of(node, light.nodes), light.textures);
}
WeightedClosure closure_of(const ViewcamClosure& closure, const ValueNodes& nodes) {
    Inputs inputs = inputs_of(closure.node, nodes);
    WeightedClosure weighted{of_name<Closure>("closure", closure.node.name, inputs), {}, !inputs.all_constant(), nodes.need_tangents(inputs)};
    for (int i = 0; i < closure.factor_count; i++) {
        weighted.factors.push_back({color_of(closure.factors[i].value, nodes), bool(closure.factors[i].rest)});
        weighted.varies |= weighted.factors.back().value.varies();
        weighted.on_tangents |= nodes.need_tangents(Inputs({{"", "", weighted.factors.back().value}}));
    }
    return weighted;
}
void add_material(Scene& scene, const ViewcamClosure* closures, int count, const ViewcamColor& normal, bool transparent_shadow) {
    const ValueNodes& nodes = scene.illumination.nodes;
    Material material;
    material.transparent_shadow = transparent_shadow;
    material.normal = color_of(normal, nodes), material.normal_on_tangents = nodes.need_tangents(Inputs({{"", "", material.normal}}));
    for (int i = 0; i < count; i++) material.closures.push_back(closure_of(closures[i], nodes));
    material.prepare(scene.illumination.textures);
    scene.illumination.materials.push_back(std::move(material));
}

// In rendering space, whose origin is given in the world's.
Lamp lamp_of(const ViewcamLamp& source, Vec3 color, Vec3 origin) {
    Affine placed;
    for (int i = 0; i < 12; i++) placed.m[i / 4][i % 4] = source.matrix[i];
    placed.m[0][3] -= origin.x, placed.m[1][3] -= origin.y, placed.m[2][3] -= origin.z;
    Lamp lamp{of_name<LampOr<>>("lamp", source.kind.name, placed, color, inputs_of(source.kind, {})), placed.translation()};
    lamp.casts_shadow = source.casts_shadow, lamp.multiple_importance = source.multiple_importance, lamp.hidden_from = source.hidden_from;
    lamp.receivers = source.receivers, lamp.shadow_rays = RayKind(source.shadow_rays);
    return lamp;
}
void add_lamp(Scene& scene, const ViewcamLamp& lamp, const ViewcamColor& emission) {
    Vec3 color = vector(lamp.color);
    Color factor = color_of(emission, scene.illumination.nodes);
    if (!factor.varies()) color *= max(factor.rgb, 0);
    if (is_black(color)) return;
    scene.illumination.lamps.push_back(lamp_of(lamp, color, scene.origin));
    scene.illumination.lamps.back().emission = factor;
}

Environment environment_of(const ViewcamWorld& source, uint32_t hidden_from, const std::vector<Texture>& textures, int threads) {
    Environment world;
    world.radiance = {source.radiance[0], source.radiance[1], source.radiance[2]}, world.hidden_from = hidden_from;
    world.image = source.image < 0 ? NONE : uint32_t(source.image), world.closest = source.closest;
    for (int i = 0; i < 12; i++) world.to_image.m[i / 4][i % 4] = source.to_image[i];
    if (world.image != NONE && world.image >= textures.size()) throw std::invalid_argument("the world has an image that the scene does not have");
    world.prepare(textures, threads);
    return world;
}
void set_film(Scene& scene, const ViewcamFilm& film) {
    Illumination& light = scene.illumination;
    light.environment = environment_of(film.world, film.hidden_from, light.textures, scene.threads);
    light.backdrop.reset();
    if (film.has_backdrop) light.backdrop = environment_of(film.backdrop, film.hidden_from, light.textures, scene.threads);
    light.film = {bool(film.transparent), film.exposure};
    light.filter = FilterShape(film.filter), light.filter_width = film.filter_width, light.version = film.version;
    scene.make_tangents();
}
void clear_light(Scene& scene) { scene.illumination = {}; }

TileSampler* create_light(const Scene& scene, const ViewcamLightSettings& settings) {
    Bounces bounces{settings.bounces[0], settings.bounces[1], settings.bounces[2], settings.bounces[3], settings.bounces[4]};
    return new TileSampler(scene, bounces, settings.seed, settings.samples, settings.error, settings.coincident);
}
// Probes: the formulas one by one, for tests. All arrays are rows of so many numbers.
namespace probe {

void sobol(uint32_t seed, uint32_t samples, int scatterings, size_t count, const uint32_t* pixels, const uint32_t* numbers, int first,
                  int dimensions, double* out) {
    SobolSampler sampler(seed, int(samples), scatterings);
    for (size_t i = 0; i < count; i++)
        for (int d = 0; d < dimensions; d++) out[i * size_t(dimensions) + d] = sampler.number(sampler.key(pixels[i]), numbers[i], first + d);
}
// u, out: (count, 2).
void filter(int shape, double width, size_t count, const double* u, double* out) {
    Filter filter(FilterShape(shape), width);
    for (size_t i = 0; i < count; i++) {
        Vec2x4 offset = filter.offset({splat4(u[2 * i]), splat4(u[2 * i + 1])});
        out[2 * i] = offset.x[0], out[2 * i + 1] = offset.y[0];
    }
}
// name: "asin", …; b: of atan2 and pow.
void function(int which, size_t count, const double* a, const double* b, double* out) {
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
// in: (count, 9), incoming, normal, shading. out: (count, 9), the bent normal, where a mirror and where a surface of that ratio
// sends the ray.
void specular(double ratio, size_t count, const double* in, double* out) {
    for (size_t i = 0; i < count; i++) {
        Interaction point;
        Vec3 incoming = vector(in + 9 * i);
        point.normal = vector(in + 9 * i + 3), point.shading = vector(in + 9 * i + 6);
        Vec3 normal = specular_normal(incoming, point.normal, point.shading), directions[3] = {normal, reflected(incoming, normal), refracted(incoming, normal, ratio)};
        for (int k = 0; k < 3; k++)
            for (int axis = 0; axis < 3; axis++) out[9 * i + 3 * k + axis] = directions[k][axis];
    }
}
// in: (count, 8), position, normal, u. out: (count, 11), direction, distance, weight, pdf, pdf_li of the direction, cosine,
// estimate.
void sample_light(const ViewcamLamp& lamp, size_t count, const double* in, double* out) {
    Light light = light_of(lamp_of(lamp, vector(lamp.color), {}));
    for (size_t i = 0; i < count; i++, in += 8, out += 11) {
        Interaction from;
        from.position = {in[0], in[1], in[2]};
        from.normal = from.shading = {in[3], in[4], in[5]};
        LightSample sample = light.sample_li(from, 0, {in[6], in[7]});
        double row[11] = {sample.direction.x, sample.direction.y, sample.direction.z, sample.distance, sample.weight.x, sample.weight.y,
                          sample.weight.z, sample.pdf, light.pdf_li(from, sample.direction), sample.cosine,
                          light.estimate(from.position, from.normal)};
        std::copy(row, row + 11, out);
    }
}
// in: (count, 9), origin, direction, nearest and farthest distance, whether the ray escapes. out: (count, 3).
void light_le(const ViewcamLamp& lamp, size_t count, const double* in, double* out) {
    Light light = light_of(lamp_of(lamp, vector(lamp.color), {}));
    for (size_t i = 0; i < count; i++, in += 9, out += 3) {
        double distance;
        Vec3 radiance = light.le({{in[0], in[1], in[2]}, {in[3], in[4], in[5]}, in[6], in[7], in[8] != 0}, distance);
        out[0] = radiance.x, out[1] = radiance.y, out[2] = radiance.z;
    }
}
// Rays that leave what others meet. rays: (count, 8), from the eye. lights: (count, 5), of each a light's direction, its distance and
// its cosine. out: (count, 11), position, normal, t, where the ray to the light starts, and how far it goes; nan where nothing is met.
void leaving(const Scene& scene, size_t count, const double* rays, const double* lights, double* out) {
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
// A closure on a floor, z up. in: (count, 10), the unit way that a path came along, a unit direction to a light, whether the
// floor is met from behind, and three numbers. out: (count, 12), eval and pdf of the direction; of what is sampled the direction,
// weight, pdf and the kind of ray.
void bsdf(const ViewcamClosure& closure, int version, size_t count, const double* in, double* out) {
    Material material;
    material.closures.push_back(closure_of(closure, {}));
    std::vector<Texture> none;
    for (size_t i = 0; i < count; i++, in += 10, out += 12) {
        Interaction point;
        point.normal = point.shading = {0, 0, 1}, point.backside = in[6] != 0;
        Vec3 direction{in[3], in[4], in[5]};
        BSDF bsdf = material.bsdf(ShadingPoint{point, {in[0], in[1], in[2]}, none, version});
        double pdf = 0;
        ScatteredLight light = bsdf.eval(direction, direction.z > 0 ? DIFFUSE | GLOSSY : TRANSMISSION, [&](RayKind, auto&& of_lobe) {
            pdf += of_lobe();
            return 1;
        });
        Vec3 sum = light.diffuse + light.other;
        BSDFSample sample;
        if (!bsdf.is_black()) sample = bsdf.sample(in[7], [&] { return Vec2{in[8], in[9]}; });
        double row[12] = {sum.x, sum.y, sum.z, pdf, sample.direction.x, sample.direction.y, sample.direction.z, sample.weight.x, sample.weight.y,
                          sample.weight.z, sample.pdf, double(sample.kind)};
        std::copy(row, row + 12, out);
    }
}
// The value of the last of some nodes on a floor, z up, whose UV is (u, v). in: (count, 6), the unit way that a path came
// along, u, v, and whether the floor is met from behind. out: (count, 4), a color or vector, and the number that it is.
void nodes(const Scene& scene, size_t count, const double* in, double* out) {
    const Illumination& light = scene.illumination;
    if (light.nodes.all.empty()) throw std::invalid_argument("there is no node");
    auto last = uint32_t(light.nodes.all.size() - 1);
    for (size_t i = 0; i < count; i++, in += 6, out += 4) {
        Interaction point;
        point.normal = point.shading = {0, 0, 1}, point.uv = {in[3], in[4]}, point.backside = in[5] != 0;
        ShadingPoint at{point, {in[0], in[1], in[2]}, light.textures, light.version, &light.nodes};
        Vec3 value = light.nodes.value(last, at);
        double row[4] = {value.x, value.y, value.z, light.nodes.number(last, at)};
        std::copy(row, row + 4, out);
    }
}

}  // namespace probe

}  // namespace

extern const ViewcamCore core;
const ViewcamCore core = {
    .name = VIEWCAM_NAME(VIEWCAM_ISA),
    .size = sizeof(ViewcamCore),
    .message = [] { return message().c_str(); },

    .scene_create = []() -> ViewcamScene* { return reinterpret_cast<ViewcamScene*>(new (std::nothrow) Scene); },
    .scene_free = [](ViewcamScene* scene) { delete &scene_of(scene); },
    .add_mesh =
        [](ViewcamScene* scene, const ViewcamMesh* source) {
            return guarded([&] {
                check::mesh(*source);
                scene_of(scene).material_counts.push_back(check::materials(source->materials, source->count));
                TriangleMesh mesh;
                mesh.vertex_count = source->vertex_count, mesh.count = source->count;
                mesh.vertices = source->vertices, mesh.triangles = source->triangles, mesh.materials = source->materials;
                mesh.corner_normals = source->corner_normals, mesh.corner_uvs = source->corner_uvs, mesh.corner_colors = source->corner_colors;
                for (size_t i = 0; i < mesh.vertex_count; i++) mesh.bounds.add(Vec3{mesh.vertices[3 * i], mesh.vertices[3 * i + 1], mesh.vertices[3 * i + 2]});
                for (size_t i = 0; i < source->attribute_count; i++) {
                    const ViewcamAttribute& attribute = source->attributes[i];
                    mesh.attributes.push_back({attribute.name, attribute.width, attribute.values});
                }
                scene_of(scene).geometries.push_back(std::move(mesh));
            });
        },
    .add_spheres =
        [](ViewcamScene* scene, const ViewcamSpheres* source) {
            return guarded([&] {
                check::spheres(*source);
                scene_of(scene).material_counts.push_back(check::materials(source->materials, source->count));
                Spheres spheres;
                spheres.count = source->count, spheres.centers = source->centers, spheres.radii = source->radii, spheres.materials = source->materials;
                scene_of(scene).geometries.push_back(std::move(spheres));
            });
        },
    .add_objects =
        [](ViewcamScene* scene, const ViewcamObject* source) {
            return guarded([&] {
                Scene& to = scene_of(scene);
                check::objects(to, *source);
                Object object;
                object.geometry = source->geometry, object.visible = source->visible, object.index = source->index;
                object.lit_by = source->lit_by, object.receivers = source->receivers, object.shadow_rays = RayKind(source->shadow_rays);
                object.first_slot = uint32_t(to.slots.size());
                for (uint32_t i = 0; i < source->count; i++) {
                    if (source->info) object.info = source->info + 5 * size_t(i);
                    to.objects.push_back(object);
                }
                for (uint32_t i = 0; i < source->slot_count; i++) to.slots.push_back({source->slot_indices[i], source->slot_materials[i]});
            });
        },
    .commit =
        [](ViewcamScene* scene, const double* matrices, const double* origin, int threads) {
            return guarded([&] {
                check::placement(scene_of(scene), matrices, origin, threads);
                scene_of(scene).origin = vector(origin);
                scene_of(scene).threads = threads;
                scene_of(scene).commit(matrices);
            });
        },
    .set_camera =
        [](ViewcamScene* scene, const ViewcamCamera* source) {
            return guarded([&] {
                check::camera(*source);
                scene_of(scene).camera = camera_of(*source);
            });
        },
    .bytes = [](const ViewcamScene* scene) { return scene_of(scene).bytes(); },

    .render_geometry =
        [](const ViewcamScene* scene, uint32_t first_row, uint32_t end_row, float* const* planes, size_t stride, const volatile int* stop) {
            return guarded([&] {
                check::rows(scene_of(scene), first_row, end_row);
                render_geometry(scene_of(scene), first_row, end_row, {planes, stride}, {}, stop);
            });
        },
    .render_hits =
        [](const ViewcamScene* scene, uint32_t first_row, uint32_t end_row, float* const* planes, size_t stride, double* depth, uint32_t* objects,
           uint32_t* primitives, const volatile int* stop) {
            return guarded([&] {
                check::rows(scene_of(scene), first_row, end_row);
                render_geometry(scene_of(scene), first_row, end_row, {planes, stride}, {depth, objects, primitives}, stop);
            });
        },
    .silhouette =
        [](const ViewcamScene* scene, const ViewcamCamera* camera, uint8_t* covered) {
            return guarded([&] {
                check::camera(*camera);
                silhouette(scene_of(scene), camera_of(*camera), covered);
            });
        },
    .surface_at =
        [](const ViewcamScene* scene, size_t count, const double* columns, const double* rows, float* const* planes) {
            return guarded([&] {
                const Scene& from = scene_of(scene);
                for (size_t i = 0; i < count; i++) {
                    Ray ray = from.camera.ray(columns[i], rows[i]);
                    Hit hit = from.closest(ray, CAMERA);
                    write_geometry(from, [&](int) { return ray; }, [&](int) { return hit; }, 1, {planes, count}, &i);
                }
            });
        },
    .surfaces_at =
        [](const ViewcamScene* scene, size_t count, const double* columns, const double* rows, double within, uint32_t* numbers,
           float* const* planes, size_t stride, double* slopes, uint32_t* objects) {
            return guarded([&] {
                const Scene& from = scene_of(scene);
                std::vector<Hit> hits;
                for (size_t i = 0, to = 0; i < count; i++) {
                    Ray ray = from.camera.ray(columns[i], rows[i]);
                    from.surfaces(ray, CAMERA, within, hits);
                    if (hits.empty()) hits.push_back({});
                    if (!planes) numbers[i] = uint32_t(hits.size());
                    for (size_t k = 0; planes && k < numbers[i]; k++, to++) {
                        write_geometry(from, [&](int) { return ray; }, [&](int) { return hits[k]; }, 1, {planes, stride}, &to);
                        objects[to] = hits[k].object;
                        slopes[to] = slopes[stride + to] = 0;
                        if (hits[k]) slopes_at(from, columns[i], rows[i], hits[k], slopes[to], slopes[stride + to]);
                    }
                }
            });
        },
    .closest =
        [](const ViewcamScene* scene, size_t count, const double* rows, uint32_t kind, int packets, double* t, uint32_t* objects, uint32_t* primitives) {
            return guarded([&] {
                Hits& hits = of_this_thread<Hits>();
                for (size_t first = 0; first < count; first += PACKET) {
                    const Ray* rays = rays_of(rows) + first;
                    int batch = int(std::min<size_t>(count - first, PACKET));
                    if (packets) scene_of(scene).closest(packet_of(rays, batch), batch, RayKind(kind), hits);
                    for (int i = 0; i < batch; i++) {
                        size_t k = first + size_t(i);
                        Hit hit = packets ? hits.hit(i) : scene_of(scene).closest(rays[i], RayKind(kind));
                        t[k] = hit.t, objects[k] = hit.object, primitives[k] = hit.primitive;
                    }
                }
            });
        },
    .occluded =
        [](const ViewcamScene* scene, size_t count, const double* rows, int packets, uint8_t* hidden) {
            return guarded([&] {
                bool is_hidden[PACKET];
                for (size_t first = 0; first < count; first += PACKET) {
                    const Ray* rays = rays_of(rows) + first;
                    int batch = int(std::min<size_t>(count - first, PACKET));
                    if (packets)
                        scene_of(scene).occluded(packet_of(rays, batch), batch, is_hidden);
                    else
                        for (int i = 0; i < batch; i++) is_hidden[i] = scene_of(scene).occluded(rays[i]);
                    for (int i = 0; i < batch; i++) hidden[first + size_t(i)] = is_hidden[i];
                }
            });
        },

    .clear_light = [](ViewcamScene* scene) { return guarded([&] { clear_light(scene_of(scene)); }); },
    .add_texture =
        [](ViewcamScene* scene, int width, int height, int channels, int srgb, int texel, const void* pixels) {
            return guarded([&] {
                check::texture(width, height, channels, texel, pixels);
                add_texture(scene_of(scene), width, height, channels, srgb, texel, pixels);
            });
        },
    .add_node =
        [](ViewcamScene* scene, const ViewcamNode* node) {
            return guarded([&] {
                check::node(scene_of(scene), *node);
                add_node(scene_of(scene), *node);
            });
        },
    .constant_node =
        [](const ViewcamScene* scene, double* value, int* is_constant) {
            return guarded([&] {
                const ValueNodes& nodes = scene_of(scene).illumination.nodes;
                check::that(!nodes.all.empty(), "there is no node");
                auto constant = std::get_if<ConstantNode>(&nodes.all.back());
                *is_constant = constant != nullptr;
                if (!constant) return;
                double all[4] = {constant->is.x, constant->is.y, constant->is.z, number_of(constant->is, constant->GIVES)};
                std::copy(all, all + 4, value);
            });
        },
    .add_material =
        [](ViewcamScene* scene, const ViewcamClosure* closures, int count, const ViewcamColor* normal, int transparent_shadow) {
            return guarded([&] {
                check::material(scene_of(scene), closures, count, *normal);
                add_material(scene_of(scene), closures, count, *normal, transparent_shadow);
            });
        },
    .add_lamp =
        [](ViewcamScene* scene, const ViewcamLamp* lamp, const ViewcamColor* emission) {
            return guarded([&] {
                check::lamp(*lamp);
                check::color(scene_of(scene), *emission);
                add_lamp(scene_of(scene), *lamp, *emission);
            });
        },
    .set_film =
        [](ViewcamScene* scene, const ViewcamFilm* film) {
            return guarded([&] {
                check::film(*film);
                set_film(scene_of(scene), *film);
            });
        },
    .light_create =
        [](const ViewcamScene* scene, const ViewcamLightSettings* settings, ViewcamLight** light) {
            return guarded([&] {
                check::light(scene_of(scene), *settings);
                *light = reinterpret_cast<ViewcamLight*>(create_light(scene_of(scene), *settings));
            });
        },
    .learn_light = [](ViewcamLight* light, int threads, const volatile int* stop) { return guarded([&] { light_of(light).learn(threads, stop); }); },
    .light_free = [](ViewcamLight* light) { delete &light_of(light); },
    .light_pairs = [](const ViewcamLight* light, size_t most, uint32_t* objects, uint64_t* counts) -> size_t {
        auto pairs = light_of(light).integrator().coincident_pairs();
        size_t i = 0;
        for (auto& [pair, count] : pairs) {
            if (i == most) break;
            objects[2 * i] = pair.first, objects[2 * i + 1] = pair.second, counts[i++] = count;
        }
        return pairs.size();
    },
    .trace_light =
        [](ViewcamLight* light, uint32_t row, uint32_t column, uint32_t samples, float* const* passes, const volatile int* stop) {
            return guarded([&] {
                check::tile(light_of(light), row, column, samples, {passes});
                light_of(light).trace(row, column, samples, {passes}, stop);
            });
        },

    .probe_sobol = [](uint32_t seed, uint32_t samples, int scatterings, size_t count, const uint32_t* pixels, const uint32_t* numbers, int first,
                      int dimensions, double* out) {
        return guarded([&] { probe::sobol(seed, samples, scatterings, count, pixels, numbers, first, dimensions, out); });
    },
    .probe_filter = [](int shape, double width, size_t count, const double* u, double* out) { return guarded([&] { probe::filter(shape, width, count, u, out); }); },
    .probe_function = [](int which, size_t count, const double* a, const double* b,
                         double* out) { return guarded([&] { probe::function(which, count, a, b, out); }); },
    .probe_specular = [](double ratio, size_t count, const double* in,
                         double* out) { return guarded([&] { probe::specular(ratio, count, in, out); }); },
    .probe_sample_light = [](const ViewcamLamp* lamp, size_t count, const double* in,
                             double* out) { return guarded([&] { probe::sample_light(*lamp, count, in, out); }); },
    .probe_light_le = [](const ViewcamLamp* lamp, size_t count, const double* in,
                         double* out) { return guarded([&] { probe::light_le(*lamp, count, in, out); }); },
    .probe_nodes = [](const ViewcamScene* scene, size_t count, const double* in,
                      double* out) { return guarded([&] { probe::nodes(scene_of(scene), count, in, out); }); },
    .probe_bsdf = [](const ViewcamClosure* closure, int version, size_t count, const double* in,
                     double* out) { return guarded([&] { probe::bsdf(*closure, version, count, in, out); }); },
    .probe_leaving = [](const ViewcamScene* scene, size_t count, const double* rays, const double* lights,
                        double* out) { return guarded([&] { probe::leaving(scene_of(scene), count, rays, lights, out); }); },
};

}  // namespace viewcam::VIEWCAM_ISA
