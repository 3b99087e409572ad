// Reads lines and writes their answers, one at a time, on a separate thread. That thread may block on standard input
// and output, so that the main thread does not.
//
//   pipe's thread: read a line ──▶ wait for its answer ──▶ write the answer ──▶ read the next line
//   main thread:      pop_line() ──────▶ … ──────▶ answer()
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace tandem::client {

/// Question-and-answer pipe with backpressure: a line is read only after the previous answer has been written. A peer
/// that does not read its answers is blocked, and no answer is lost.
///
/// Thread  always the same thread; the pipe reads and writes on a thread of its own
class CommandPipe {
 public:
  /// In      lines, answers  file descriptors; the pipe does not close them
  /// Fails   std::system_error: no eventfd or no thread could be made
  CommandPipe(int lines, int answers);
  CommandPipe(const CommandPipe&) = delete;
  CommandPipe& operator=(const CommandPipe&) = delete;
  /// Calls finish().
  ~CommandPipe();

  /// Returns the next line, without its line end; nothing if there is none yet. A line that is too long is cut to
  /// kMaxCommandBytes + 1 bytes, so that the parser refuses it.
  std::optional<std::string> pop_line();
  /// Answers the line that pop_line() returned last.
  /// In      answer  one line, without its line end
  void answer(const std::string& answer);
  /// Returns whether no further line can arrive: the input has ended, or the answers have no reader.
  bool is_over() const;
  /// Returns the reason why answers could not be written; empty if there is none.
  std::string problem() const;
  /// Stops reading. The last answer may still be written for 0.5 s. Waits at most 1 s for the thread.
  void finish();

 private:
  struct Impl;
  /// Shared with the thread, because finish() leaves the thread running if it is blocked in a read or a write.
  std::shared_ptr<Impl> impl_;
};

}  // namespace tandem::client
