#include "common/base/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <utility>

namespace tandem {
namespace {

class ProgressLine {
 public:
  explicit ProgressLine(std::function<void(const std::string&)> write) : write_(std::move(write)) {}

  void show(const std::string& what, double done) {
    if (what != what_) shown_percent_ = -1;
    what_ = what;
    const int every = is_terminal_ ? 1 : 25;
    const int percent = static_cast<int>(std::floor(100 * std::clamp(done, 0.0, 1.0))) / every * every;
    if (percent <= shown_percent_) return;
    shown_percent_ = percent;
    const bool ends = percent == 100 || !is_terminal_;
    write_((is_terminal_ ? "\r" : "") + what + ": " + std::to_string(percent) + " %" + (ends ? "\n" : ""));
  }

 private:
  std::function<void(const std::string&)> write_;
  bool is_terminal_ = isatty(STDERR_FILENO) != 0;
  std::string what_;
  int shown_percent_ = -1;
};

}  // namespace

std::function<void(const std::string& what, double done)> progress_on_stderr(
    std::function<void(const std::string& text)> write) {
  if (!write) write = [](const std::string& text) { std::cerr << text << std::flush; };
  const auto line = std::make_shared<ProgressLine>(std::move(write));
  return [line](const std::string& what, double done) { line->show(what, done); };
}

namespace {

thread_local const CallOffScope* call_off_scope = nullptr;

}  // namespace

CallOffScope::CallOffScope(std::stop_token stop, AtPoint at_point)
    : stop_(std::move(stop)), at_point_(std::move(at_point)) {
  call_off_scope = this;
}

CallOffScope::~CallOffScope() {
  call_off_scope = nullptr;
}

void call_off_point() {
  if (call_off_scope == nullptr) return;
  if (call_off_scope->at_point_) call_off_scope->at_point_(call_off_scope->stop_);
  if (call_off_scope->stop_.stop_requested()) throw CalledOff();
}

}  // namespace tandem
