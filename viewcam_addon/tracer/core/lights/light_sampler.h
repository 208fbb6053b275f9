// All that gives light in a scene, and which of it a point is lit by.
//
// A point gets the light of one light, chosen at random, divided by the chance that it had. Of a few lights the chance is in
// proportion to what each may bring to that point; of many those that have a place stand in a tree (light_tree.h), beside which
// those at infinity have chances of their own, half of them by their light and half alike for all.
//
// Where the eye sees points in the light of very few lamps, that choice is most of the noise: there each lamp is asked by
// itself, the brightest at every sample, and others as often as what they may bring is worth it. The sky, too, is then asked no
// more often than that, and lobes that may show lamps are sampled instead of diffuse ones. In a field of spheres under three lamps
// and a sky the former makes half the noise in the same time, the latter takes a quarter of the variance.
//
// Lamps are sampled by solid angle, which is bounded, so that rays scattered by diffuse surfaces need not look for them.
// Surfaces that shine are found both ways, weighted by Veach's power heuristic.
#pragma once
#include "../accel/traverse.h"
#include "light.h"
#include "light_tree.h"

namespace viewcam::VIEWCAM_ISA {

class LightSampler {
   public:
    // For so many the chances are computed at each point, and so many lamps are asked one by one where the eye sees points.
    static constexpr int FEW = 32, MOST_CHOICES = 4;

    // chance: that the light was chosen, above 0. rest: what is left of the number that chose, in [0, 1). slot: another for
    // each that is asked at a point, and the same at all points for a lamp that is asked by itself.
    struct Choice {
        const Light* light;
        double chance, rest;
        int slot = 0;
    };

    // The choices of four points, or some of them; a lane that has no choice goes along with one that has.
    struct Choices {
        const Light* light[4];
        double4 chance, rest;
        unsigned lanes = 0;

        bool is_one() const { return light[0] == light[1] && light[0] == light[2] && light[0] == light[3]; }
        // of(light), flags, of each.
        template <class Of> uint4 flags(const Of& of) const {
            return is_one() ? splat4(uint32_t(of(*light[0]))) : uint4{of(*light[0]), of(*light[1]), of(*light[2]), of(*light[3])};
        }

        // The samples of these lights. point_of(i): all that is known of a point.
        template <class PointOf> LightSampleOf<double4> sample_li(const SurfacePoint<double4>& from, const PointOf& point_of, const Vec2x4& u) const {
            if (is_one()) return light[0]->sample_li(from, point_of, lanes, rest, u);
            LightSampleOf<double4> samples;
            for (unsigned left = lanes; left;) {
                int i = take_bit(left);
                samples.set(i, light[i]->sample_li(point_of(i), rest[i], {u.x[i], u.y[i]}));
            }
            return samples;
        }
    };

    explicit LightSampler(const Scene& scene) : objects_(&scene.objects), environment_(&scene.illumination.environment) {
        const Illumination& illumination = scene.illumination;
        uint32_t lit = DIFFUSE;  // the kinds of rays that surfaces scatter light into from any one direction
        for (const Material& material : illumination.materials) lit |= material.rough_kinds();
        std::vector<Light> unlit;
        for (const Lamp& lamp : illumination.lamps) {
            linked_ |= lamp.receivers != EVERYTHING;
            Light light = light_of(lamp, &scene);
            light.number = uint32_t(&lamp - illumination.lamps.data());
            (lit & ~lamp.hidden_from ? lights_ : unlit).push_back(light);
        }
        if (environment_->has_image() && lit & ~environment_->hidden_from) {
            sky_ = uint32_t(lights_.size());
            lights_.emplace_back(EnvironmentLight(*environment_), environment_->hidden_from, true);
        }
        lamps_ = lights_.size();
        std::vector<Vec3> emissions;
        for (const Material& material : illumination.materials) emissions.push_back(material.mean_emission());
        owners_.assign(scene.objects.size(), NONE);
        for (const Object& placed : scene.objects) linked_ |= placed.receivers != EVERYTHING;
        const Object* black = nullptr;  // the last object none of whose triangles shines: most of a million instances are like it
        for (uint32_t object = 0; object < scene.objects.size(); object++) {
            const Object& placed = scene.objects[object];
            uint32_t visible = placed.visible;
            if (!(visible & lit) || (black && black->geometry == placed.geometry && black->first_slot == placed.first_slot)) continue;
            MeshLight mesh(scene, object, emissions);
            if (mesh.is_black()) black = &placed;
            if (mesh.is_dark()) continue;
            owners_[object] = uint32_t(lights_.size());
            lights_.emplace_back(std::move(mesh), ~visible, true, placed.receivers, placed.shadow_rays);
        }
        size_t meshes = lights_.size();
        lights_.insert(lights_.end(), unlit.begin(), unlit.end());
        for (size_t i = 0; i < lights_.size(); i++)
            if ((i < lamps_ || i >= meshes) && i != sky_ && lights_[i].is_sized() && lights_[i].multiple_importance)
                (lights_[i].bounds() ? placed_ : boundless_).push_back(uint32_t(i)),
                    met_by_ |= (CAMERA | GLOSSY | TRANSMISSION) & ~lights_[i].hidden_from, shadow_linked_ |= lights_[i].shadow_rays != SHADOW;
        hierarchy_ = build_bvh(placed_.size(), [&](size_t i) { return lights_[placed_[i]].bounds()->box; }, 1, 1);
        count_ = int(meshes);
        random_ = count_ > 1 || (count_ == 1 && lights_[0].is_sized());
        if (count_ > FEW) build_tree();
    }

