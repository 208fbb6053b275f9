// Light along paths from the eye: what the levels `direct` and `path` compute.
//
// Up to 64 paths go at once, scattering by scattering. Where one meets a surface, the surface's own light is added, then that of
// a light, chosen at random, to which a shadow ray is sent; then the path is scattered and goes on until it leaves the scene or
// its bounces are used up. Light that both the shadow ray and the scattered ray can find is weighted between them (multiple
// importance sampling by the power heuristic: Veach, 1997).
//
// Level `direct` is level `path` without bounces, as Cycles counts them: a path may be scattered once more than there are
// bounces, in all and by each kind of surface, and where it comes to then, only what shines there counts.
//
// Where a surface is transparent, a path goes straight on as often as that has a share in all that goes on there, on the same ray,
// from behind what it has met; else it is scattered. What shines there counts in either case. A shadow ray takes along the product of
// what it goes through. Of two surfaces in the same place one counts.
//
// Before a light that has blockers of its own (shadow linking) nothing else stands: what scattered rays find of it is looked for
// along the whole of each, past all that it meets, with a shadow ray to each such light that it runs into.
//
// Nothing is traced that can't bring anything: without lights no shadow rays, without anything bright that rays could run into
// no last ray, without either one ray a sample. What a path brings depends on its own numbers alone, and on the guide (guide.h) if there
// is one, and is added up in an order of its own: whichever paths go along with it, and whether rays are traced in packets, changes no bit.
//
// Several surfaces in one place are a matter of rounding: which of them a ray of a float32 renderer meets, and which shadows
// the other. The light that depends on that choice can be asked for: then that alone counts which comes by such a place, as
// much of it as all surfaces there would scatter, none of which shadows another. No choice of a renderer's brings more, and any
// brings at least nothing. So it is with light that shadow rays find and scattered rays do not, or the reverse (an object that
// only some kinds of rays see, a material that asks which kind has come, a lamp without shadows): how much of it a picture has
// is its renderer's own weights of multiple importance sampling, which elsewhere make no difference. And so it is with a light that
// only some kinds of rays see, on a surface that scatters several, and with rough refraction (`weighed_otherwise`).
//
// Where paths come to materials that are wide (Material::is_wide), four of one material go on at a time, on triangles or on spheres, at
// every depth: surface, light, lobes and the next ray are computed in vectors, whatever the other paths of the block have met (WidePaths).
// Formulas that both ways share are templates over one number or four, so that a path has the same bits either way.
//
// Rejected: splitting a path at glass, which makes work where light is faint.
#pragma once
#include <map>
#include <mutex>
#include <utility>

#include "../film/film.h"
#include "../lights/light_sampler.h"
#include "../samplers/sobol.h"
#include "../scene.h"
#include "guide.h"

namespace viewcam::VIEWCAM_ISA {

// The length of a ray from a point to a light: it ends before it by what rounding can move the light's own surface along the
// ray, so that what the light touches does not hide it.
template <class T> inline T shadow_ray_end(const SurfacePoint<T>& point, Vec3Of<T> origin, const LightSampleOf<T>& sample) {
    constexpr double ROUNDINGS = 32 * 0x1p-53, FLATTEST = 1e-6;
    T largest = max_component(abs(origin)) + sample.distance;
    T slack = (2.0 * point.offset + ROUNDINGS * largest) / max(sample.cosine, splat<T>(FLATTEST));
    return select(Mask<T>(sample.distance < INFINITE), max(sample.distance - slack, T{}), splat<T>(INFINITE));
}
inline Ray shadow_ray(const Interaction& point, const LightSample& sample) {
    Vec3 origin = point.ray_origin(sample.direction);
    return {origin, sample.direction, 0, shadow_ray_end<double>(point, origin, sample)};
}

// Samples of pixels, row · width + column, with the keys of these and the rays from the eye.
struct CameraSamples {
    uint32_t pixel[PACKET], number[PACKET], key[PACKET];
    Rays rays;
};

class PathIntegrator {
   public:
    static constexpr int MOST = PACKET;  // paths at a time

    // bounces: of the scene, or none at level `direct`. coincident: 0 for all light, or how many of float32's roundings apart
    // surfaces are in one place, for what comes by these alone.
    PathIntegrator(const Scene& scene, const Bounces& bounces, uint32_t seed, int samples, double coincident)
        : scene_(scene), lights_(scene), sampler_(seed, samples, std::min(bounces.total, 15) + 1), coincident_(coincident) {
        most_ = bounces.total + 1;
        most_of_[DIFFUSE] = bounces.diffuse + 1;
        most_of_[GLOSSY] = bounces.glossy + 1;
        most_of_[TRANSMISSION] = bounces.transmission + 1;
        most_passed_ = bounces.transparent;
        ended_after_ = bounces.transparent + (scene.illumination.version < CYCLES_5_0);
        bool shines = false;
        for (const Material& material : scene.illumination.materials) {
            shines |= material.emits();
            kinds_ |= material.kinds();
            transparent_ |= material.is_transparent();
            mixed_ |= material.is_transparent() && material.scatters();
            non_specular_ |= (material.kinds() & DIFFUSE) | material.rough_kinds();
        }
        for (RayKind kind : {DIFFUSE, GLOSSY, TRANSMISSION}) {
            meets_[kind] = shines || lights_.environment().lights(kind) || lights_.meets_lamps(kind);
            only_sky_[kind] = !shines && !transparent_ && !lights_.meets_lamps(kind) && !scene.hides_anything();
        }
        for (const Material& material : scene.illumination.materials) wide_.push_back(material.is_wide());
        shadow_linked_ = shines && scene.is_shadow_linked();
        for (const ValueNode& node : scene.illumination.nodes.all) has_pixels_ |= std::holds_alternative<BumpNode>(node);
        dark_ = !shines && !transparent_;
        sees_otherwise_ = std::any_of(scene.objects.begin(), scene.objects.end(), [&](const Object& object) {
            return (object.visible & kinds_) != (object.visible & SHADOW ? kinds_ : 0);
        });
        for (const Lamp& lamp : scene.illumination.lamps) sees_otherwise_ |= !lamp.casts_shadow;
        for (const Material& material : scene.illumination.materials) sees_otherwise_ |= material.is_transparent() && !material.transparent_shadow;
        for (const ValueNode& node : scene.illumination.nodes.all) sees_otherwise_ |= transparent_ && std::holds_alternative<LightPathNode>(node);
        lit_ = !scene.illumination.lamps.empty() || shines || !is_black(lights_.environment().radiance);
    }

    const SobolSampler& sampler() const { return sampler_; }
    const Scene& scene() const { return scene_; }
    // Two objects, which may be one, that paths have met in one place, and how often; with NONE in the place of the second, an object
    // that shadow rays see otherwise than others, or a light that only some rays see, or without shadows. Lamps are counted after the
    // objects, and the world after these.
    std::map<std::pair<uint32_t, uint32_t>, uint64_t> coincident_pairs() const {
        std::lock_guard lock(mutex_);
        return pairs_;
    }

    // True if paths through the same point of the film may bring different light.
    bool is_random() const {
        bool random = mixed_ || (kinds_ & GLOSSY && kinds_ & TRANSMISSION);
        for (RayKind kind : {DIFFUSE, GLOSSY, TRANSMISSION})
            random |= non_specular_ & kind && (lights_.is_random() || std::min(most_, most_of_[kind]) > 1 || meets_[kind]);
        return lit_ && random;
    }

    // True if a guide may find light that diffuse surfaces get from one another, or from what else shines.
    bool may_be_guided() const { return lit_ && kinds_ & DIFFUSE && std::min(most_, most_of_[DIFFUSE]) > 1 && coincident_ == 0; }
    // Diffuse rays follow it from now on, or none if it is null.
    void set_guide(const Guide* guide) { guide_ = guide; }

