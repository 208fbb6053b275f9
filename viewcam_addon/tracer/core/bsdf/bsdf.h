// The BSDF that closures become at a point of a surface: a sum of lobes, what it gives off and what it lets straight through.
//
// A path takes one lobe only, chosen in proportion to the lobes' colors, and its weight is divided by that share: where there
// is one lobe, it is taken and nothing is random. Glass is two lobes, shared out by Fresnel's equations.
#pragma once
#include <concepts>
#include <cstddef>
#include <new>
#include <optional>
#include <variant>

#include "diffuse.h"
#include "microfacet.h"
#include "sheen.h"
#include "specular.h"

namespace viewcam::VIEWCAM_ISA {

// The end of light on a bumped surface: what bumps turn towards the light may lie where the surface itself looks away.
//
// As in Cycles: since 4.5 bumps shadow diffuse light as microfacets would (Conty Estevez et al., A Microfacet-Based Shadowing Function
// to Solve the Bump Terminator Problem, Ray Tracing Gems, 2019), before that it is faded by a cubic (Chiang et al., Taming the Shadow
// Terminator, 2019).
template <class T> struct ShadowTerminatorOf {
    Vec3Of<T> smooth;  // the normal without bumps
    bool by_facets, of_all;  // since 4.5; since 5.0, of light that is not diffuse, too

    // The share that is left of light from a direction, scattered by a lobe with a bumped normal.
    T left(Vec3Of<T> bumped, bool is_diffuse, Vec3Of<T> to_light) const {
        T flat = dot(smooth, to_light), tilt = dot(smooth, bumped), light = dot(bumped, to_light), none{}, all = splat<T>(1);
        if (!is_diffuse) return select(Mask<T>((of_all ? flat * tilt * light : flat * light) < 0.0), none, all);
        if (!by_facets) {
            T g = select(Mask<T>(light * tilt != 0.0), flat / (light * tilt), none);
            return select(Mask<T>(g >= 1.0), all, select(Mask<T>(g < 0.0), none, ((1.0 - g) * g + 1.0) * g));
        }
        T up = abs(flat), cosine = abs(tilt), squared = min(0.125 * (1.0 / (cosine * cosine) - 1.0), all);
        T left = 2.0 / (1.0 + sqrt(1.0 + squared * (1.0 / (up * up) - 1.0)));
        left = select(Mask<T>(up < 1e-6), none, left);
        left = select(Mask<T>(up >= 1.0) | Mask<T>(cosine >= 1.0), all, left);
        return select(Mask<T>(flat * tilt * light < 0.0), none, left);
    }
};

// One line a kind of lobe. Each has a color (the most that it sends on), KIND (by which objects and lights hide and by which
// bounces are counted), DELTA (whether its direction is no matter of chance), IS_DIFFUSE (whether passes count it so), eval, pdf
// and sample; `importance` where what it scatters is not its color. Those of four points at once are templates.
template <class T> struct LobeOf {
    using Kinds = std::variant<LambertOf<T>, OrenNayarOf<T>, SpecularReflectionOf<T>, MicrofacetReflectionOf<T>>;
};
template <> struct LobeOf<double> {
    using Kinds = std::variant<Lambert, SpecularReflection, SpecularTransmission, OrenNayar, Translucent, MicrofacetReflection, MicrofacetTransmission, SheenLobe, VelvetLobe>;
};
template <class Kind>
concept IsLobe = requires(const Kind& lobe, Vec3 to_light, Vec2 u) {
    { Kind::KIND } -> std::convertible_to<RayKind>;
    { Kind::DELTA } -> std::convertible_to<bool>;
    { Kind::IS_DIFFUSE } -> std::convertible_to<bool>;
    { lobe.eval(to_light) } -> std::same_as<Vec3>;
    { lobe.pdf(to_light) } -> std::convertible_to<double>;
    { lobe.sample(u) } -> std::same_as<LobeSample>;
    requires requires { lobe.frame.n; } || requires { lobe.normal; };
    requires requires { { lobe.importance() } -> std::same_as<double>; } || requires { { lobe.color } -> std::convertible_to<Vec3>; };
};
template <class Kinds> constexpr bool ALL_ARE_LOBES = false;
template <class... Kinds> constexpr bool ALL_ARE_LOBES<std::variant<Kinds...>> = (IsLobe<Kinds> && ...);
static_assert(ALL_ARE_LOBES<LobeOf<double>::Kinds>);

// Light that lobes send on, by the passes that count it.
template <class T> struct ScatteredLightOf {
    Vec3Of<T> diffuse, other;
};

// At one point, or at four of one material: there a lobe has lanes, which are those of its points where it scatters anything.
template <class T> class BSDFOf {
   public:
    static constexpr int MOST_LOBES = 64;
    using Lobe = typename LobeOf<T>::Kinds;

    // Black lobes are left out.
    template <class Kind> void add(const Kind& lobe) {
        T share = importance(lobe);
        Mask<T> lanes(share > 0.0);
        if (!any(lanes) || count_ == MOST_LOBES) return;
        new (&storage_[count_]) Lobe(lobe);
        lanes_[count_] = lanes, shares_[count_] = select(lanes, share, T{}), total_ += shares_[count_], count_++;
        kinds_ |= where(lanes, Kind::KIND);
        if (!Kind::DELTA) non_specular_kinds_ |= where(lanes, Kind::KIND);
    }
    void emit(Vec3 radiance) { emission_ += radiance; }
    // Its lobes have bumped normals, and light ends on them so.
    void bump(Mask<T> bumped, const ShadowTerminatorOf<T>& terminator) { bumped_ = bumped, terminator_ = terminator; }
    void let_through(Vec3 transparency) { transparency_ += transparency; }

    bool is_black() const { return count_ == 0; }
    Vec3 emission() const { return emission_; }
    Vec3 transparency() const { return transparency_; }
    // The share of it in all that goes on from here, by which a path is let through.
    double chance_through() const {
        double through = std::fabs(transparency_.x + transparency_.y + transparency_.z);
        return through > 0 ? through / (through + total_) : 0;
    }
    // Makes `sample` choose lobes of a kind so much less often.
    void thin(RayKind kind, T factor) {
        total_ = T{};
        for (int i = 0; i < count_; i++) total_ += shares_[i] *= std::visit([&](const auto& lobe) { return lobe.KIND == kind ? factor : splat<T>(1); }, lobe(i));
    }
    // The kinds of rays that light from any one direction is scattered into all over: what lights can be sampled for.
    Flags<T> non_specular_kinds() const { return non_specular_kinds_; }
    // The albedo of what is diffuse, which a pass of its own shows.
    Vec3Of<T> diffuse_color() const {
        Vec3Of<T> sum;
        for (int i = 0; i < count_; i++)
            std::visit([&](const auto& lobe) { if (lobe.IS_DIFFUSE) sum = sum + select(lanes_[i], lobe.color, Vec3Of<T>{}); }, lobe(i));
        return sum;
    }

    // The share of light from a unit direction that lobes of some kinds send on to where the path came from, cosine included.
    // weight(kind, pdf): the part of it that counts, by the density with which `sample` chooses that lobe and this direction.
    template <class Weight> ScatteredLightOf<T> eval(Vec3Of<T> to_light, Flags<T> kinds, Weight&& weight) const {
        ScatteredLightOf<T> sum;
        for (int i = 0; i < count_; i++)
            std::visit(
                [&](const auto& lobe) {
                    if (lobe.DELTA) return;
                    Mask<T> lanes = lanes_[i] & has(kinds, lobe.KIND);
                    if (!any(lanes)) return;
                    Vec3Of<T> light = lobe.eval(to_light);
                    if (any(bumped_)) light = light * select(bumped_, terminator_.left(normal_of(lobe), lobe.IS_DIFFUSE, to_light), splat<T>(1));
                    lanes = lanes & (viewcam::VIEWCAM_ISA::is_black(light) == Mask<T>{});
                    if (!any(lanes)) return;
                    Vec3Of<T>& to = lobe.IS_DIFFUSE ? sum.diffuse : sum.other;
                    to = to + select(lanes, light * weight(lobe.KIND, [&]() -> T { return share(i) * lobe.pdf(to_light); }), Vec3Of<T>{});
                },
                lobe(i));
        return sum;
    }
    // Calls visit(lobe, light, lost, pdf) for the lobes that scatter light from a direction all over, with what they send on, what more they
    // do where `sample` has chosen the direction, and the density with which it chooses them and this direction.
    template <class Visit> void each(Vec3 to_light, Visit&& visit) const {
        for (int i = 0; i < count_; i++)
            std::visit([&](const auto& lobe) {
                if (lobe.DELTA) return;
                double left = bumped_ ? terminator_.left(normal_of(lobe), lobe.IS_DIFFUSE, to_light) : 1;
                Vec3 light = lobe.eval(to_light);
                visit(lobe, light * left, light * (lobe.IS_DIFFUSE && lobe.KIND == TRANSMISSION ? 1 - left : 0), share(i) * lobe.pdf(to_light));
            }, this->lobe(i));
    }
    // u_lobe: which lobe, in [0, 1). direction: two numbers in [0, 1) that are made where they are asked for.
    template <class Numbers>
    BSDFSampleOf<T> sample(T u_lobe, Numbers&& direction) const {
        return sample(u_lobe, direction, [](const auto& lobe, Vec2Of<T> u) { return lobe.sample(u); });
    }
    // sample_lobe(lobe, u): the direction of a lobe.
    template <class Numbers, class SampleLobe>
    BSDFSampleOf<T> sample(T u_lobe, Numbers&& direction, const SampleLobe& sample_lobe) const {
        T chosen{}, reached{};
        for (int i = 0; i < count_; i++) {  // the last is taken even where the sum is rounded to less than u
            chosen = select(Mask<T>(u_lobe >= reached) & Mask<T>(shares_[i] > 0.0), splat<T>(i), chosen);
            reached += share(i);
        }
        BSDFSampleOf<T> sample;
        std::optional<Vec2Of<T>> u;
        for (int i = 0; i < count_; i++) {
            Mask<T> lanes(chosen == double(i));
            if (!any(lanes)) continue;
            std::visit(
                [&](const auto& lobe) {
                    if (!lobe.DELTA && !u) u = direction();
                    LobeSampleOf<T> of_lobe = sample_lobe(lobe, lobe.DELTA ? Vec2Of<T>{} : *u);
                    if (any(bumped_) && lobe.IS_DIFFUSE && lobe.KIND != TRANSMISSION)  // so Cycles has it
                        of_lobe.weight = of_lobe.weight * select(bumped_, terminator_.left(normal_of(lobe), true, of_lobe.direction), splat<T>(1));
                    sample.direction = select(lanes, of_lobe.direction, sample.direction);
                    sample.weight = select(lanes, of_lobe.weight / share(i), sample.weight);
                    sample.pdf = select(lanes, of_lobe.pdf * share(i), sample.pdf);
                    sample.kind |= where(lanes, lobe.KIND);
                    if (lobe.IS_DIFFUSE) sample.is_diffuse = sample.is_diffuse | lanes;
                },
                lobe(i));
        }
        return sample;
    }
    bool needs_choice() const { return count_ > 1; }
    // The kinds of rays that the lobes scatter.
    Flags<T> kinds() const { return kinds_; }

   private:
    template <class Kind> static T importance(const Kind& lobe) {
        if constexpr (requires { lobe.importance(); })
            return lobe.importance();
        else
            return lobe.color.x + lobe.color.y + lobe.color.z;
    }
    template <class Kind> static Vec3Of<T> normal_of(const Kind& lobe) {
        if constexpr (requires { lobe.frame; })
            return lobe.frame.n;
        else
            return lobe.normal;
    }
    T share(int lobe) const { return count_ == 1 ? splat<T>(1) : shares_[lobe] / total_; }

    static_assert(std::is_trivially_destructible_v<Lobe>);
    struct Storage {  // not filled before there is a lobe
        alignas(Lobe) std::byte bytes[sizeof(Lobe)];
    };
    const Lobe& lobe(int i) const { return *reinterpret_cast<const Lobe*>(&storage_[i]); }

    Storage storage_[MOST_LOBES];
    T shares_[MOST_LOBES], total_{};
    Mask<T> lanes_[MOST_LOBES], bumped_{};
    int count_ = 0;
    Flags<T> kinds_{}, non_specular_kinds_{};
    ShadowTerminatorOf<T> terminator_;
    Vec3 emission_, transparency_;  // at one point: emissive and transparent surfaces are met by each path alone
};
using ScatteredLight = ScatteredLightOf<double>;
using BSDF = BSDFOf<double>;
using BSDFSample = BSDFSampleOf<double>;

}  // namespace viewcam::VIEWCAM_ISA
