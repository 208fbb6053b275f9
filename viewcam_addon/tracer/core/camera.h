// A pinhole camera in rendering space: (x, y, 1) of the view plane at distance 1 are a ray's right, up and forward components, so
// that t along it is planar depth.
#pragma once
#include "ray.h"

namespace viewcam::VIEWCAM_ISA {

struct Camera {
    Vec3 eye, right, up, forward;        // unit, but for silhouettes; `right` is −u where the picture is mirrored
    Vec2 principal_point, distance;      // pixels, along both axes
    uint32_t width = 0, height = 0;
    double t_min = 0, t_max = INFINITE;  // the clip range, whose own ends are visible

    // Where a point is: to the right, up and ahead; and where that is in the picture, from 0 to 1.
    Vec3 to_camera(Vec3 point) const {
        Vec3 from = point - eye;
        return {dot(from, right), dot(from, up), dot(from, forward)};
    }
    Vec3 from_camera(Vec3 direction) const { return right * direction.x + up * direction.y + forward * direction.z; }
    Vec2 window(Vec3 point) const {
        Vec3 at = to_camera(point);
        return {(at.x / at.z * distance.x + principal_point.x) / width, (at.y / at.z * distance.y + principal_point.y) / height};
    }
    // The growth of a pixel's width with each length of a ray in a direction: how far the unit directions of the next pixels,
    // to the right and above, are from its own, as Cycles has it (kernel/camera/camera.h).
    double spread(Vec3 direction) const {
        Vec3 ahead{dot(direction, right), dot(direction, up), dot(direction, forward)};
        ahead = ahead / ahead.z;
        Vec3 here = normalize(ahead), beside = normalize(ahead + Vec3{1 / distance.x, 0, 0}), above = normalize(ahead + Vec3{0, 1 / distance.y, 0});
        return (length(beside - here) + length(above - here)) / 2;
    }

    // Through a place in the picture, or four places, in pixels from its lower left corner, as pinhole.py's view_plane has it.
    template <class T> Vec3Of<T> direction(T column, T row) const {
        T x = (column - principal_point.x) / distance.x, y = (row - principal_point.y) / distance.y;
        return splat<T>(right) * x + splat<T>(up) * y + splat<T>(forward);
    }
    Ray ray(double column, double row) const { return {eye, direction(column, row), t_min, t_max}; }
    // The rays through up to 64 places, filled up to a multiple of four as `Rays` are.
    void rays(const double* columns, const double* rows, int count, Rays& rays) const {
        for (int i = 0; i < count; i += 4) {
            Vec3x4 ahead = direction(load<double4>(columns + i), load<double4>(rows + i));
            for (int axis = 0; axis < 3; axis++) store(rays.origin[axis] + i, splat4(eye[axis])), store(rays.direction[axis] + i, ahead[axis]);
            store(rays.t_min + i, splat4(t_min)), store(rays.t_max + i, splat4(t_max));
        }
    }
};

}  // namespace viewcam::VIEWCAM_ISA
