// Draws a scene with OpenGL 3.3. A sun with soft shadows and ambient light of the sky illuminate the scene. The floor
// has a grid. Transparent objects are drawn last.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/view/camera.hpp"
#include "client/view/drawn_mesh.hpp"

namespace tandem::client {

/// An object to draw: a mesh at a pose. `mesh` is the index that add_mesh() returned.
struct DrawnThing {
  std::size_t mesh = 0;
  Pose X_W;
  Vec3 scale = Vec3::Ones();
  Rgba tint{1, 1, 1, 1};  ///< factor on the mesh's colour; an object with an opacity below 1 casts no shadow
  float glow = 0;         ///< 0: lit by the scene's lights, 1: shown in its own colour without lighting
  bool is_mark = false;   ///< true: drawn in front of all objects and without a shadow
};

/// Quality of the rendering.
/// * kFull: multisampled edges and soft shadows.
/// * kFast: for rendering without a graphics card. One sample per pixel, a smaller shadow map that is sampled once, and
///   a display gamma of 2 instead of 2.2, which needs no logarithm.
enum class RenderQuality : std::uint8_t { kFull, kFast };

struct DrawnFrame {
  std::vector<DrawnThing> things;
  Vec3 focus_W = Vec3::Zero();  ///< centre of the ball in which shadows are cast
  double focus_radius_m = 0.2;  ///< radius of this ball
  double floor_z_m = 0;
  double grid_m = 0.05;                               ///< distance between two lines of the floor's grid
  std::optional<Eigen::Hyperplane<double, 3>> cut_W;  ///< cutting plane: only its positive side is drawn; empty: no cut
};

/// Draws frames in the current OpenGL context.
///
/// Thread  the thread whose OpenGL context is current
class Renderer {
 public:
  /// Fails   std::runtime_error if the driver refuses a shader; the text contains the driver's message
  explicit Renderer(RenderQuality quality);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  std::size_t add_mesh(const DrawnMesh& mesh);
  void replace_mesh(std::size_t mesh, const DrawnMesh& by);
  /// Removes `mesh` and all meshes added after it.
  void remove_meshes_from(std::size_t mesh);
  /// Draws into the whole frame buffer of the window.
  void draw(const DrawnFrame& frame, const Camera& camera, int width, int height);
  /// Returns the pixels of the last frame, three bytes per pixel, in rows from top to bottom.
  static std::vector<std::uint8_t> pixels(int width, int height);
  /// Returns the driver's name for the renderer, e.g. "llvmpipe (…)".
  static std::string driver();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
