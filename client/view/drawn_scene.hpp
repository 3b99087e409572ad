// The drawn meshes of a joined scene, one for each body and tool. They are made from the scene's message and its
// assets.
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
  std::string name;  ///< name of the body, with printable characters only
  DrawnMesh mesh;    ///< triangles in the body's frame
  Pose X_WB_start;
  bool is_static = false;
  double radius_m = 0;                                ///< radius of a bounding ball around the body's origin
  std::shared_ptr<const docking::Molecule> molecule;  ///< atoms in the body's frame; null: none, or not received yet
  /// For a soft body: its triangles at rest. For each vertex, the points of proto::soft_lattice() that move the vertex,
  /// with their weights.
  geometry::TriangleMesh soft{};
  std::vector<proto::NearPlaces> soft_goes_with{};
  Rgba soft_color{};
};

struct DrawnScene {
  /// Maximum number of entries of the legend. Needed because a large molecule, such as a ribosome, has more chains.
  static constexpr std::size_t kMaxLegend = 24;

  std::vector<DrawnBody> bodies;       ///< bodies in the order of scene.bodies
  std::vector<DrawnBody> soft_bodies;  ///< soft bodies at rest, in the order of scene.soft_bodies
  std::vector<DrawnBody> tools;        ///< tools in the order of scene.tools
  std::vector<LegendEntry> legend;     ///< meanings of the molecules' colours, each once, at most kMaxLegend
  std::size_t legend_omitted = 0;      ///< number of entries omitted because of kMaxLegend
  std::vector<std::string> missing;    ///< names of the objects that cannot be drawn (yet), with the reason
  /// Ball around the objects of interest: tools, moving bodies, and static bodies that are not much larger.
  Vec3 focus_W = Vec3::Zero();
  double focus_radius_m = 0.1;
  double floor_z_m = 0;  ///< lowest z of the static bodies; if there are none, of the focus ball
};

/// Returns the colour of a tool by its index. The colours are those of Okabe and Ito, which colour-blind users can
/// distinguish. Their yellow and cyan are not used here, because the arrows have these colours.
Rgba tool_color(std::size_t tool);

/// In      assets  may be incomplete: shapes whose asset is missing are omitted and listed in `missing`
///         stop    once a stop is requested, meshes are omitted and molecules remain incomplete
/// Cost    up to some seconds with molecular surfaces (molecular_surface.hpp)
/// Thread  any
DrawnScene make_drawn_scene(const wire::Joined& joined, const AssetMap& assets, MoleculeStyle molecules = {},
                            const std::stop_token& stop = {});

/// Returns the mesh of a deformed soft body in the body's frame. Empty if the body is not soft, or if its surface has
/// not been received.
/// In      offsets_W  offset of each point of proto::soft_lattice()
DrawnMesh drawn_soft(const DrawnBody& body, std::span<const Vec3> offsets_W);

/// Returns the first body that a ray hits: the index of the body, and the hit point in the body's frame. Returns
/// nothing if the ray hits no body.
/// In      X_WB  poses of the bodies, in their order in the scene
std::optional<std::pair<std::size_t, Vec3>> first_hit(const DrawnScene& scene, std::span<const Pose> X_WB,
                                                      const Vec3& from_W, const Vec3& along_W);

}  // namespace tandem::client
