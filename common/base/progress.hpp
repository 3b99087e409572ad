// What takes seconds: a line on a terminal that says how much of it is done, and a way to end it before.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <stop_token>
#include <string>

namespace tandem {

/// A line on the standard error output: what takes long, and how much of it is done (0..1; 1 ends the line). On a
/// terminal the line is overwritten; else a new one is written every 25 %.
///
/// In      write  takes the text instead
/// Thread  any, one at a time
std::function<void(const std::string& what, double done)> progress_on_stderr(
    std::function<void(const std::string& text)> write = {});

/// Ends a long calculation where it reaches a call_off_point().
class CalledOff final : public std::exception {
 public:
  const char* what() const noexcept override { return "called off before it was done"; }
};

/// While it lives, a request to stop ends a long calculation of this thread. Of the thread, not a parameter of the
/// calculation: what a mesh is made of passes through a dozen functions, most of which others call, too.
///
/// Thread  made and destroyed by one; at most one a thread
class CallOffScope {
 public:
  /// Called at each call_off_point(), before the request is looked up; for tests.
  using AtPoint = std::function<void(const std::stop_token& stop)>;

  explicit CallOffScope(std::stop_token stop, AtPoint at_point = {});
  ~CallOffScope();
  CallOffScope(const CallOffScope&) = delete;
  CallOffScope& operator=(const CallOffScope&) = delete;

 private:
  friend void call_off_point();
  std::stop_token stop_;
  AtPoint at_point_;
};

/// Things of a mesh (triangles, points) between two call_off_point() of a loop: below 10 ms.
inline constexpr std::size_t kCallOffEvery = 16'384;

/// Called by long calculations about each 10 ms of work; nothing outside of a CallOffScope.
/// Fails   CalledOff: its stop was requested
void call_off_point();
/// The same in a loop: at each kCallOffEvery-th i.
inline void call_off_point(std::size_t i) {
  if (i % kCallOffEvery == 0) call_off_point();
}

}  // namespace tandem
