// Parallel loop of two threads: the owner, which runs it, and an idle helper.
//
//   run():  open ── takes turns ── closes ── waits until no helper is in a turn
//   help():      sees it open, takes turns
//
// Each turn is taken by incrementing a counter, so it is taken once. A helper registers itself before it checks again
// that the loop is open, so run() never leaves one behind.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

#include "common/base/time.hpp"

namespace tandem::server {

/// Uses no lock and does not allocate; run() spins while it waits for helpers. A turn must not throw: the other thread
/// would not be notified.
class SharedTurns {
 public:
  using Turn = std::function<void(std::size_t)>;

  /// Calls `turn` once with each number below `count`, here or in help(). Returns when all calls have returned.
  /// Thread  one
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
  /// Takes turns of the open loop; waits up to `time` for it to open.
  /// Thread  any thread that does not block: run() waits for turns taken here
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

  const Turn* turn_ = nullptr;  ///< open loop's, as count_
  std::size_t count_ = 0;
  std::atomic<std::size_t> next_{0};
  std::atomic<int> helpers_{0};
  std::atomic<bool> is_open_{false};
};

}  // namespace tandem::server
