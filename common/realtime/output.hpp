// Non-blocking output of a program. A program that displays forces must never wait for the reader of its output: a
// terminal can be stopped (Ctrl-S), a pipe can be full, and the reading program may have ended.
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

/// Limits the number of lines of one kind per minute. Suppressed lines are counted and reported. A peer that triggers
/// log lines therefore cannot fill the log.
///
/// Thread  any, one at a time
class LineLimit {
 public:
  static constexpr std::size_t kMaxLines = 60;
  static constexpr Duration kWindow{std::chrono::minutes(1)};

  /// Returns the lines to write instead of `line`, in this order:
  /// 1. for each kind whose window has ended, the number of suppressed lines;
  /// 2. `line` itself; or a notice if `line` is the first suppressed one; or nothing if it is a later one.
  /// In      kind  kind of line, chosen by the program and never by a peer, so that the number of kinds is limited
  std::vector<std::string> admitted(std::string_view kind, const std::string& line, LocalTime now);
  /// Returns the counts of suppressed lines that have not been reported yet.
  std::vector<std::string> left_out();

 private:
  struct Window {
    LocalTime begin{};
    std::size_t lines = 0;
  };
  static void end(std::string_view kind, Window& window, std::vector<std::string>& shown);

  std::map<std::string, Window, std::less<>> windows_;
};

/// Output of one program, constructed first in main() and never destroyed. Its threads may be blocked in a write at the
/// end of the program. The process therefore ends without joining the threads or freeing their memory.
///
/// Thread  any
class Output {
 public:
  /// Ignores SIGPIPE, so that the program continues if the reader of its output ends.
  explicit Output(const std::string& program);
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// Writes text unchanged: out() to standard output, err() to standard error.
  void out(const std::string& text);
  void err(const std::string& text);
  /// Writes a line with a time stamp to standard error, subject to LineLimit.
  void log(std::string_view kind, const std::string& line);

  /// Reports the suppressed lines, then waits up to half a second for all lines to be written. Lines not written by
  /// then are lost.
  void finish();

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace tandem::realtime
