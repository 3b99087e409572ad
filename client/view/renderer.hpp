// Draws a scene with OpenGL 3.3: a sun with soft shadows, ambient light of the sky, and a floor with a grid.
// Transparent objects are drawn last.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/view/camera.hpp"
#include "client/view/drawn_mesh.hpp"

namespace tandem::client {

/// One mesh at one pose; `mesh` is the index that add_mesh() returned.
struct DrawnThing {
  std::size_t mesh = 0;
  Pose X_W;
  Vec3 scale = Vec3::Ones();
  Rgba tint{1, 1, 1, 1};  ///< factor of the mesh's colour; an opacity below 1: transparent, without a shadow
  float glow = 0;         ///< share of emitted light
  bool is_mark = false;   ///< a mark instead of an object: drawn in front of all objects, without a shadow
};

struct DrawnFrame {
  std::vector<DrawnThing> things;
  Vec3 focus_W = Vec3::Zero();  ///< shadows are cast within a ball about this point
  double focus_radius_m = 0.2;
  double floor_z_m = 0;
  double grid_m = 0.05;                               ///< distance between two lines of the floor
  std::optional<Eigen::Hyperplane<double, 3>> cut_W;  ///< objects are drawn on its positive side only; none: whole
};

/// Thread  the one whose OpenGL context is current
class Renderer {
 public:
  /// Fails   std::runtime_error: the driver refuses a shader; contains the driver's message
  Renderer();
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  std::size_t add_mesh(const DrawnMesh& mesh);
  void replace_mesh(std::size_t mesh, const DrawnMesh& by);
  /// Removes `mesh` and all meshes added after it.
  void remove_meshes_from(std::size_t mesh);
  /// Draws into the whole frame buffer of the window.
  void draw(const DrawnFrame& frame, const Camera& camera, int width, int height);
  /// Pixels of the last frame, rows from top to bottom, three bytes per pixel.
  static std::vector<std::uint8_t> pixels(int width, int height);
  /// The driver's name of the renderer, e.g. "llvmpipe (…)".
  static std::string driver();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
