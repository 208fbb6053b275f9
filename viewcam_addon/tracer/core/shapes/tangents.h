// Tangents of a UV map, on which normal maps and stretched facets stand: those of MikkTSpace (Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008),
// which bakers and renderers share.
//
// Corners of the same place, normal and UV are one vertex. Of the triangles round it, those that follow each other side by side and
// are laid out on the same side of the map have one tangent: the mean of the directions in which their u grows, each laid into the
// plane of the normal, by the triangles' angles there.
#pragma once
#include <algorithm>
#include <array>
#include <numeric>

#include "../math/trig.h"
#include "triangle_mesh.h"

namespace viewcam::VIEWCAM_ISA {

class TangentsOfMesh {
   public:
    // uvs: (count, 3, 2). Returns (count, 3, 4): a tangent, not always of unit length, and the side of the map, 1 or −1.
    static std::vector<float> of(const TriangleMesh& mesh, const float* uvs) { return TangentsOfMesh(mesh, uvs).values(); }

   private:
    struct Edge {
        uint32_t low, high, corner;  // two vertices, and where the edge begins
        bool operator<(const Edge& other) const { return std::tie(low, high, corner) < std::tie(other.low, other.high, other.corner); }
    };

    TangentsOfMesh(const TriangleMesh& mesh, const float* uvs) : mesh_(mesh), uvs_(uvs), corners_(3 * mesh.count) {
        weld();
        group_.resize(corners_);
        std::iota(group_.begin(), group_.end(), 0u);
        along_.resize(mesh.count), turns_.resize(mesh.count), has_area_.resize(mesh.count);
        for (size_t i = 0; i < mesh.count; i++) lay_out(i);
        join();
    }

    static size_t next(size_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
    static size_t previous(size_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }
    Vec3 place(size_t corner) const { return mesh_.corner(corner / 3, int(corner % 3)); }
    // Rounded to float32, so that equal faces have equal ones.
    std::array<float, 3> normal(size_t corner) const {
        if (mesh_.corner_normals) {
            const float* n = mesh_.corner_normals + 3 * corner;
            return {n[0], n[1], n[2]};
        }
        size_t first = corner / 3 * 3;
        Vec3 n = cross(place(first + 1) - place(first), place(first + 2) - place(first));
        double size = length(n);
        if (size > 0) n = n / size;
        return {float(n.x), float(n.y), float(n.z)};
    }

    // Numbers the vertices.
    void weld() {
        std::vector<std::array<double, 8>> keys(corners_);
        std::vector<uint32_t> order(corners_);
        for (size_t i = 0; i < corners_; i++) {
            Vec3 at = place(i);
            std::array<float, 3> n = normal(i);
            keys[i] = {at.x, at.y, at.z, n[0], n[1], n[2], uvs_[2 * i], uvs_[2 * i + 1]};
            for (double& each : keys[i])
                if (!(each == each)) each = 0;  // NaN has no order
        }
        std::iota(order.begin(), order.end(), 0u);
        std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return keys[a] < keys[b]; });
        vertex_.resize(corners_);
        for (size_t i = 0; i < corners_; i++) vertex_[order[i]] = i && keys[order[i]] == keys[order[i - 1]] ? vertex_[order[i - 1]] : uint32_t(i);
    }

    bool is_degenerate(size_t triangle) const {
        const uint32_t* v = &vertex_[3 * triangle];
        Vec3 a = place(3 * triangle), b = place(3 * triangle + 1), c = place(3 * triangle + 2);
        return v[0] == v[1] || v[1] == v[2] || v[2] == v[0] || length(b - a) == 0 || length(c - b) == 0 || length(a - c) == 0;
    }
    // Where u grows on a triangle, and which side of the map it is on: 0 where it has no area there.
    void lay_out(size_t triangle) {
        const float* uv = uvs_ + 6 * triangle;
        double s1 = double(uv[2]) - uv[0], t1 = double(uv[3]) - uv[1], s2 = double(uv[4]) - uv[0], t2 = double(uv[5]) - uv[1];
        double area = s1 * t2 - t1 * s2;
        if (is_degenerate(triangle) || !(area != 0)) return;
        Vec3 first = place(3 * triangle);
        Vec3 along = (place(3 * triangle + 1) - first) * t2 - (place(3 * triangle + 2) - first) * t1;
        turns_[triangle] = area > 0 ? 1 : -1, has_area_[triangle] = true;
        double size = length(along);
        if (size > 0 && size < INFINITE) along_[triangle] = along * (turns_[triangle] / size);
    }

