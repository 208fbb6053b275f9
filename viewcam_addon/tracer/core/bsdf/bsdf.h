// What closures become at a point of a surface: the BSDF, a sum of lobes, what it gives off and what it lets straight through.
//
// A path takes one lobe only, chosen in proportion to the lobes' colours, and its weight is divided by that share: where there
// is one lobe, it is taken and nothing is random. Glass is two lobes, shared out by Fresnel's equations.
#pragma once
#include <concepts>
#include <cstddef>
#include <new>
#include <variant>

#include "dielectric.h"
#include "lambert.h"
#include "microfacet.h"
#include "oren_nayar.h"
#include "shadow_terminator.h"
#include "sheen.h"
#include "specular.h"
#include "translucent.h"

namespace viewcam::VIEWCAM_ISA {

// One line a kind of lobe. Each has a colour (the most that it sends on), KIND (by which objects and lights hide and by which
// bounces are counted), DELTA (whether its direction is no matter of chance), IS_DIFFUSE (whether passes count it so), eval, pdf
// and sample; `importance` where what it scatters is not its colour.
using Lobe = std::variant<Lambert, SpecularReflection, SpecularTransmission, OrenNayar, Translucent, MicrofacetReflection, MicrofacetTransmission, SheenLobe, VelvetLobe>;
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
static_assert(ALL_ARE_LOBES<Lobe>);

// Light that lobes send on, by the passes that count it.
struct ScatteredLight {
    Vec3 diffuse, other;
};

class BSDF {
   public:
    static constexpr int MOST_LOBES = 64;

    // Black lobes are left out.
    template <class Kind> void add(const Kind& lobe) {
        double share = importance(lobe);
        if (!(share > 0) || count_ == MOST_LOBES) return;
        new (&storage_[count_]) Lobe(lobe);
        shares_[count_++] = share, total_ += share;
        kinds_ |= Kind::KIND;
        if (!Kind::DELTA) spread_ |= Kind::KIND;
    }
    void emit(Vec3 radiance) { emission_ += radiance; }
    // Its lobes have bumped normals, and light ends on them so.
    void bump(const ShadowTerminator& terminator) { bumped_ = true, terminator_ = terminator; }
    void let_through(Vec3 transparency) { transparency_ += transparency; }

    bool is_black() const { return count_ == 0; }
    Vec3 emission() const { return emission_; }
    Vec3 transparency() const { return transparency_; }
    // The share of it in all that goes on from here, by which a path is let through.
    double chance_through() const {
        double through = transparency_.x + transparency_.y + transparency_.z;
        return through > 0 ? through / (through + total_) : 0;
    }
    // Makes `sample` choose lobes of a kind so much less often.
    void thin(RayKind kind, double factor) {
        total_ = 0;
        for (int i = 0; i < count_; i++) total_ += shares_[i] *= std::visit([&](const auto& lobe) { return lobe.KIND == kind ? factor : 1; }, lobe(i));
    }
    // The kinds of rays that light from any one direction is scattered into all over: what lights can be sampled for.
    uint32_t spread_kinds() const { return spread_; }
    // The albedo of what is diffuse, which a pass of its own shows.
    Vec3 diffuse_color() const {
        Vec3 sum;
        for (int i = 0; i < count_; i++)
            std::visit([&](const auto& lobe) { if (lobe.IS_DIFFUSE) sum += lobe.color; }, lobe(i));
        return sum;
    }

    // What of light from a unit direction is sent on to where the path came from, cosine included, by lobes of some kinds.
    // weight(kind, pdf): what of it counts, by the density with which `sample` chooses that lobe and this direction.
    template <class Weight> ScatteredLight eval(Vec3 to_light, uint32_t kinds, Weight&& weight) const {
        ScatteredLight sum;
        for (int i = 0; i < count_; i++)
            std::visit(
                [&](const auto& lobe) {
                    if (lobe.DELTA || !(lobe.KIND & kinds)) return;
                    Vec3 light = lobe.eval(to_light);
                    if (bumped_) light *= terminator_.left(normal_of(lobe), lobe.IS_DIFFUSE, to_light);
                    if (viewcam::VIEWCAM_ISA::is_black(light)) return;
                    (lobe.IS_DIFFUSE ? sum.diffuse : sum.other) += light * weight(lobe.KIND, [&] { return share(i) * lobe.pdf(to_light); });
                },
                lobe(i));
        return sum;
    }
    // u_lobe: which lobe, in [0, 1). direction: two numbers in [0, 1) that are made where they are asked for.
    template <class Numbers>
    BSDFSample sample(double u_lobe, Numbers&& direction) const {
        int chosen = 0;
        double reached = 0;
        for (int i = 0; i < count_; i++) {  // the last is taken even where the sum is rounded to less than u
            if (u_lobe >= reached && shares_[i] > 0) chosen = i;
            reached += share(i);
        }
        BSDFSample sample;
        std::visit(
            [&](const auto& lobe) {
                static_cast<LobeSample&>(sample) = lobe.sample(lobe.DELTA ? Vec2{} : direction());
                sample.kind = lobe.KIND, sample.is_diffuse = lobe.IS_DIFFUSE;
                if (bumped_ && lobe.IS_DIFFUSE) sample.weight *= terminator_.left(normal_of(lobe), true, sample.direction);
            },
            lobe(chosen));
        sample.weight = sample.weight / share(chosen);
        sample.pdf *= share(chosen);
        return sample;
    }
    bool needs_choice() const { return count_ > 1; }
    // The kinds of rays that the lobes scatter.
    uint32_t kinds() const { return kinds_; }

   private:
    template <class Kind> static double importance(const Kind& lobe) {
        if constexpr (requires { lobe.importance(); })
            return lobe.importance();
        else
            return lobe.color.x + lobe.color.y + lobe.color.z;
    }
    template <class Kind> static Vec3 normal_of(const Kind& lobe) {
        if constexpr (requires { lobe.frame; })
            return lobe.frame.n;
        else
            return lobe.normal;
    }
    double share(int lobe) const { return count_ == 1 ? 1 : shares_[lobe] / total_; }

    static_assert(std::is_trivially_destructible_v<Lobe>);
    struct Storage {  // not filled before there is a lobe
        alignas(Lobe) std::byte bytes[sizeof(Lobe)];
    };
    const Lobe& lobe(int i) const { return *reinterpret_cast<const Lobe*>(&storage_[i]); }

    Storage storage_[MOST_LOBES];
    double shares_[MOST_LOBES], total_ = 0;
    int count_ = 0;
    uint32_t kinds_ = 0, spread_ = 0;
    bool bumped_ = false;
    ShadowTerminator terminator_;
    Vec3 emission_, transparency_;
};

}  // namespace viewcam::VIEWCAM_ISA
