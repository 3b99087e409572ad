// Exchange of commands and events between two threads, in order. A full ring refuses new values instead of overwriting
// old ones. Threads of this project exchange data in three ways only:
// * ring.hpp: commands and events, none of which may be lost unnoticed
// * mailbox.hpp: states, of which only the newest matters
// * handover.hpp: objects that own memory
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>

namespace tandem::realtime {

/// Wait-free queue for one writer thread and one reader thread; its capacity is fixed at construction.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : queue_(capacity) {}

  /// Appends a value and returns true. If the ring is full, stores nothing and returns false; the caller must then
  /// count or report the loss.
  bool push(const T& value) { return queue_.push(value); }
  /// Removes the oldest value. Returns false if the ring is empty.
  bool pop(T& value) { return queue_.pop(value); }
  /// Thread  reader thread
  bool is_empty() const { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace tandem::realtime
