// Ordered exchange of commands and events between two threads. Nothing is overwritten: a full ring refuses new values.
// For states, of which only the newest matters, use mailbox.hpp; for objects that own memory, handover.hpp. Threads of
// this project exchange data in these three ways only.
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstddef>

namespace tandem::realtime {

/// Wait-free queue for one writer thread and one reader thread; its capacity is fixed at construction.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : queue_(capacity) {}

  /// Returns false if the ring is full. The value is then not stored, and the caller counts or reports it.
  bool push(const T& value) { return queue_.push(value); }
  /// Returns false if the ring is empty.
  bool pop(T& value) { return queue_.pop(value); }
  /// Thread  reader
  bool is_empty() const { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace tandem::realtime
