// Parallel loop of two threads: the owner runs the loop, and an idle helper takes part. A turn is one iteration.
//
//   run():   opens the loop ── executes turns ── closes the loop ── waits until no helper executes a turn
//   help():       finds the loop open ── executes turns
//
// A thread takes a turn by incrementing a shared counter, so each turn is executed once. A helper first registers
// itself, and only then checks that the loop is open. Therefore run() sees every helper that executes a turn, and does
// not return before it.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

#include "common/base/time.hpp"

namespace tandem::server {

/// Parallel loop without locks or allocation. run() spins while it waits for helpers. A turn must not throw, because
/// run() and help() are noexcept.
class SharedTurns {
 public:
  using Turn = std::function<void(std::size_t)>;

  /// Calls `turn` once with each number below `count`, on this thread or on one in help(). Returns after all calls have
  /// returned.
  /// Thread  always the same thread (the owner)
  void run(std::size_t count, const Turn& turn) noexcept {
    turn_ = &turn;
    count_ = count;
    next_.store(0, std::memory_order_relaxed);
    is_open_.store(true);
    run_open_turns();
    is_open_.store(false);
    while (helpers_.load() > 0) {
    }
  }
  /// Executes turns of the open loop. If the loop is not open, spins until it is, for at most `time`.
  /// Thread  any thread that cannot block, because run() waits for the turns executed here
  void help(Duration time) noexcept {
    const SteadyClock clock;
    const LocalTime until = clock.now() + time;
    while (!is_open_.load(std::memory_order_relaxed)) {
      if (clock.now() >= until) return;
    }
    helpers_.fetch_add(1);
    if (is_open_.load()) run_open_turns();
    helpers_.fetch_sub(1);
  }

 private:
  void run_open_turns() {
    for (std::size_t i = next_.fetch_add(1); i < count_; i = next_.fetch_add(1)) (*turn_)(i);
  }

  const Turn* turn_ = nullptr;  ///< body of the open loop, with count_ iterations
  std::size_t count_ = 0;
  std::atomic<std::size_t> next_{0};
  std::atomic<int> helpers_{0};
  std::atomic<bool> is_open_{false};
};

}  // namespace tandem::server
