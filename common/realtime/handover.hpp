// Passes objects that own memory from a maker thread to a user thread. The maker thread later frees the objects. The
// user thread therefore neither allocates, locks, waits nor frees, and it never holds a pointer to a freed object.
//
// Each object has a number, its generation g, which increases by 1 with each object. Object g is stored in slot
// g mod 2, so at most two objects exist: the one in use and the next one.
//
//   maker thread                                        user thread
//   offer(g, object)  ──────────────────────────────▶   enter(g): from now on uses only object g, by get()
//   offer(g + 1, …): returns false until enter(g)  ◀──
//     was called, then frees object g − 1
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

namespace tandem::realtime {

/// Passes one object per generation from one maker thread to one user thread.
template <class T>
class Handover {
 public:
  /// Stores `object` as the object of `generation` and returns true. The slot holds the object of generation − 2, which
  /// is freed. If the user thread may still use that older object, returns false, and `object` remains with the caller,
  /// who must try again later.
  /// In      generation  above 0, and higher than at the previous call
  /// Thread  maker thread
  bool offer(std::uint32_t generation, std::unique_ptr<T>& object) {
    const std::size_t slot = generation % kSlots;
    const std::uint32_t older = generations_[slot].load(std::memory_order_relaxed);
    if (objects_[slot] != nullptr && older >= entered_.load(std::memory_order_acquire)) return false;
    objects_[slot] = std::move(object);
    shown_[slot].store(objects_[slot].get(), std::memory_order_relaxed);
    generations_[slot].store(generation, std::memory_order_release);
    return true;
  }

  /// Returns the object of `generation`, before or after enter(generation) is called; null if it was not offered yet.
  /// Thread  user thread
  T* offered(std::uint32_t generation) const noexcept {
    const std::size_t slot = generation % kSlots;
    const bool is_it = generations_[slot].load(std::memory_order_acquire) == generation;
    return is_it ? shown_[slot].load(std::memory_order_relaxed) : nullptr;
  }
  /// Declares that the user thread now uses the object of `generation`, and no longer any object of an older
  /// generation.
  /// Thread  user thread
  void enter(std::uint32_t generation) noexcept { entered_.store(generation, std::memory_order_release); }
  /// Returns the object that the user thread uses now: that of the last enter(); null before the first enter().
  /// Thread  user thread
  T* get() const noexcept { return offered(entered_.load(std::memory_order_relaxed)); }

 private:
  static constexpr std::size_t kSlots = 2;

  std::array<std::unique_ptr<T>, kSlots> objects_;  ///< the objects, by slot; accessed by the maker only
  /// Pointers to the objects for the user thread, by slot. They are atomic, because the maker thread may replace a
  /// pointer while the user thread loads it.
  std::array<std::atomic<T*>, kSlots> shown_{};
  std::array<std::atomic<std::uint32_t>, kSlots> generations_{};
  std::atomic<std::uint32_t> entered_{0};
};

}  // namespace tandem::realtime
