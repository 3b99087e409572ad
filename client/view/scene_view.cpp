#include "client/view/scene_view.hpp"

#include "client/view/goal_panel.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stop_token>
#include <utility>

#include "client/session/scene_from_wire.hpp"
#include "common/geometry/tessellation.hpp"

namespace tandem::client {
namespace {

constexpr Rgba kGhost{0.85F, 0.92F, 1.0F, 0.32F};
constexpr Rgba kHandle{1, 1, 1, 0.30F};
constexpr Rgba kStretch{1, 1, 1, 1};
constexpr Rgba kUntinted{1, 1, 1, 1};
constexpr Rgba kHydrogenBond{1, 1, 1, 1};
constexpr Rgba kGoal{0.4F, 0.95F, 0.6F, 0.6F};

/// Sizes of arrows and marks, as multiples of the focus ball's radius.
constexpr double kPerNewton = 0.16;
constexpr double kPerNewtonMetre = 3.2;
constexpr double kRod = 0.011;
constexpr double kHandleRadius = 0.045;
constexpr double kContact = 0.009;
/// Smallest force and torque for which an arrow is drawn.
constexpr double kMinForce_n = 0.05;
constexpr double kMinTorque_n_m = 0.003;

/// Limits for the marks of selected residues:
/// * If up to kMaxDetailed residues are selected, each of their atoms is marked and each residue is named. Otherwise
///   one atom of each residue is marked.
/// * kMaxMarked: maximum number of marked residues. kMaxMarkedAtoms: maximum number of marked atoms of one residue.
constexpr std::size_t kMaxDetailed = 12, kMaxMarked = 300, kMaxMarkedAtoms = 60;

DrawnMesh drawn(const geometry::TriangleMesh& mesh) {
  DrawnMesh result;
  append_mesh(result, mesh, Pose{}, kUntinted);
  return result;
}

DrawnMesh cone() {
  DrawnMesh result;
  append_cone(result);
  return result;
}

/// Returns a pose with the origin `from`, whose z axis points along `direction`. `direction` must not be zero.
Pose along(const Vec3& from, const Vec3& direction) {
  return {from, Quat::FromTwoVectors(Vec3::UnitZ(), direction)};
}

std::string number(double value, const char* unit, int digits) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.*f %s", digits, value, unit);
  return text.data();
}

/// Returns the distance between grid lines for a scene of the size `size_m`: about a third of it, rounded to 1, 2 or 5
/// times a power of ten.
double grid_for(double size_m) {
  const double power = std::pow(10, std::floor(std::log10(size_m / 3)));
  const double times = size_m / 3 / power;
  return power * (times < 2 ? 1 : times < 5 ? 2 : 5);
}

/// Returns a bright variant of a colour, for text on a dark background.
Rgba bright(const Rgba& color) {
  return {0.45F + 0.55F * color[0], 0.45F + 0.55F * color[1], 0.45F + 0.55F * color[2], 1};
}

const proto::BodyState* find_body(const auto& states, std::size_t index) {
  const auto found = std::ranges::find(states, body_id_at(index), &proto::BodyState::id);
  return found == states.end() ? nullptr : &*found;
}

std::string name_of_user(const ClientIoSnapshot& io, UserId id) {
  const auto found = std::ranges::find(io.users, id.value, &wire::UserJoined::user);
  return found == io.users.end() ? "user " + std::to_string(id.value) : printable(found->name());
}

}  // namespace

SceneView::SceneView(Renderer& renderer)
    : renderer_(renderer),
      ball_(renderer.add_mesh(drawn(geometry::tessellated_sphere(1)))),
      rod_(renderer.add_mesh(drawn(geometry::tessellated_cylinder(1, 1)))),
      cone_(renderer.add_mesh(cone())),
      first_of_scene_(cone_ + 1) {}

bool SceneView::update(const ClientIoSnapshot& io, MoleculeStyle molecules) {
  if (io.joined == nullptr) return false;
  if (io.joined != joined_) forget_scene(io);
  assets_ = io.assets;
  const bool is_another = is_making(molecules) && show_made(molecules);
  apply_soft_offsets(io);
  return is_another;
}

/// Returns the content to show next. In a scene without molecules, the style of the shown content is kept, because it
/// has no effect.
SceneView::Content SceneView::wanted(MoleculeStyle molecules) const {
  const auto has_molecule = [](const DrawnBody& body) { return body.molecule != nullptr; };
  const bool has_style = !shown_ || std::ranges::any_of(scene_.bodies, has_molecule);
  return {assets_, has_style ? molecules : shown_->second};
}

