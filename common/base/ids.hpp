// Identifiers of objects. They are used instead of pointers where an object is named in another thread or in a message.
// Zero means "none", so a default-constructed id is invalid.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace tandem {

/// An integer that can be compared only with ids of the same kind.
template <class Tag, class Integer = std::uint32_t>
struct Id {
  Integer value = 0;

  constexpr bool is_valid() const { return value != 0; }
  constexpr auto operator<=>(const Id&) const = default;  // NOLINT(modernize-use-nullptr): there is no pointer
};

/// Id of a body: its 1-based position in the scene's list `bodies`, the same on server and client.
using BodyId = Id<struct BodyTag>;
constexpr BodyId body_id_at(std::size_t index) {
  return {static_cast<std::uint32_t>(index) + 1};
}
/// Id of a user in a room. It is never reused during the lifetime of the room.
using UserId = Id<struct UserTag>;
/// Id of a room within its server.
using RoomId = Id<struct RoomTag>;
/// Id of a connection on the wire. It is random, so that an attacker cannot guess the id.
using ConnectionId = Id<struct ConnectionTag, std::uint64_t>;

/// Number of a client's haptic tick (input), from 1; 0 before the first tick.
using Tick = Id<struct TickTag, std::uint64_t>;

/// Number of a room's fixed simulation step, from 1; 0 before the first step.
using Step = Id<struct StepTag, std::uint64_t>;

}  // namespace tandem

template <class Tag, class Integer>
struct std::hash<tandem::Id<Tag, Integer>> {
  std::size_t operator()(tandem::Id<Tag, Integer> id) const noexcept { return std::hash<Integer>{}(id.value); }
};