    // The light of up to 64 paths. learned: receives their diffuse rays, if it is not null.
    void trace(const CameraSamples& samples, int count, PathLight* light, std::vector<Guide::LearnedRay>* learned = nullptr) const {
        Block& block = of_this_thread<Block>();
        block.samples = &samples, block.light = light;
        block.live = 0;
        start(count, block);
        for (int depth = 1; block.live > 0 || block.wide; depth++) {
            scatter(depth, block);
            gather(depth, block);
            if (learned) note_rays(block);
            arrive(depth, block);
        }
        if (learned) learn(block, *learned);
    }

   private:
    // Light may grow with every scattering by colors beyond 1; with no more than this, no square of it is infinite.
    static constexpr double MOST_WEIGHT = 1e40;
    // Scatterings before a path may be ended by chance. Sooner, it costs more noise than it saves time.
    static constexpr int CERTAIN = 3;

    // A path that goes on. from: which of the block's points its ray leaves.
    struct Path {
        int sample, from;
        Category category = COLOR;
        RayKind kind = CAMERA;
        bool coincident = false;             // true if it has met surfaces in one place
        bool last = false, through = false;  // through: whether light from behind counts where it leaves
        bool diffuse = false;                // true if a diffuse lobe scattered its ray
        int passed = 0;                      // surfaces that it has gone straight through
        double width = 0, spread = 0;        // its pixel's, as RayState has it, where materials ask for that
        std::array<uint16_t, 3> scattered = {};  // diffuse, glossy, transmission
        uint32_t inside = NONE;                   // the object that it has been let into last, until it is let out
        bool may_touch = false, touches = false;  // true if its ray may meet, or has met, a surface right where it starts
        Vec3 weight{1, 1, 1};
        Ray ray;
        double pdf = INFINITE;
    };
    // Light that paths receive if nothing hides it.
    struct Lit {
        int count;
        bool plain;  // true if each has a shadow ray, and such a one as most lights have
        double4 light[MOST], other[MOST];  // other: of what is not diffuse where the eye sees it
        uint64_t others;                   // a bit for each that has it
        int sample[MOST];
        Category category[MOST];
        uint32_t shadow_rays[MOST];  // RayKind
        RayState ray[MOST];          // where anything lets light through
        Rays rays;

        void clear() { count = 0, plain = true, others = 0; }
        // The place of one more.
        int add(double4 brought, int of_sample, Category to, uint32_t kind) {
            light[count] = brought, sample[count] = of_sample, category[count] = to, shadow_rays[count] = kind;
            plain &= kind == SHADOW;
            return count++;
        }
    };
    // Where a path has come to a wide material, of which nothing has been computed yet.
    struct WidePoint {
        SurfaceHit hit;
        uint32_t material;

        bool goes_along_with(const WidePoint& other) const { return material == other.material && !hit.mesh == !other.hit.mesh; }
    };
    // Up to four paths at such points, of one material. A lane that has none goes along with one that has.
    struct WidePaths {
        unsigned lanes = 0;
        int slots[4], samples[4];
        const Path* paths[4];
        SurfacePoint<double4> at;
        Vec3x4 incoming, weight;
        double4 footprint;  // where materials ask for that
    };
    // A diffuse ray from which a guide may learn, and the light that its path had brought before.
    struct NotedRay {
        int sample;
        Vec3 position, normal, direction, weight, before;
        double pdf;
    };
    struct Block {
        const CameraSamples* samples;
        PathLight *light, ignored;
        std::vector<NotedRay> noted;
        int live = 0;
        Path paths[MOST], onwards[MOST];
        // Paths at wide materials by slot, which is the sample's number for rays from the eye; `wide`: a bit for each slot that has one.
        uint64_t wide = 0;
        Path wide_paths[MOST];
        WidePoint wide_points[MOST];
        Interaction tables[2][2 * MOST], *points = tables[0], *next_points = tables[1];  // wide materials' points behind the others
        Lit lit[LightSampler::MOST_CHOICES];  // by the light that was asked
        Hits hits;
        // The hits of the rays of some paths.
        Ray met_rays[MOST];
        Hit met[MOST];
        const Ray* met_by[MOST];
    };

    static void note_rays(Block& block) {
        for (int i = 0; i < block.live; i++) {
            const Path& path = block.onwards[i];
            const Interaction& from = block.points[path.from];
            if (path.kind == DIFFUSE)
                block.noted.push_back({path.sample, from.position, from.normal, path.ray.direction, path.weight, block.light[path.sample].combined(), path.pdf});
        }
    }
    void learn(Block& block, std::vector<Guide::LearnedRay>& learned) const {
        for (const NotedRay& ray : block.noted) {
            double brought = mean(block.light[ray.sample].combined() - ray.before), weight = mean(ray.weight), mixed = ray.pdf;
            if (!(weight > 0)) continue;
            if (guide_) mixed = GuideAt<double>(*guide_, [&](int) { return std::pair(ray.position, ray.normal); }).mixed(ray.pdf, ray.direction);
            learned.push_back(Guide::learned(ray.position, ray.normal, ray.direction, brought / weight, ray.pdf, mixed));
        }
        block.noted.clear();
    }

    static int row(RayKind kind) { return kind == DIFFUSE ? 0 : kind == GLOSSY ? 1 : 2; }

    // Where that belongs which a path brings that is scattered for the depth-th time.
    static Category after(Category category, bool is_diffuse, int depth) {
        if (depth == 1) return is_diffuse ? DIRECT : OTHER;
        return depth == 2 && category == DIRECT ? INDIRECT : category;
    }