bool SceneView::is_making(MoleculeStyle molecules) const {
  const Content content = wanted(molecules);
  return joined_ != nullptr && shown_ != content && failed_ != content;
}

void SceneView::forget_scene(const ClientIoSnapshot& io) {
  maker_ = {};
  made_ = {};
  surface_.reset();
  failed_.reset();
  shown_.reset();
  scene_ = {};
  soft_offsets_.clear();
  renderer_.remove_meshes_from(first_of_scene_);
  joined_ = io.joined;
}

void SceneView::show(DrawnScene scene, const Content& content) {
  const bool is_of_same_assets = shown_ && shown_->first == content.first;
  if (is_of_same_assets && shown_->second.shape == MoleculeStyle::kSurface)
    surface_.emplace(*shown_, std::move(scene_));
  scene_ = std::move(scene);
  shown_ = content;
  soft_offsets_.clear();
  renderer_.remove_meshes_from(first_of_scene_);
  for (const auto* things : {&scene_.bodies, &scene_.soft_bodies, &scene_.tools}) {
    for (const DrawnBody& body : *things) renderer_.add_mesh(body.mesh);
  }
}

/// Shows the next content if its meshes are complete, and returns true. Otherwise starts a thread that makes them,
/// unless one is running already.
bool SceneView::show_made(MoleculeStyle molecules) {
  Content content = wanted(molecules);
  if (surface_ && surface_->first == content) {
    show((*std::exchange(surface_, std::nullopt)).second, content);
    return true;
  }
  // Balls can be made quickly, so molecules are shown as balls until the requested style is complete.
  if (!shown_) content.second.shape = MoleculeStyle::kBalls;
  if (!made_.valid()) begin_making(content);
  // If assets arrive while meshes are being made, the work is not restarted. The next run includes these assets.
  if (making_.second != content.second) {
    is_given_up_ = true;
    maker_.request_stop();
  }
  if (made_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
  try {
    DrawnScene scene = made_.get();
    if (is_given_up_) return false;
    show(std::move(scene), making_);
    return true;
  } catch (const std::exception& error) {
    failed_ = making_;
    if (!shown_) shown_ = making_;
    scene_.missing.push_back(std::string("molecules as ") + MoleculeStyle::kShapeNames.at(making_.second.shape) + ": " +
                             error.what());
    return false;
  }
}

void SceneView::begin_making(const Content& content) {
  std::packaged_task<DrawnScene(const std::stop_token&)> make([joined = joined_, content](const auto& stop) {
    return make_drawn_scene(*joined, content.first != nullptr ? *content.first : AssetMap{}, content.second, stop);
  });
  making_ = content;
  is_given_up_ = false;
  made_ = make.get_future();
  maker_ = std::jthread(std::move(make));
}

void SceneView::apply_soft_offsets(const ClientIoSnapshot& io) {
  soft_offsets_.resize(io.soft_offsets.size());
  const std::size_t bodies = std::min(io.soft_offsets.size(), scene_.soft_bodies.size());
  for (std::size_t i = 0; i < bodies; ++i) {
    if (io.soft_offsets[i] == nullptr || io.soft_offsets[i] == soft_offsets_[i]) continue;
    soft_offsets_[i] = io.soft_offsets[i];
    renderer_.replace_mesh(first_of_scene_ + scene_.bodies.size() + i,
                           drawn_soft(scene_.soft_bodies[i], *soft_offsets_[i]));
  }
}

void SceneView::arrange(const View* view, const ClientIoSnapshot& io, const WindowSwitches& switches,
                        const Camera& camera, const Figures& figures, LocalTime now) {
  const bool shows_ghosts = switches.shows_ghosts;
  frame_.things.clear();
  labels_.clear();
  if (joined_ == nullptr) return;
  frame_.focus_W = scene_.focus_W;
  frame_.focus_radius_m = scene_.focus_radius_m;
  frame_.floor_z_m = scene_.floor_z_m - 0.002 * scene_.focus_radius_m;
  frame_.grid_m = grid_for(scene_.focus_radius_m);
  frame_.cut_W.reset();
  if (switches.cuts) {
    const double depth_m = (2 * switches.cut_share - 1) * scene_.focus_radius_m;
    frame_.cut_W.emplace(camera.forward_W(), camera.focus_W() + depth_m * camera.forward_W());
  }
  add_bodies(view, io, shows_ghosts);
  add_goals(view, io);
  if (has_tool(joined_->role())) add_own_tool(view, shows_ghosts);
  if (view != nullptr && view->has_state) add_partners(*view, io, shows_ghosts);
  if (view != nullptr && switches.shows_contacts) add_contacts(*view);
  if (switches.shows_contacts && figures.has_molecules) add_hydrogen_bonds(view, figures);
  add_pointed(view, io, now);
}

void SceneView::add(std::size_t mesh, const Pose& X, const Rgba& tint, float glow) {
  frame_.things.push_back({.mesh = mesh, .X_W = X, .tint = tint, .glow = glow});
}

void SceneView::add_mark(std::size_t mesh, const Pose& X, const Vec3& scale, const Rgba& tint) {
  frame_.things.push_back({.mesh = mesh, .X_W = X, .scale = scale, .tint = tint, .glow = 0.55F, .is_mark = true});
}

void SceneView::add_rod(const Vec3& from, const Vec3& to, double radius_m, const Rgba& tint) {
  const Vec3 between = to - from;
  if (between.norm() < radius_m) return;
  add_mark(rod_, along((from + to) / 2, between), {radius_m, radius_m, between.norm()}, tint);
}

void SceneView::add_arrow(const Vec3& from, const Vec3& along_W, const Rgba& tint, const std::string& text,
                          double label_above) {
  const double thick_m = kRod * scene_.focus_radius_m;
  const double head_m = std::min(5 * thick_m, 0.6 * along_W.norm());
  const Vec3 neck = from + along_W * (1 - head_m / along_W.norm());
  add_rod(from, neck, thick_m, tint);
  add_mark(cone_, along(neck, along_W), {2.4 * thick_m, 2.4 * thick_m, head_m}, tint);
  labels_.push_back({from + along_W + 2 * thick_m * along_W.normalized(), text, tint, label_above});
}

/// Draws the regions and figures of the open goals as lines, and bodies at their target poses as ghosts.
void SceneView::add_goals(const View* view, const ClientIoSnapshot& io) {
  if (io.game == nullptr || io.joined != joined_) return;
  const auto pose_of = [&](std::size_t body) {
    return body < scene_.bodies.size() ? felt_pose(scene_, view, body) : Pose{};
  };
  const GoalOutline outline = outline_of(joined_->scene(), io.game->state, pose_of);
  const double lift_m = 0.002 * scene_.focus_radius_m;
  for (const auto& [from_W, to_W] : outline.lines) {
    add_rod(from_W + lift_m * Vec3::UnitZ(), to_W + lift_m * Vec3::UnitZ(), 0.3 * kRod * scene_.focus_radius_m, kGoal);
  }
  for (const auto& [body, X_W] : outline.ghosts) {
    if (body < scene_.bodies.size()) add(first_of_scene_ + body, X_W, kGoal, 0.3F);
  }
}

void SceneView::add_bodies(const View* view, const ClientIoSnapshot& io, bool shows_ghosts) {
  for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
    if (io.game != nullptr && std::ranges::count(io.game->state.absent_bodies(), body_id_at(i).value) > 0) continue;
    const DrawnBody& body = scene_.bodies[i];
    const proto::BodyState* const felt = view == nullptr ? nullptr : find_body(view->bodies, i);
    add(first_of_scene_ + i, felt != nullptr ? felt->state.X : body.X_WB_start);
    const proto::BodyState* const received = view == nullptr ? nullptr : find_body(view->received_bodies, i);
    if (shows_ghosts && received != nullptr && !body.is_static)
      add(first_of_scene_ + i, received->state.X, kGhost, 0.3F);
  }
  for (std::size_t i = 0; i < scene_.soft_bodies.size(); ++i) {
    const std::size_t mesh = first_of_scene_ + scene_.bodies.size() + i;
    add(mesh, scene_.soft_bodies[i].X_WB_start);
  }
}

