// Part of the panels for scenes with two molecules: values for their relative pose, and the saved poses.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "client/view/panels.hpp"
#include "common/docking/field_model.hpp"
#include "common/docking/molecule.hpp"

namespace tandem::client {
namespace {

constexpr int kRowsShown = 8;

std::string counted(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// Draws the button of a row of the list, and its popup in which the saved pose can be renamed or deleted.
void draw_edit(const PanelContent& content, WindowSwitches& switches, const wire::KeptPose& pose) {
  if (pose.number() == 0) return ImGui::TextUnformatted("");
  if (ImGui::SmallButton("...")) {
    switches.new_pose_name = {};
    pose.name().copy(switches.new_pose_name.data(), switches.new_pose_name.size() - 1);
    ImGui::OpenPopup("edit");
  }
  if (!ImGui::BeginPopup("edit")) return;
  ImGui::SetNextItemWidth(12 * ImGui::GetFontSize());
  const bool is_entered = ImGui::InputText("##rename", switches.new_pose_name.data(), switches.new_pose_name.size(),
                                           ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  const bool renames = ImGui::Button("rename") || is_entered;
  ImGui::SameLine();
  const bool deletes = ImGui::Button("delete");
  if (renames) ask_pose(content.client, wire::AskPose::RENAME, pose.number(), switches.new_pose_name.data());
  if (deletes) ask_pose(content.client, wire::AskPose::DELETE, pose.number());
  if (renames || deletes) ImGui::CloseCurrentPopup();
  ImGui::EndPopup();
}

/// Draws the button that starts an energy minimisation. During a minimisation, draws its progress and a button that
/// cancels it.
void draw_minimising(const PanelContent& content) {
  const auto& progress = content.io->pose_progress;
  if (!progress) {
    if (ImGui::Button("minimise")) ask_pose(content.client, wire::AskPose::MINIMISE);
    return;
  }
  if (ImGui::Button("cancel")) ask_pose(content.client, wire::AskPose::CANCEL);
  const float done = static_cast<float>(progress->steps()) / static_cast<float>(progress->max_steps());
  ImGui::ProgressBar(std::min(1.0F, done), ImVec2(-1, 0),
                     text_of("minimising: %.0f kJ/mol", progress->energy_kj_per_mol()).c_str());
}

void draw_kept(const PanelContent& content, WindowSwitches& switches, const std::vector<wire::KeptPose>& poses) {
  const float row = ImGui::GetTextLineHeightWithSpacing();
  const float height = row * static_cast<float>(1 + std::min<std::size_t>(kRowsShown, poses.size()));
  if (!ImGui::BeginTable("poses", 5, ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg, ImVec2(0, height))) return;
  ImGui::TableSetupScrollFreeze(0, 1);
  ImGui::TableSetupColumn("pose", ImGuiTableColumnFlags_WidthStretch);
  for (const char* name : {"kJ/mol", "RMSD", "H-bonds", " ... "}) {
    ImGui::TableSetupColumn(name, ImGuiTableColumnFlags_WidthFixed, ImGui::CalcTextSize(name).x);
  }
  ImGui::TableHeadersRow();
  for (const wire::KeptPose& pose : poses) {
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::PushID(static_cast<int>(pose.number()));
    const int flags = ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_AllowItemOverlap;
    if (ImGui::Selectable(pose.name().c_str(), false, flags)) {
      ask_pose(content.client, wire::AskPose::GO_TO, pose.number());
    }
    if (ImGui::IsItemHovered() && !pose.user_name().empty()) ImGui::SetTooltip("kept by %s", pose.user_name().c_str());
    for (const std::string& text : {text_of("%.0f", pose.lj_kj_per_mol() + pose.coulomb_kj_per_mol()),
                                    text_of("%.2f", pose.rmsd_angstrom()), std::to_string(pose.hydrogen_bonds())}) {
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(text.c_str());
    }
    ImGui::TableNextColumn();
    draw_edit(content, switches, pose);
    ImGui::PopID();
  }
  ImGui::EndTable();
}

}  // namespace

void ask_pose(ClientIo* client, wire::AskPose::Kind kind, std::uint32_t number, const char* name) {
  if (client != nullptr) client->send(pose_command(kind, number, name));
}

void keep_pose(ClientIo* client, WindowSwitches& switches) {
  ask_pose(client, wire::AskPose::KEEP, 0, switches.pose_name.data());
  switches.pose_name = {};
}

void draw_poses(const PanelContent& content, WindowSwitches& switches) {
  const Figures& figures = *content.figures;
  if (content.view != nullptr && content.view->has_state) {
    const double energy = content.view->newest.update.field_energy_kj_per_mol;
    const bool is_overlap = std::abs(energy) >= 1e6;
    ImGui::Text(is_overlap ? "%.1e kJ/mol (%.1e kcal/mol)" : "%.1f kJ/mol (%.1f kcal/mol)", energy,
                energy / docking::kKilojoulesPerKilocalorie);
  }
  ImGui::TextUnformatted(
      (counted(figures.contacts, "contact") + ", " + counted(figures.hydrogen_bonds.size(), "hydrogen bond")).c_str());
  if (figures.rmsd_angstrom) ImGui::Text("%.2f Å RMSD from the files' pose", *figures.rmsd_angstrom);
  if (content.io->kept_poses == nullptr || content.io->joined->role() == wire::ROLE_OBSERVER) return;
  const ImGuiStyle& style = ImGui::GetStyle();
  const char* const keep = "keep";
  ImGui::SetNextItemWidth(-ImGui::CalcTextSize(keep).x - 2 * style.FramePadding.x - style.ItemSpacing.x);
  const bool is_entered = ImGui::InputTextWithHint("##name", "name of a pose", switches.pose_name.data(),
                                                   switches.pose_name.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  if (ImGui::Button(keep) || is_entered) keep_pose(content.client, switches);
  if (ImGui::Button("undo")) ask_pose(content.client, wire::AskPose::UNDO);
  ImGui::SameLine();
  if (ImGui::Button("redo")) ask_pose(content.client, wire::AskPose::REDO);
  ImGui::SameLine();
  draw_minimising(content);
  draw_kept(content, switches, *content.io->kept_poses);
}

}  // namespace tandem::client
