// Ordered exchange of commands and events between two threads. A full ring refuses new values instead of overwriting
// old ones. For states of which only the newest matters, use mailbox.hpp; for objects that own memory, use
// handover.hpp. Threads of this project exchange data only in these three ways.
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>

namespace tandem::realtime {

/// Wait-free queue for one writer thread and one reader thread; its capacity is fixed at construction.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : queue_(capacity) {}

  /// Appends a value. Returns false if the ring is full; then the value is not stored, and the caller must count or
  /// report it.
  bool push(const T& value) { return queue_.push(value); }
  /// Removes the oldest value. Returns false if the ring is empty.
  bool pop(T& value) { return queue_.pop(value); }
  /// Thread  reader thread
  bool is_empty() const { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace tandem::realtime
