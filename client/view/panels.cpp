#include "client/view/panels.hpp"

#include "client/view/goal_panel.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>

#include "client/view/scene_view.hpp"
#include "common/docking/molecule.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/safety.hpp"

namespace tandem::client {
namespace {

constexpr float kPanelEm = 21;  ///< width in font heights
constexpr double kMaxSliderDelay_ms = 300;
constexpr double kMaxSliderJitter_ms = 50;
constexpr double kMaxSliderLoss = 30;  ///< %

const ImVec4 kDim(0.72F, 0.76F, 0.80F, 1);
const ImVec4 kWarning(0.98F, 0.72F, 0.20F, 1);

ImVec4 color_of(const Rgba& color) {
  return {color[0], color[1], color[2], color[3]};
}

void fact(const char* name, const std::string& value) {
  ImGui::TextColored(kDim, "%s", name);
  ImGui::SameLine(ImGui::GetFontSize() * 6.4F);
  ImGui::TextUnformatted(value.c_str());
}

/// Plots a curve. The axis ranges from 0 to a round number above all values.
void curve(const char* name, const Curve& values, const char* format, double least_top, const ImVec4& color) {
  double top = least_top;
  while (top < values.largest()) top *= 2;
  const ImVec2 size(ImGui::GetContentRegionAvail().x - ImGui::GetFontSize() * 2.4F, ImGui::GetFontSize() * 2.1F);
  const std::string id = std::string("##") + name;
  const std::string overlay = std::string(name) + "  " + text_of(format, values.newest());
  ImGui::PushStyleColor(ImGuiCol_PlotLines, color);
  ImGui::PlotLines(id.c_str(), values.data(), Curve::kLength, values.offset(), overlay.c_str(), 0,
                   static_cast<float>(top), size);
  ImGui::PopStyleColor();
  ImGui::SameLine();
  ImGui::TextColored(kDim, "%g", top);
}

bool slider(const char* name, double& value, double largest, const char* format) {
  auto single = static_cast<float>(value);
  ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 4.2F);
  const bool is_moved = ImGui::SliderFloat(name, &single, 0, static_cast<float>(largest), format);
  value = std::clamp(static_cast<double>(single), 0.0, largest);
  return is_moved;
}

/// Draws a choice among names. Returns the new choice, or an empty string if it is unchanged.
std::string chosen(const char* label, const std::string& now, const std::vector<std::string>& names) {
  std::string choice;
  ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 5.2F);
  if (!ImGui::BeginCombo(label, now.c_str())) return choice;
  for (const std::string& name : names) {
    if (ImGui::Selectable(name.c_str(), name == now) && name != now) choice = name;
  }
  ImGui::EndCombo();
  return choice;
}

std::vector<std::string> strings(const std::vector<std::string_view>& views) {
  return {views.begin(), views.end()};
}

/// Begins a part of the panels, and updates whether the part is open.
bool begin_part(const char* title, bool& is_open) {
  ImGui::SetNextItemOpen(is_open, ImGuiCond_Once);
  is_open = ImGui::CollapsingHeader(title);
  return is_open;
}

void draw_link(ClientIo& client, net::LinkParameters& link) {
  double delay_ms = to_seconds(link.delay) * 1e3, jitter_ms = to_seconds(link.jitter) * 1e3, loss = link.loss * 100;
  ImGui::TextColored(kDim, "simulated link, each way");
  bool is_moved = slider("delay", delay_ms, kMaxSliderDelay_ms, "%.0f ms");
  is_moved = slider("jitter", jitter_ms, kMaxSliderJitter_ms, "%.1f ms") || is_moved;
  is_moved = slider("loss", loss, kMaxSliderLoss, "%.1f %%") || is_moved;
  if (!is_moved) return;
  link.delay = from_seconds(delay_ms * 1e-3);
  link.jitter = from_seconds(jitter_ms * 1e-3);
  link.loss = loss / 100;
  client.send(command::SetLinks{link});
}

/// Draws the server's other rooms, and the operator's button.
void draw_room(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  const std::string scene = printable(io.joined->scene().name());
  if (io.rooms.size() > 1) {
    const std::string room = chosen("room", io.room, io.rooms);
    if (!room.empty()) content.client->send(command::ChangeRoom{room});
  } else {
    fact("room", io.room);
  }
  if (scene != io.room) fact("scene", scene);
  if (io.joined->role() == wire::ROLE_OPERATOR && ImGui::Button("reset the room")) {
    content.client->send(command::ResetRoom{});
  }
}

