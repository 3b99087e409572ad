// Divides the processor time of one thread fairly among several rooms.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace tandem::server {

/// Start-time fair queueing: the next slice of work belongs to the room that has received the least work so far.
///
/// Model   Each room i has a start tag s_i, in units of work. v is the tag of the room that next() selected last.
///         * next() selects, among the rooms with work, the room with the smallest tag.
///         * charge() adds the work of the slice to the tag of its room.
///         * When an idle room gets work again, its tag is set to max(s_i, v), so idle time earns no credit.
///         Let M be the largest work of a slice. Then s_i ≤ v + M, which bounds the unfairness:
///         (1) between a room's first request and its first slice, each other room receives at most 2 M;
///         (2) while two rooms both have work, the amounts of work that they receive differ by at most 2 M.
/// Source  Goyal, Vin, Cheng, "Start-time Fair Queueing", SIGCOMM 1996, section 2; with equal weights
/// Thread  always the same thread
class FairTurns {
 public:
  explicit FairTurns(std::size_t rooms) : rooms_(rooms) {}

  /// Selects the room for the next slice.
  /// In      has_work  returns whether the room of an index has work
  /// Out     index of the room; none if no room has work
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
  /// Adds work that was done for a room to its tag.
  void charge(std::size_t room, std::uint64_t work) { rooms_[room].tag += work; }

 private:
  struct Room {
    std::uint64_t tag = 0;
    bool has_work = false;
  };
  std::vector<Room> rooms_;
  std::uint64_t now_ = 0;  ///< v: tag of the last selected room, before its slice was charged
};

}  // namespace tandem::server
