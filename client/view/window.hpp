// The window of tandem-client: what a person sees, and with the device "mouse" also moves. The only folder that knows
// GLFW, OpenGL and Dear ImGui, and this header names none of them.
//
//   haptic thread ── view mailbox ──▶ draw() ◀── snapshot of the session (io thread, its own lock)
//                 ◀── pointer mailbox ── mouse and keys
//
// Nothing waits for a window: one that is stalled, hidden or slow is only late itself.
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
  std::string molecules{},
      molecule_colors{};                   ///< of MoleculeStyle's names, as users switched them; empty: as remembered
  std::shared_ptr<devices::Device> cap{};  ///< a 3D mouse that steers the camera; null: none
  bool remembers = true;                   ///< what users switched, from one run to the next (window_memory.hpp)
  ClientIo* client = nullptr;              ///< what users ask for goes there; outlives the window
  /// What the window writes as mouse and keys say; null: the device is no mouse, and the mouse only turns the picture.
  std::shared_ptr<devices::Pointer> pointer{};
  std::vector<std::pair<std::string, std::string>> facts{};  ///< of the run, for the session's panel
  std::string recording_folder{};                            ///< of recordings that the button begins
  net::LinkParameters link{};                                ///< of the simulated link, at first
  WorkspaceSettings workspace{};                             ///< of the hand, at first
};

/// Thread  main: one, that which made it
class Window {
 public:
  /// Opens it, empty.
  /// Fails   std::runtime_error: no display, no OpenGL 3.3, or a program that was built without its window;
  ///         the line says what would do
  explicit Window(WindowSettings settings);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  /// Each tick, in order.
  void add(const TickRecord& record);
  /// Takes what mouse and keys did, and draws one frame; waits before it, so that there are at most 60 a second (30 where
  /// no graphics card draws).
  /// In      view    null: none yet
  ///         notice  for the top of the window; "": the session's own, if any
  void draw(const View* view, const ClientIoSnapshot& io, const std::string& notice);
  /// What the session's panel says of recordings from now on, below a button that begins or ends one. "": nothing.
  void show_recording(bool is_recording, const std::string& state);
  /// Somebody has pressed that button since the last call.
  bool take_record_press();
  /// Somebody closed it.
  bool is_closed() const;
  /// Molecules are still being made as they are to be seen.
  bool is_making() const;
  /// The next frame is also written to a PNG file; draw() then fails with std::runtime_error when that cannot be.
  void save_next_frame(const std::filesystem::path& file);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
