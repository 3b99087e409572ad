// Reads lines and writes their answers, one at a time, in a separate thread. That thread may block on the standard
// input and output, so that the main thread never does.
//
//   thread of this file: read a line ──▶ wait for its answer ──▶ write the answer ──▶ read the next line
//   main thread:            pop_line() ──────▶ … ──────▶ answer()
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace tandem::client {

/// Backpressure: a line is read only after the previous answer was written. A peer that writes lines without reading
/// the answers is blocked, and no answer is lost.
///
/// Thread  one, in addition to the pipe's thread
class CommandPipe {
 public:
  /// In      lines, answers  file descriptors; the pipe does not close them
  /// Fails   std::system_error: no eventfd or no thread could be made
  CommandPipe(int lines, int answers);
  CommandPipe(const CommandPipe&) = delete;
  CommandPipe& operator=(const CommandPipe&) = delete;
  /// Calls finish().
  ~CommandPipe();

  /// Returns the next line once, without its line end; nothing if there is none yet. A line that is too long is cut to
  /// kMaxCommandBytes + 1 bytes.
  std::optional<std::string> pop_line();
  /// Answers the line that pop_line() returned last.
  /// In      answer  one line, without its line end
  void answer(const std::string& answer);
  /// Returns whether no more line can arrive, because the input has ended or the answers have no reader.
  bool is_over() const;
  /// Reason why answers could not be written; empty if there is none.
  std::string problem() const;
  /// Stops reading. The last answer may still be written for half a second. Waits at most one second for the thread.
  void finish();

 private:
  struct Impl;
  /// Shared with the thread. If the thread is blocked in a read from a terminal, or in a write to one, finish() leaves
  /// it running.
  std::shared_ptr<Impl> impl_;
};

}  // namespace tandem::client
