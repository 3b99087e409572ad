// Hand-over of objects that own memory, from the thread that makes them to the one that uses them, and of their end
// back to the maker: the user neither allocates, locks, waits nor frees, and nobody holds a pointer to a freed object.
//
//   maker: offer(g, object) ──▶ slot g mod 2 ──▶ get()             user, in generation g
//          frees the object of g − 2, once ◀─── enter(g − 1) ───── user
//
// Each object belongs to a generation, a number that only grows. The user says which one it is in; what belongs to an
// older one it never asks for again, so the maker may free it.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

namespace tandem::realtime {

/// At most one object a generation, for one maker thread and one user thread.
template <class T>
class Handover {
 public:
  /// Takes `object`, the only one of `generation` (> 0, growing); false leaves it with the caller, to be offered again
  /// later: the user may still use what was handed over two generations before.
  /// Thread  maker: frees that older object
  bool offer(std::uint32_t generation, std::unique_ptr<T>& object) {
    const std::size_t slot = generation % kSlots;
    const std::uint32_t older = generations_[slot].load(std::memory_order_relaxed);
    if (objects_[slot] != nullptr && older >= entered_.load(std::memory_order_acquire)) return false;
    objects_[slot] = std::move(object);
    shown_[slot].store(objects_[slot].get(), std::memory_order_relaxed);
    generations_[slot].store(generation, std::memory_order_release);
    return true;
  }

  /// The object of `generation`, before it is entered; null while it has none.
  /// Thread  user
  T* offered(std::uint32_t generation) const noexcept {
    const std::size_t slot = generation % kSlots;
    const bool is_it = generations_[slot].load(std::memory_order_acquire) == generation;
    return is_it ? shown_[slot].load(std::memory_order_relaxed) : nullptr;
  }
  /// From now on the user uses the object of `generation` and never one of an older generation.
  /// Thread  user
  void enter(std::uint32_t generation) noexcept { entered_.store(generation, std::memory_order_release); }
  /// The object of the generation entered last; null while it has none.
  /// Thread  user
  T* get() const noexcept { return offered(entered_.load(std::memory_order_relaxed)); }

 private:
  static constexpr std::size_t kSlots = 2;

  std::array<std::unique_ptr<T>, kSlots> objects_;  ///< the maker's alone
  /// Theirs, for the user: atomic, for a compiler may load it before it knows whether it is the one asked for.
  std::array<std::atomic<T*>, kSlots> shown_{};
  std::array<std::atomic<std::uint32_t>, kSlots> generations_{};
  std::atomic<std::uint32_t> entered_{0};
};

}  // namespace tandem::realtime