    const Environment& environment() const { return *environment_; }
    // The radiance of the world along a ray that a surface has scattered with a density. seen, through: see `choose`.
    Vec3 environment_le(Vec3 direction, RayKind kind, const Interaction& from, double pdf, bool seen, bool through) const {
        Vec3 radiance = environment_->le(direction, kind);
        if (sky_ == NONE || pdf == INFINITE || is_black(radiance)) return radiance;
        return radiance * power_heuristic(pdf, environment_->pdf_li(direction) * chance(from, sky_, seen, through));
    }
    // Calls visit(lamp, radiance, distance) for the lamps that such a ray runs through, with what counts of each where it may have been
    // found from there, too, but for what stands before it.
    template <class Visit> void each_lamp(const LightRay& ray, RayKind kind, const Interaction& from, double pdf, bool seen, bool through, const Visit& visit) const {
        if (!meets_lamps(kind)) return;
        each_met(ray, kind, [&](uint32_t light, Vec3 radiance, double distance) {
            visit(lights_[light], radiance * share(light, ray, from, pdf, seen, through), distance);
        });
    }
    // True if rays run into lamps that have blockers of their own.
    bool is_shadow_linked() const { return shadow_linked_; }

    // True if the receivers of a light, or of an object that shines, are all, or what a point is of is one of them.
    template <class Linked> bool reaches(const Linked& light, const Interaction& point) const {
        return !linked_ || light.receivers == EVERYTHING || point.object == NONE || light.receivers & (*objects_)[point.object].lit_by;
    }

    bool is_linked() const { return linked_; }

    // The number of lights that surfaces can be lit by, and whether what they get depends on chance.
    int count() const { return count_; }
    bool has_sky() const { return sky_ != NONE; }  // among them
    bool has_meshes() const { return size_t(count_) > lamps_; }
    bool is_random() const { return random_; }
    // True if rays of a kind run into lamps.
    bool meets_lamps(RayKind kind) const { return met_by_ & kind; }

    // The radiance of all lamps that a ray of a kind runs through.
    Vec3 le(const LightRay& ray, RayKind kind) const {
        Vec3 sum;
        each_met(ray, kind, [&](uint32_t, Vec3 radiance, double) { sum += radiance; });
        return sum;
    }

