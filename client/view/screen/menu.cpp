#include "client/view/screen/menu.hpp"

#include <imgui.h>

#include <algorithm>

#include "client/view/screen/style.hpp"

namespace tandem::client {
namespace {

void add_item(const char* name, const char* keys, MenuAction is, MenuAction& chosen) {
  if (ImGui::MenuItem(name, keys)) chosen = is;
}

/// Draws the invitations, each with a button that copies it.
void draw_invitations(const std::vector<std::string>& invitations, bool& is_open) {
  const ImVec2 size = ImGui::GetIO().DisplaySize;
  const float em = ImGui::GetFontSize();
  const float width = std::min(34 * em, size.x - 2 * em);
  ImGui::SetNextWindowPos(ImVec2(em, static_cast<float>(menu_height()) + em), ImGuiCond_Once);
  ImGui::SetNextWindowSize(ImVec2(width, 0));
  if (ImGui::Begin("Invitations", &is_open, ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoResize)) {
    draw_explanation(
        "Send each invitation to one person. It lets that person in once, within 15 minutes: paste it on the start "
        "screen "
        "under Join.");
    for (std::size_t i = 0; i < invitations.size(); ++i) {
      ImGui::PushID(static_cast<int>(i));
      if (ImGui::Button("Copy")) ImGui::SetClipboardText(invitations[i].c_str());
      ImGui::SameLine();
      // The text cannot be changed. It is in an input field, because the field scrolls and an invitation is longer than
      // the window.
      std::string text = invitations[i];
      ImGui::SetNextItemWidth(-1);
      ImGui::InputText("##invitation", text.data(), text.size() + 1, ImGuiInputTextFlags_ReadOnly);
      ImGui::PopID();
    }
  }
  ImGui::End();
}

}  // namespace

double menu_height() {
  return ImGui::GetFontSize() + 2.0 * ImGui::GetStyle().FramePadding.y;
}

MenuAction draw_menu(const MenuContent& content, MenuState& state) {
  MenuAction chosen = MenuAction::kNone;
  const bool is_hosted = content.invitations != nullptr && !content.invitations->empty();
  if (ImGui::BeginMainMenuBar()) {
    if (ImGui::BeginMenu("Session")) {
      add_item("Open something else ...", "", MenuAction::kOpen, chosen);
      add_item("Host for others ...", "", MenuAction::kHost, chosen);
      if (is_hosted) ImGui::MenuItem("Invitations", "", &state.shows_invitations);
      ImGui::Separator();
      add_item("Save a picture", "", MenuAction::kSavePicture, chosen);
      add_item(content.is_recording ? "End the recording" : "Record", "", MenuAction::kRecord, chosen);
      ImGui::Separator();
      add_item("Quit", "Ctrl+Q", MenuAction::kQuit, chosen);
      ImGui::EndMenu();
    }
    if (ImGui::BeginMenu("View")) {
      add_item(content.shows_panels ? "Hide the panel" : "Show the panel", "Tab", MenuAction::kPanels, chosen);
      add_item("Settings", "", MenuAction::kSettings, chosen);
      add_item("Full screen", "F11", MenuAction::kFullScreen, chosen);
      ImGui::EndMenu();
    }
    if (ImGui::BeginMenu("Help")) {
      add_item("Guided first minute", "", MenuAction::kGuide, chosen);
      add_item("Mouse and keys", "F1", MenuAction::kHelp, chosen);
      ImGui::EndMenu();
    }
    ImGui::EndMainMenuBar();
  }
  if (is_hosted && state.shows_invitations) draw_invitations(*content.invitations, state.shows_invitations);
  return chosen;
}

}  // namespace tandem::client
