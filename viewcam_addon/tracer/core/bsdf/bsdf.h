// The BSDF at a point of a surface: a sum of lobes.
//
// A path takes one lobe only, chosen in proportion to the lobes' colours, and its weight is divided by that share: where there
// is one lobe, it is taken and nothing is random. Glass is two lobes, shared out by Fresnel's equations.
#pragma once
#include <cstddef>
#include <new>
#include <variant>

#include "dielectric.h"
#include "lambert.h"
#include "specular.h"

namespace viewcam::VIEWCAM_ISA {

// One line a kind of lobe. Each has a colour (the most that it sends on), KIND (by which objects and lights hide and by which
// bounces are counted), DELTA (whether its direction is no matter of chance), eval, pdf and sample.
using Lobe = std::variant<Lambert, SpecularReflection, SpecularTransmission>;

class BSDF {
   public:
    static constexpr int MOST_LOBES = 8;

    // Black lobes are left out.
    template <class Kind> void add(const Kind& lobe) {
        double share = lobe.color.x + lobe.color.y + lobe.color.z;
        if (!(share > 0) || count_ == MOST_LOBES) return;
        new (&storage_[count_]) Lobe(lobe);
        shares_[count_++] = share, total_ += share;
        kinds_ |= Kind::KIND, spread_ |= !Kind::DELTA;
    }

    bool is_black() const { return count_ == 0; }
    // Whether light from any one direction is scattered into all: what lights can be sampled for.
    bool is_spread() const { return spread_; }

    // What of light from a unit direction is sent on to where the path came from, cosine included, by lobes of a kind.
    Vec3 eval(Vec3 to_light, RayKind kind) const {
        Vec3 sum;
        for (int i = 0; i < count_; i++)
            std::visit([&](const auto& lobe) { if (lobe.KIND == kind && !lobe.DELTA) sum += lobe.eval(to_light); }, lobe(i));
        return sum;
    }
    // The density by solid angle with which `sample` chooses a direction.
    double pdf(Vec3 to_light) const {
        double sum = 0;
        for (int i = 0; i < count_; i++)
            std::visit([&](const auto& lobe) { if (!lobe.DELTA) sum += share(i) * lobe.pdf(to_light); }, lobe(i));
        return sum;
    }
    // u_lobe: which lobe, in [0, 1). direction: two numbers in [0, 1) that are made where they are asked for.
    template <class Numbers>
    BSDFSample sample(double u_lobe, Numbers&& direction) const {
        int chosen = 0;
        double reached = 0;
        for (int i = 0; i < count_; i++) {  // the last is taken even where the sum is rounded to less than u
            if (u_lobe >= reached) chosen = i;
            reached += share(i);
        }
        BSDFSample sample;
        std::visit(
            [&](const auto& lobe) {
                static_cast<LobeSample&>(sample) = lobe.sample(lobe.DELTA ? Vec2{} : direction());
                sample.kind = lobe.KIND;
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
    double share(int lobe) const { return count_ == 1 ? 1 : shares_[lobe] / total_; }

    static_assert(std::is_trivially_destructible_v<Lobe>);
    struct Storage {  // not filled before there is a lobe
        alignas(Lobe) std::byte bytes[sizeof(Lobe)];
    };
    const Lobe& lobe(int i) const { return *reinterpret_cast<const Lobe*>(&storage_[i]); }

    Storage storage_[MOST_LOBES];
    double shares_[MOST_LOBES], total_ = 0;
    int count_ = 0;
    uint32_t kinds_ = 0;
    bool spread_ = false;
};

}  // namespace viewcam::VIEWCAM_ISA