    // The sum that a path's light is added to.
    PathLight& light_of(const Path& path, Block& block) const {
        return coincident_ > 0 && !path.coincident ? block.ignored : block.light[path.sample];
    }
    // Light that a path has met at a distance, |cos| to the surface that shines, and that a shadow ray could have found, too.
    PathLight& light_of(const Path& path, double distance, double cosine, const Light* lamp, int depth, Block& block) const {
        if (coincident_ > 0 && sees_otherwise_ && !path.coincident && path.kind != CAMERA && path.pdf < INFINITE) {
            Ray ray = shadow_ray(block.points[path.from], {path.ray.direction, distance, {}, 0, cosine});
            RayState state{path.kind, path.diffuse, false, depth, path.passed, path.scattered, 0, path.width};
            if (left_by_kinds(ray, lamp, state).differ()) return block.light[path.sample];
        }
        return light_of(path, block);
    }
    // The shares that shadow rays, and scattered rays, leave of a light.
    struct LeftByKinds {
        Vec3 shadow{1, 1, 1}, scattered{1, 1, 1};
        bool differ() const { return !VIEWCAM_ISA::is_black(shadow - scattered); }
    };
    // The shares that are left along a ray; notes what makes the difference. lamp: null where a surface or the sky shines.
    // state: of the scattered ray.
    [[gnu::noinline]] LeftByKinds left_by_kinds(const Ray& ray, const Light* lamp, const RayState& state) const {
        static thread_local std::vector<Hit> hits;
        scene_.surfaces(ray, RayKind(state.kind | SHADOW), INFINITE, hits);
        RayState shadow = state;
        shadow.kind = SHADOW, shadow.diffuse = false;
        bool shadows = !lamp || lamp->casts_shadow;
        LeftByKinds left;
        uint32_t cause = NONE;
        for (const Hit& hit : hits) {
            Vec3 by_shadow = shadows ? left_behind(ray, hit, shadow) : Vec3{1, 1, 1}, by_scattered = left_behind(ray, hit, state);
            if (cause == NONE && !VIEWCAM_ISA::is_black(by_shadow - by_scattered)) cause = hit.object;
            left.shadow *= by_shadow, left.scattered *= by_scattered;
        }
        if (left.differ()) {
            std::lock_guard lock(mutex_);
            pairs_[{shadows ? cause : name_of(*lamp), NONE}]++;
        }
        return left;
    }
    uint32_t name_of(const Light& lamp) const { return uint32_t(scene_.objects.size()) + lamp.number; }
    uint32_t name_of_world() const { return uint32_t(scene_.objects.size() + scene_.illumination.lamps.size()); }
    // The share that a surface leaves of light that comes along a ray through it.
    Vec3 left_behind(const Ray& ray, const Hit& hit, RayState state) const {
        if (!(scene_.objects[hit.object].visible & state.kind)) return {1, 1, 1};
        Interaction point = scene_.interaction(ray, hit);
        const Material& made_of = material(point);
        if (!made_of.is_transparent() || (state.kind == SHADOW && !made_of.transparent_shadow)) return {};
        state.length = hit.t * length(ray.direction);
        return made_of.bsdf(scene_.shading(point, ray.direction, state)).transparency();
    }
    // By how much rounding may move a surface along a ray that meets it, in world units. size: of what is rounded.
    double coincident_reach(double size, double cosine) const {
        constexpr double FLOAT32 = 0x1p-24, GRAZED = 0.05;
        return coincident_ * FLOAT32 * size / max(cosine, GRAZED);
    }
    // Where several surfaces lie in the place of what a path has met: one of them, by chance, in the place of all.
    [[gnu::noinline]] void meet_coincident(Path& path, const Ray& ray, Hit& hit, Interaction& point, int depth, const Block& block) const {
        constexpr double PARALLEL = 0.1;
        static thread_local std::vector<Hit> hits;
        const Ray* met_by = &ray;
        Interaction met;
        double magnitude, unit = length(ray.direction);
        scene_.interactions(&met_by, &hit, 1, &met, &magnitude);
        double reach = coincident_reach(magnitude + met.t * unit, met.cosine);
        scene_.surfaces({ray.origin, ray.direction, max(met.t - reach / unit, ray.t_min), met.t + reach / unit}, path.kind, INFINITE, hits);
        // Where surfaces cross at an angle, that is as wide as rounding: no matter.
        if (hits.size() > 1) std::erase_if(hits, [&](const Hit& other) { return length(cross(scene_.interaction(ray, other).normal, met.normal)) > PARALLEL; });
        if (hits.size() < 2) return;
        path.coincident = true;
        {
            std::lock_guard lock(mutex_);
            for (size_t i = 1; i < hits.size(); i++) pairs_[std::minmax(hits[0].object, hits[i].object)]++;
        }
        // Any number does that the sampler does not use for anything else.
        uint32_t chosen = ((block.samples->pixel[path.sample] * 0x9e3779b9u ^ block.samples->number[path.sample]) * 0x85ebca6bu ^ uint32_t(depth)) * 0xc2b2ae35u >> 16;
        hit = hits[chosen % hits.size()];
        point = scene_.interaction(ray, hit);
        point.offset = max(point.offset, 2 * reach * max(point.cosine, 0.0));
        path.weight = min(path.weight * double(hits.size()), MOST_WEIGHT);
    }
    // The distance before its light at which a shadow ray must end, so that nothing in the light's place counts; 0 where
    // nothing is there. Notes the surface that a lamp lies in, as in that of a ceiling; the places of surfaces that shine are
    // met by paths, too.
    [[gnu::noinline]] double coincident_end(const Interaction& point, const LightSample& sample, const Light& light) const {
        static thread_local std::vector<Hit> hits;
        if (!(sample.distance < INFINITE && light.casts_shadow)) return 0;
        double largest = max_component(abs(point.position + scene_.origin)) + sample.distance;
        double reach = coincident_reach(largest, sample.cosine);
        scene_.surfaces({point.position, sample.direction, max(sample.distance - reach, 0.0), sample.distance + reach}, SHADOW, INFINITE, hits);
        if (light.mesh()) return hits.size() > 1 ? reach : 0;
        if (hits.empty()) return 0;
        std::lock_guard lock(mutex_);
        pairs_[{hits[0].object, name_of(light)}]++;
        return reach;
    }

    const Material& material(const Interaction& point) const { return scene_.illumination.materials[point.material]; }
    // Where a path has come to along its ray. depth: scatterings before.
    ShadingPoint shading(const Interaction& point, const Path& path, Vec3 incoming, int depth) const {
        bool singular = path.kind != CAMERA && path.pdf == INFINITE;
        return scene_.shading(point, incoming, {path.kind, path.diffuse, singular, depth, path.passed, path.scattered, point.t, path.width, path.spread});
    }
    // The point where the path arrives, with the normal that its material gives the point.
    ShadingPoint arriving(Interaction& point, const Path& path, int depth) const {
        ShadingPoint at = shading(point, path, path.ray.direction, depth);
        const Color& normal = material(point).normal;
        if (VIEWCAM_ISA::is_bumped(normal)) point.shading = at.normal(normal);
        return at;
    }
    // True if what a path has met has a wide material; `point` receives what scattering needs.
    bool meets_wide(const Hit& hit, WidePoint& point) const {
        if (coincident_ > 0) return false;
        const Object& object = scene_.objects[hit.object];
        auto mesh = std::get_if<TriangleMesh>(&scene_.geometries[object.geometry]);
        const int32_t* slots = mesh ? mesh->materials : std::get<Spheres>(scene_.geometries[object.geometry]).materials;
        uint32_t material = scene_.slots[object.first_slot + uint32_t(slots[hit.primitive])].material;
        if (!wide_[material]) return false;
        point = {{mesh, &object, nullptr, hit.primitive}, material};
        return true;
    }
    // Light of a surface where a path's ray arrives, less what samples of that light find. distance: from where it was
    // scattered.
    Vec3 emission(const Path& path, const ShadingPoint& at, double distance, const Block& block) const {
        double share = 1;
        if (path.kind != CAMERA) {
            const Interaction& from = block.points[path.from];
            if (!lights_.reaches(scene_.objects[at.point.object], from)) return {};
            if (path.pdf < INFINITE && lights_.has_meshes())
                share = power_heuristic(path.pdf, lights_.pdf_li(from, at.point, path.ray.direction, distance, path.through));
        }
        return path.weight * material(at.point).emission(at) * share;
    }

    // A path's number in [0, 1) of a dimension.
    double number(const Path& path, int dimension, const Block& block) const {
        return sampler_.number(block.samples->key[path.sample], block.samples->number[path.sample], dimension);
    }
    bool has_ended(const Path& path) const { return path.passed > 0 && path.passed >= ended_after_; }

