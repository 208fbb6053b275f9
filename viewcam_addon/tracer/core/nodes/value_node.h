// Nodes, from which closures' inputs are computed where they are neither constants nor a plain image. Each makes a number, a
// color or a vector of what other nodes make. A scene has one list of them; a node names only nodes before it.
//
// Evaluated at each hit, from the input back: what no input needs is never computed. A node whose inputs are all constant becomes
// its value when it is made, so that constants cost nothing. Rejected: a stack machine (Cycles' SVM), whose order must be compiled.
#pragma once
#include <concepts>
#include <variant>

#include "color.h"
#include "curves.h"
#include "geometry.h"
#include "ies.h"
#include "image.h"
#include "normals.h"
#include "procedural.h"
#include "voronoi.h"

namespace viewcam::VIEWCAM_ISA {

struct ConstantNode {
    static constexpr const char* NAME = "constant";
    static constexpr Gives GIVES = Gives::COLOR;
    Vec3 is;
    Vec3 eval(const ShadingPoint&) const { return is; }
};

// One variant of the nodes of several.
template <class First, class... Others> struct Joined { using Variant = First; };
template <class... First, class... Second, class... Others>
struct Joined<std::variant<First...>, std::variant<Second...>, Others...> : Joined<std::variant<First..., Second...>, Others...> {};

// Each file of several nodes lists them at its end, those of one stand here. A node has a NAME, by which a scene asks for it, what it
// GIVES, by which it becomes a number, and `eval`; VARIES or `varies` where it depends on more than its inputs; `gives` where the node
// itself knows what it gives.
using ValueNode = Joined<std::variant<ConstantNode, BumpNode, IESNode, NormalMapNode, VoronoiNode>, ImageNodes, GeometryNodes,
                         MathNodes, ColorNodes, CurveNodes, ProceduralNodes>::Variant;
template <class Kind>
concept IsValueNode = requires(const Kind& node, const ShadingPoint& at) {
    { Kind::NAME } -> std::convertible_to<std::string_view>;
    { Kind::GIVES } -> std::convertible_to<Gives>;
    { node.eval(at) } -> std::same_as<Vec3>;
    requires !(requires { Kind::VARIES; } && requires { node.varies(); });
};
template <class Kinds> constexpr bool ALL_ARE_VALUE_NODES = false;
template <class... Kinds> constexpr bool ALL_ARE_VALUE_NODES<std::variant<Kinds...>> = (IsValueNode<Kinds> && ...);
static_assert(ALL_ARE_VALUE_NODES<ValueNode>);

// A number of a value that is of some sort: a color's luminance, a vector's mean.
inline double number_of(Vec3 value, Gives sort) {
    return sort == Gives::NUMBER ? value.x : sort == Gives::VECTOR ? (value.x + value.y + value.z) / 3 : luminance(value);
}

struct ValueNodes {
    std::vector<ValueNode> all;

    Vec3 value(uint32_t node, const ShadingPoint& at) const {
        return std::visit([&](const auto& kind) { return finite(kind.eval(at)); }, all[node]);
    }
    double number(uint32_t node, const ShadingPoint& at) const {
        return std::visit([&](const auto& kind) { return number_of(finite(kind.eval(at)), gives(kind)); }, all[node]);
    }

    // Adds the node of this name; std::invalid_argument if there is none.
    void add(std::string_view name, const Inputs& inputs, const std::vector<Texture>& textures) {
        all.push_back(create(name, inputs, textures));
        on_tangents_.push_back(uv_of_tangents(all.back()) != nullptr || need_tangents(inputs));
    }
    // True if what makes any of these asks for the tangents of a UV map; and the name of that which a node itself asks for.
    bool need_tangents(const Inputs& inputs) const {
        return inputs.any_node([&](uint32_t node) { return on_tangents_[node]; });
    }
    static const std::string* uv_of_tangents(const ValueNode& node) {
        if (auto map = std::get_if<NormalMapNode>(&node); map && map->space == NormalMapNode::TANGENT) return &map->uv;
        if (auto tangent = std::get_if<TangentNode>(&node); tangent && !tangent->radial) return &tangent->uv;
        return nullptr;
    }
    // The color, or the constant that its node has turned out to be.
    Color resolved(Color color) const {
        if (color.node == NONE) return color;
        if (color.node >= all.size()) throw std::invalid_argument("an input names no node");
        if (auto constant = std::get_if<ConstantNode>(&all[color.node])) return {constant->is};
        return color;
    }

   private:
    std::vector<bool> on_tangents_;
    static constexpr double LARGEST = 1e18;

    template <class Kind> static Gives gives(const Kind& kind) {
        if constexpr (requires { kind.gives(); })
            return kind.gives();
        else
            return kind.GIVES;
    }
    // True if the node itself knows that it depends on more than its inputs.
    template <class Kind> static bool varies(const Kind& kind) {
        if constexpr (requires { kind.varies(); })
            return kind.varies();
        else
            return false;
    }
    static double finite(double x) { return x < LARGEST ? max(x, -LARGEST) : x > 0 ? LARGEST : 0; }
    static Vec3 finite(Vec3 v) { return {finite(v.x), finite(v.y), finite(v.z)}; }

    template <size_t I = 1> ValueNode create(std::string_view name, const Inputs& inputs, const std::vector<Texture>& textures) const {
        if constexpr (I == std::variant_size_v<ValueNode>) {
            throw std::invalid_argument("no node is called " + std::string(name));
        } else {
            using Kind = std::variant_alternative_t<I, ValueNode>;
            if (name != Kind::NAME) return create<I + 1>(name, inputs, textures);
            Kind node(inputs);
            if constexpr (!requires { Kind::VARIES; })
                if (inputs.all_constant() && !varies(node)) {
                    Interaction nowhere;
                    // As a number a vector is its mean, and a constant its luminance; as a normal one of zeros is none.
                    if (Kind::GIVES != Gives::VECTOR) return ConstantNode{finite(node.eval({nowhere, {0, 0, -1}, textures}))};
                }
            return node;
        }
    }
};

inline Vec3 ShadingPoint::value_of_node(uint32_t node) const { return nodes->value(node, *this); }
inline double ShadingPoint::number_of_node(uint32_t node) const { return nodes->number(node, *this); }

}  // namespace viewcam::VIEWCAM_ISA
