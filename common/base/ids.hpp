// Ids of objects that threads and the wire share. Zero is "none" for every id: a default-constructed id is invalid, and
// no pointer crosses a thread or the wire.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace tandem {

/// An opaque number that compares only with ids of its own kind.
template <class Tag, class Integer = std::uint32_t>
struct Id {
  Integer value = 0;

  constexpr bool is_valid() const { return value != 0; }
  constexpr auto operator<=>(const Id&) const = default;  // NOLINT(modernize-use-nullptr): there is no pointer
};

/// A body of a room's scene: 1-based position in the scene's `bodies`, the same on server and client.
using BodyId = Id<struct BodyTag>;
constexpr BodyId body_id_at(std::size_t index) {
  return {static_cast<std::uint32_t>(index) + 1};
}
/// A user in a room; never reused within the life of the room.
using UserId = Id<struct UserTag>;
/// A room of a server.
using RoomId = Id<struct RoomTag>;
/// A connection's id on the wire: random, so that an attacker cannot guess it.
using ConnectionId = Id<struct ConnectionTag, std::uint64_t>;

/// Counts a client's haptic ticks (inputs), from 1. 0: no tick yet.
using Tick = Id<struct TickTag, std::uint64_t>;

/// Counts a room's fixed simulation steps, from 1. 0: not yet stepped.
using Step = Id<struct StepTag, std::uint64_t>;

}  // namespace tandem

template <class Tag, class Integer>
struct std::hash<tandem::Id<Tag, Integer>> {
  std::size_t operator()(tandem::Id<Tag, Integer> id) const noexcept { return std::hash<Integer>{}(id.value); }
};