    // True if a path goes straight through a surface; what it brings from now on is weighted by the chance of that. u: a number in
    // [0, 1) that chooses, or −1 where none has been made yet.
    bool passes(Path& path, const BSDF& bsdf, int depth, double& u, const Block& block) const {
        double chance = path.last ? !is_black(bsdf.transparency()) : bsdf.chance_through();
        if (!(chance > 0)) return false;
        if (chance < 1) {
            if (u < 0) u = number(path, SobolSampler::dimension(depth + 1, SobolSampler::THROUGH), block);
            if (u >= chance) {
                path.weight = min(path.weight / (1 - chance), MOST_WEIGHT);
                u = (u - chance) / (1 - chance);
                return false;
            }
            u /= chance;
        }
        path.weight = min(path.weight * bsdf.transparency() / chance, MOST_WEIGHT);
        path.passed++;
        return true;
    }
    // Takes a path from the first surface that its ray meets through all that lets it through, and adds what shines there. Whether it
    // is scattered at `point`, where it then is. depth: how often it has been scattered.
    bool follow(Path& path, Ray ray, Hit hit, Interaction& point, int depth, Block& block) const {
        for (double u = -1;;) {
            if (coincident_ > 0) meet_coincident(path, ray, hit, point, depth + path.passed, block);
            const Material& made_of = material(point);
            ShadingPoint at = arriving(point, path, depth);
            if (made_of.emits() && (!shadow_linked_ || path.kind == CAMERA || scene_.objects[point.object].shadow_rays == SHADOW)) {
                PathLight& light = light_of(path, hit.t, point.cosine, nullptr, depth, block);
                light.add(path.kind == CAMERA ? EMISSION : path.category, emission(path, at, hit.t, block));
            }
            if (has_ended(path)) return false;
            if (!made_of.is_transparent()) return made_of.scatters() && !path.last;
            BSDF bsdf = made_of.bsdf(at);
            if (path.kind == CAMERA) block.light[path.sample].add(COLOR, path.weight * bsdf.diffuse_color());
            if (!passes(path, bsdf, depth, u, block)) return made_of.scatters() && !path.last;
            ray.t_min = hit.t;
            hit = scene_.closest(ray, path.kind);
            meet_lamps(path, ray, hit, depth, block);
            if (!hit) {
                leave(path, ray, depth, block);
                return false;
            }
            point = scene_.interaction(ray, hit);
        }
    }
    // Adds what lamps bring that a path's ray runs through before it meets anything.
    void meet_lamps(const Path& path, const Ray& ray, const Hit& hit, int depth, Block& block) const {
        if (!lights_.meets_lamps(path.kind)) return;
        double size = path.kind == CAMERA ? length(ray.direction) : 1;
        LightRay seen{ray.origin, ray.direction / size, ray.t_min * size, min(ray.t_max, hit.t) * size, !hit, path.kind == CAMERA ? scene_.camera.t_min * size : 0};
        if (path.kind == CAMERA) return light_of(path, block).add(EMISSION, path.weight * lights_.le(seen, CAMERA));
        Vec3 sum;
        lights_.each_lamp(seen, path.kind, block.points[path.from], path.pdf, depth == 1, path.through, [&](const Light& lamp, Vec3 radiance, double distance) {
            if (lamp.shadow_rays != SHADOW) return;
            if (coincident_ > 0)
                light_of(path, distance, 1, &lamp, depth, block).add(path.category, path.weight * radiance);
            else
                sum += radiance;
        });
        light_of(path, block).add(path.category, path.weight * sum);
    }
    // Adds what lights with blockers of their own bring along a path's ray: whatever else it meets, only these stand before them.
    [[gnu::noinline]] void meet_shadow_linked(const Path& path, int depth, Block& block) const {
        const Interaction& from = block.points[path.from];
        RayState state{SHADOW, false, false, depth, path.passed, path.scattered, 0, path.width};
        auto add = [&](Vec3 light, double distance, double cosine, RayKind shadow_rays) {
            if (!is_black(light)) light_of(path, block).add(path.category, light * unoccluded(shadow_ray(from, {path.ray.direction, distance, {}, 0, cosine}), shadow_rays, state));
        };
        Ray ray = path.ray;
        while (Hit hit = scene_.closest(ray, SHADOW_LINKED)) {
            const Object& object = scene_.objects[hit.object];
            ray.t_min = hit.t;
            if (!(object.visible & path.kind)) continue;
            Interaction point = scene_.interaction(path.ray, hit);
            if (!material(point).emits()) continue;
            ShadingPoint at = arriving(point, path, depth);
            add(emission(path, at, hit.t, block), hit.t, std::fabs(dot(point.normal, ray.direction)), object.shadow_rays);
        }
        if (lights_.is_shadow_linked()) lights_.each_lamp({ray.origin, ray.direction, 0, INFINITE, true}, path.kind, from, path.pdf, depth == 1, path.through, [&](const Light& lamp, Vec3 radiance, double distance) {
            if (lamp.shadow_rays != SHADOW) add(path.weight * radiance, distance, 1, lamp.casts_shadow ? lamp.shadow_rays : NO_RAY);
        });
    }
    // Adds what the world brings to a path that leaves the scene.
    void leave(const Path& path, const Ray& ray, int depth, Block& block) const {
        PathLight& light = lights_.has_sky() ? light_of(path, INFINITE, 1, nullptr, depth, block) : light_of(path, block);
        if (path.kind == CAMERA) {
            const auto& backdrop = scene_.illumination.backdrop;
            const Environment& behind = backdrop ? *backdrop : lights_.environment();
            light.add(ENVIRONMENT, path.weight * behind.le(behind.has_image() ? normalize(ray.direction) : ray.direction, CAMERA));
            light.covered = 1 - mean(path.weight);
        } else {
            light.add(path.category, path.weight * lights_.environment_le(ray.direction, path.kind, block.points[path.from], path.pdf, depth == 1, path.through));
        }
    }
    // The share of light that comes along a shadow ray that meets something: none but where all that stands in its way lets
    // some through.
    Vec3 transmittance(Ray ray, RayKind kind, RayState state) const {
        Vec3 left{1, 1, 1};
        while (!is_black(left)) {
            Hit hit = scene_.closest(ray, kind);
            if (!hit) return left;
            Interaction point = scene_.interaction(ray, hit);
            const Material& made_of = material(point);
            if (!made_of.is_transparent() || !made_of.transparent_shadow || state.passed >= most_passed_) return {};
            state.length = hit.t * length(ray.direction);
            left *= made_of.bsdf(scene_.shading(point, ray.direction, state)).transparency();
            state.passed++;
            ray.t_min = hit.t;
        }
        return left;
    }

    // The share of light that comes along a shadow ray.
    Vec3 unoccluded(const Ray& ray, RayKind kind, const RayState& state) const {
        if (!scene_.occluded(ray, kind)) return {1, 1, 1};
        return transparent_ ? transmittance(ray, kind, state) : Vec3{};
    }

    // Follows the eye's rays to what they meet, and adds the light that is of this alone.
    void start(int count, Block& block) const {
        int met = 0;
        bool meets_lamps = lights_.meets_lamps(CAMERA);
        PathLight* light = block.light;
        scene_.closest(block.samples->rays, count, CAMERA, block.hits);
        for (int i = 0; i < count; i++) light[i].clear();
        for (int i = 0; i < count; i++) {
            Hit hit = block.hits.hit(i);
            bool is_wide = hit && meets_wide(hit, block.wide_points[i]);
            block.wide |= uint64_t(is_wide) << i;
            if (is_wide && !meets_lamps) continue;
            block.met[met] = hit;
            Ray& ray = block.met_rays[met] = block.samples->rays.ray(i);
            Path& path = block.paths[met];  // the rest is known when it is scattered
            path.sample = i, path.from = met;
            path.category = COLOR, path.kind = CAMERA, path.last = path.diffuse = false, path.pdf = INFINITE, path.passed = 0;
            path.scattered = {}, path.inside = NONE, path.touches = path.coincident = false;
            path.weight = {1, 1, 1};
            meet_lamps(path, ray, hit, 0, block);
            if (!hit) {
                leave(path, ray, 0, block);
                continue;
            }
            if (!is_wide) block.met_by[met++] = &ray;
        }
        scene_.interactions(block.met_by, block.met, met, block.points);
        for (int k = 0; k < met; k++) {
            Path& path = block.paths[block.live];
            if (block.live < k) path = block.paths[k];
            path.ray.direction = normalize(block.met_by[k]->direction);
            if (follow(path, *block.met_by[k], block.met[k], block.points[k], 0, block)) block.live++;
        }
    }

    // The direction in which a path goes on, diffuse ones with the guide where there is one. point(i): position and normal.
    template <class T, class Numbers, class Point> BSDFSampleOf<T> sample_bsdf(const BSDFOf<T>& bsdf, T u_lobe, const Numbers& direction, const Point& point) const {
        if (!guide_) return bsdf.sample(u_lobe, direction);
        GuideAt<T> guide(*guide_, point);
        return bsdf.sample(u_lobe, direction, [&]<class Lobe>(const Lobe& lobe, Vec2Of<T> u) {
            if constexpr (Lobe::KIND == DIFFUSE && !Lobe::DELTA) return guide.sample(lobe, u); else return lobe.sample(u);
        });
    }

