// Lines in, answers out, one after the other: the thread of --commands that may block on the standard input and output, so
// that the main thread never does.
//
//   thread of this file: read a line ──▶ wait for its answer ──▶ write the answer ──▶ read the next line
//   main thread:            take() ──────▶ … ──────▶ answer()
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace tandem::client {

/// A line is read only when the answer to the one before has been written: who writes many lines and reads no answers is
/// slowed down, and no answer is lost.
///
/// Thread  one, but for its own
class CommandPipe {
 public:
  /// In      lines, answers  file descriptors; they stay open
  /// Fails   std::system_error: no eventfd or no thread
  CommandPipe(int lines, int answers);
  CommandPipe(const CommandPipe&) = delete;
  CommandPipe& operator=(const CommandPipe&) = delete;
  /// As finish().
  ~CommandPipe();

  /// The next line, once, without its end; of a line longer than kMaxCommandBytes that many bytes and one more. Nothing:
  /// none yet.
  std::optional<std::string> take();
  /// Of the line that was taken last.
  /// In      answer  one line, without its end
  void answer(const std::string& answer);
  /// No line comes any more: the input has ended, or the answers have no reader.
  bool is_over() const;
  /// Reason why answers could not be written; "": there is none.
  std::string problem() const;
  /// Reads no more. Waits until the last answer is written, at most half a second.
  void finish();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;  ///< shared with a thread that hangs in a terminal, and is left behind
};

}  // namespace tandem::client
