#include "client/view/goal_panel.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <optional>

#include "common/net/text.hpp"
#include "proto/placement.hpp"
#include "proto/scene_ranges.hpp"

namespace tandem::client {
namespace {

/// Height of a window, in heights of a line, below which the panel has only what a player needs, so that it does not
/// cover the scene: no texts of events, which the messages also show, and the choice of levels closed.
constexpr float kSmallEm = 40;
const ImVec4 kOpen(0.92F, 0.93F, 0.95F, 1), kReached(0.35F, 0.85F, 0.45F, 1), kFailed(0.95F, 0.45F, 0.35F, 1),
    kWaits(0.55F, 0.58F, 0.62F, 1);

ImVec4 color_of_status(wire::GoalState::Status status) {
  switch (status) {
    case wire::GoalState::REACHED:
      return kReached;
    case wire::GoalState::FAILED:
      return kFailed;
    case wire::GoalState::WAITING:
      return kWaits;
    default:
      return kOpen;
  }
}

const char* phase_text(wire::GameState::Phase phase) {
  switch (phase) {
    case wire::GameState::WAITING:
      return "waits for players";
    case wire::GameState::WON:
      return "won";
    case wire::GameState::LOST:
      return "lost";
    default:
      return "";
  }
}

bool may_choose(const wire::Joined& joined) {
  const bool is_operator = joined.role() == wire::ROLE_OPERATOR;
  return is_operator || (joined.role() == wire::ROLE_MANIPULATOR && joined.scene().game().users_choose());
}

void set(ClientIo* client, const char* name, double value) {
  if (client != nullptr) client->send(SessionCommand(command::SetParameter{name, value}));
}

/// Draws a button for each level and one for gravity, if this user may use them.
void draw_choices(const PanelContent& content, const wire::Game& game) {
  for (int i = 0; i < game.levels_size(); ++i) {
    if (i % 4 != 0) ImGui::SameLine();
    const std::string label = net::printable(game.levels(i).name()) + "##level" + std::to_string(i);
    if (ImGui::SmallButton(label.c_str())) set(content.client, "game.level", i + 1);
  }
  if (ImGui::SmallButton("gravity on (1)")) set_game_gravity(content.client, true);
  ImGui::SameLine();
  if (ImGui::SmallButton("off (2)")) set_game_gravity(content.client, false);
}

/// Draws polygons to scale, one colour each, in a picture of the given width.
void draw_outlines(const std::vector<SolutionOutline>& outlines, float width) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = Eigen::Vector2d::Constant(-1e9);
  for (const SolutionOutline& outline : outlines) {
    for (const Eigen::Vector2d& point : outline) {
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
  }
  if ((high - low).minCoeff() <= 0) return;
  const double scale = width / (high - low).x();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  for (const SolutionOutline& outline : outlines) {
    std::vector<ImVec2> points;
    for (const Eigen::Vector2d& point : outline) {
      points.emplace_back(corner.x + static_cast<float>(scale * (point - low).x()),
                          corner.y + static_cast<float>(scale * (high - point).y()));
    }
    ImGui::GetWindowDrawList()->AddPolyline(points.data(), static_cast<int>(points.size()),
                                            ImGui::GetColorU32(kReached), ImDrawFlags_Closed, 2);
  }
  ImGui::Dummy(ImVec2(width, static_cast<float>(scale * (high - low).y())));
}

/// Draws a button for each solution of the level, and the solution whose button was pressed last.
void draw_solutions(const wire::Level& level, std::uint32_t number) {
  const std::string id = "solution of level " + std::to_string(number);
  int& shown = *ImGui::GetStateStorage()->GetIntRef(ImGui::GetID(id.c_str()), 0);
  for (int i = 0; i < level.solutions_size(); ++i) {
    if (i % 3 != 0) ImGui::SameLine();
    const bool is_shown = shown == i + 1;
    const std::string label = (is_shown ? "hide " : "show ") + net::printable(level.solutions(i).name());
    if (ImGui::SmallButton((label + "##solution" + std::to_string(i)).c_str())) shown = is_shown ? 0 : i + 1;
  }
  if (shown > level.solutions_size()) shown = 0;
  if (shown > 0) draw_outlines(solution_outlines(level, level.solutions(shown - 1)), 10 * ImGui::GetFontSize());
}

constexpr int kCircleSides = 24;

class Outliner {
 public:
  Outliner(const wire::Scene& scene, const std::function<Pose(std::size_t)>& pose_of)
      : scene_(scene), pose_of_(pose_of) {}

  void add(const wire::Condition& condition) {
    if (condition.has_in_region()) add(condition.in_region().region());
    if (condition.has_at_pose()) add(condition.at_pose());
    if (condition.has_silhouette()) add(condition.silhouette());
  }
  GoalOutline take() { return std::move(out_); }

