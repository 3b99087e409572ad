// From what is known (the joined scene, the newest view) to what is drawn: which mesh where, which words where.
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
#include "client/view/panels.hpp"
#include "client/view/renderer.hpp"

namespace tandem::client {

/// Words at a place of the scene.
struct SceneLabel {
  Vec3 at_W = Vec3::Zero();
  std::string text;
  Rgba color{1, 1, 1, 1};
  double above = 0;  ///< that, in heights of its letters
};

inline constexpr Rgba kForceColor{1.0F, 0.89F, 0.15F, 1};
inline constexpr Rgba kContactColor{0.80F, 0.0F, 0.60F, 1};
inline constexpr Rgba kTorqueColor{0.25F, 0.90F, 0.98F, 1};

/// Thread  the window's
class SceneView {
 public:
  explicit SceneView(Renderer& renderer);

  /// Has the scene's meshes made aside when scene, assets or style are others than before, and shows them when they are here;
  /// of molecules balls first. Those of soft bodies that have yielded follow at once. A surface that was shown last is kept.
  /// True: there is another scene, or more of it.
  bool take(const ClientIoSnapshot& io, MoleculeStyle molecules);
  /// In      view  null: none yet, and things are where the scene starts
  void arrange(const View* view, const ClientIoSnapshot& io, const WindowSwitches& switches, const Camera& camera,
               const Figures& figures, LocalTime now);

  const DrawnScene& scene() const { return scene_; }
  /// Whether the scene, or more of it, or molecules of this style are still to come.
  bool is_making(MoleculeStyle molecules) const;
  const DrawnFrame& frame() const { return frame_; }
  const std::vector<SceneLabel>& labels() const { return labels_; }
  /// The user's own tool, where it is felt.
  const Pose& tool_pose() const { return X_WT_; }

 private:
  /// What a scene is made of beside its message.
  using Content = std::pair<std::shared_ptr<const AssetMap>, MoleculeStyle>;

  void forget_scene(const ClientIoSnapshot& io);
  Content wanted(MoleculeStyle molecules) const;
  void show(DrawnScene scene, const Content& content);
  bool take_made(MoleculeStyle molecules);
  void begin_making(const Content& content);
  void add(std::size_t mesh, const Pose& X, const Rgba& tint = {1, 1, 1, 1}, float glow = 0);
  void add_mark(std::size_t mesh, const Pose& X, const Vec3& scale, const Rgba& tint);
  void add_rod(const Vec3& from, const Vec3& to, double radius_m, const Rgba& tint);
  void add_arrow(const Vec3& from, const Vec3& along, const Rgba& tint, const std::string& text, double label_above);
  void add_bodies(const View* view, bool shows_ghosts);
  void add_own_tool(const View* view, bool shows_ghosts);
  void add_handle(const View& view);
  void add_wrench(const View& view);
  void add_contacts(const View& view);
  void add_hydrogen_bonds(const View* view, const Figures& figures);
  void add_pointed(const View* view, const ClientIoSnapshot& io, LocalTime now);
  void take_soft_offsets(const ClientIoSnapshot& io);
  void add_partners(const View& view, const ClientIoSnapshot& io, bool shows_ghosts);

  Renderer& renderer_;
  std::size_t ball_;
  std::size_t rod_;
  std::size_t cone_;
  std::size_t first_of_scene_ = 0;  ///< meshes: bodies, soft bodies, tools
  std::shared_ptr<const wire::Joined> joined_;
  std::shared_ptr<const AssetMap> assets_;
  std::optional<Content> shown_;                           ///< null: nothing of this scene yet
  std::optional<std::pair<Content, DrawnScene>> surface_;  ///< while that is not shown, once it was
  std::optional<Content> failed_;                          ///< could not be made
  std::vector<std::shared_ptr<const std::vector<Vec3>>> soft_offsets_;
  DrawnScene scene_;
  DrawnFrame frame_;
  std::vector<SceneLabel> labels_;
  Pose X_WT_;
  Content making_;            ///< what is being made while made_ is valid
  bool is_given_up_ = false;  ///< since then another was wanted
  std::future<DrawnScene> made_;
  std::jthread maker_;
};

}  // namespace tandem::client
