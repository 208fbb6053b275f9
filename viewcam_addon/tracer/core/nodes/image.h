// An image, looked up by a vector.
#pragma once
#include "math.h"

namespace viewcam::VIEWCAM_ISA {

struct ImageNode {
    static constexpr const char* NAME = "image";
    static constexpr Gives GIVES = Gives::COLOR;
    Color image, vector;
    Lookup lookup;
    bool alpha;

    explicit ImageNode(const Inputs& in)
        : image(in["image"]), vector(in["vector"]), lookup(lookup_of(in.choice("interpolation"), in.choice("extension"), in.flag("straight"))),
          alpha(in.choice("output") == "alpha") {}
    Vec3 eval(const ShadingPoint& at) const {
        if (image.image == NONE) return {};
        Vec3 place = at.value(vector);
        const Texture& texture = at.textures[image.image];
        return alpha ? grey(texture.alpha({place.x, place.y}, lookup)) : texture.at({place.x, place.y}, lookup);
    }

   private:
    static Lookup lookup_of(const std::string& interpolation, const std::string& extension, bool straight) {
        return {interpolation == "closest" ? Lookup::CLOSEST : interpolation == "cubic" ? Lookup::CUBIC : Lookup::LINEAR,
                extension == "extend"   ? Lookup::EXTEND
                : extension == "clip"   ? Lookup::CLIP
                : extension == "mirror" ? Lookup::MIRROR
                                        : Lookup::REPEAT,
                straight};
    }
};

}  // namespace viewcam::VIEWCAM_ISA
