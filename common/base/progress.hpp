// Long calculations: a progress line on a terminal, and cancellation.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <stop_token>
#include <string>

namespace tandem {

/// Returns a function that shows a task and its progress (0..1; 1 ends the line) on standard error. A terminal
/// overwrites the line; any other output gets a new line every 25 %.
///
/// In      write  receives the text instead of standard error
/// Thread  any, one at a time
std::function<void(const std::string& what, double done)> progress_on_stderr(
    std::function<void(const std::string& text)> write = {});

/// Exception that ends a long calculation at a call_off_point().
class CalledOff final : public std::exception {
 public:
  const char* what() const noexcept override { return "called off before it was done"; }
};

/// While it exists, a stop request ends a long calculation of this thread. It belongs to the thread and is not a
/// parameter: mesh preparation passes through a dozen functions, most of which have other callers.
///
/// Thread  one constructs and destroys it; at most one per thread
class CallOffScope {
 public:
  /// Called at each call_off_point(), before the stop request is checked; for tests.
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

/// Mesh elements (triangles, points) between two call_off_point() of a loop: below 10 ms.
inline constexpr std::size_t kCallOffEvery = 16'384;

/// Long calculations call it about every 10 ms of work; it does nothing outside a CallOffScope.
/// Fails   CalledOff: a stop was requested
void call_off_point();
/// The same in a loop: acts at each kCallOffEvery-th i.
inline void call_off_point(std::size_t i) {
  if (i % kCallOffEvery == 0) call_off_point();
}

}  // namespace tandem