    // Adds what lights may bring to all points where paths are, and finds the rays on which they go on.
    void scatter(int depth, Block& block) const {
        int onwards = 0;
        for (Lit& lit : block.lit) lit.clear();
        for (int i = 0; i < block.live; i++) {
            const Path& path = block.paths[i];
            const Interaction& point = block.points[path.from];
            ShadingPoint at = shading(point, path, path.ray.direction, depth - 1);
            const Material& made_of = material(point);
            BSDF bsdf = made_of.bsdf(at);
            if (depth == 1 && !made_of.is_transparent()) block.light[path.sample].add(COLOR, path.weight * bsdf.diffuse_color());
            if (bsdf.is_black() || !lit_) continue;
            auto number = [&](SobolSampler::Purpose purpose) { return this->number(path, SobolSampler::dimension(depth, purpose), block); };
            auto pair = [&](SobolSampler::Purpose purpose) {
                int dimension = SobolSampler::dimension(depth, purpose);
                return Vec2{this->number(path, dimension, block), this->number(path, dimension + 1, block)};
            };
            bool total_used = depth >= most_;
            uint32_t leading = 0, last = 0;  // kinds of rays that can bring anything, and those on which the path ends
            for (RayKind kind : {DIFFUSE, GLOSSY, TRANSMISSION}) {
                bool ends = total_used || path.scattered[row(kind)] + 1 >= most_of_[kind];
                if (ends) last |= kind;
                if (!ends || meets_[kind]) leading |= kind;
            }
            double brightest = 0, sky = 1;  // sky: how often a diffuse ray is worth it that finds the sky alone
            bool through = bsdf.non_specular_kinds() & TRANSMISSION;
            LightSampler::Choice choices[LightSampler::MOST_CHOICES];
            int chosen = 0;
            if (bsdf.non_specular_kinds() && lights_.count() > 0)
                chosen = lights_.choose(point, lights_.is_random() ? number(SobolSampler::LIGHT) : 0, depth == 1, through, choices, brightest);
            if (brightest > 0 && last & DIFFUSE) {
                if (bsdf.kinds() & leading & ~DIFFUSE)  // lobes that may show lamps take its place
                    bsdf.thin(DIFFUSE, min(lights_.sky_share(brightest, DIFFUSE), 1.0));
                else
                    sky = lights_.sky_chance(brightest, DIFFUSE);
            }
            Vec2 u_light = chosen && lights_.is_random() ? pair(SobolSampler::LIGHT_POINT) : Vec2{};
            for (int k = 0; k < chosen; k++) ask(choices[k], at, u_light, path, depth, bsdf, block);

            if (!(bsdf.kinds() & leading)) continue;
            BSDFSample sampled = sample_bsdf<double>(bsdf, bsdf.needs_choice() ? number(SobolSampler::LOBE) : 0, [&] { return pair(SobolSampler::DIRECTION); },
                                                     [&](int) { return std::pair(point.position, point.normal); });
            if (const Environment& sky = lights_.environment(); coincident_ > 0 && !path.coincident && !lights_.has_sky() && sampled.pdf < INFINITE && !is_black(sky.radiance)) {
                double all;
                ScatteredLight light = weighed_otherwise(bsdf, sampled.direction, sky.hidden_from, {}, all);
                add_weighed(light, sky.radiance / all, {point.ray_origin(sampled.direction), sampled.direction, 0, INFINITE}, RayKind(sampled.kind),
                            sky.hidden_from & (DIFFUSE | GLOSSY | TRANSMISSION) ? name_of_world() : point.object, path, depth, block);
            }
            if (!(sampled.kind & leading)) continue;
            // A smooth normal may send rays to the wrong side of the true surface: that light is lost, as in Cycles.
            if ((dot(sampled.direction, point.normal) > 0) == (sampled.kind == TRANSMISSION)) continue;
            Path& next = block.onwards[onwards];
            next = path;
            next.from = path.from;
            next.kind = RayKind(sampled.kind), next.diffuse = sampled.is_diffuse || next.kind == DIFFUSE;
            next.last = last & sampled.kind;
            next.scattered[row(next.kind)]++;
            next.through = through;
            next.category = after(path.category, sampled.is_diffuse, depth);
            next.weight = min(path.weight * sampled.weight, MOST_WEIGHT);
            double survival = 1;
            if (sampled.kind == DIFFUSE && next.last)
                survival = sky;
            else if (depth > CERTAIN && !next.last)
                survival = min(std::sqrt(max_component(next.weight)), 1.0);
            if (survival < 1) {
                if (number(SobolSampler::ROULETTE) >= survival) continue;
                next.weight = next.weight / survival;
            }
            next.pdf = sampled.pdf;
            if (has_pixels_) next.width = at.footprint(), next.spread = path.kind == CAMERA ? scene_.camera.spread(path.ray.direction) : path.spread;
            next.ray = {point.ray_origin(sampled.direction), sampled.direction, 0, INFINITE};
            bool passed = sampled.kind == TRANSMISSION;
            if (passed) next.inside = point.backside ? NONE : point.object;
            next.may_touch = passed ? point.backside : path.touches;
            onwards++;
        }
        scatter_wide(depth, onwards, block);
        block.live = onwards;
    }

