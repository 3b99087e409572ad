// The start screen, which is shown if the program is started without an address.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "client/start/start_flow.hpp"
#include "client/view/guide/guide.hpp"
#include "client/view/screen/screen.hpp"

namespace tandem::client {

class ScenePictures;

/// Text fields and lists of the start screen.
struct StartForm {
  std::array<char, 65> name{};  ///< the user's name
  std::array<char, 1025> file{}, receptor{}, ligand{};
  std::array<char, 2049> address{};
  std::vector<std::string> devices;  ///< one line of text for each device that was found
  std::string about;                 ///< line at the end of the page
  GuideProgress guide{};             ///< progress in the guide, from the user's earlier runs
  bool wants_guide = false;          ///< true: the user has requested the guided first minute
  bool begins_guide = false;         ///< true: the guide begins when the scene that is being opened is shown
};

/// Draws the start screen in the current ImGui context, and passes the user's choice to the flow.
/// In      pictures  null: cards without pictures
/// Thread  the one that runs the window
void draw_start(StartFlow& flow, StartForm& form, ScenePictures* pictures);

/// The start screen in a window.
class StartScreen {
 public:
  /// In      screen, form  must outlive this
  StartScreen(Screen& screen, StartForm& form);
  ~StartScreen();
  StartScreen(const StartScreen&) = delete;
  StartScreen& operator=(const StartScreen&) = delete;

  /// Draws one frame, and updates the flow by the user's input.
  void draw(StartFlow& flow);

 private:
  Screen& screen_;
  StartForm& form_;
  std::unique_ptr<ScenePictures> pictures_;
};

}  // namespace tandem::client
