// What a program writes on its standard outputs. A program that moves a hand, or serves those who do, must never wait for
// whoever reads what it says: a terminal can stand still (Ctrl-S), a pipe can be full, its reader can be gone.
//
//   any thread: out(), err(), log() ──▶ queue of 1024 lines ──▶ a thread for each output: write(2), may hang
//                                       full: the oldest is dropped, and counted
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.hpp"

namespace tandem::realtime {

/// So many lines of a kind in a minute; what is left out is counted and said. Whoever can make a program write a line can
/// then not fill its log.
///
/// Thread  one at a time
class LineLimit {
 public:
  static constexpr std::size_t kMaxLines = 60;
  static constexpr Duration kWindow{std::chrono::minutes(1)};

  /// What to write for this line: it, or that others of its kind are left out, or nothing; before it what was left out
  /// in windows that have ended.
  /// In      kind  chosen by the program, never by a peer: there are few
  std::vector<std::string> admitted(std::string_view kind, const std::string& line, LocalTime now);
  /// What was left out and not said yet.
  std::vector<std::string> left_out();

 private:
  struct Window {
    LocalTime begin{};
    std::size_t lines = 0;
  };
  static void end(std::string_view kind, Window& window, std::vector<std::string>& said);

  std::map<std::string, Window, std::less<>> windows_;
};

/// One a program, made first of all in main() and there till the end. It owns threads that may hang, so nothing waits for
/// them at the end of the process: what it holds is never freed.
///
/// Thread  any
class Output {
 public:
  /// Ignores SIGPIPE, for a reader who goes away must not end the program.
  explicit Output(const std::string& program);
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  /// Text for the standard output, and for the standard error output, as it is.
  void out(const std::string& text);
  void err(const std::string& text);
  /// A line for the standard error output, with the time before it, bounded by LineLimit.
  void log(std::string_view kind, const std::string& line);

  /// Says what the log left out, and waits until all is written, at most half a second: what nobody has read then is lost.
  void finish();

 private:
  struct Impl;
  Impl* impl_;
};

}  // namespace tandem::realtime