void SceneView::add_own_tool(const View* view, bool shows_ghosts) {
  const std::size_t tool = joined_->tool();
  if (tool >= scene_.tools.size()) return;
  const std::size_t mesh = first_of_scene_ + scene_.bodies.size() + scene_.soft_bodies.size() + tool;
  const bool has_state = view != nullptr && view->has_state;
  X_WT_ = scene_.tools[tool].X_WB_start;
  if (has_state) X_WT_ = view->record.is_local ? view->record.local_tool_W.X : view->record.tool_W.X;
  add(mesh, X_WT_, kUntinted, 0.15F);
  if (!has_state) return;
  if (shows_ghosts) add(mesh, view->record.tool_W.X, kGhost, 0.3F);
  add_handle(*view);
  add_wrench(*view);
}

// Draws the pose of the device's handle as a glass ball with axes, and a line from the ball to the tool.
void SceneView::add_handle(const View& view) {
  if (!view.record.sample.is_valid) return;
  constexpr std::array<Rgba, 3> kAxes{{{0.84F, 0.37F, 0, 1}, {0, 0.62F, 0.45F, 1}, {0.2F, 0.5F, 0.9F, 1}}};
  const Pose& X_WH = view.record.handle_W.X;
  const double radius_m = kHandleRadius * scene_.focus_radius_m;
  for (int axis = 0; axis < 3; ++axis) {
    add_rod(X_WH.p, X_WH * (1.6 * radius_m * Vec3::Unit(axis)), 0.3 * kRod * scene_.focus_radius_m,
            kAxes[static_cast<std::size_t>(axis)]);
  }
  add_rod(X_WH.p, X_WT_.p, 0.35 * kRod * scene_.focus_radius_m, kStretch);
  add_mark(ball_, X_WH, Vec3::Constant(radius_m), kHandle);
}

