// Reads lines and writes one answer to each line, on a thread of its own. Standard input and output may block this
// thread, but never the main thread.
//
//   pipe's thread: read a line ──▶ wait for its answer ──▶ write the answer ──▶ read the next line
//   main thread:      pop_line() ──────▶ … ──────▶ answer()
#pragma once

#include <memory>
#include <optional>
#include <string>

namespace tandem::client {

/// Pipe for questions and answers, with backpressure: the next line is read only after the answer to the previous line
/// has been written. So no answer is lost; a peer that does not read its answers is blocked.
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
  /// Returns true if no further line can arrive, because the input has ended or nobody reads the answers.
  bool is_over() const;
  /// Returns the reason why answers could not be written; empty if there is none.
  std::string problem() const;
  /// Stops reading. The last answer may still be written within 0.5 s. Then waits at most 0.5 s more for the end of the
  /// thread.
  void finish();

 private:
  struct Impl;
  /// State that is shared with the thread. If the thread is blocked in a read or a write, finish() does not wait for
  /// it, so the thread may outlive this object.
  std::shared_ptr<Impl> impl_;
};

}  // namespace tandem::client
