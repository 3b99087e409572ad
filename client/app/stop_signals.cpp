// See stop_signals.hpp.
#include "client/app/stop_signals.hpp"

#include <signal.h>
#include <time.h>
#include <unistd.h>

#include <optional>
#include <utility>

#include "common/base/time.hpp"

namespace tandem::client {
namespace {

// Period at which the signal thread checks whether the program has ended. The end is delayed by at most this time.
constexpr Duration kSignalPollPeriod{std::chrono::milliseconds(50)};
// Time after the first signal from which a second signal ends the program at once. In this time the force is ramped
// down in any case (haptic_loop.cpp needs far less). For a user who presses Ctrl-C again, the time is short.
constexpr Duration kSecondSignalAfter{std::chrono::seconds(1)};

bool is_ignored(int signal) {
  struct sigaction action {};
  return sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

sigset_t stop_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT}) sigaddset(&signals, signal);
  // Does not block SIGHUP if it is ignored (nohup), because a blocked signal stays pending even if it is ignored.
  if (!is_ignored(SIGHUP)) sigaddset(&signals, SIGHUP);
  return signals;
}

}  // namespace

void block_stop_signals() {
  const sigset_t signals = stop_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, nullptr);
}

StopSignals::StopSignals() : thread_([this] { watch(); }) {}

StopSignals::~StopSignals() {
  is_closing_.store(true, std::memory_order_relaxed);
  thread_.join();
}

void StopSignals::when_requested(std::function<void()> on_stop) {
  const std::lock_guard lock(mutex_);
  on_stop_ = std::move(on_stop);
  if (is_requested() && on_stop_) on_stop_();
}

void StopSignals::watch() {
  const sigset_t signals = stop_signals();
  const SteadyClock clock;
  timespec poll_period{};
  poll_period.tv_nsec = kSignalPollPeriod.count();
  std::optional<LocalTime> first;
  while (!is_closing_.load(std::memory_order_relaxed)) {
    if (sigtimedwait(&signals, nullptr, &poll_period) <= 0) continue;
    if (first && clock.now() - *first >= kSecondSignalAfter) _exit(1);
    if (first) continue;
    first = clock.now();
    request();
  }
}

void StopSignals::request() {
  const std::lock_guard lock(mutex_);
  is_requested_.store(true, std::memory_order_relaxed);
  if (on_stop_) on_stop_();
}

}  // namespace tandem::client
