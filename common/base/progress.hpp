// A line that grows on a terminal while something takes seconds.
#pragma once

#include <functional>
#include <iosfwd>
#include <string>

namespace tandem {

/// Thread  any, one at a time
class ProgressLine {
 public:
  /// In      is_terminal  the line is overwritten; else a new one is written every 25 %
  ProgressLine(std::ostream& out, bool is_terminal) : out_(out), is_terminal_(is_terminal) {}

  /// In      done  0..1; 1 ends the line
  void show(const std::string& what, double done);

 private:
  std::ostream& out_;
  bool is_terminal_;
  std::string what_;
  int shown_percent_ = -1;
};

/// A line on the standard error output: what takes long, and how much of it is done (0..1).
std::function<void(const std::string& what, double done)> progress_on_stderr();

}  // namespace tandem