void SceneView::add_contacts(const View& view) {
  for (const Vec3& at_W : view.contacts_W) {
    add_mark(ball_, {at_W, Quat::Identity()}, Vec3::Constant(kContact * scene_.focus_radius_m), kContactColor);
  }
}

/// Draws dashed lines from donor to acceptor.
void SceneView::add_hydrogen_bonds(const View* view, const Figures& figures) {
  constexpr int kDashes = 5;
  const double scale = joined_->scene().molecular_field().metres_per_angstrom();
  const auto [a, b] = figures.molecules;
  if (std::max(a, b) >= scene_.bodies.size()) return;
  const docking::Molecule* const first = scene_.bodies[a].molecule.get();
  const docking::Molecule* const second = scene_.bodies[b].molecule.get();
  if (first == nullptr || second == nullptr) return;
  const Pose X_WA = felt_pose(scene_, view, a), X_WB = felt_pose(scene_, view, b);
  for (const auto& [i, j] : figures.hydrogen_bonds) {
    if (i >= first->size() || j >= second->size()) continue;
    const Vec3 from = X_WA * Vec3(scale * first->positions_angstrom[i]);
    const Vec3 step = (X_WB * Vec3(scale * second->positions_angstrom[j]) - from) / (2 * kDashes + 1);
    for (int dash = 0; dash < kDashes; ++dash) {
      add_rod(from + (2 * dash + 1) * step, from + (2 * dash + 2) * step, 0.12 * scale, kHydrogenBond);
    }
  }
}

void SceneView::add_selection(const View* view, const ResidueSelection& selection,
                              const std::optional<AtomDistance>& distance) {
  if (joined_ == nullptr || selection.is_empty()) return;
  const bool is_detailed = selection.residues().size() <= kMaxDetailed;
  std::size_t count = 0;
  for (const AtomPlace& place : selection.residues()) {
    const docking::Molecule* const molecule = molecule_at(scene_, place);
    if (molecule == nullptr || ++count > kMaxMarked) continue;
    add_residue(felt_pose(scene_, view, place.body), *molecule, place.atom, is_detailed);
  }
  if (!distance) return;
  const double scale = joined_->scene().molecular_field().metres_per_angstrom();
  add_rod(distance->from_W, distance->to_W, 0.15 * scale, kSelectionColor);
  labels_.push_back({(distance->from_W + distance->to_W) / 2, number(distance->angstrom, "Å", 2), kSelectionColor, 0});
}

