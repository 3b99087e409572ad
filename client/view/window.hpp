// The window of tandem-client. It displays the scene, and moves the hand of the device "mouse". Only this folder uses
// GLFW, OpenGL and Dear ImGui; this header includes none of them.
//
//   haptic thread ── view mailbox ──▶ draw() ◀── snapshot of the session (io thread, its own lock)
//                 ◀── pointer mailbox ── mouse and keys
//
// No other thread waits for the window. A stalled, hidden or slow window therefore delays only itself.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "client/view/drawn_molecule.hpp"
#include "devices/device.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

class Screen;

/// Request that the user has made in the menu; it ends the session.
enum class WindowRequest { kNone, kOpen, kHost, kGuide };

struct WindowSettings {
  std::string title = "tandem";
  Screen* screen = nullptr;                    ///< screen for drawing; required, and must outlive the window
  bool is_scene_only = false;                  ///< true: a saved frame shows the scene without panels and texts
  std::string molecules{}, molecule_colors{};  ///< names as in MoleculeStyle; empty: as in the last run
  std::shared_ptr<devices::Device> cap{};      ///< 3D mouse that moves the camera; null: none
  bool begins_guide = false;                   ///< true: shows the guided first minute, at the step where the user was
  bool remembers = true;       ///< true: stores the user's switches from one run to the next (window_memory.hpp)
  ClientIo* client = nullptr;  ///< receives the user's requests; must outlive the window
  /// Pointer that the window moves by mouse and keys. Null: the device is not "mouse", and the mouse moves only the
  /// camera.
  std::shared_ptr<devices::Pointer> pointer{};
  std::vector<std::pair<std::string, std::string>> facts{};  ///< facts about the run, for the session panel
  std::vector<std::string> invitations{};                    ///< invitations of a hosted session, for other users
  std::string recording_folder{};                            ///< folder for recordings that the button starts
  net::LinkParameters link{};                                ///< initial parameters of the simulated link
  WorkspaceSettings workspace{};                             ///< initial mapping of the hand
};

/// Thread  main: the thread that constructed the window
class Window {
 public:
  /// Fails   std::runtime_error if the display's driver refuses a shader
  explicit Window(WindowSettings settings);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Adds a tick. Call for each tick, in order.
  void add(const TickRecord& record);
  /// Evaluates mouse and keys, and draws one frame of the screen.
  /// In      view    newest view; null if none was received yet
  ///         notice  text for the top of the window; "": the session's notice, if there is one
  void draw(const View* view, const ClientIoSnapshot& io, const std::string& notice);
  /// Sets the text about recordings in the session panel; "": no text. It is shown below the button that starts or ends
  /// a recording.
  void show_recording(bool is_recording, const std::string& state);
  /// Sets the text in the session panel about the last message of the room.
  void show_news(const std::string& news);
  /// Returns whether the button for recordings was pressed since the last call.
  bool pop_record_press();
  /// Returns the last request from the menu since the last call.
  WindowRequest pop_request();
  /// Returns whether the user has closed the window.
  bool is_closed() const;
  /// Returns whether molecules in the current style are still being made.
  bool is_making() const;
  /// Writes the next frame also to a PNG file. If that fails, draw() throws std::runtime_error.
  void save_next_frame(const std::filesystem::path& file);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
