// Lock-free, wait-free exchange of a value between two threads: the newest value replaces older ones.
//
//   writer owns slot A      middle slot      reader owns slot B
//        publish(): A ⇄ middle (mark fresh)      poll(): if fresh, middle ⇄ B
//
// With three slots the writer can always write and the reader can always read a complete value. A value in this project
// describes a whole state, of which only the newest matters. The writer therefore overwrites a value that was never
// read. In this case publish() returns true, so that the caller can count the loss.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace tandem::realtime {

/// Triple buffer for one writer thread and one reader thread.
///
/// In      T  copy-assignable; its assignment should not allocate if the mailbox is used in a real-time tick
/// Thread  write side: one thread; read side: one other thread
template <class T>
class Mailbox {
 public:
  Mailbox() = default;
  /// Fills all slots with `initial`, so that their memory is allocated at construction.
  explicit Mailbox(const T& initial) { slots_.fill(initial); }

  /// Returns the slot that the next publish() makes visible to the reader. The slot contains an arbitrary older value,
  /// so the writer must assign all of its fields.
  T& back() { return slots_[back_]; }

  /// Makes back() the newest value. Returns true if the value that it replaces was never read.
  bool publish() {
    const std::uint8_t previous = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel);
    back_ = previous & kIndex;
    return (previous & kFresh) != 0;
  }
  bool publish(const T& value) {
    back() = value;
    return publish();
  }

  /// Makes the newest value available in front() if one was published since the last poll; otherwise front() is
  /// unchanged.
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