    // Scatters paths at wide materials, four of one at a time.
    void scatter_wide(int depth, int& onwards, Block& block) const {
        for (uint64_t left = std::exchange(block.wide, 0); left;) {
            WidePaths four;
            const WidePoint& first = block.wide_points[std::countr_zero(left)];
            int count = 0;
            for (uint64_t others = left; others && count < 4; others &= others - 1) {
                int slot = std::countr_zero(others);
                if (!block.wide_points[slot].goes_along_with(first)) continue;
                four.slots[count++] = slot;
                left &= ~(uint64_t(1) << slot);
            }
            four.lanes = (1u << count) - 1;
            for (; count < 4; count++) four.slots[count] = four.slots[0];
            scatter_wide(four, scene_.illumination.materials[first.material], depth, onwards, block);
        }
    }
    void scatter_wide(WidePaths& four, const Material& made_of, int depth, int& onwards, Block& block) const {
        static constexpr Path eye{};
        SurfaceHit hits[4];
        Vec3x4 origin, direction;
        for (int i = 0; i < 4; i++) {
            int slot = four.slots[i];
            hits[i] = block.wide_points[slot].hit;
            four.paths[i] = depth == 1 ? &eye : &block.wide_paths[slot];
            four.samples[i] = depth == 1 ? slot : four.paths[i]->sample;
        }
        if (depth == 1) {
            auto rays = [&](const double (&values)[3][PACKET]) {
                auto of_slots = [&](const double* value) {
                    bool in_turn = four.slots[3] == four.slots[0] + 3;
                    return in_turn ? load<double4>(value + four.slots[0]) : gather4([&](int i) { return value[four.slots[i]]; });
                };
                return Vec3x4{of_slots(values[0]), of_slots(values[1]), of_slots(values[2])};
            };
            origin = rays(block.samples->rays.origin), direction = rays(block.samples->rays.direction);
            four.weight = splat4(Vec3{1, 1, 1});
        } else {
            origin = gather4([&](int i) { return four.paths[i]->ray.origin; });
            direction = gather4([&](int i) { return four.paths[i]->ray.direction; });
            four.weight = gather4([&](int i) { return four.paths[i]->weight; });
        }
        Interaction points[4];
        double4 t;
        four.at = scene_.surfaces(hits, origin, direction, t, made_of.varies() ? points : nullptr);
        four.incoming = depth == 1 ? normalize(direction) : direction;
        if (has_pixels_) four.footprint = gather4([&](int i) {
            Interaction point;
            point.position = lane(four.at.position, i), point.t = t[i], point.object = uint32_t(hits[i].object - scene_.objects.data());
            return shading(point, *four.paths[i], {}, depth - 1).footprint();
        });
        if (!made_of.varies()) {
            BSDFOf<double4> bsdf = made_of.bsdf(ShadingPoints{four.at, four.incoming, scene_.illumination.version, nullptr});
            return scatter_wide(four, bsdf, depth, onwards, block);
        }
        auto point = [&](int i) { return shading(points[i], *four.paths[i], lane(four.incoming, i), depth - 1); };
        const ShadingPoint each[] = {point(0), point(1), point(2), point(3)};
        BSDFOf<double4> bsdf = made_of.bsdf(ShadingPoints{four.at, four.incoming, scene_.illumination.version, each});
        scatter_wide(four, bsdf, depth, onwards, block);
    }
    void scatter_wide(const WidePaths& four, BSDFOf<double4>& bsdf, int depth, int& onwards, Block& block) const {
        if (depth == 1) {
            double4 colors[4];
            rows(bsdf.diffuse_color(), colors);
            for (unsigned left = four.lanes; left;) {
                int i = take_bit(left);
                block.light[four.samples[i]].add(COLOR, colors[i]);
            }
        }
        if (bsdf.is_black() || !lit_) return;
        auto of_samples = [&](const uint32_t* values) { return uint4{values[four.samples[0]], values[four.samples[1]], values[four.samples[2]], values[four.samples[3]]}; };
        uint4 keys = of_samples(block.samples->key), numbers = of_samples(block.samples->number);
        auto number = [&](SobolSampler::Purpose purpose) { return sampler_.number(keys, numbers, SobolSampler::dimension(depth, purpose)); };
        auto pair = [&](SobolSampler::Purpose purpose) { return sampler_.pair(keys, numbers, SobolSampler::dimension(depth, purpose)); };
        auto point_of = [&](int i) {
            const SurfaceHit& hit = block.wide_points[four.slots[i]].hit;
            Interaction point;
            static_cast<SurfacePoint<double>&>(point) = lane(four.at, i);
            point.object = uint32_t(hit.object - scene_.objects.data()), point.primitive = hit.primitive;
            return point;
        };
        // The lanes that have lobes of a kind; of these, where rays can bring anything, and those on which the path ends.
        unsigned diffuse = lanes_with(bsdf.kinds(), DIFFUSE), glossy = lanes_with(bsdf.kinds(), GLOSSY), last_diffuse = 0, last_glossy = 0;
        for (int i = 0; i < 4; i++) {
            auto ends = [&](RayKind kind) { return unsigned(depth >= most_ || four.paths[i]->scattered[row(kind)] + 1 >= most_of_[kind]) << i; };
            last_diffuse |= ends(DIFFUSE), last_glossy |= ends(GLOSSY);
        }
        if (!meets_[DIFFUSE]) diffuse &= ~last_diffuse;
        if (!meets_[GLOSSY]) glossy &= ~last_glossy;

        LightSampler::Choices choices[LightSampler::MOST_CHOICES];
        double4 brightest{}, sky = splat4(1.0), u{};
        Vec2x4 u_light;
        if (unsigned lit = four.lanes & lanes_with(bsdf.non_specular_kinds(), DIFFUSE | GLOSSY); lit && lights_.count() > 0) {
            if (lights_.is_random()) u = number(SobolSampler::LIGHT), u_light = pair(SobolSampler::LIGHT_POINT);
            lights_.choose(point_of, lit, u, depth == 1, choices, brightest);
        }
        if (unsigned thinned = bits(long4(brightest > 0.0)) & last_diffuse) {
            double4 share = splat4(1.0);
            while (thinned) {
                int i = take_bit(thinned);
                if (glossy >> i & 1)  // lobes that may show lamps take its place
                    share[i] = min(lights_.sky_share(brightest[i], DIFFUSE), 1.0);
                else
                    sky[i] = lights_.sky_chance(brightest[i], DIFFUSE);
            }
            bsdf.thin(DIFFUSE, share);
        }
        for (int slot = 0; slot < LightSampler::MOST_CHOICES; slot++)
            if (choices[slot].lanes) ask(choices[slot], slot, four, bsdf, point_of, u_light, depth, block);

        if (!(four.lanes & (diffuse | glossy))) return;
        BSDFSampleOf<double4> sampled = sample_bsdf<double4>(bsdf, bsdf.needs_choice() ? number(SobolSampler::LOBE) : double4{}, [&] { return pair(SobolSampler::DIRECTION); },
                                                             [&](int i) { return std::pair(lane(four.at.position, i), lane(four.at.normal, i)); });
        unsigned is_diffuse = bits(sampled.is_diffuse), goes_diffuse = lanes_with(sampled.kind, DIFFUSE);
        unsigned going = four.lanes & ((goes_diffuse & diffuse) | (lanes_with(sampled.kind, GLOSSY) & glossy));
        going &= bits(long4(dot(sampled.direction, four.at.normal) > 0.0));
        Vec3x4 weight = min(four.weight * sampled.weight, MOST_WEIGHT), origin = four.at.ray_origin(sampled.direction);
        while (going) {
            int i = take_bit(going);
            const Path& path = *four.paths[i];
            RayKind kind = goes_diffuse >> i & 1 ? DIFFUSE : GLOSSY;
            bool ends = (kind == DIFFUSE ? last_diffuse : last_glossy) >> i & 1;
            Vec3 left = lane(weight, i);
            double survival = 1;
            if (kind == DIFFUSE && ends)
                survival = sky[i];
            else if (!ends && depth > CERTAIN)
                survival = min(std::sqrt(max_component(left)), 1.0);
            if (survival < 1) {
                if (sampler_.number(keys[i], numbers[i], SobolSampler::dimension(depth, SobolSampler::ROULETTE)) >= survival) continue;
                left = left / survival;
            }
            block.points[MOST + four.slots[i]] = point_of(i);
            Path& next = block.onwards[onwards++];
            next = path;
            next.sample = four.samples[i], next.from = MOST + four.slots[i];
            next.kind = kind, next.diffuse = is_diffuse >> i & 1, next.last = ends, next.through = false;
            next.scattered[row(kind)]++;
            next.category = after(path.category, next.diffuse, depth);
            next.weight = left, next.pdf = sampled.pdf[i];
            next.ray = {lane(origin, i), lane(sampled.direction, i), 0, INFINITE};
            if (has_pixels_) next.width = four.footprint[i], next.spread = depth == 1 ? scene_.camera.spread(lane(four.incoming, i)) : path.spread;
            next.may_touch = path.touches;
        }
    }