    uint32_t root(uint32_t corner) {
        while (group_[corner] != corner) corner = group_[corner] = group_[group_[corner]];
        return corner;
    }
    void unite(size_t a, size_t b) { group_[root(uint32_t(a))] = root(uint32_t(b)); }
    // Joins corners across the edges that two triangles share.
    void join() {
        std::vector<Edge> edges;
        for (size_t i = 0; i < corners_; i++) {
            uint32_t a = vertex_[i], b = vertex_[next(i)];
            if (!is_degenerate(i / 3)) edges.push_back({std::min(a, b), std::max(a, b), uint32_t(i)});
        }
        std::sort(edges.begin(), edges.end());
        std::vector<std::pair<uint32_t, uint32_t>> shared;
        std::vector<bool> is_paired(edges.size());
        for (size_t i = 0; i < edges.size(); i++)
            for (size_t k = i + 1; !is_paired[i] && k < edges.size() && edges[k].low == edges[i].low && edges[k].high == edges[i].high; k++)
                if (!is_paired[k] && vertex_[edges[k].corner] != vertex_[edges[i].corner])  // they run against each other
                    is_paired[i] = is_paired[k] = true, shared.push_back({edges[i].corner, edges[k].corner});
        // A triangle that has no side of its own is on that of a neighbor.
        for (auto [a, b] : shared)
            for (auto [from, to] : {std::pair{a / 3, b / 3}, std::pair{b / 3, a / 3}})
                if (!turns_[to]) turns_[to] = turns_[from];
        for (auto [a, b] : shared)
            if (turns_[a / 3] == turns_[b / 3]) unite(a, next(b)), unite(next(a), b);
    }

    std::vector<float> values() {
        auto within = [](Vec3 v, Vec3 normal) {
            Vec3 flat = v - normal * dot(v, normal);
            double size = length(flat);
            return size > 0 ? flat / size : Vec3{};
        };
        std::vector<Vec3> sum(corners_);
        std::vector<bool> is_laid_out(corners_);  // true of a vertex where some triangle has an area in the map
        for (size_t i = 0; i < corners_; i++) {
            if (is_degenerate(i / 3)) continue;
            if (has_area_[i / 3]) is_laid_out[root(uint32_t(i))] = true;
            auto [x, y, z] = normal(i);
            Vec3 n{x, y, z};
            Vec3 before = within(place(previous(i)) - place(i), n), after = within(place(next(i)) - place(i), n);
            double cosine = max(min(dot(before, after), 1.0), -1.0);
            sum[root(uint32_t(i))] += within(along_[i / 3], n) * acos(cosine);
        }
        std::vector<float> tangents(4 * corners_);
        for (size_t i = 0; i < corners_; i++) {
            Vec3 tangent = sum[root(uint32_t(i))];
            double size = length(tangent);
            if (size > 0) tangent = tangent / size;
            if (!is_laid_out[root(uint32_t(i))]) tangent = {1, 0, 0};
            for (int axis = 0; axis < 3; axis++) tangents[4 * i + size_t(axis)] = float(tangent[axis]);
            tangents[4 * i + 3] = is_laid_out[root(uint32_t(i))] && turns_[i / 3] > 0 ? 1 : -1;
        }
        return tangents;
    }

    const TriangleMesh& mesh_;
    const float* uvs_;
    size_t corners_;
    std::vector<uint32_t> vertex_, group_;  // by corner
    std::vector<Vec3> along_;               // by triangle
    std::vector<int> turns_;
    std::vector<bool> has_area_;  // in the map
};

}  // namespace viewcam::VIEWCAM_ISA
