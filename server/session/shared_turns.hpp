// A loop whose turns two threads take: the one that runs it, and one that has nothing better to do just then.
//
//   run():  open ── takes turns ── closes ── waits until no helper is in a turn
//   help():      sees it open, takes turns
//
// A turn is taken by counting up, so each is taken once; a helper says that it is there before it looks again whether the
// loop is open, so run() never leaves one behind.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

#include "common/base/time.hpp"

namespace tandem::server {

/// Without a lock or an allocation; who waits for the other spins. A turn must not throw: the other would never be told.
class SharedTurns {
 public:
  using Turn = std::function<void(std::size_t)>;

  /// Calls `turn` once with each number below `count`, here or in help(), and returns when all have returned.
  /// Thread  one
  void run(std::size_t count, const Turn& turn) noexcept {
    turn_ = &turn;
    count_ = count;
    next_.store(0, std::memory_order_relaxed);
    is_open_.store(true);
    take();
    is_open_.store(false);
    while (helpers_.load() > 0) {
    }
  }
  /// Takes turns of the loop that runs, or begins within `time`.
  /// Thread  any: run() waits for a turn that is taken here, so none that may be held up
  void help(Duration time) noexcept {
    const SteadyClock clock;
    const LocalTime until = clock.now() + time;
    while (!is_open_.load(std::memory_order_relaxed)) {
      if (clock.now() >= until) return;
    }
    helpers_.fetch_add(1);
    if (is_open_.load()) take();
    helpers_.fetch_sub(1);
  }

 private:
  void take() {
    for (std::size_t i = next_.fetch_add(1); i < count_; i = next_.fetch_add(1)) (*turn_)(i);
  }

  const Turn* turn_ = nullptr;  ///< these two: of the loop that is open
  std::size_t count_ = 0;
  std::atomic<std::size_t> next_{0};
  std::atomic<int> helpers_{0};
  std::atomic<bool> is_open_{false};
};

}  // namespace tandem::server
