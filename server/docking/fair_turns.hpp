// Fair scheduling of one thread's work among several rooms.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace tandem::server {

/// Start-time fair queueing: the room served least so far is next. Work comes in slices; M is the largest.
///
/// Model   Each room i has a start tag s_i. next() serves the room that has work and the smallest tag, v. charge() adds
///         the slice's work to its tag. A room that had no work before gets s_i = max(s_i, v): idle time gives no
///         credit.
///         So s_i ≤ v + M, and
///         (1) between a room's first request and its first slice, each other room is served at most 2 M;
///         (2) while two rooms both have work, their served work differs by at most 2 M.
/// Source  Goyal, Vin, Cheng, "Start-time Fair Queueing", SIGCOMM 1996, section 2; with equal weights
/// Thread  one
class FairTurns {
 public:
  explicit FairTurns(std::size_t rooms) : rooms_(rooms) {}

  /// In      has_work  whether the room with that index has work
  /// Out     the room whose slice is next; nothing: no room has work
  std::optional<std::size_t> next(const std::function<bool(std::size_t)>& has_work) {
    std::optional<std::size_t> least;
    for (std::size_t i = 0; i < rooms_.size(); ++i) {
      const bool had_work = rooms_[i].has_work;
      rooms_[i].has_work = has_work(i);
      if (!rooms_[i].has_work) continue;
      if (!had_work) rooms_[i].tag = std::max(rooms_[i].tag, now_);
      if (!least || rooms_[i].tag < rooms_[*least].tag) least = i;
    }
    if (least) now_ = rooms_[*least].tag;
    return least;
  }
  /// Records the work done for a room.
  void charge(std::size_t room, std::uint64_t work) { rooms_[room].tag += work; }

 private:
  struct Room {
    std::uint64_t tag = 0;
    bool has_work = false;
  };
  std::vector<Room> rooms_;
  std::uint64_t now_ = 0;  ///< v: tag of the room served last, before that slice
};

}  // namespace tandem::server
