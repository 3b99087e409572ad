// Converts the joined scene and the newest view to objects to draw: meshes at poses, and labels.
#pragma once

#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/view/drawn_scene.hpp"
#include "client/view/molecule/residue_selection.hpp"
#include "client/view/panels.hpp"
#include "client/view/renderer.hpp"

namespace tandem::client {

/// A text at a point of the scene.
struct SceneLabel {
  Vec3 at_W = Vec3::Zero();
  std::string text;
  Rgba color{1, 1, 1, 1};
  double above = 0;  ///< distance above the point, in text heights
};

inline constexpr Rgba kForceColor{1.0F, 0.89F, 0.15F, 1};
inline constexpr Rgba kContactColor{0.80F, 0.0F, 0.60F, 1};
inline constexpr Rgba kSelectionColor{0.70F, 1.0F, 0.45F, 1};
inline constexpr Rgba kTorqueColor{0.25F, 0.90F, 0.98F, 1};

/// Makes the meshes of the joined scene and arranges them for each frame.
///
/// Thread  the one that runs the window
class SceneView {
 public:
  explicit SceneView(Renderer& renderer);

  /// Shows the meshes of the joined scene in the requested style. If scene, assets or style have changed, a thread
  /// makes the meshes, which are shown when they are complete. Molecules are shown as balls meanwhile. Deformed soft
  /// bodies are updated at once. The last shown molecular surface is kept in memory. Returns true if a different scene
  /// is shown, or more parts of the same scene.
  bool update(const ClientIoSnapshot& io, MoleculeStyle molecules);
  /// In      view  null: none received yet; objects are at their start poses
  void arrange(const View* view, const ClientIoSnapshot& io, const WindowSwitches& switches, const Camera& camera,
               const Figures& figures, LocalTime now);

  /// Adds marks and names of the selected residues, and a line for the distance of two picked atoms. Must be called
  /// after arrange().
  void add_selection(const View* view, const ResidueSelection& selection, const std::optional<AtomDistance>& distance);

  const DrawnScene& scene() const { return scene_; }
  /// Returns true if meshes are still being made: the scene, parts of it, or molecules in this style are not shown yet.
  bool is_making(MoleculeStyle molecules) const;
  const DrawnFrame& frame() const { return frame_; }
  const std::vector<SceneLabel>& labels() const { return labels_; }
  /// Returns the displayed pose of the user's tool.
  const Pose& tool_pose() const { return X_WT_; }

 private:
  /// Data from which a scene's meshes are made, in addition to its message.
  using Content = std::pair<std::shared_ptr<const AssetMap>, MoleculeStyle>;

  void forget_scene(const ClientIoSnapshot& io);
  Content wanted(MoleculeStyle molecules) const;
  void show(DrawnScene scene, const Content& content);
  bool show_made(MoleculeStyle molecules);
  void begin_making(const Content& content);
  void add(std::size_t mesh, const Pose& X, const Rgba& tint = {1, 1, 1, 1}, float glow = 0);
  void add_mark(std::size_t mesh, const Pose& X, const Vec3& scale, const Rgba& tint);
  void add_rod(const Vec3& from, const Vec3& to, double radius_m, const Rgba& tint);
  void add_arrow(const Vec3& from, const Vec3& along, const Rgba& tint, const std::string& text, double label_above);
  void add_bodies(const View* view, const ClientIoSnapshot& io, bool shows_ghosts);
  void add_goals(const View* view, const ClientIoSnapshot& io);
  void add_own_tool(const View* view, bool shows_ghosts);
  void add_handle(const View& view);
  void add_wrench(const View& view);
  void add_contacts(const View& view);
  void add_hydrogen_bonds(const View* view, const Figures& figures);
  void add_residue(const Pose& X_WB, const docking::Molecule& molecule, std::size_t start, bool is_detailed);
  void add_pointed(const View* view, const ClientIoSnapshot& io, LocalTime now);
  void apply_soft_offsets(const ClientIoSnapshot& io);
  void add_partners(const View& view, const ClientIoSnapshot& io, bool shows_ghosts);

  Renderer& renderer_;
  std::size_t ball_;
  std::size_t rod_;
  std::size_t cone_;
  std::size_t first_of_scene_ = 0;  ///< index of the scene's first mesh, in the order bodies, soft bodies, tools
  std::shared_ptr<const wire::Joined> joined_;
  std::shared_ptr<const AssetMap> assets_;
  std::optional<Content> shown_;  ///< content that is shown now; empty: nothing of this scene is shown yet
  std::optional<std::pair<Content, DrawnScene>> surface_;  ///< last shown surface, kept while another style is shown
  std::optional<Content> failed_;                          ///< content whose meshes could not be made
  std::vector<std::shared_ptr<const std::vector<Vec3>>> soft_offsets_;
  DrawnScene scene_;
  DrawnFrame frame_;
  std::vector<SceneLabel> labels_;
  Pose X_WT_;
  Content making_;            ///< content of the meshes in `made_`; valid while `made_` is valid
  bool is_given_up_ = false;  ///< true: the result of `made_` will be discarded, because other content was requested
  std::future<DrawnScene> made_;
  std::jthread maker_;
};

}  // namespace tandem::client
