// Draws a scene with OpenGL 3.3: a sun with soft shadows and the light of the sky; a floor with a grid; what shines
// through last.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/view/camera.hpp"
#include "client/view/drawn_mesh.hpp"

namespace tandem::client {

/// One mesh at one place. A mesh is known by its index as add_mesh() gave it.
struct DrawnThing {
  std::size_t mesh = 0;
  Pose X_W;
  Vec3 scale = Vec3::Ones();
  Rgba tint{1, 1, 1, 1};  ///< times the mesh's own colour; less than 1 opaque: shines through, without a shadow
  float glow = 0;         ///< share of the light that is its own
  bool is_mark = false;   ///< no thing of the scene: in front of all that is one, and without a shadow
};

struct DrawnFrame {
  std::vector<DrawnThing> things;
  Vec3 focus_W = Vec3::Zero();  ///< shadows are cast within a ball about this
  double focus_radius_m = 0.2;
  double floor_z_m = 0;
  double grid_m = 0.05;                               ///< between two lines of the floor
  std::optional<Eigen::Hyperplane<double, 3>> cut_W;  ///< things are drawn on its positive side only; none: whole
};

/// Thread  the one whose OpenGL context is current
class Renderer {
 public:
  /// Fails   std::runtime_error: a shader that the driver refuses, with its words
  Renderer();
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  std::size_t add_mesh(const DrawnMesh& mesh);
  void replace_mesh(std::size_t mesh, const DrawnMesh& by);
  /// Of those added since `mesh`, itself too.
  void remove_meshes_from(std::size_t mesh);
  /// Into the window's frame buffer, all of it.
  void draw(const DrawnFrame& frame, const Camera& camera, int width, int height);
  /// As drawn, from top to bottom, three bytes a pixel.
  static std::vector<std::uint8_t> pixels(int width, int height);
  /// The driver's name for what draws, e.g. "llvmpipe (…)".
  static std::string driver();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
