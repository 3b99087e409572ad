// What of a joined scene is drawn: a mesh for each body and tool, from the scene's message and its assets.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "client/session/asset_store.hpp"
#include "client/view/drawn_molecule.hpp"
#include "common/docking/molecule.hpp"
#include "proto/soft_shape.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

struct DrawnBody {
  std::string name;  ///< fit for a screen
  DrawnMesh mesh;    ///< in the body's frame
  Pose X_WB_start;
  bool is_static = false;
  double radius_m = 0;                                ///< of a ball about its origin that holds it
  std::shared_ptr<const docking::Molecule> molecule;  ///< in the body's frame; null: it is none, or not here
  /// Of a soft body: its triangles at rest, and which points of proto::soft_lattice() each vertex goes with.
  geometry::TriangleMesh soft{};
  std::vector<proto::NearPlaces> soft_goes_with{};
  Rgba soft_color{};
};

struct DrawnScene {
  std::vector<DrawnBody> bodies;       ///< as scene.bodies
  std::vector<DrawnBody> soft_bodies;  ///< as scene.soft_bodies, at rest
  std::vector<DrawnBody> tools;        ///< as scene.tools
  std::vector<std::string> missing;    ///< what cannot be drawn (yet), and why
  /// A ball around what users are here for: tools, what moves, and what is not much larger.
  Vec3 focus_W = Vec3::Zero();
  double focus_radius_m = 0.1;
  double floor_z_m = 0;  ///< the lowest that there is
};

/// Colours of tools, by their index: those of Okabe and Ito that can be told apart by everybody. Yellow and cyan are of the
/// arrows.
Rgba tool_color(std::size_t tool);

/// In      assets  may lack some: those shapes are left out, and named in `missing`
///         stop    once requested, meshes are left out and molecules left as far as they are
/// Cost    with surfaces of molecules up to some seconds (molecular_surface.hpp)
/// Thread  any
DrawnScene make_drawn_scene(const wire::Joined& joined, const AssetMap& assets, MoleculeStyle molecules = {},
                            const std::stop_token& stop = {});

/// A soft body as it is now, in its own frame; empty for a body that is none, or is not here.
/// In      offsets_W  of proto::soft_lattice(), as many
DrawnMesh drawn_soft(const DrawnBody& body, std::span<const Vec3> offsets_W);

/// The body that a ray meets first, by index, and where, in its frame.
/// In      X_WB  one a body
std::optional<std::pair<std::size_t, Vec3>> first_hit(const DrawnScene& scene, std::span<const Pose> X_WB,
                                                      const Vec3& from_W, const Vec3& along_W);

}  // namespace tandem::client
