// Section of the panels about atoms and residues: the atom under the mouse, the selection, the distance of two atoms,
// and the legend of colours.
#include <imgui.h>

#include <algorithm>

#include "client/view/panels.hpp"
#include "client/view/screen/style.hpp"

namespace tandem::client {
namespace {

/// Draws a text in an area of two lines, so that a change from one line to two moves no control below it.
void draw_in_place(const std::string& text, const ImVec4& color) {
  const float top = ImGui::GetCursorPosY();
  ImGui::PushStyleColor(ImGuiCol_Text, color);
  ImGui::TextWrapped("%s", text.c_str());
  ImGui::PopStyleColor();
  ImGui::SetCursorPosY(std::max(ImGui::GetCursorPosY(), top + 2 * ImGui::GetTextLineHeightWithSpacing()));
}

/// Draws a coloured square with a text. The entry is drawn beside the previous entry if the line has enough space.
void draw_entry(const LegendEntry& entry, bool is_first) {
  const float em = ImGui::GetFontSize(), width = 1.4F * em + ImGui::CalcTextSize(entry.text.c_str()).x;
  if (!is_first) {
    ImGui::SameLine(0, 0.8F * em);
    if (ImGui::GetContentRegionAvail().x < width) ImGui::NewLine();
  }
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const float side = 0.8F * em, top = from.y + 0.1F * em;
  ImGui::GetWindowDrawList()->AddRectFilled(
      ImVec2(from.x, top), ImVec2(from.x + side, top + side),
      ImGui::ColorConvertFloat4ToU32({entry.color[0], entry.color[1], entry.color[2], 1}), 0.2F * em);
  ImGui::Dummy(ImVec2(side, ImGui::GetTextLineHeight()));
  ImGui::SameLine(0, 0.3F * em);
  ImGui::TextUnformatted(entry.text.c_str());
}

void draw_legend(const DrawnScene& scene) {
  for (const LegendEntry& entry : scene.legend) draw_entry(entry, &entry == &scene.legend.front());
  if (scene.legend_omitted > 0) ImGui::TextColored(kDim, "and %zu more", scene.legend_omitted);
}

/// Returns a sentence about the selection, or about the distance of two picked atoms.
std::string sentence_of(const MoleculeContent& content) {
  if (!content.distance.empty()) return content.distance + ". Escape clears.";
  const std::size_t count = content.selection->residues().size();
  if (content.selection->is_empty())
    return "A click on an atom selects its residue; a second atom shows their distance.";
  return std::to_string(count) + (count == 1 ? " residue" : " residues") + " selected. Escape clears.";
}

/// Draws the input field for a range of residues, and the current selection.
void draw_selection(const MoleculeContent& content, WindowSwitches& switches) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const char* const button = "select";
  ImGui::SetNextItemWidth(-ImGui::CalcTextSize(button).x - 2 * style.FramePadding.x - style.ItemSpacing.x);
  const bool is_entered = ImGui::InputTextWithHint("##residues", "residues, e.g. A:10-25", switches.residues.data(),
                                                   switches.residues.size(), ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  if (ImGui::Button(button) || is_entered) {
    *content.problem = content.selection->select(*content.scene, switches.residues.data());
  }
  const bool has_problem = !content.problem->empty();
  draw_in_place(has_problem ? *content.problem : sentence_of(content), has_problem ? kWarning : kDim);
}

}  // namespace

void draw_residues(const MoleculeContent& content, WindowSwitches& switches) {
  if (content.selection == nullptr) return;
  draw_in_place(content.under_mouse.empty() ? "Nothing is under the mouse." : "Mouse: " + content.under_mouse, kTitle);
  draw_selection(content, switches);
  draw_legend(*content.scene);
}

}  // namespace tandem::client