    // The lights that a point asks, at most MOST_CHOICES. seen: whether the eye sees it, so that several are worth it. through: whether
    // light from behind the surface counts. u: in [0, 1). brightest: receives about what the brightest lamp brings where lamps are asked one by one, else 0.
    int choose(const Interaction& point, double u, bool seen, bool through, Choice (&choices)[MOST_CHOICES], double& brightest) const {
        brightest = 0;
        if (count_ == 0) return 0;
        if (samples_each() && seen) {
            double estimates[MOST_CHOICES];
            for (int i = 0; i < count_; i++) brightest = max(brightest, estimates[i] = estimate(i, point, through));
            int chosen = 0;
            for (int i = 0; i < count_; i++) {
                // One without a size has no noise of its own.
                double chance = lights_[i].is_sized() ? min(estimates[i] / (brightest * WORTH), 1.0) : estimates[i] > 0;
                if (u < chance && chance > SMALLEST_CHANCE) choices[chosen++] = {&lights_[i], chance, u, i};
            }
            return chosen;
        }
        if (count_ == 1) {
            choices[0] = {&lights_[0], 1, u};
            return 1;
        }
        if (count_ > FEW) {
            double apart = chance_apart(point, through);
            if (u < apart) {
                u /= apart;
                size_t which = std::min<size_t>(std::upper_bound(reached_.begin(), reached_.end(), u) - reached_.begin(), apart_.size() - 1);
                double before = which ? reached_[which - 1] : 0, share = reached_[which] - before;
                choices[0] = {&lights_[apart_[which]], apart * share, std::clamp((u - before) / share, 0.0, BELOW_1)};
                return 1;
            }
            LightTree::Choice choice = tree_.choose(point, through, min((u - apart) / (1 - apart), BELOW_1));
            double chance = (1 - apart) * choice.chance;
            if (!(chance > SMALLEST_CHANCE)) return 0;
            choices[0] = {&lights_[choice.light], chance, choice.rest};
            return 1;
        }
        double estimates[FEW], total = 0, reached = 0;
        for (int i = 0; i < count_; i++) total += estimates[i] = estimate(i, point, through);
        double wanted = u * total;
        for (int i = 0, last = -1; i <= count_; i++) {  // the last that has a chance is taken even where sums are rounded
            if (i < count_ && estimates[i] > 0) last = i;
            bool here = i < count_ ? estimates[i] > 0 && wanted < reached + estimates[i] : last >= 0;
            if (here) {
                double share = estimates[last], before = i < count_ ? reached : total - share;
                if (!(share / total > SMALLEST_CHANCE)) return 0;
                choices[0] = {&lights_[last], share / total, std::clamp((wanted - before) / share, 0.0, BELOW_1)};
                return 1;
            }
            if (i < count_) reached += estimates[i];
        }
        return 0;
    }

    // Choices for some of four points, by slot. point_of(i): all that is known of a point.
    template <class PointOf> void choose(const PointOf& point_of, unsigned lanes, double4 u, bool seen, Choices (&choices)[MOST_CHOICES], double4& brightest) const {
        brightest = double4{};
        if (count_ == 1 && !(samples_each() && seen)) {
            const Light* light = &lights_[0];
            choices[0] = {{light, light, light, light}, splat4(1.0), u, lanes};
            return;
        }
        while (lanes && count_ > 0) {
            Choice chosen[MOST_CHOICES];
            int i = take_bit(lanes);
            double most;
            for (int k = choose(point_of(i), u[i], seen, false, chosen, most); k-- > 0;) {
                Choices& to = choices[chosen[k].slot];
                if (!to.lanes) std::fill_n(to.light, 4, chosen[k].light), to.chance = splat4(1.0), to.rest = double4{};
                to.light[i] = chosen[k].light, to.chance[i] = chosen[k].chance, to.rest[i] = chosen[k].rest, to.lanes |= 1u << i;
            }
            brightest[i] = most;
        }
    }

    // The light that the sky may bring, over the brightest lamp's, as `choose` tells, and how often it is worth a ray beside
    // that.
    double sky_share(double brightest, RayKind kind) const {
        return environment_->lights(kind) ? PI * mean(environment_->mean_radiance()) / brightest : 0;
    }
    double sky_chance(double brightest, RayKind kind) const { return min(sky_share(brightest, kind) / WORTH, 1.0); }

    // The density by solid angle with which a point would have sent a ray to a surface that its scattered ray has met.
    double pdf_li(const Interaction& from, const Interaction& met, Vec3 direction, double distance, bool through) const {
        uint32_t owner = owners_[met.object];
        if (owner == NONE) return 0;
        double pdf = lights_[owner].mesh()->pdf_li(met.material, distance, std::fabs(dot(met.normal, direction)));
        return pdf * chance(from, owner, false, through);
    }

   private:
    // A light has every sample that may bring this part of what the brightest may, and one that brings less is left out of
    // samples: half as many of both take as long for the same error. A smaller chance than SMALLEST_CHANCE comes never.
    static constexpr double WORTH = 0.25, SMALLEST_CHANCE = 1e-80, BELOW_1 = 1 - 0x1p-53;

    // True if lamps and the sky are asked one by one where the eye sees points.
    bool samples_each() const { return count_ <= MOST_CHOICES && !has_meshes() && (count_ > 1 || !is_black(environment_->radiance)); }

    // The most that a light may bring to a point.
    double estimate(uint32_t light, const Interaction& point, bool through) const {
        if (!reaches(lights_[light], point)) return 0;
        double before = estimate(light, point, point.shading, point.normal);
        return through ? before + estimate(light, point, -point.shading, -point.normal) : before;
    }
    // The estimate on one side. normal: the true one, for what the smooth one turns its back on.
    double estimate(uint32_t light, const Interaction& point, Vec3 shading, Vec3 normal) const {
        double brought = lights_[light].estimate(point.position, shading);
        return brought > 0 || is_black(shading - normal) ? brought : lights_[light].estimate(point.position, normal);
    }