 private:
  std::optional<std::size_t> index(const std::string& name) const {
    const auto found = std::ranges::find(scene_.bodies(), name, &wire::Body::name);
    if (found == scene_.bodies().end()) return std::nullopt;
    return static_cast<std::size_t>(found - scene_.bodies().begin());
  }
  Pose frame(const std::string& name) const {
    const auto body = index(name);
    return body ? pose_of_(*body) : Pose{};
  }
  void circle(const Pose& X, double radius_m, const Vec3& a, const Vec3& b, const Vec3& centre) {
    const auto point = [&](int i) {
      const double angle = 2 * std::numbers::pi * i / kCircleSides;
      return X * Vec3(centre + radius_m * (std::cos(angle) * a + std::sin(angle) * b));
    };
    for (int i = 0; i < kCircleSides; ++i) out_.lines.emplace_back(point(i), point(i + 1));
  }
  void add(const wire::Region& region) {
    const Pose X_WR = frame(region.body()) * proto::pose_from_placement(region.placement());
    const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
    if (region.has_sphere()) {
      for (const auto& [a, b] : {std::pair(x, y), std::pair(y, z), std::pair(z, x)}) {
        circle(X_WR, region.sphere().radius_m(), a, b, Vec3::Zero());
      }
    } else if (region.has_cylinder()) {
      const double radius_m = region.cylinder().radius_m(), half_m = region.cylinder().length_m() / 2;
      for (const double end : {-half_m, half_m}) circle(X_WR, radius_m, x, y, end * z);
      for (const Vec3& side : {x, Vec3(-x), y, Vec3(-y)}) {
        out_.lines.emplace_back(X_WR * Vec3(radius_m * side - half_m * z), X_WR * Vec3(radius_m * side + half_m * z));
      }
    } else if (region.box().size_m_size() == 3) {
      const Vec3 half(region.box().size_m(0) / 2, region.box().size_m(1) / 2, region.box().size_m(2) / 2);
      add_box(X_WR, half);
    }
  }
  void add_box(const Pose& X, const Vec3& half) {
    for (int axis = 0; axis < 3; ++axis) {
      for (unsigned corner = 0; corner < 4; ++corner) {
        Vec3 from = half;
        from[(axis + 1) % 3] *= (corner & 1U) != 0 ? 1 : -1;
        from[(axis + 2) % 3] *= (corner & 2U) != 0 ? 1 : -1;
        Vec3 to = from;
        to[axis] = -half[axis];
        out_.lines.emplace_back(X * from, X * to);
      }
    }
  }
  void add(const wire::AtPose& target) {
    const auto body = index(target.body());
    if (body) out_.ghosts.emplace_back(*body, frame(target.beside()) * proto::pose_from_placement(target.placement()));
  }
  void add(const wire::Silhouette& silhouette) {
    const auto& numbers = silhouette.figure_m();
    const int corners = numbers.size() / 2;
    for (int i = 0; i < corners; ++i) {
      const int next = (i + 1) % corners;
      out_.lines.emplace_back(Vec3(numbers[2 * i], numbers[2 * i + 1], 0),
                              Vec3(numbers[2 * next], numbers[2 * next + 1], 0));
    }
  }

