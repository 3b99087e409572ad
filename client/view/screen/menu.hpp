// The menu at the top of a session, and its dialogs.
#pragma once

#include <string>
#include <vector>

namespace tandem::client {

enum class MenuAction {
  kNone,
  kOpen,
  kHost,
  kSavePicture,
  kRecord,
  kFullScreen,
  kSettings,
  kGuide,
  kHelp,
  kPanels,
  kQuit
};

struct MenuContent {
  bool is_recording = false;
  bool shows_panels = true;
  const std::vector<std::string>* invitations = nullptr;  ///< invitations of a hosted session; else empty
};

/// State of the menu's dialog.
struct MenuState {
  bool shows_invitations = true;  ///< true: the invitations of a hosted session are shown
};

/// Draws the menu, and the invitations of a hosted session, in the current ImGui context. Returns the chosen action.
/// Thread  the one that runs the window
MenuAction draw_menu(const MenuContent& content, MenuState& state);

/// Height of the menu, in ImGui's pixels.
double menu_height();

}  // namespace tandem::client