/// Marks the atoms of a residue and names the residue. If it is one of many selected residues, marks only one atom: its
/// α carbon, or its first atom.
void SceneView::add_residue(const Pose& X_WB, const docking::Molecule& molecule, std::size_t start, bool is_detailed) {
  const double scale = joined_->scene().molecular_field().metres_per_angstrom();
  const std::size_t end = residue_end(molecule, start);
  std::size_t middle = start;
  for (std::size_t atom = start; atom < end; ++atom) {
    if (atom < molecule.atom_names.size() && molecule.atom_names[atom] == "CA") middle = atom;
  }
  const auto at_W = [&](std::size_t atom) { return X_WB * Vec3(scale * molecule.positions_angstrom[atom]); };
  const auto mark = [&](std::size_t atom) {
    add_mark(ball_, {at_W(atom), Quat::Identity()}, Vec3::Constant(0.35 * scale), kSelectionColor);
  };
  if (!is_detailed) return mark(middle);
  for (std::size_t atom = start; atom < std::min(end, start + kMaxMarkedAtoms); ++atom) mark(atom);
  labels_.push_back({at_W(middle), residue_text(molecule, middle), kSelectionColor, 1});
}

/// Draws a pulsing cone at the place to which a user points, in the colour of that user's tool.
void SceneView::add_pointed(const View* view, const ClientIoSnapshot& io, LocalTime now) {
  constexpr double kBeats_per_s = 2;
  const double size_m = scene_.focus_radius_m;
  for (const auto& [since, message] : io.pointed) {
    if (now - since > ClientSession::kPointed) continue;
    const wire::Point& point = message.point();
    const std::size_t body = point.body() - std::size_t{1};
    Vec3 at_W(point.place(0), point.place(1), point.place(2));
    if (point.body() != 0) {
      if (body >= scene_.bodies.size()) continue;  // the body is not in this scene
      at_W = felt_pose(scene_, view, body) * at_W;
    }
    const auto user = std::ranges::find(io.users, message.user(), &wire::UserJoined::user);
    const bool is_own = io.joined != nullptr && message.user() == io.joined->user();
    const Rgba color = bright(tool_color(user != io.users.end() ? user->tool() : io.joined->tool()));
    const double beat = 0.5 * std::abs(std::sin(std::numbers::pi * kBeats_per_s * to_seconds(now - since)));
    const Vec3 tail_W = at_W + Vec3(0, 0, (0.16 + 0.1 * beat) * size_m);
    add_mark(cone_, along(tail_W, at_W - tail_W), {0.03 * size_m, 0.03 * size_m, (tail_W - at_W).norm()}, color);
    add_mark(ball_, {at_W, Quat::Identity()}, Vec3::Constant((0.015 + 0.01 * beat) * size_m), color);
    labels_.push_back({tail_W, (is_own ? "you" : name_of_user(io, UserId{message.user()})) + ": here", color, 1});
  }
}

// Draws the displayed force and torque as arrows. Their lengths are in proportion to the values at the device.
void SceneView::add_wrench(const View& view) {
  const Wrench& on_hand_D = view.record.displayed_on_hand_D;
  const double force_n = on_hand_D.f.norm(), torque_n_m = on_hand_D.t.norm();
  const double size_m = scene_.focus_radius_m;
  if (force_n > kMinForce_n) {
    add_arrow(X_WT_.p, view.workspace.X_WD.q * on_hand_D.f * kPerNewton * size_m, kForceColor, number(force_n, "N", 2),
              0);
  }
  if (torque_n_m > kMinTorque_n_m) {
    add_arrow(X_WT_.p, view.workspace.X_WD.q * on_hand_D.t * kPerNewtonMetre * size_m, kTorqueColor,
              number(torque_n_m, "N·m", 3), 1.5);
  }
}

void SceneView::add_partners(const View& view, const ClientIoSnapshot& io, bool shows_ghosts) {
  const std::size_t first_tool = first_of_scene_ + scene_.bodies.size() + scene_.soft_bodies.size();
  for (const proto::OtherUserState& user : view.users) {
    if (user.tool_index >= scene_.tools.size()) continue;
    const DrawnBody& tool = scene_.tools[user.tool_index];
    add(first_tool + user.tool_index, user.tool.X, kUntinted, 0.15F);
    const auto received = std::ranges::find(view.newest.update.users, user.id, &proto::OtherUserState::id);
    if (shows_ghosts && received != view.newest.update.users.end()) {
      add(first_tool + user.tool_index, received->tool.X, kGhost, 0.3F);
    }
    const Vec3 under = user.tool.X.p - Vec3(0, 0, tool.radius_m + 0.02 * scene_.focus_radius_m);
    labels_.push_back({under, name_of_user(io, user.id), bright(tool_color(user.tool_index)), -0.8});
  }
}

}  // namespace tandem::client