void draw_recording(const PanelContent& content) {
  if (ImGui::Button(content.is_recording ? "end recording" : "begin recording")) *content.is_record_pressed = true;
  if (!content.is_recording && ImGui::IsItemHovered()) {
    ImGui::SetTooltip("device, tool, forces and link, into a new file in %s", content.recording_folder->c_str());
  }
  if (content.recording_state->empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, kDim);
  ImGui::TextWrapped("%s", content.recording_state->c_str());
  ImGui::PopStyleColor();
}

void draw_session(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  fact("state", std::string(name_of(io.status.state)));
  if (io.joined != nullptr) draw_room(content);
  for (const auto& [name, value] : *content.facts) fact(name.c_str(), value);
  std::string others;
  for (const wire::UserJoined& user : io.users) others += (others.empty() ? "" : ", ") + printable(user.name());
  fact("with", others.empty() ? "no other user" : others);
  draw_recording(content);
  for (const std::string& line : *content.missing) ImGui::TextWrapped("not drawn: %s", line.c_str());
  if (!content.news.empty()) ImGui::TextWrapped("%s", content.news.c_str());
}

/// Draws a slider for a coefficient of the coupling, for the operator of the room. Its value has three significant
/// digits.
/// felt.
void draw_coefficient(ClientIo& client, const char* label, const char* name, double now, double largest) {
  double value = now;
  if (slider(label, value, largest, "%.3g") && value > 0) client.send(command::SetParameter{name, value});
}

/// Draws a choice that is disabled, with the reason.
void closed_choice(const char* label, const std::string& now, const std::string& why) {
  ImGui::BeginDisabled();
  chosen(label, now, {});
  ImGui::EndDisabled();
  ImGui::PushStyleColor(ImGuiCol_Text, kDim);
  ImGui::TextWrapped("%s", why.c_str());
  ImGui::PopStyleColor();
}

/// Draws the coupling law of the room, which its operator can change.
void draw_law(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  const wire::Coupling& of_scene = io.joined->scene().coupling();
  std::vector<std::string> laws;
  std::string why_none;
  for (const haptics::CouplingLawInfo& law : haptics::coupling_laws()) {
    const std::string problem =
        haptics::law_change_problem(*haptics::find_coupling_law(of_scene.law()), law, of_scene.has_adaptive());
    if (problem.empty()) {
      laws.emplace_back(law.name);
    } else {
      why_none = problem;
    }
  }
  const std::string now(io.law);
  if (io.joined->role() != wire::ROLE_OPERATOR) {
    closed_choice("law", now, "set by the room's operator (--role operator)");
  } else if (laws.size() < 2) {
    closed_choice("law", now, why_none);
  } else if (const std::string law = chosen("law", now, laws); !law.empty()) {
    content.client->send(command::SetLaw{law});
  }
}

/// Draws the stage, which is the method by which the scene is rendered to the hand.
void draw_stage(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  StageSettings wanted = io.rendering.stage;
  const std::string stage = chosen("stage", wanted.name, strings(stage_names()));
  const std::string predictor = chosen("predictor", wanted.predictor, strings(predictor_names()));
  if (!stage.empty()) wanted.name = stage;
  if (!predictor.empty()) wanted.predictor = predictor;
  const bool is_switched = ImGui::Checkbox("passivity controller", &wanted.passivity);
  if (!stage.empty() || !predictor.empty() || is_switched) content.client->send(command::SetStage{wanted});
  if (!io.rendering.stage_note.empty()) ImGui::TextWrapped("%s", io.rendering.stage_note.c_str());
  if (io.joined == nullptr) return;
  draw_law(content);
  if (io.joined->role() != wire::ROLE_OPERATOR) {
    fact("coupling",
         text_of("%.0f N/m, ", io.coupling.stiffness_n_per_m) + text_of("%.1f N·s/m", io.coupling.damping_n_s_per_m));
    return;
  }
  draw_coefficient(*content.client, "N/m", "coupling.stiffness_n_per_m", io.coupling.stiffness_n_per_m, 2000);
  draw_coefficient(*content.client, "N·s/m", "coupling.damping_n_s_per_m", io.coupling.damping_n_s_per_m, 20);
}

void draw_drops(const char* way, const proto::DropCounters& drops) {
  for (std::size_t i = 1; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
    const auto reason = static_cast<proto::DropReason>(i);
    if (drops.count(reason) == 0) continue;
    std::string words(proto::name_of(reason));
    std::ranges::replace(words, '_', ' ');
    ImGui::TextColored(kDim, "dropped %s, %s: %llu", way, words.c_str(),
                       static_cast<unsigned long long>(drops.count(reason)));
  }
}

