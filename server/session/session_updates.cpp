// Sends published updates of rooms to their users, on the io thread and in parallel on the room thread.
#include <algorithm>
#include <functional>
#include <utility>

#include "server/session/session_hub_impl.hpp"

namespace tandem::server {
namespace {

/// Minimum number of users for which the room thread helps to send. For fewer users, the io thread alone is faster.
constexpr std::size_t kWorthHelping = 4;
/// Maximum time for which the room thread waits (by spinning) until the io thread begins to send. An io thread that is
/// awake begins within this time.
constexpr Duration kHelpBeginsWithin = std::chrono::microseconds(20);

void add_counts(const proto::ChannelCounters& more, proto::ChannelCounters& to) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
    const auto reason = static_cast<proto::DropReason>(i);
    to.received_drops.add(reason, more.received_drops.count(reason));
    to.sent_drops.add(reason, more.sent_drops.count(reason));
  }
  to.datagrams_received += more.datagrams_received;
  to.datagrams_sent += more.datagrams_sent;
  to.updates_suppressed += more.updates_suppressed;
  to.updates_paced += more.updates_paced;
}

}  // namespace

/// Sends the newest update of a room to its users. Datagrams are sent by the io thread and a helping room thread, in
/// parallel. Only the io thread writes to TCP connections.
void SessionHub::Impl::send_updates(std::size_t room, const Clock& clock) {
  Room& count = room_seats[room]->room();
  if (!count.output().poll()) return;
  const RoomUpdate& update = count.output().front();
  updated.clear();
  for (const auto& [handle, connection] : connections) {
    if (connection->is_in(count) && !connection->state_over_tcp) updated.push_back(connection.get());
  }
  const auto send = [&](std::size_t i) { send_update(*updated[i], update, clock.now()); };
  updates[room].run(updated.size(), std::ref(send));
  for (const auto& [handle, connection] : connections) {
    if (!connection->is_in(count)) continue;
    if (connection->state_over_tcp) send_update(*connection, update, clock.now());
    collect(*connection);
  }
  for (const auto& service : services) service->on_update(count);
}

/// Sends an update to one user. Modifies only this connection, so two threads can serve different connections.
/// Thread  io, or the room thread in help()
void SessionHub::Impl::send_update(Connection& connection, const RoomUpdate& update, LocalTime now) {
  // The update may have been made for the previous user of the seat.
  if (update.user[connection.seat.index] != connection.seat.user) return;
  connection.seats->on_update(connection.seat, update);
  const bool is_blocked = connection.state_over_tcp && queued_bytes(connection) > 0;
  const auto deliver = [&](std::span<const std::byte> datagram) { return deliver_state(connection, datagram); };
  connection.bodies_thinned += connection.stream->send(update, is_blocked, now, deliver);
}

void SessionHub::Impl::collect(Connection& connection) {
  counters.bodies_thinned += std::exchange(connection.bodies_thinned, 0);
  add_counts(std::exchange(connection.counters, {}), counters);
}

bool SessionHub::Impl::deliver_state(Connection& connection, std::span<const std::byte> datagram) {
  if (!connection.state_over_tcp) return transport.send_datagram(connection.handle, datagram);
  wire::ServerControl message;
  message.set_state_datagram(datagram.data(), datagram.size());
  send(connection, message);
  return true;
}

void SessionHub::help(const Room& room) {
  std::size_t users = 0;
  for (std::size_t seat = 0; seat < proto::kMaxUsers; ++seat) users += room.seat(seat).user.is_valid() ? 1 : 0;
  if (users < kWorthHelping) return;
  const auto is_it = [&room](const auto& seats) { return &seats->room() == &room; };
  const auto found = std::ranges::find_if(impl_->room_seats, is_it);
  impl_->updates[static_cast<std::size_t>(found - impl_->room_seats.begin())].help(kHelpBeginsWithin);
}

}  // namespace tandem::server
