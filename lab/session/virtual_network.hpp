// The network of a trial: the transports of one server and its clients over simulated links, in virtual time.
//
//   ClientSession ── VirtualClientTransport ══ up: datagrams, stream ══▶ ┐
//                                          ◀══ down: datagrams, stream ══╡ VirtualNetwork ── SessionHub
//
// A stream (TCP) is a reliable SimulatedLink with the delay of the datagrams. Both share one line: each gets the part
// of the rate limit that the other leaves, in the order of sending. The cost of retransmission under loss is not
// modelled. Connecting takes one round trip.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "client/session/session.hpp"
#include "common/base/histogram.hpp"
#include "common/base/time.hpp"
#include "common/net/link.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::lab {

class VirtualNetwork;

/// Traffic that one client and the server sent, both directions together, including losses.
struct TrafficCounters {
  std::uint64_t datagrams = 0;
  std::uint64_t bytes = 0;         ///< payload of datagrams and streams, without the headers of UDP, TCP and IP
  std::uint64_t stream_bytes = 0;  ///< payload of streams only
};

/// One client's end.
class VirtualClientTransport final : public client::ClientTransport {
 public:
  VirtualClientTransport(const Clock& clock, net::LinkParameters up, net::LinkParameters down, std::uint64_t seed,
                         std::uint64_t first_stream);

  void connect(LocalTime now) override;
  void send_control(std::span<const std::byte> bytes) override;
  bool send_datagram(std::span<const std::byte> datagram) override;
  void set_datagram_port(std::uint16_t) override { has_datagram_port_ = true; }
  std::size_t queued_control_bytes() const override;
  void close() override;

  /// Receives the packets due at both ends, before either end sends in this slot.
  void collect(LocalTime now);
  /// Passes the packets that have arrived at this end to its session.
  void deliver(client::ClientSession& session, LocalTime now);

  const net::LinkCounters& datagrams_up() const { return datagrams_up_.counters(); }
  const net::LinkCounters& datagrams_down() const { return datagrams_down_.counters(); }
  const TrafficCounters& traffic() const { return traffic_; }
  /// Wait of the server's datagrams for the line, which they share with the stream.
  const Histogram& waits_down() const { return waits_down_; }
  /// Time of the last arrival at the server's end.
  LocalTime received_at_server() const { return received_at_server_; }

 private:
  friend class VirtualNetwork;
  using Packets = std::vector<std::vector<std::byte>>;
  void count_datagram(std::size_t bytes) {
    ++traffic_.datagrams;
    traffic_.bytes += bytes;
  }
  void count_stream(std::size_t bytes) {
    traffic_.bytes += bytes;
    traffic_.stream_bytes += bytes;
  }

  const Clock& clock_;
  net::SimulatedLink datagrams_up_;
  net::SimulatedLink datagrams_down_;
  net::SimulatedLink stream_up_;
  net::SimulatedLink stream_down_;
  TrafficCounters traffic_;
  Histogram waits_down_;
  LocalTime received_at_server_{};
  // Arrived packets that are not yet passed on.
  Packets arrived_datagrams_up_;
  Packets arrived_datagrams_down_;
  Packets arrived_stream_up_;
  Packets arrived_stream_down_;
  bool is_open_ = false;  ///< at the client's end
  bool has_datagram_port_ = false;
  std::uint32_t attempt_ = 0;                ///< connections started so far; chunks of earlier ones are ignored
  server::ConnectionHandle connection_ = 0;  ///< at the server's end; 0: none
  std::uint32_t server_attempt_ = 0;         ///< attempt of `connection_`
  bool server_knows_address_ = false;
};

/// The server's end of all clients' links.
class VirtualNetwork final : public server::ServerTransport {
 public:
  explicit VirtualNetwork(const Clock& clock) : clock_(clock) {}

  /// Adds a client, which may connect; it lives as long as the network.
  VirtualClientTransport& add_client(const net::LinkParameters& up, const net::LinkParameters& down,
                                     std::uint64_t seed);

  void send_control(server::ConnectionHandle connection, std::span<const std::byte> bytes) override;
  bool send_datagram(server::ConnectionHandle connection, std::span<const std::byte> datagram) override;
  std::size_t queued_control_bytes(server::ConnectionHandle connection) const override;
  void close(server::ConnectionHandle connection) override;

  /// Receives the packets due at both ends of every client's links: the first action in a slot.
  void collect(LocalTime now);
  /// Passes the packets that have arrived at the server to the hub, clients in the order of add_client().
  void deliver(server::SessionHub& hub, LocalTime now);

 private:
  VirtualClientTransport* client_of(server::ConnectionHandle connection) const;
  void deliver_stream(VirtualClientTransport& client, server::SessionHub& hub, LocalTime now);
  void deliver_datagrams(VirtualClientTransport& client, server::SessionHub& hub, LocalTime now);

  const Clock& clock_;
  std::vector<std::unique_ptr<VirtualClientTransport>> clients_;
  server::ConnectionHandle last_connection_ = 0;
};

}  // namespace tandem::lab
