// Support for long calculations: a progress line on a terminal, and cancellation.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <stop_token>
#include <string>

namespace tandem {

/// Returns a function that prints the name of a task and the progress of the task (0 to 1) on standard error. On a
/// terminal, each output overwrites the line of the previous one until the progress is 1. On any other output, a new
/// line is printed every 25 %.
///
/// In      write  function that receives the text instead of standard error
/// Thread  any, one at a time
std::function<void(const std::string& what, double done)> progress_on_stderr(
    std::function<void(const std::string& text)> write = {});

/// Exception that call_off_point() throws to end a long calculation.
class CalledOff final : public std::exception {
 public:
  const char* what() const noexcept override { return "called off before it was done"; }
};

/// Makes long calculations of the current thread cancellable. While an object of this class exists, a stop request ends
/// the calculation at its next call of call_off_point().
/// The stop token is stored per thread instead of being passed as a parameter. Otherwise a dozen nested functions of
/// mesh preparation would need the parameter, most of which have other callers, too.
///
/// Thread  the thread of the calculation constructs and destroys the object; at most one object per thread
class CallOffScope {
 public:
  /// Hook for tests, called at each call_off_point() before the stop request is checked.
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

/// Number of mesh elements (triangles, points) that a loop processes between two calls of call_off_point(). A loop
/// processes this number in less than 10 ms.
inline constexpr std::size_t kCallOffEvery = 16'384;

/// Ends a long calculation if a stop was requested; has no effect outside a CallOffScope. Long calculations call it
/// about every 10 ms.
/// Fails   CalledOff: a stop was requested
void call_off_point();
/// Checks for a stop request like call_off_point(), but only if the loop index i is a multiple of kCallOffEvery.
inline void call_off_point(std::size_t i) {
  if (i % kCallOffEvery == 0) call_off_point();
}

}  // namespace tandem
