// Ordered exchange of commands and events between two threads: nothing is overwritten, a full ring refuses. For state,
// of which only the newest counts, use mailbox.hpp; for objects that own memory, handover.hpp. Threads of this project
// exchange data only in these three ways.
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>

namespace tandem::realtime {

/// Wait-free queue for one writer thread and one reader thread, capacity fixed at construction.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : queue_(capacity) {}

  /// False when full: the value is not stored, and the caller counts or reports it.
  bool push(const T& value) { return queue_.push(value); }
  /// False when empty.
  bool pop(T& value) { return queue_.pop(value); }
  /// Thread  reader
  bool is_empty() const { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace tandem::realtime
