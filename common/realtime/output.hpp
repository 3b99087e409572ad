// Non-blocking output of a program. A program that moves a hand, or serves such programs, must never wait for the
// reader of its output: a terminal can be stopped (Ctrl-S), a pipe can be full, its reader may have ended.
//
//   any thread: out(), err(), log() ──▶ queue of 1024 lines ──▶ a thread for each output: write(2), may hang
//                                       full: the oldest line is dropped and counted
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::realtime {

/// Limits the lines of a kind per minute; suppressed lines are counted and reported. A peer that triggers lines thus
/// cannot fill the log.
///
/// Thread  one at a time
class LineLimit {
 public:
  static constexpr std::size_t kMaxLines = 60;
  static constexpr Duration kWindow{std::chrono::minutes(1)};

  /// Lines to write for this line: the line itself, a notice that further ones are suppressed, or nothing. Before them
  /// the counts of suppressed lines in windows that have ended.
  /// In      kind  chosen by the program, never by a peer: there are few kinds
  std::vector<std::string> admitted(std::string_view kind, const std::string& line, LocalTime now);
  /// Counts of suppressed lines that have not been reported yet.
  std::vector<std::string> left_out();

 private:
  struct Window {
    LocalTime begin{};
    std::size_t lines = 0;
  };
  static void end(std::string_view kind, Window& window, std::vector<std::string>& shown);

  std::map<std::string, Window, std::less<>> windows_;
};

/// One per program, constructed first in main() and used until the end. It owns threads that may block, so the process
/// does not wait for them: its memory is never freed.
///
/// Thread  any
class Output {
 public:
  /// Ignores SIGPIPE, so that a reader that ends does not end the program.
  explicit Output(const std::string& program);
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// Writes text unchanged to the standard output (out) or the standard error output (err).
  void out(const std::string& text);
  void err(const std::string& text);
  /// Writes a line with the time to the standard error output, limited by LineLimit.
  void log(std::string_view kind, const std::string& line);

  /// Reports the suppressed lines and waits until all is written, at most half a second; text unread by then is lost.
  void finish();

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace tandem::realtime
