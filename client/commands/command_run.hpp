// Docking by a script: executes the commands of --commands one after the other, by the same requests as the window's panel.
//
//   standard input ──▶ command_pipe ──▶ command (parsed) ──▶ this ──▶ ClientIo::ask_pose(), ScriptedHand
//   standard output ◀── command_pipe ◀── one JSON object a line ◀──┘
#pragma once

#include <memory>
#include <string>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Each line is answered by exactly one line: {"line": its number, "command": its name, "ok": true, and what it gave}, or
/// {"line", "command", "ok": false, "error": what happened and what would help}.
///
/// Thread  main
class CommandRun {
 public:
  /// Reads the first line once the room is joined and its state and kept poses are here.
  /// In      io  must outlive this
  ///         pointer  of the device that commands move; null: they move none
  ///         lines, answers  file descriptors
  /// Fails   std::system_error: as CommandPipe
  CommandRun(ClientIo& io, std::shared_ptr<devices::Pointer> pointer, int lines, int answers);
  CommandRun(const CommandRun&) = delete;
  CommandRun& operator=(const CommandRun&) = delete;
  /// As finish().
  ~CommandRun();

  /// Continues the present command, or begins the next; every 10 ms or so.
  /// In      view  HapticCore::newest_view(); null: none yet
  void poll(const ClientIoSnapshot& io, const View* view, LocalTime now);
  /// The program is to end: by the command quit, by the end of the input, or because nobody reads the answers.
  bool is_over() const;
  /// Answers the present command with an error, and reads no more.
  void finish();
  /// Why the run has not done what its commands say; "": all were answered and none with an error. After finish().
  std::string problem() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