void draw_network(const PanelContent& content, net::LinkParameters& link) {
  const Figures& figures = *content.figures;
  curve("round trip [ms]", figures.round_trip_ms, "%.1f", 10, {0.80F, 0.47F, 0.65F, 1});
  curve("state age [ms]", figures.state_age_ms, "%.1f", 5, {0.34F, 0.71F, 0.91F, 1});
  fact("jitter", text_of("%.2f ms", figures.jitter_ms));
  fact("loss", text_of("%.1f %% up, ", figures.loss_up * 100) + text_of("%.1f %% down", figures.loss_down * 100));
  draw_link(*content.client, link);
  draw_drops("here", content.io->counters.received_drops);
  draw_drops("on the way out", content.io->counters.sent_drops);
}

void draw_touch(const PanelContent& content) {
  const Figures& figures = *content.figures;
  curve("force [N]", figures.force_n, "%.2f", 1, color_of(kForceColor));
  curve("torque [N·m]", figures.torque_n_m, "%.3f", 0.02, color_of(kTorqueColor));
  curve("prediction's residual [N]", figures.residual_n, "%.2f", 0.5, {0.90F, 0.62F, 0.0F, 1});
  curve("longest tick [ms]", figures.longest_tick_ms, "%.2f", 2, {0.80F, 0.80F, 0.80F, 1});
  if (content.view == nullptr) return;
  const TickRecord& record = content.view->record;
  // Only a scene with molecules has an energy.
  if (const double energy = content.view->newest.update.field_energy_kj_per_mol;
      content.view->has_state && energy != 0 && !figures.has_molecules) {
    fact("energy",
         text_of("%.1f kJ/mol, ", energy) + text_of("%.1f kcal/mol", energy / docking::kKilojoulesPerKilocalorie));
  }
  fact("safety", haptics::describe_safety_faults(record.safety_faults));
  fact("passivity", text_of("%.0f %% of the force", record.passivity_gain * 100));
  if (record.is_local && content.view->loop_delay > Duration{0}) {
    fact("loop", text_of("%.1f ms there and back", to_seconds(content.view->loop_delay) * 1e3));
  }
}

/// Draws a choice among the enumerators with these names.
template <std::size_t kCount, class Number>
void choose(const char* label, const std::array<const char*, kCount>& all, Number& number) {
  const std::vector<std::string> names(all.begin(), all.end());
  const std::string choice = chosen(label, names.at(number), names);
  if (!choice.empty()) number = static_cast<Number>(std::ranges::find(names, choice) - names.begin());
}

/// Draws the settings of the user's hand. The workspace mapping is set when a slider is released, because each change
/// fades the force out and in again.
void draw_workspace(const PanelContent& content, WorkspaceSettings& workspace) {
  auto scale = static_cast<float>(workspace.scale);
  auto turn_deg = static_cast<float>(workspace.turn_rad * 180 / std::numbers::pi);
  ImGui::TextColored(kDim, "tool motion per hand motion");
  ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 4.2F);
  ImGui::SliderFloat("reach", &scale, 0.1F, 10, "%.2f", ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
  bool is_set = ImGui::IsItemDeactivatedAfterEdit();
  workspace.scale = scale;
  // A hand moved by the mouse moves in directions of the picture, so the user does not need to rotate its workspace.
  if (!content.is_mouse) {
    ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 4.2F);
    ImGui::SliderFloat("turn", &turn_deg, -180, 180, "%.0f°", ImGuiSliderFlags_AlwaysClamp);
    is_set = ImGui::IsItemDeactivatedAfterEdit() || is_set;
    workspace.turn_rad = turn_deg * std::numbers::pi / 180;
    if (ImGui::Button("align with the view")) {
      workspace.turn_rad = content.camera_turn_rad;
      is_set = true;
    }
  }
  if (is_set) content.client->send(command::SetWorkspace{workspace});
  bool has_nudges = content.io->has_nudges;
  if (ImGui::Checkbox("nudge me where others point", &has_nudges)) {
    content.client->send(command::SetNudges{has_nudges});
  }
}

void draw_molecule_style(const PanelContent& content, MoleculeStyle& style) {
  choose("atoms (M)", MoleculeStyle::kShapeNames, style.shape);
  choose("coloured by (N)", MoleculeStyle::kColorNames, style.colors);
  if (content.is_making_molecules) ImGui::TextColored(kDim, "being made");
}

void draw_view(const PanelContent& content, WindowSwitches& switches) {
  ImGui::Checkbox("server's poses as ghosts (G)", &switches.shows_ghosts);
  ImGui::Checkbox("contact points (P)", &switches.shows_contacts);
  ImGui::Checkbox("follow the tool (T)", &switches.follows_tool);
  draw_molecule_style(content, switches.molecules);
  ImGui::Checkbox("cut away the front (X)", &switches.cuts);
  if (switches.cuts) slider("depth", switches.cut_share, 1, "%.2f");
  ImGui::TextColored(kDim, "F1: help");
}

