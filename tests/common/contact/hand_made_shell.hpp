// Shapes with explicitly given points. Tests of the contact search that use them do not depend on the sampling of
// surfaces.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "common/contact/contact_shape.hpp"
#include "common/contact/field/primitive_fields.hpp"

namespace tandem::contact {

inline ContactShape hand_made_shape(std::shared_ptr<const DistanceField> field, PointShell surface,
                                    PointShell features = {}) {
  ContactShape shape;
  Eigen::AlignedBox3d box;
  for (const ShellPoint& point : surface.points) box.extend(point.p_S.cast<double>());
  shape.field = std::move(field);
  shape.shells = {std::move(surface), std::move(features)};
  shape.low_S = box.min();
  shape.high_S = box.max();
  return shape;
}

/// Returns `count` points that are evenly distributed on a sphere.
inline std::vector<ShellPoint> sphere_points(double radius_m, int count) {
  std::vector<ShellPoint> points;
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double area = 4 * std::numbers::pi * radius_m * radius_m / count;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count;
    const double ring = std::sqrt(1 - z * z);
    const Vec3 normal(ring * std::cos(golden * i), ring * std::sin(golden * i), z);
    points.push_back({(radius_m * normal).cast<float>(), normal.cast<float>(), static_cast<float>(area)});
  }
  return points;
}

/// Returns the centres of the squares of a lattice on each face of a box.
inline std::vector<ShellPoint> box_points(const Vec3& size_m, double spacing_m) {
  std::vector<ShellPoint> points;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    const int columns = static_cast<int>(std::ceil(size_m[u] / spacing_m));
    const int rows = static_cast<int>(std::ceil(size_m[v] / spacing_m));
    const double area = size_m[u] / columns * size_m[v] / rows;
    for (int i = 0; i < 2 * columns * rows; ++i) {
      Vec3 normal = Vec3::Zero();
      normal[axis] = i % 2 == 0 ? 1 : -1;
      Vec3 p = normal.cwiseProduct(size_m) / 2;
      const int column = i / 2 % columns, row = i / 2 / columns;
      p[u] = size_m[u] * ((column + 0.5) / columns - 0.5);
      p[v] = size_m[v] * ((row + 0.5) / rows - 0.5);
      points.push_back({p.cast<float>(), normal.cast<float>(), static_cast<float>(area)});
    }
  }
  return points;
}

/// Returns points along the twelve edges of a box.
inline std::vector<ShellPoint> box_edge_points(const Vec3& size_m, double spacing_m) {
  std::vector<ShellPoint> points;
  for (int axis = 0; axis < 3; ++axis) {
    const int count = static_cast<int>(std::ceil(size_m[axis] / spacing_m));
    for (int i = 0; i < 4 * (count + 1); ++i) {
      Vec3 outwards(i % 2 == 0 ? 1 : -1, i % 2 == 0 ? 1 : -1, i % 2 == 0 ? 1 : -1);
      outwards[(axis + 1) % 3] = i / 2 % 2 == 0 ? 1 : -1;
      const int place = i / 4;
      outwards[axis] = 2.0 * place / count - 1;
      const Vec3 p = outwards.cwiseProduct(size_m) / 2;
      outwards[axis] = 0;
      const auto area = static_cast<float>(spacing_m * size_m[axis] / count);
      points.push_back({p.cast<float>(), outwards.normalized().cast<float>(), area});
    }
  }
  return points;
}

/// A box with sample points on its faces and edges.
inline ContactShape box_shape(const Vec3& size_m, double spacing_m = 4.5e-4) {
  return hand_made_shape(box_field(size_m),
                         PointShell::make(box_points(size_m, spacing_m), std::max(4.5e-4, spacing_m)),
                         PointShell::make(box_edge_points(size_m, spacing_m), spacing_m));
}

/// Returns the same shape without flat nodes, so that each of its points is a separate contact.
inline ContactShape without_flat_parts(ContactShape shape) {
  shape.shells.surface.flat_nodes.clear();
  for (ShellNode& node : shape.shells.surface.nodes) node.flat = ShellNode::kNotFlat;
  return shape;
}

}  // namespace tandem::contact
