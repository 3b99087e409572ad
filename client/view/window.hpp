// The window of tandem-client: displays the scene, and moves the hand of the device "mouse". Only this folder uses
// GLFW, OpenGL and Dear ImGui, and this header includes none of them.
//
//   haptic thread ── view mailbox ──▶ draw() ◀── snapshot of the session (io thread, its own lock)
//                 ◀── pointer mailbox ── mouse and keys
//
// No other thread waits for the window: a stalled, hidden or slow window delays only itself.
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

struct WindowSettings {
  std::string title = "tandem";
  int width = 1280;
  int height = 800;
  std::string molecules{}, molecule_colors{};  ///< names as in MoleculeStyle, set by the user; empty: as remembered
  std::shared_ptr<devices::Device> cap{};      ///< a 3D mouse that steers the camera; null: none
  bool remembers = true;       ///< whether switches of the user are kept from one run to the next (window_memory.hpp)
  ClientIo* client = nullptr;  ///< receives the user's requests; outlives the window
  /// Written by the window from mouse and keys; null: the device is no mouse, and the mouse only turns the picture.
  std::shared_ptr<devices::Pointer> pointer{};
  std::vector<std::pair<std::string, std::string>> facts{};  ///< about the run, for the session's panel
  std::string recording_folder{};                            ///< folder of recordings that the button begins
  net::LinkParameters link{};                                ///< initial parameters of the simulated link
  WorkspaceSettings workspace{};                             ///< initial mapping of the hand
};

/// Thread  main: the thread that constructed it
class Window {
 public:
  /// Opens an empty window.
  /// Fails   std::runtime_error: no display, no OpenGL 3.3, or a program built without its window; the message names
  ///         the remedy
  explicit Window(WindowSettings settings);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Adds a tick; call for each tick, in order.
  void add(const TickRecord& record);
  /// Evaluates mouse and keys, and draws one frame. Waits first, so that there are at most 60 frames a second (30
  /// without a graphics card).
  /// In      view    null: none yet
  ///         notice  for the top of the window; "": the session's own, if any
  void draw(const View* view, const ClientIoSnapshot& io, const std::string& notice);
  /// Sets the session panel's text about recordings, below a button that begins or ends one. "": no text.
  void show_recording(bool is_recording, const std::string& state);
  /// Sets the session panel's text about the last news of the room.
  void show_news(const std::string& news);
  /// Returns whether that button was pressed since the last call.
  bool pop_record_press();
  /// Returns whether the user has closed the window.
  bool is_closed() const;
  /// Returns whether molecules in the present style are still being made.
  bool is_making() const;
  /// Also writes the next frame to a PNG file; draw() then throws std::runtime_error if that fails.
  void save_next_frame(const std::filesystem::path& file);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
