// The sample of a BSDF, or of one lobe of it.
#pragma once
#include "../ray.h"

namespace viewcam::VIEWCAM_ISA {

// direction: unit. weight: the BSDF times the cosine over the density. pdf: the density by solid angle, INFINITE of mirrors.
template <class T> struct LobeSampleOf {
    Vec3Of<T> direction, weight;
    T pdf{};
};
using LobeSample = LobeSampleOf<double>;
// kind: of the ray that goes on, a RayKind.
template <class T> struct BSDFSampleOf : LobeSampleOf<T> {
    Flags<T> kind{};
    Mask<T> is_diffuse{};
};

}  // namespace viewcam::VIEWCAM_ISA
