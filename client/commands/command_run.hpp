// Scripted docking: executes the commands of --commands in order, by the same requests as the window's panel.
//
//   standard input ──▶ command_pipe ──▶ command (parsed) ──▶ this ──▶ ClientIo::send(), ScriptedHand
//   standard output ◀── command_pipe ◀── one JSON object a line ◀──┘
#pragma once

#include <memory>
#include <string>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Answers each line by exactly one line: {"line": its number, "command": its name, "ok": true, and the results}, or
/// {"line", "command", "ok": false, "error": the problem and the remedy}.
///
/// Thread  main
class CommandRun {
 public:
  /// Reads the first line once the room is joined and its state and kept poses have arrived.
  /// In      io              must outlive this
  ///         pointer         of the device that the commands move; null: movement commands are refused
  ///         lines, answers  file descriptors
  /// Fails   std::system_error: as CommandPipe
  CommandRun(ClientIo& io, std::shared_ptr<devices::Pointer> pointer, int lines, int answers);
  CommandRun(const CommandRun&) = delete;
  CommandRun& operator=(const CommandRun&) = delete;
  /// Calls finish().
  ~CommandRun();

  /// Receives an event of the client; call for each, before the poll() with a snapshot that has its effect.
  void receive(const Event& event);
  /// Continues the present command, or begins the next; called about every 10 ms.
  /// In      view  HapticCore::newest_view(); null: none yet
  void poll(const ClientIoSnapshot& io, const View* view, LocalTime now);
  /// Returns whether the program must end: the command quit, the end of the input, or no reader of the answers.
  bool is_over() const;
  /// Answers the present command with an error, and stops reading.
  void finish();
  /// Failed commands or unwritten answers, as text; "" if all were answered without an error. After finish().
  std::string problem() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
