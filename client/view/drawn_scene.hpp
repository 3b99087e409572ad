// The drawn meshes of a joined scene: one for each body and tool, from the scene's message and its assets.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "client/exchange/asset_map.hpp"
#include "client/view/drawn_molecule.hpp"
#include "common/docking/molecule.hpp"
#include "proto/soft_shape.hpp"
#include "tandem/control.pb.h"

namespace tandem::client {

struct DrawnBody {
  std::string name;  ///< printable
  DrawnMesh mesh;    ///< in the body's frame
  Pose X_WB_start;
  bool is_static = false;
  double radius_m = 0;                                ///< radius of a bounding ball about the body's origin
  std::shared_ptr<const docking::Molecule> molecule;  ///< in the body's frame; null: no molecule, or not received yet
  /// Soft body only: triangles at rest, and for each vertex the weights of the points of proto::soft_lattice() that
  /// move it.
  geometry::TriangleMesh soft{};
  std::vector<proto::NearPlaces> soft_goes_with{};
  Rgba soft_color{};
};

struct DrawnScene {
  std::vector<DrawnBody> bodies;       ///< in the order of scene.bodies
  std::vector<DrawnBody> soft_bodies;  ///< in the order of scene.soft_bodies, at rest
  std::vector<DrawnBody> tools;        ///< in the order of scene.tools
  std::vector<std::string> missing;    ///< objects that cannot be drawn (yet), with the reason
  /// Ball around the objects of interest: tools, moving bodies, and static bodies that are not much larger.
  Vec3 focus_W = Vec3::Zero();
  double focus_radius_m = 0.1;
  double floor_z_m = 0;  ///< lowest z of the static bodies; without any, of the focus ball
};

/// Colour of a tool by its index: those of Okabe and Ito, distinguishable with any colour vision. Their yellow and cyan
/// are reserved for the arrows.
Rgba tool_color(std::size_t tool);

/// In      assets  may be incomplete: shapes without their asset are omitted and named in `missing`
///         stop    once requested, meshes are omitted and molecules are left incomplete
/// Cost    with molecular surfaces up to some seconds (molecular_surface.hpp)
/// Thread  any
DrawnScene make_drawn_scene(const wire::Joined& joined, const AssetMap& assets, MoleculeStyle molecules = {},
                            const std::stop_token& stop = {});

/// Mesh of a deformed soft body in its own frame; empty if there is no soft body, or its surface has not arrived.
/// In      offsets_W  one for each point of proto::soft_lattice()
DrawnMesh drawn_soft(const DrawnBody& body, std::span<const Vec3> offsets_W);

/// Finds the first body that a ray hits: its index, and the hit point in its frame.
/// In      X_WB  one for each body
std::optional<std::pair<std::size_t, Vec3>> first_hit(const DrawnScene& scene, std::span<const Pose> X_WB,
                                                      const Vec3& from_W, const Vec3& along_W);

}  // namespace tandem::client