void draw_help(const PanelContent& content, bool& is_open) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(size.x * 0.5F, size.y * 0.5F), ImGuiCond_Always, ImVec2(0.5F, 0.5F));
  if (ImGui::Begin("Help", &is_open,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse)) {
    const auto line = [](const char* what, const char* does) {
      ImGui::TextUnformatted(what);
      ImGui::SameLine(ImGui::GetFontSize() * 15);
      ImGui::TextColored(kDim, "%s", does);
    };
    if (content.is_mouse) {
      line("drag, left button", "move the hand: to the sides, up and down");
      line("  + Shift, or the wheel", "on the level: away from you and towards you");
      line("  + Ctrl", "turn the hand; the wheel rolls it");
      line("arrows, page up and down", "move the hand, without a mouse");
      line("double click, or Space", "grab the body within reach, or release it");
      line("C held", "clutch: the hand moves, the tool stays");
      line("R", "hand back to where it began");
      ImGui::Separator();
    }
    line("drag, right button", "view from another side");
    line("drag, middle button", "move the picture");
    line(content.is_mouse ? "wheel" : "wheel, left button", "nearer and farther");
    line("F", "fit the scene; T: follow the tool");
    line("3D mouse", "the cap holds the scene, where it is not your device");
    line("G", "ghosts: where the server has things; P: contact points");
    line("X", "cut away the front; M: molecules as balls, sticks, surface or ribbon; N: their colours");
    if (content.figures->has_molecules) line("K", "keep this pose of the molecules; Z: back, Y: forward again");
    if (content.io->game != nullptr) line("1, 2", "gravity of the game on, off");
    line("V", "point at the place under the mouse: other users see it and feel its direction");
    line("Tab", "panels; F1: this help; Ctrl+Q: quit");
    ImGui::Separator();
    line("yellow arrow", "force on your hand, of the device");
    line("cyan arrow", "torque on your hand");
    line("glass ball, white line", "your device; the spring that joins it to the tool");
  }
  ImGui::End();
}

void draw_notice(const std::string& text) {
  if (text.empty()) return;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos(ImVec2(size.x * 0.5F, ImGui::GetFontSize()), ImGuiCond_Always, ImVec2(0.5F, 0));
  ImGui::SetNextWindowSizeConstraints(ImVec2(0, 0), ImVec2(size.x * 0.5F, size.y));
  ImGui::Begin("##notice", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs);
  ImGui::PushTextWrapPos(size.x * 0.5F - 2 * ImGui::GetFontSize());
  ImGui::TextColored(kWarning, "%s", text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::End();
}

}  // namespace

std::string text_of(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string session_problem(const ClientIoSnapshot& io) {
  const std::string& why = io.status.why;
  switch (io.status.state) {
    case SessionState::kActive:
      return "";
    case SessionState::kWaiting:
      return "Connection lost, trying again: " + why;
    case SessionState::kEnded:
      return "The session has ended: " + why;
    default:
      return why.empty() ? "Connecting ..." : "Connecting again: " + why;
  }
}

double panels_width() {
  return (kPanelEm + 1.2) * ImGui::GetFontSize();
}

void draw_panels(const PanelContent& content, WindowSwitches& switches, net::LinkParameters& link,
                 WorkspaceSettings& workspace) {
  draw_notice(content.notice);
  draw_goals(content);
  if (switches.shows_help) draw_help(content, switches.shows_help);
  if (!switches.shows_panels) return;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  ImGui::SetNextWindowPos(ImVec2(size.x - 0.6F * em, 0.6F * em), ImGuiCond_Always, ImVec2(1, 0));
  ImGui::SetNextWindowSizeConstraints(ImVec2(kPanelEm * em, 0), ImVec2(kPanelEm * em, size.y - 1.2F * em));
  ImGui::Begin("##panels", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize);
  if (begin_part("Session", switches.is_open[0])) draw_session(content);
  if (content.figures->has_molecules && begin_part("Molecules", switches.is_open[5])) draw_poses(content, switches);
  if (begin_part("Network", switches.is_open[1])) draw_network(content, link);
  if (begin_part("Touch", switches.is_open[2])) draw_touch(content);
  if (begin_part("Stage", switches.is_open[3])) draw_stage(content);
  if (begin_part("View", switches.is_open[4])) draw_view(content, switches);
  if (begin_part("Hand", switches.is_open[6])) draw_workspace(content, workspace);
  ImGui::End();
}

}  // namespace tandem::client
