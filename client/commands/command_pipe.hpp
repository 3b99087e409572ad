// Reads lines and writes their answers, one at a time, in a thread that may block on the standard input and output, so
// that the main thread never does.
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
/// Thread  one, besides its own
class CommandPipe {
 public:
  /// In      lines, answers  file descriptors; not closed here
  /// Fails   std::system_error: no eventfd or no thread
  CommandPipe(int lines, int answers);
  CommandPipe(const CommandPipe&) = delete;
  CommandPipe& operator=(const CommandPipe&) = delete;
  /// Calls finish().
  ~CommandPipe();

  /// Returns the next line once, without its end. A longer line is cut to kMaxCommandBytes + 1 bytes. Nothing: none
  /// yet.
  std::optional<std::string> pop_line();
  /// Answers the last taken line.
  /// In      answer  one line, without its end
  void answer(const std::string& answer);
  /// Returns whether no more line can arrive: the input has ended, or the answers have no reader.
  bool is_over() const;
  /// Reason why answers could not be written; "" if there is none.
  std::string problem() const;
  /// Stops reading. The last answer may still be written for half a second; waits for the thread at most one second.
  void finish();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;  ///< shared with the thread, which is abandoned if it is blocked in a terminal
};

}  // namespace tandem::client