    void build_tree() {
        constexpr double LEAST = 1e-100, MOST = 1e100;  // bounds within which sums and quotients are numbers
        std::vector<LightTree::Leaf> leaves;
        for (uint32_t i = 0; i < uint32_t(count_); i++) {
            if (std::optional<LightBounds> bounds = lights_[i].bounds())
                leaves.push_back({i, *bounds});
            else
                apart_.push_back(i), irradiance_ += min(lights_[i].irradiance(), MOST);
        }
        tree_ = LightTree(std::move(leaves), count_);
        double reached = 0, total = max(irradiance_, LEAST);
        for (uint32_t i : apart_)
            reached_.push_back(reached += 0.5 * min(lights_[i].irradiance(), MOST) / total + 0.5 / double(apart_.size()));
        if (!reached_.empty()) reached_.back() = 1;
    }
    // The chance that of many lights one at infinity is picked: between one and three quarters, since the tree's part is only a bound, but where
    // there is nothing else to pick.
    double chance_apart(const Interaction& point, bool through) const {
        if (apart_.empty()) return 0;
        double placed = tree_.importance(point, through);
        return placed > 0 ? 0.25 + 0.5 * irradiance_ / (irradiance_ + placed) : 1;
    }

    // Calls visit(light, radiance, distance) for the lamps that a ray runs through.
    template <class Visit> void each_met(const LightRay& ray, RayKind kind, const Visit& visit) const {
        auto meet = [&](uint32_t light) {
            if (lights_[light].hidden_from & kind) return;
            double distance = INFINITE;
            Vec3 radiance = lights_[light].le(ray, distance);
            if (!is_black(radiance)) visit(light, radiance, distance);
        };
        for (uint32_t light : boundless_) meet(light);
        traverse<false>(hierarchy_, Ray{ray.origin, ray.direction, ray.nearest}, ray.farthest, 0, [&](uint32_t leaf, BoxRay&) {
            meet(placed_[hierarchy_.leaves[leaf]]);
            return false;
        });
    }

    // The part that counts of what a scattered ray sees of a lamp.
    double share(uint32_t light, const LightRay& ray, const Interaction& from, double pdf, bool seen, bool through) const {
        if (!reaches(lights_[light], from)) return 0;
        double other = pdf < INFINITE && int(light) < count_ ? lights_[light].pdf_li(from, ray.direction) * chance(from, light, seen, through) : 0;
        return power_heuristic(pdf, other);
    }

    double chance(const Interaction& point, uint32_t light, bool seen, bool through) const {
        if (samples_each() && seen) {
            double brightest = 0;
            for (int i = 0; i < count_; i++) brightest = max(brightest, estimate(i, point, through));
            return min(estimate(light, point, through) / (brightest * WORTH), 1.0);
        }
        if (count_ == 1) return 1;
        if (count_ > FEW) {
            double apart = chance_apart(point, through);
            if (tree_.has(light)) return (1 - apart) * tree_.chance(point, through, light);
            size_t which = std::lower_bound(apart_.begin(), apart_.end(), light) - apart_.begin();
            return apart * (reached_[which] - (which ? reached_[which - 1] : 0));
        }
        double total = 0, own = 0;
        for (int i = 0; i < count_; i++) {
            double brought = estimate(i, point, through);
            total += brought;
            if (uint32_t(i) == light) own = brought;
        }
        return total > 0 ? own / total : 0;
    }

    const std::vector<Object>* objects_;
    bool shadow_linked_ = false;  // true if rays run into a lamp that has blockers of its own
    bool linked_ = false;        // true if any light has receivers of its own
    std::vector<Light> lights_;  // lamps that light diffuse surfaces, meshes, lamps that don't
    size_t lamps_;
    int count_;
    bool random_;
    std::vector<uint32_t> owners_;                // by object, the light that it is
    std::vector<uint32_t> placed_, boundless_;    // lamps that have a size: in the hierarchy, and at infinity
    Bvh hierarchy_;
    uint32_t met_by_ = 0;  // the kinds of rays that run into any of these
    LightTree tree_;                              // among many lights, those that have a place
    std::vector<uint32_t> apart_;                 // and the others
    std::vector<double> reached_;                 // the sums of their chances
    double irradiance_ = 0;                       // the others' irradiance together
    const Environment* environment_;
    uint32_t sky_ = NONE;  // the number of the world's image as a light
};

}  // namespace viewcam::VIEWCAM_ISA
