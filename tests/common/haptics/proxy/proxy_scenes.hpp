// Surfaces and motions for the tests of the proxy.
#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "common/haptics/proxy/god_object.hpp"
#include "tests/common/contact/test_meshes.hpp"

namespace tandem::haptics {

inline Pose at(const Vec3& p_W) {
  return {p_W, Quat::Identity()};
}

inline ProxyObstacle touchable(std::shared_ptr<const contact::ExactField> primitive, const Pose& X_WB = {}) {
  ProxyObstacle obstacle;
  obstacle.primitive = std::move(primitive);
  obstacle.X_WB = X_WB;
  return obstacle;
}

inline ProxyObstacle touchable(const geometry::TriangleMesh& mesh, const Pose& X_WB = {}) {
  ProxyObstacle obstacle;
  obstacle.mesh = std::make_shared<const ProxyMesh>(mesh);
  obstacle.X_WB = X_WB;
  return obstacle;
}

inline ProxyObstacle with_friction(ProxyObstacle obstacle, double still, double sliding) {
  obstacle.static_friction = still;
  obstacle.dynamic_friction = sliding;
  return obstacle;
}

inline GodObject proxy_at(const Vec3& p_W, std::vector<ProxyObstacle> obstacles, bool is_shaded = false,
                          double radius_m = 1e-3) {
  return {{radius_m, is_shaded}, std::move(obstacles), p_W};
}

/// Returns a sheet z = f(x, y) over a square with the edge `width_m`. It consists of `pieces`² cells of two triangles.
inline geometry::TriangleMesh height_mesh(double width_m, int pieces, const std::function<double(double, double)>& f) {
  geometry::TriangleMesh mesh;
  for (int i = 0; i <= pieces; ++i) {
    for (int j = 0; j <= pieces; ++j) {
      const double x = width_m * (static_cast<double>(i) / pieces - 0.5);
      const double y = width_m * (static_cast<double>(j) / pieces - 0.5);
      mesh.vertices.emplace_back(x, y, f(x, y));
    }
  }
  const int row = pieces + 1;
  for (int i = 0; i < pieces; ++i) {
    for (int j = 0; j < pieces; ++j) {
      const int a = i * row + j;
      mesh.triangles.push_back({a, a + row, a + row + 1});
      mesh.triangles.push_back({a, a + row + 1, a + 1});
    }
  }
  return mesh;
}

/// Moves the goal to `to_W` along a straight line in `steps` updates.
inline void drag(GodObject& proxy, const Vec3& to_W, int steps) {
  const Vec3 from_W = proxy.state().goal_W;
  for (int i = 1; i <= steps; ++i) proxy.update(from_W + (to_W - from_W) * i / steps);
}

}  // namespace tandem::haptics