    // Notes what lights bring to four points if nothing hides them.
    template <class PointOf>
    void ask(const LightSampler::Choices& choice, int slot, const WidePaths& four, const BSDFOf<double4>& bsdf, const PointOf& point_of, const Vec2x4& u, int depth, Block& block) const {
        LightSampleOf<double4> sample = choice.sample_li(four.at, point_of, u);
        uint4 kinds = choice.flags([](const Light& light) { return ~light.hidden_from; }), hit_by = choice.flags([](const Light& light) { return light.hit_by(); });
        uint4 shadow_rays = choice.flags([](const Light& light) { return uint32_t(light.casts_shadow ? light.shadow_rays : NO_RAY); });
        // See the other one.
        long4 lossy = has(choice.flags([](const Light& light) { return uint32_t(light.multiple_importance); }), 1) & ~long4(dot(four.at.normal, sample.direction) > 0.0);
        auto weight = [&](RayKind kind, auto&& pdf) {
            long4 shared = lossy | has(hit_by, kind);
            return any(shared) ? select(shared, power_heuristic(sample.pdf * choice.chance, pdf()), splat4(1.0)) : splat4(1.0);
        };
        ScatteredLightOf<double4> light = bsdf.eval(sample.direction, kinds, weight);
        if (depth > 1) light.diffuse = light.diffuse + light.other, light.other = {};
        light.diffuse = light.diffuse * sample.weight, light.other = light.other * sample.weight;
        long4 black = is_black(light.diffuse), has_other = ~is_black(light.other);
        unsigned lanes = choice.lanes & bits(~black | has_other), others = bits(has_other);
        if (lights_.is_linked())
            for (unsigned left = lanes; left;)
                if (int i = take_bit(left); !lights_.reaches(*choice.light[i], point_of(i))) lanes &= ~(1u << i);
        if (!lanes) return;
        double4 diffuse[4], other[4];
        rows(light.diffuse * four.weight / choice.chance, diffuse);
        if (others) rows(light.other * four.weight / choice.chance, other);
        Vec3x4 origin = four.at.ray_origin(sample.direction);
        Lit& lit = block.lit[slot];
        lit.rays.set(lit.count, lanes, origin, sample.direction, shadow_ray_end(four.at, origin, sample));
        while (lanes) {
            int i = take_bit(lanes);
            const Path& path = *four.paths[i];
            int place = lit.add(diffuse[i], four.samples[i], after(path.category, true, depth), shadow_rays[i]);
            if (others >> i & 1) lit.other[place] = other[i], lit.others |= uint64_t(1) << place;
            if (transparent_) lit.ray[place] = {SHADOW, false, false, depth, path.passed, path.scattered, 0, has_pixels_ ? four.footprint[i] : 0};
        }
    }

    // Notes what a light brings to a point if nothing hides it.
    void ask(const LightSampler::Choice& choice, const ShadingPoint& at, Vec2 u, const Path& path, int depth, const BSDF& bsdf,
             Block& block) const {
        const Interaction& point = at.point;
        if (!lights_.reaches(*choice.light, point)) return;
        LightSample sample = choice.light->sample_li(point, choice.rest, u);
        // Light that the smooth surface has before it and the true one behind it counts, less what scattered rays would have found:
        // these are lost, as in Cycles.
        bool behind = !(dot(point.normal, sample.direction) > 0);
        double end = coincident_ > 0 && !choice.light->is_environment() ? coincident_end(point, sample, *choice.light) : 0;
        uint32_t kinds = ~choice.light->hidden_from, unseen = 0;  // unseen: for which no scattered ray finds what this one does
        bool hidden_from_some = coincident_ > 0 && !path.coincident && end == 0;
        if (hidden_from_some) {
            const Light& light = *choice.light;
            double all, pdf = light.is_sized() && light.multiple_importance ? sample.pdf : INFINITE;
            uint32_t name = !(light.hidden_from & (DIFFUSE | GLOSSY | TRANSMISSION)) ? point.object : light.mesh() ? light.mesh()->object() : light.is_environment() ? name_of_world() : name_of(light);
            add_weighed(weighed_otherwise(bsdf, sample.direction, light.hidden_from, {pdf * choice.chance, pdf / lights_.count()}, all), sample.weight / choice.chance, shadow_ray(point, sample),
                        light.casts_shadow ? light.shadow_rays : NO_RAY, name, path, depth, block);
            kinds &= bsdf.non_specular_kinds();
            see_otherwise(*choice.light, point, sample, path, depth, kinds, unseen);
            if (!kinds) return;
        }
        auto weight = [&](RayKind kind, auto&& pdf) {
            if (unseen & kind) return 1.0;
            bool is_lost = behind != (kind == TRANSMISSION);
            return (is_lost && choice.light->multiple_importance) || choice.light->hit_by() & kind ? power_heuristic(sample.pdf * choice.chance, pdf()) : 1.0;
        };
        ScatteredLight light = bsdf.eval(sample.direction, kinds, weight);
        if (depth > 1) light.diffuse += light.other, light.other = {};
        light.diffuse = light.diffuse * sample.weight, light.other = light.other * sample.weight;
        if (is_black(light.diffuse) && is_black(light.other)) return;
        bool traced = choice.light->casts_shadow && !hidden_from_some;
        Vec3 diffuse = light.diffuse * path.weight / choice.chance, other = light.other * path.weight / choice.chance;
        Lit& lit = block.lit[choice.slot];
        int place = lit.add(double4{diffuse.x, diffuse.y, diffuse.z, 0}, path.sample, after(path.category, true, depth), traced ? choice.light->shadow_rays : NO_RAY);
        if (!is_black(light.other)) lit.other[place] = double4{other.x, other.y, other.z, 0}, lit.others |= uint64_t(1) << place;
        lit.ray[place] = {SHADOW, false, false, depth, path.passed, path.scattered, 0, has_pixels_ ? at.footprint() : 0};
        Ray ray = shadow_ray(point, sample);
        if (end > 0) ray.t_max = max(min(ray.t_max, sample.distance - end), 0.0);
        lit.rays.set(place, ray);
    }

    // Light from a direction of which Cycles has more or less than there is, by about so much. A ray that a lobe has scattered carries the
    // light of all lobes there, and its kind says what it sees (`surface_shader_bsdf_sample_closure`); a shadow ray finds a light for the
    // lobes whose class it is not hidden from, where translucence is diffuse, and glass is hidden from if both its kinds are
    // (`_surface_shader_exclude`). And where no facet refracts, rough refraction has a density, but no ray comes of it; and bumps shadow
    // translucence for a shadow ray, and not for a scattered one.
    // hidden_from: the kinds of rays that don't see the light. pdfs: between which Cycles' density of a shadow ray is, 0 where there is none;
    // INFINITE where scattered rays don't find the light. all: receives the density of all lobes together.
    [[gnu::noinline]] ScatteredLight weighed_otherwise(const BSDF& bsdf, Vec3 direction, uint32_t hidden_from, Vec2 pdfs, double& all) const {
        constexpr uint32_t BOTH = GLOSSY | TRANSMISSION;
        bool refracts = false, is_chosen = lights_.count() > 1 || lights_.has_meshes();
        bool is_weighed = pdfs.x == 0 || (pdfs.x < INFINITE && is_chosen);
        double seeing = 0;
        all = 0;
        auto no_facet = [&](const auto& lobe) {
            if constexpr (requires { lobe.has_facet(direction); }) return !lobe.has_facet(direction);
            return false;
        };
        bsdf.each(direction, [&](const auto& lobe, Vec3, Vec3, double density) {
            if constexpr (requires { lobe.has_facet(direction); }) refracts = true;
            is_chosen |= lobe.IS_DIFFUSE;
            all += density;
            if (!(hidden_from & (lobe.IS_DIFFUSE ? lobe.KIND | DIFFUSE : lobe.KIND)) && !no_facet(lobe)) seeing += density;
        });
        double carried = all > 0 ? seeing / all : 0;
        ScatteredLight sum;
        bsdf.each(direction, [&](const auto& lobe, Vec3 light, Vec3 lost, double) {
            uint32_t hiding = lobe.IS_DIFFUSE ? hidden_from & DIFFUSE
                              : refracts      ? (hidden_from & BOTH) == BOTH
                                              : hidden_from & (lobe.KIND == DIFFUSE ? GLOSSY : lobe.KIND);
            double ours = hidden_from & lobe.KIND ? 0 : 1;
            auto off = [&](double pdf) {
                double asked = power_heuristic(pdf, all);
                return std::fabs((hiding ? 0 : asked) + (1 - asked) * carried - ours);
            };
            (lobe.IS_DIFFUSE ? sum.diffuse : sum.other) += light * (no_facet(lobe) ? double(is_chosen) : max(off(pdfs.x), off(pdfs.y)));
            if (is_weighed && lobe.IS_DIFFUSE) sum.diffuse += lost;
        });
        return sum;
    }
    // Adds such light. name: what makes it, as in `pairs_`.
    void add_weighed(ScatteredLight light, Vec3 weight, const Ray& ray, RayKind kind, uint32_t name, const Path& path, int depth, Block& block) const {
        if (is_black(light.diffuse) && is_black(light.other)) return;
        weight *= path.weight * unoccluded(ray, kind, {kind, false, false, depth, path.passed, path.scattered, 0, path.width});
        if (is_black(weight)) return;
        if (depth > 1) light.diffuse += light.other, light.other = {};
        block.light[path.sample].add(after(path.category, true, depth), light.diffuse * weight);
        block.light[path.sample].add(OTHER, light.other * weight);
        std::lock_guard lock(mutex_);
        pairs_[{name, NONE}]++;
    }

