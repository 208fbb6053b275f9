// All of the core, compiled for one instruction set, VIEWCAM_ISA, as the table of functions that capi.h describes.
#include <exception>
#include <new>
#include <string>

#include "capi.h"
#include "checks.h"
#include "integrators/geometry.h"
#include "light_functions.h"

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
Camera camera_of(const ViewcamCamera& given) {
    Camera camera;
    camera.eye = vector(given.eye), camera.right = vector(given.right), camera.up = vector(given.up), camera.forward = vector(given.forward);
    camera.principal_point = {given.principal_point[0], given.principal_point[1]};
    camera.distance = {given.distance[0], given.distance[1]};
    camera.t_min = given.t_min, camera.t_max = given.t_max, camera.width = given.width, camera.height = given.height;
    return camera;
}

}  // namespace

extern const ViewcamCore core;
const ViewcamCore core = {
    .name = VIEWCAM_NAME(VIEWCAM_ISA),
    .size = sizeof(ViewcamCore),
    .message = [] { return message().c_str(); },

    .scene_create = []() -> ViewcamScene* { return reinterpret_cast<ViewcamScene*>(new (std::nothrow) Scene); },
    .scene_free = [](ViewcamScene* scene) { delete &scene_of(scene); },
    .add_mesh =
        [](ViewcamScene* scene, const ViewcamMesh* given) {
            return guarded([&] {
                check::mesh(*given);
                scene_of(scene).material_counts.push_back(check::materials(given->materials, given->count));
                TriangleMesh mesh;
                mesh.vertex_count = given->vertex_count, mesh.count = given->count;
                mesh.vertices = given->vertices, mesh.triangles = given->triangles, mesh.materials = given->materials;
                mesh.corner_normals = given->corner_normals, mesh.corner_uvs = given->corner_uvs, mesh.corner_colors = given->corner_colors;
                for (size_t i = 0; i < mesh.vertex_count; i++) mesh.bounds.add(Vec3{mesh.vertices[3 * i], mesh.vertices[3 * i + 1], mesh.vertices[3 * i + 2]});
                for (size_t i = 0; i < given->attribute_count; i++) {
                    const ViewcamAttribute& one = given->attributes[i];
                    mesh.attributes.push_back({one.name, one.width, one.values});
                }
                scene_of(scene).geometries.push_back(std::move(mesh));
            });
        },
    .add_spheres =
        [](ViewcamScene* scene, const ViewcamSpheres* given) {
            return guarded([&] {
                check::spheres(*given);
                scene_of(scene).material_counts.push_back(check::materials(given->materials, given->count));
                Spheres spheres;
                spheres.count = given->count, spheres.centers = given->centers, spheres.radii = given->radii, spheres.materials = given->materials;
                scene_of(scene).geometries.push_back(std::move(spheres));
            });
        },
    .add_objects =
        [](ViewcamScene* scene, const ViewcamObject* given) {
            return guarded([&] {
                Scene& to = scene_of(scene);
                check::objects(to, *given);
                Object object;
                object.geometry = given->geometry, object.visible = given->visible, object.index = given->index;
                object.lit_by = given->lit_by, object.receivers = given->receivers, object.shadow_rays = RayKind(given->shadow_rays);
                object.first_slot = uint32_t(to.slots.size());
                for (uint32_t i = 0; i < given->count; i++) {
                    if (given->info) object.info = given->info + 5 * size_t(i);
                    to.objects.push_back(object);
                }
                for (uint32_t i = 0; i < given->slot_count; i++) to.slots.push_back({given->slot_indices[i], given->slot_materials[i]});
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
        [](ViewcamScene* scene, const ViewcamCamera* given) {
            return guarded([&] {
                check::camera(*given);
                scene_of(scene).camera = camera_of(*given);
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
        [](const ViewcamScene* scene, const ViewcamCamera* given, uint8_t* covered) {
            return guarded([&] {
                check::camera(*given);
                silhouette(scene_of(scene), camera_of(*given), covered);
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
                    int some = int(std::min<size_t>(count - first, PACKET));
                    if (packets) scene_of(scene).closest(packet_of(rays, some), some, RayKind(kind), hits);
                    for (int i = 0; i < some; i++) {
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
                bool found[PACKET];
                for (size_t first = 0; first < count; first += PACKET) {
                    const Ray* rays = rays_of(rows) + first;
                    int some = int(std::min<size_t>(count - first, PACKET));
                    if (packets)
                        scene_of(scene).occluded(packet_of(rays, some), some, found);
                    else
                        for (int i = 0; i < some; i++) found[i] = scene_of(scene).occluded(rays[i]);
                    for (int i = 0; i < some; i++) hidden[first + size_t(i)] = found[i];
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
        [](const ViewcamScene* scene, const ViewcamLightSettings* settings, ViewcamLight** made) {
            return guarded([&] {
                check::light(scene_of(scene), *settings);
                *made = reinterpret_cast<ViewcamLight*>(create_light(scene_of(scene), *settings));
            });
        },
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
    .probe_specular = [](double ratio, size_t count, const double* given,
                         double* out) { return guarded([&] { probe::specular(ratio, count, given, out); }); },
    .probe_sample_light = [](const ViewcamLamp* lamp, size_t count, const double* given,
                             double* out) { return guarded([&] { probe::sample_light(*lamp, count, given, out); }); },
    .probe_light_le = [](const ViewcamLamp* lamp, size_t count, const double* given,
                         double* out) { return guarded([&] { probe::light_le(*lamp, count, given, out); }); },
    .probe_nodes = [](const ViewcamScene* scene, size_t count, const double* given,
                      double* out) { return guarded([&] { probe::nodes(scene_of(scene), count, given, out); }); },
    .probe_bsdf = [](const ViewcamClosure* closure, int version, size_t count, const double* given,
                     double* out) { return guarded([&] { probe::bsdf(*closure, version, count, given, out); }); },
    .probe_leaving = [](const ViewcamScene* scene, size_t count, const double* rays, const double* lights,
                        double* out) { return guarded([&] { probe::leaving(scene_of(scene), count, rays, lights, out); }); },
};

}  // namespace viewcam::VIEWCAM_ISA
