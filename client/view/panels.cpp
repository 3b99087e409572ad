#include "client/view/panels.hpp"

#include "client/view/goal_panel.hpp"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <numbers>

#include "client/view/scene_view.hpp"
#include "client/view/screen/menu.hpp"
#include "client/view/screen/sentences.hpp"
#include "client/view/screen/style.hpp"
#include "common/docking/molecule.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/safety.hpp"

namespace tandem::client {
namespace {

/// Bounds of the panels' width in font heights. Between the bounds, the width is kPanelShare of the window's width, so
/// that the centre stays free.
constexpr float kMinPanelEm = 15, kMaxPanelEm = 21;
constexpr float kPanelShare = 0.36F;
constexpr double kMaxSliderDelay_ms = 300;
constexpr double kMaxSliderJitter_ms = 50;
constexpr double kMaxSliderLoss = 30;  ///< largest loss that the slider can set [%]

ImVec4 color_of(const Rgba& color) {
  return {color[0], color[1], color[2], color[3]};
}

void fact(const char* name, const std::string& value) {
  ImGui::TextColored(kDim, "%s", name);
  ImGui::SameLine(ImGui::GetFontSize() * 5.2F);
  ImGui::TextWrapped("%s", value.c_str());
}

/// Shows a text that explains the last drawn control, while the mouse is over that control.
void tip(const char* text) {
  if (!ImGui::IsItemHovered()) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(22 * ImGui::GetFontSize());
  ImGui::TextUnformatted(text);
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

/// Draws a sentence in an area of at least two lines. So a change between one and two lines moves no control below the
/// sentence.
void sentence_in_place(const std::string& text) {
  const float top = ImGui::GetCursorPosY();
  draw_explanation(text.c_str());
  ImGui::SetCursorPosY(std::max(ImGui::GetCursorPosY(), top + 2 * ImGui::GetTextLineHeightWithSpacing()));
}

void heading(const char* name) {
  ImGui::TextColored(kTitle, "%s", name);
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

/// Draws a selection list of names. Returns the new selection, or an empty string if it is unchanged.
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

/// Begins a collapsible section of the panels, and updates whether the section is open.
bool begin_part(const char* title, bool& is_open) {
  ImGui::SetNextItemOpen(is_open, ImGuiCond_Once);
  is_open = ImGui::CollapsingHeader(title);
  return is_open;
}

/// Draws the round-trip delay, and a slider that adds delay.
void draw_delay(const PanelContent& content, net::LinkParameters& link) {
  heading("Delay");
  double delay_ms = to_seconds(link.delay) * 1e3;
  const bool is_moved = slider("added", delay_ms, kMaxSliderDelay_ms, "%.0f ms");
  tip("Delay that this program adds in each direction, to try what a distance does to touch. Others are not affected.");
  sentence_in_place(delay_sentence(content.figures->round_trip_ms.newest(), link.delay));
  if (!is_moved) return;
  link.delay = from_seconds(delay_ms * 1e-3);
  content.client->send(command::SetLinks{link});
}

void draw_link(ClientIo& client, net::LinkParameters& link) {
  double jitter_ms = to_seconds(link.jitter) * 1e3, loss = link.loss * 100;
  ImGui::TextColored(kDim, "simulated link, each way");
  bool is_moved = slider("jitter", jitter_ms, kMaxSliderJitter_ms, "%.1f ms");
  tip("Standard deviation of the added delay.");
  is_moved = slider("loss", loss, kMaxSliderLoss, "%.1f %%") || is_moved;
  tip("Share of messages that this program discards, in bad periods of 20 ms.");
  if (!is_moved) return;
  link.jitter = from_seconds(jitter_ms * 1e-3);
  link.loss = loss / 100;
  client.send(command::SetLinks{link});
}

/// Draws the users in the room, the server's other rooms, and the operator's button.
void draw_people(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  heading("People");
  sentence_in_place(people_sentence(io));
  if (io.joined == nullptr) return;
  if (io.rooms.size() > 1) {
    const std::string room = chosen("room", io.room, io.rooms);
    if (!room.empty()) content.client->send(command::ChangeRoom{room});
  }
  if (io.joined->role() == wire::ROLE_OPERATOR) {
    if (ImGui::Button("put everything back")) content.client->send(command::ResetRoom{});
    tip("Moves all bodies of the room back to their start, for everybody.");
  }
}

/// Draws the force on the hand over the last seconds.
void draw_force(const PanelContent& content) {
  heading("Force");
  curve("force [N]", content.figures->force_n, "%.2f", 1, color_of(kForceColor));
  sentence_in_place(force_sentence(content.view));
}

void draw_recording(const PanelContent& content) {
  if (ImGui::Button(content.is_recording ? "end recording" : "begin recording")) *content.is_record_pressed = true;
  if (!content.is_recording && ImGui::IsItemHovered()) {
    ImGui::SetTooltip("device, tool, forces and link, into a new file in %s", content.recording_folder->c_str());
  }
}

void draw_session(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  fact("state", std::string(name_of(io.status.state)));
  if (io.joined != nullptr) {
    fact("room", io.room);
    if (const std::string scene = printable(io.joined->scene().name()); scene != io.room) fact("scene", scene);
  }
  for (const auto& [name, value] : *content.facts) fact(name.c_str(), value);
  draw_recording(content);
  for (const std::string& line : *content.missing) ImGui::TextWrapped("not drawn: %s", line.c_str());
}

/// Draws a slider for a coefficient of the coupling, for the operator of the room. Its value has three significant
/// digits.
void draw_coefficient(ClientIo& client, const char* label, const char* name, double now, double largest) {
  double value = now;
  if (slider(label, value, largest, "%.3g") && value > 0) client.send(command::SetParameter{name, value});
}

/// Draws a disabled selection list, with the reason why it is disabled.
void closed_choice(const char* label, const std::string& now, const std::string& why) {
  ImGui::BeginDisabled();
  chosen(label, now, {});
  ImGui::EndDisabled();
  draw_explanation(why.c_str());
}

/// Draws the coupling law of the room. Only the operator of the room can change it.
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

/// Draws a selection list of the stages, the methods by which the scene is rendered to the hand.
void draw_stage(const PanelContent& content) {
  heading("Stage");
  StageSettings wanted = content.io->rendering.stage;
  const std::string stage = chosen("stage", wanted.name, strings(stage_names()));
  tip("How the delay is bridged. The page STAGES.md compares all of them.");
  sentence_in_place(std::string(stage_sentence(wanted.name)));
  if (stage.empty()) return;
  wanted.name = stage;
  content.client->send(command::SetStage{wanted});
}

/// Draws the settings of the stage and of the coupling.
void draw_coupling(const PanelContent& content) {
  const ClientIoSnapshot& io = *content.io;
  StageSettings wanted = io.rendering.stage;
  const std::string predictor = chosen("predictor", wanted.predictor, strings(predictor_names()));
  if (!predictor.empty()) wanted.predictor = predictor;
  const bool is_switched = ImGui::Checkbox("passivity controller", &wanted.passivity);
  tip("Limits the energy that the hand receives to the energy that was put in.");
  if (!predictor.empty() || is_switched) content.client->send(command::SetStage{wanted});
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
    ImGui::PushStyleColor(ImGuiCol_Text, kDim);
    ImGui::TextWrapped("%s, %s: %llu", way, words.c_str(), static_cast<unsigned long long>(drops.count(reason)));
    ImGui::PopStyleColor();
  }
}

void draw_network(const PanelContent& content, net::LinkParameters& link) {
  const Figures& figures = *content.figures;
  curve("round trip [ms]", figures.round_trip_ms, "%.1f", 10, {0.80F, 0.47F, 0.65F, 1});
  tip("Time from a message of this program to the server's answer, with the added delay.");
  curve("since last state [ms]", figures.state_age_ms, "%.1f", 5, {0.34F, 0.71F, 0.91F, 1});
  tip("Time since the newest state of the server arrived. It is short also on a long way, because states arrive "
      "often.");
  fact("jitter", text_of("%.2f ms", figures.jitter_ms));
  tip("Standard deviation of the transit time of the server's states over the last 2 s.");
  fact("loss", text_of("%.1f %% up, ", figures.loss_up * 100) + text_of("%.1f %% down", figures.loss_down * 100));
  draw_link(*content.client, link);
  draw_drops("received, not used", content.io->counters.received_drops);
  tip("States that a newer one replaced before they were used (overwritten) are normal: only the newest counts.");
  draw_drops("not sent", content.io->counters.sent_drops);
}

void draw_touch(const PanelContent& content) {
  const Figures& figures = *content.figures;
  curve("torque [N·m]", figures.torque_n_m, "%.3f", 0.02, color_of(kTorqueColor));
  curve("prediction's residual [N]", figures.residual_n, "%.2f", 0.5, {0.90F, 0.62F, 0.0F, 1});
  tip("Part of the force that the local model did not compute itself, as the predictor continues it.");
  curve("longest tick [ms]", figures.longest_tick_ms, "%.2f", 2, {0.80F, 0.80F, 0.80F, 1});
  tip("Longest time between two steps of the haptic loop. It is 1 ms on a machine that is fast enough.");
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

/// Draws a selection list of the enumerators with these names.
template <std::size_t kCount, class Number>
void choose(const char* label, const std::array<const char*, kCount>& all, Number& number) {
  const std::vector<std::string> names(all.begin(), all.end());
  const std::string choice = chosen(label, names.at(number), names);
  if (!choice.empty()) number = static_cast<Number>(std::ranges::find(names, choice) - names.begin());
}

/// Draws the settings of the user's hand. A changed workspace mapping is sent only when a slider is released, because
/// each change of the mapping fades the force out and in again.
void draw_workspace(const PanelContent& content, WorkspaceSettings& workspace) {
  auto scale = static_cast<float>(workspace.scale);
  auto turn_deg = static_cast<float>(workspace.turn_rad * 180 / std::numbers::pi);
  ImGui::TextColored(kDim, "tool motion per hand motion");
  ImGui::SetNextItemWidth(-ImGui::GetFontSize() * 4.2F);
  ImGui::SliderFloat("reach", &scale, 0.1F, 10, "%.2f", ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp);
  bool is_set = ImGui::IsItemDeactivatedAfterEdit();
  workspace.scale = scale;
  // A hand that the mouse moves follows directions of the picture, so its workspace need not be rotated.
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
  if (content.figures->has_molecules) draw_molecule_style(content, switches.molecules);
  ImGui::Checkbox("cut away the front (X)", &switches.cuts);
  if (switches.cuts) slider("depth", switches.cut_share, 1, "%.2f");
  if (content.is_mouse) ImGui::Checkbox("sounds at contact (S)", &switches.has_sound);
  ImGui::TextColored(kDim, "F1: help");
}

void draw_help(const PanelContent& content, bool& is_open) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize(), top = static_cast<float>(menu_height());
  const ImVec2 extent(std::min(44 * em, size.x - em), std::min(34 * em, size.y - top - em));
  ImGui::SetNextWindowPos(ImVec2(size.x * 0.5F, (size.y + top) * 0.5F), ImGuiCond_Always, ImVec2(0.5F, 0.5F));
  ImGui::SetNextWindowSize(extent);
  ImGui::SetNextWindowBgAlpha(1);
  if (ImGui::Begin("Help", &is_open,
                   ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse)) {
    const auto line = [column = std::min(12 * ImGui::GetFontSize(), 0.36F * size.x)](const char* what,
                                                                                     const char* does) {
      ImGui::TextWrapped("%s", what);
      ImGui::SameLine(column);
      draw_explanation(does);
    };
    if (content.is_mouse) {
      line("drag, left button", "move the hand: to the sides, up and down");
      line("  + Shift, or the wheel", "on the level: away from you and towards you");
      line("  + Ctrl", "turn the hand; the wheel rolls it");
      line("arrows, page up and down", "move the hand, without a mouse");
      line("double click, or Space", "grab the body within reach, or release it");
      line("C held", "clutch: the hand moves, the tool stays");
      line("R", "hand back to where it began");
      line("S", "short sounds at contact and grasp on, off");
      ImGui::Separator();
    }
    line("drag, right button", "view from another side");
    line("drag, middle button", "move the picture");
    line(content.is_mouse ? "wheel" : "wheel, left button", "nearer and farther");
    line("F", "fit the scene; T: follow the tool");
    line("3D mouse", "the cap holds the scene, where it is not your device");
    line("G", "ghosts: where the server has things; P: contact points");
    line("X", "cut away the front");
    if (content.figures->has_molecules) {
      line("click on an atom", "select its residue; a second atom shows their distance; Escape clears");
      line("M, N", "molecules as balls, sticks, surface or ribbon; their colours");
      line("Ctrl+K", "keep this pose of the molecules, for everybody");
      line("Ctrl+Z, Ctrl+Y", "back to the last pose, forward again, for everybody");
    }
    if (content.io->game != nullptr) line("1, 2", "gravity of the game on, off");
    line("V", "point at the place under the mouse: other users see it and feel its direction");
    line("Tab", "panel; F1: this help; F11: full screen; Escape: close; Ctrl+Q: quit");
    ImGui::Separator();
    line("yellow arrow", "force on your hand, of the device");
    line("cyan arrow", "torque on your hand");
    line("glass ball, white line", "your device; the spring that joins it to the tool");
  }
  ImGui::End();
}

/// Draws the notice, and returns the vertical position below it [px].
float draw_notice(const std::string& text, bool shows_panels) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize(), top = static_cast<float>(menu_height()) + 0.6F * em;
  if (text.empty()) return top;
  // The notice is beside the panel, so that it hides none of the panel's controls.
  const float width = std::max(12 * em, size.x - (shows_panels ? static_cast<float>(panels_width()) : 0) - 1.2F * em);
  ImGui::SetNextWindowPos(ImVec2(0.6F * em, top));
  // A message that takes the focus would close an open menu.
  ImGui::Begin("##notice", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoInputs |
                   ImGuiWindowFlags_NoFocusOnAppearing);
  ImGui::PushTextWrapPos(width);
  ImGui::TextColored(kWarning, "%s", text.c_str());
  ImGui::PopTextWrapPos();
  const float bottom = ImGui::GetWindowPos().y + ImGui::GetWindowHeight();
  ImGui::End();
  return bottom + 0.3F * em;
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
  const float em = ImGui::GetFontSize();
  return std::clamp(kPanelShare * ImGui::GetIO().DisplaySize.x, kMinPanelEm * em, kMaxPanelEm * em) + 1.2F * em;
}

void draw_panels(const PanelContent& content, WindowSwitches& switches, net::LinkParameters& link,
                 WorkspaceSettings& workspace) {
  draw_goals(content, draw_notice(content.notice, switches.shows_panels));
  if (switches.shows_help) draw_help(content, switches.shows_help);
  if (!switches.shows_panels) return;
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize(), top = static_cast<float>(menu_height()) + 0.6F * em;
  const float width = static_cast<float>(panels_width()) - 1.2F * em;
  ImGui::SetNextWindowPos(ImVec2(size.x - 0.6F * em, top), ImGuiCond_Always, ImVec2(1, 0));
  ImGui::SetNextWindowSizeConstraints(ImVec2(width, 0), ImVec2(width, size.y - top - 0.6F * em));
  ImGui::Begin("##panels", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize);
  draw_people(content);
  draw_force(content);
  draw_delay(content, link);
  draw_stage(content);
  if (content.figures->has_molecules && begin_part("Molecules", switches.is_open[5])) {
    draw_poses(content, switches);
    draw_residues(content.molecules, switches);
  }
  if (begin_part("Details", switches.is_open[7])) {
    if (begin_part("Session", switches.is_open[0])) draw_session(content);
    if (begin_part("Network", switches.is_open[1])) draw_network(content, link);
    if (begin_part("Touch", switches.is_open[2])) draw_touch(content);
    if (begin_part("Coupling", switches.is_open[3])) draw_coupling(content);
    if (begin_part("View", switches.is_open[4])) draw_view(content, switches);
    if (begin_part("Hand", switches.is_open[6])) draw_workspace(content, workspace);
  }
  ImGui::End();
}

}  // namespace tandem::client