    // Leaves of kinds of rays those that see a light otherwise than shadow rays do. unseen: receives those of them that don't see it.
    [[gnu::noinline]] void see_otherwise(const Light& light, const Interaction& point, const LightSample& sample, const Path& path, int depth, uint32_t& kinds,
                                         uint32_t& unseen) const {
        bool uses_mis = light.is_sized() && light.multiple_importance && light.shadow_rays == SHADOW;
        if (!sees_otherwise_ || !uses_mis) {
            kinds = 0;
            return;
        }
        const Light* lamp = light.mesh() || light.is_environment() ? nullptr : &light;
        for (RayKind kind : {DIFFUSE, GLOSSY, TRANSMISSION}) {
            if (!(kinds & kind)) continue;
            RayState state{kind, kind == DIFFUSE, false, depth, path.passed, path.scattered};
            state.scattered[row(kind)]++;
            LeftByKinds left = left_by_kinds(shadow_ray(point, sample), lamp, state);
            if (!left.differ()) kinds &= ~kind;
            if (VIEWCAM_ISA::is_black(left.scattered)) unseen |= kind;
        }
    }

    // Sends the shadow rays, and adds the light that nothing hides.
    void gather(int depth, Block& block) const {
        for (Lit& lit : block.lit) {
            bool hidden[MOST];
            if (lit.count > 0 && depth == 1 && lit.plain) {
                lit.rays.fill(lit.count);
                scene_.occluded(lit.rays, lit.count, hidden);
            } else {
                for (int i = 0; i < lit.count; i++) hidden[i] = lit.shadow_rays[i] != NO_RAY && scene_.occluded(lit.rays.ray(i), RayKind(lit.shadow_rays[i]));
            }
            for (int i = 0; i < lit.count; i++) {
                if (hidden[i] && !transparent_) continue;
                double4 left = splat4(1.0);
                if (hidden[i]) {
                    Vec3 through = transmittance(lit.rays.ray(i), RayKind(lit.shadow_rays[i]), lit.ray[i]);
                    left = double4{through.x, through.y, through.z, 0};
                }
                PathLight& light = block.light[lit.sample[i]];
                light.add(lit.category[i], lit.light[i] * left);
                if (lit.others >> i & 1) light.add(OTHER, lit.other[i] * left);
            }
        }
    }

    // Where one thing stands on another, their surfaces are in one place, up to rounding. Rays come out of the one before they meet
    // the other, as if there were air between: what is found nearest is not asked there.
    static double nearly(const Interaction& point, Vec3 direction) {
        return 8 * point.offset / max(std::fabs(dot(point.normal, direction)), 1e-6);
    }
    // The hit on another thing right where a path's ray starts, which comes out of one or goes back to what it came from.
    Hit touched(Path& path, const Interaction& point) const {
        double range = nearly(point, path.ray.direction);
        Ray ray{point.position - path.ray.direction * range, path.ray.direction, 0, 2 * range};
        while (Hit hit = scene_.closest(ray, path.kind, point.object)) {
            if (!scene_.interaction(ray, hit).backside) {
                path.ray = ray, path.ray.t_max = INFINITE;
                return hit;
            }
            ray.t_min = hit.t;
        }
        return {};
    }
    // Puts the surface through which a path leaves what it is inside of in the place of what it has met there.
    void let_out_first(const Path& path, Hit& met, Interaction& point) const {
        double range = nearly(point, path.ray.direction);
        Ray ray = path.ray;
        ray.t_min = max(ray.t_min, met.t - range), ray.t_max = met.t + range;
        while (Hit hit = scene_.closest(ray, path.kind, met.object)) {
            if (hit.object == path.inside) {
                Interaction exit = scene_.interaction(ray, hit);
                if (exit.backside) met = hit, point = exit;
                return;
            }
            ray.t_min = hit.t;
        }
    }

    // Where rays come to; adds what shines there.
    void arrive(int depth, Block& block) const {
        int arrived[MOST], met = 0, wide = 0;
        for (int i = 0; i < block.live; i++) {
            Path& path = block.onwards[i];
            if (shadow_linked_ || lights_.is_shadow_linked()) meet_shadow_linked(path, depth, block);
            Hit hit = path.may_touch ? touched(path, block.points[path.from]) : Hit{};
            path.touches = bool(hit);
            if (path.last && only_sky_[path.kind]) {
                if (!hit && !scene_.occluded(path.ray)) leave(path, path.ray, depth, block);
                continue;
            }
            if (!hit) hit = scene_.closest(path.ray, path.kind);
            meet_lamps(path, path.ray, hit, depth, block);
            if (hit && path.last && dark_) continue;
            if (hit && path.inside == NONE && meets_wide(hit, block.wide_points[wide])) {
                if (path.last || has_ended(path)) continue;
                block.wide_paths[wide] = path;
                block.wide |= uint64_t(1) << wide++;
            } else if (hit)
                arrived[met] = i, block.met_by[met] = &path.ray, block.met[met++] = hit;
            else
                leave(path, path.ray, depth, block);
        }
        scene_.interactions(block.met_by, block.met, met, block.next_points);
        int live = 0;
        for (int k = 0; k < met; k++) {
            Path& path = block.onwards[arrived[k]];
            if (path.inside != NONE && path.inside != block.met[k].object) let_out_first(path, block.met[k], block.next_points[k]);
            if (!follow(path, path.ray, block.met[k], block.next_points[k], depth, block)) continue;
            block.paths[live] = path;
            block.paths[live].from = k;
            live++;
        }
        block.live = live;
        std::swap(block.points, block.next_points);
    }

    const Scene& scene_;
    std::vector<char> wide_;  // by material, Material::is_wide
    LightSampler lights_;
    SobolSampler sampler_;
    const Guide* guide_ = nullptr;
    int most_, most_of_[TRANSMISSION + 1] = {};
    bool meets_[TRANSMISSION + 1] = {}, only_sky_[TRANSMISSION + 1] = {};
    bool lit_, transparent_ = false, mixed_ = false;  // true if materials let anything straight through, and beside that scatter
    bool dark_;                                       // true if nothing shines but lamps and the sky, and nothing lets light through
    bool shadow_linked_ = false;                      // true if the light of surfaces has blockers of its own
    bool sees_otherwise_ = false;                     // true if shadow rays may find a light where scattered rays don't, or the reverse
    bool has_pixels_ = false;                         // true if materials ask how wide pixels are
    int most_passed_, ended_after_;                   // surfaces that shadow rays, and paths, go straight through
    uint32_t kinds_ = 0, non_specular_ = 0;  // kinds of rays that any material scatters, and those scattered all over
    double coincident_;                // roundings
    mutable std::mutex mutex_;
    mutable std::map<std::pair<uint32_t, uint32_t>, uint64_t> pairs_;
};

}  // namespace viewcam::VIEWCAM_ISA
