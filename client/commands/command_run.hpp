// Scripted docking: executes the lines of --commands in order, by the same requests as the window's panel.
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

/// Answers each line with exactly one line of JSON:
/// * success: {"line": number of the line, "command": name of the command, "ok": true, and the results}
/// * failure: {"line", "command", "ok": false, "error": the problem and the remedy}
///
/// Thread  main
class CommandRun {
 public:
  /// Begins with the first line when the room is joined and its state and saved poses have arrived.
  /// In      io              must outlive this object
  ///         pointer         pointer of the device that the commands move; null: movement commands are refused
  ///         lines, answers  file descriptors
  /// Fails   see CommandPipe
  CommandRun(ClientIo& io, std::shared_ptr<devices::Pointer> pointer, int lines, int answers);
  CommandRun(const CommandRun&) = delete;
  CommandRun& operator=(const CommandRun&) = delete;
  /// Calls finish().
  ~CommandRun();

  /// Receives an event of the client. Must be called for each event, before the poll() whose snapshot contains the
  /// effect of the event.
  void receive(const Event& event);
  /// Continues the current command, or begins the next one. Call it about every 10 ms.
  /// In      view  HapticCore::newest_view(); null: none yet
  void poll(const ClientIoSnapshot& io, const View* view, LocalTime now);
  /// Returns true if the program must end: after the command quit, at the end of the input, or if nobody reads the
  /// answers.
  bool is_over() const;
  /// Fails the current command with an error, and stops reading.
  void finish();
  /// Returns text about failed commands and unwritten answers; empty if there are none. Call it after finish().
  std::string problem() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tandem::client
