// Scripted docking: executes the commands of --commands in order, with the same requests as the window's panel.
//
//   standard input ──▶ command_pipe ──▶ command (parsed) ──▶ CommandRun ──▶ ClientIo::send(), ScriptedHand
//   standard output ◀── command_pipe ◀── one JSON object a line ◀──┘
#pragma once

#include <memory>
#include <string>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"
#include "devices/pointer.hpp"

namespace tandem::client {

/// Answers each line with exactly one line: {"line": its number, "command": its name, "ok": true, and the results}, or
/// {"line", "command", "ok": false, "error": the problem and the remedy}.
///
/// Thread  main
class CommandRun {
 public:
  /// Reads the first line when the room is joined and its state and saved poses have been received.
  /// In      io              must outlive this object
  ///         pointer         pointer of the device that the commands move; null: movement commands are refused
  ///         lines, answers  file descriptors
  /// Fails   see CommandPipe
  CommandRun(ClientIo& io, std::shared_ptr<devices::Pointer> pointer, int lines, int answers);
  CommandRun(const CommandRun&) = delete;
  CommandRun& operator=(const CommandRun&) = delete;
  /// Calls finish().
  ~CommandRun();

  /// Receives an event of the client. Call for each event, before the poll() whose snapshot includes its effect.
  void receive(const Event& event);
  /// Continues the current command, or begins the next one. Called about every 10 ms.
  /// In      view  HapticCore::newest_view(); null: none yet
  void poll(const ClientIoSnapshot& io, const View* view, LocalTime now);
  /// Returns whether the program must end, because of the command quit, the end of the input, or the loss of the
  /// reader.
  bool is_over() const;
  /// Answers the current command with an error, and stops reading.
  void finish();
  /// Describes failed commands and unwritten answers; empty if there were none. Call after finish().
  std::string problem() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
