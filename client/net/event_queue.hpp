// Bounded queue of a session's events for the program.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "client/session/event.hpp"

namespace tandem::client {

/// Events in the order of their occurrence. If the queue is full, the oldest event is dropped and counted.
class EventQueue {
 public:
  static constexpr std::size_t kCapacity = 4096;

  void push(Event event) {
    if (events_.size() == kCapacity) {
      events_.pop_front();
      ++dropped_;
    }
    events_.push_back(std::move(event));
  }
  std::optional<Event> pop() {
    if (events_.empty()) return std::nullopt;
    Event event = std::move(events_.front());
    events_.pop_front();
    return event;
  }
  bool is_empty() const { return events_.empty(); }
  /// Returns the number of events dropped since construction.
  std::uint64_t dropped() const { return dropped_; }

 private:
  std::deque<Event> events_;
  std::uint64_t dropped_ = 0;
};

}  // namespace tandem::client