  const wire::Scene& scene_;
  const std::function<Pose(std::size_t)>& pose_of_;
  GoalOutline out_;
};

}  // namespace

GoalOutline outline_of(const wire::Scene& scene, const wire::GameState& state,
                       const std::function<Pose(std::size_t body)>& pose_of) {
  Outliner outliner(scene, pose_of);
  if (state.phase() != wire::GameState::PLAYING && state.phase() != wire::GameState::WAITING) return {};
  const wire::Level& level = scene.game().levels(static_cast<int>(state.level()));
  for (int i = 0; i < std::min(state.goals_size(), level.goals_size()); ++i) {
    if (state.goals(i).status() != wire::GoalState::OPEN) continue;
    for (const wire::Condition& condition : level.goals(i).conditions()) {
      if (!condition.negated()) outliner.add(condition);
    }
  }
  return outliner.take();
}

std::string time_text(double seconds) {
  const auto whole = static_cast<long>(std::ceil(std::clamp(seconds, 0.0, 1e6) - 1e-6));
  char text[32];
  std::snprintf(text, sizeof text, "%ld:%02ld", whole / 60, whole % 60);
  return text;
}

std::string level_time_text(const wire::Game& game, const wire::GameState& state) {
  const double limit_s = game.levels(static_cast<int>(state.level())).time_limit_s();
  if (limit_s > 0) return time_text(limit_s - state.level_elapsed_s()) + " left";
  return time_text(state.level_elapsed_s());
}

std::vector<GoalRow> goal_rows(const wire::Game& game, const wire::GameState& state) {
  const wire::Level& level = game.levels(static_cast<int>(state.level()));
  std::vector<GoalRow> rows;
  for (int i = 0; i < std::min(level.goals_size(), state.goals_size()); ++i) {
    const wire::Goal& goal = level.goals(i);
    const wire::GoalState& now = state.goals(i);
    std::string text = net::printable(goal.text());
    if (now.status() == wire::GoalState::OPEN && goal.conditions_size() > 1) {
      text += "  " + std::to_string(now.satisfied()) + "/" + std::to_string(goal.at_least());
    }
    if (now.status() == wire::GoalState::OPEN && goal.time_limit_s() > 0) {
      text += "  " + time_text(goal.time_limit_s() - now.elapsed_s()) + " left";
    }
    rows.push_back({text, now.status()});
  }
  return rows;
}

std::vector<std::string> signal_rows(const wire::Game& game, const wire::GameState& state) {
  std::vector<std::string> rows;
  for (int i = 0; i < std::min(game.signals_size(), state.signals_size()); ++i) {
    const wire::GameSignal& signal = game.signals(i);
    const wire::SignalReport& now = state.signals(i);
    const std::string name = net::printable(signal.text());
    if (!now.fresh()) {
      const bool is_in_table = std::ranges::any_of(
          game.levels(), [&signal](const wire::Level& level) { return level.next().signal() == signal.name(); });
      rows.push_back("no signal " + name + (is_in_table ? ": by score alone" : ""));
      continue;
    }
    const bool has_state = now.state() >= 1 && now.state() <= static_cast<std::uint32_t>(signal.states_size());
    const std::string of_state =
        has_state ? net::printable(signal.states(static_cast<int>(now.state()) - 1).name()) + " " : std::string();
    rows.push_back(name + ": " + of_state + text_of("%.2f", now.value()));
  }
  return rows;
}

std::vector<SolutionOutline> solution_outlines(const wire::Level& level, const wire::Solution& solution) {
  std::vector<SolutionOutline> outlines;
  for (const wire::SolvedBody& solved : solution.bodies()) {
    if (solved.position_m_size() != 2) continue;
    const Eigen::Rotation2Dd turn(solved.angle_deg() * std::numbers::pi / 180);
    const Eigen::Vector2d origin(solved.position_m(0), solved.position_m(1));
    for (const wire::Goal& goal : level.goals()) {
      for (const wire::Condition& condition : goal.conditions()) {
        for (const wire::Outline& piece : condition.silhouette().pieces()) {
          if (piece.body() != solved.body()) continue;
          SolutionOutline& outline = outlines.emplace_back();
          for (int i = 0; i + 1 < piece.points_m_size(); i += 2) {
            outline.emplace_back(origin + turn * Eigen::Vector2d(piece.points_m(i), piece.points_m(i + 1)));
          }
        }
      }
    }
  }
  return outlines;
}

void draw_goals(const PanelContent& content, float top) {
  if (content.io->game == nullptr || content.io->joined == nullptr) return;
  const wire::Game& game = content.io->joined->scene().game();
  const wire::GameState& state = content.io->game->state;
  if (state.level() >= static_cast<std::uint32_t>(game.levels_size())) return;
  const float em = ImGui::GetFontSize();
  const bool is_small = ImGui::GetIO().DisplaySize.y < kSmallEm * em;
  ImGui::SetNextWindowPos(ImVec2(0.6F * em, top), ImGuiCond_Always);
  ImGui::SetNextWindowSizeConstraints(ImVec2(14 * em, 0), ImVec2(24 * em, ImGui::GetIO().DisplaySize.y));
  ImGui::Begin("##game", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize |
                   ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::PushTextWrapPos(23 * em);
  ImGui::Text("%s   score %s", net::printable(game.title()).c_str(), proto::number_text(state.score()).c_str());
  const wire::Level& level = game.levels(static_cast<int>(state.level()));
  ImGui::TextColored(kWaits, "level %u of %d: %s   %s  %s", state.level() + 1, game.levels_size(),
                     net::printable(level.text()).c_str(), level_time_text(game, state).c_str(),
                     phase_text(state.phase()));
  for (const GoalRow& row : goal_rows(game, state))
    ImGui::TextColored(color_of_status(row.status), "%s", row.text.c_str());
  for (const std::string& row : signal_rows(game, state)) ImGui::TextColored(kWaits, "%s", row.c_str());
  for (const wire::GameEvent& event : content.io->game->last_events()) {
    if (is_small) break;  // the messages above the hint show the texts too
    const Vec3 color = color_of(event, game);
    ImGui::TextColored(
        ImVec4(static_cast<float>(color.x()), static_cast<float>(color.y()), static_cast<float>(color.z()), 1), "%s",
        text_of(event, game).c_str());
  }
  draw_solutions(level, state.level());
  if (may_choose(*content.io->joined)) {
    ImGui::SetNextItemOpen(!is_small, ImGuiCond_Once);
    if (ImGui::CollapsingHeader("levels and gravity")) draw_choices(content, game);
  }
  ImGui::PopTextWrapPos();
  ImGui::End();
}

void set_game_gravity(ClientIo* client, bool is_on) {
  if (client == nullptr || client->snapshot().game == nullptr) return;
  set(client, "game.gravity", is_on ? 1 : 0);
}

}  // namespace tandem::client
