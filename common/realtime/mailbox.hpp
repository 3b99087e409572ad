// Newest-wins hand-over of a value from one thread to another, without a lock and without waiting.
//
//   writer owns slot A      middle slot      reader owns slot B
//        publish(): A ⇄ middle (mark fresh)      poll(): if fresh, middle ⇄ B
//
// Three slots, so the writer can always write and the reader can always read a whole value. State is
// absolute in this project (design: freshest-only), so a value that nobody read in time is only counted.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tandem::realtime {

/// Triple buffer for one writer thread and one reader thread.
///
/// In      T  copy-assignable; its assignment should not allocate where the mailbox is used on a tick
/// Thread  write side: one thread; read side: one (other) thread
template <class T>
class Mailbox {
 public:
  Mailbox() = default;
  /// With that in all its slots: what needs memory has it from the start.
  explicit Mailbox(const T& initial) { slots_.fill(initial); }

  /// The slot that the next publish() hands over. Holds an arbitrary older value: assign all of it.
  T& back() { return slots_[back_]; }

  /// Makes back() the newest value. True when the value it replaces had never been read.
  bool publish() {
    const std::uint8_t previous = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel);
    back_ = previous & kIndex;
    return (previous & kFresh) != 0;
  }
  bool publish(const T& value) {
    back() = value;
    return publish();
  }

  /// Takes the newest value, if one came since the last poll. front() is unchanged otherwise.
  bool poll() {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) == 0) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    return true;
  }
  const T& front() const { return slots_[front_]; }

 private:
  static constexpr std::uint8_t kFresh = 4;
  static constexpr std::uint8_t kIndex = 3;

  std::array<T, 3> slots_{};
  alignas(64) std::atomic<std::uint8_t> middle_{0};
  alignas(64) std::uint8_t back_ = 1;
  alignas(64) std::uint8_t front_ = 2;
};

}  // namespace tandem::realtime
