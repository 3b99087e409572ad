// The network of a trial: the transports of one server and its clients over simulated links, in virtual time.
//
//   ClientSession ── VirtualClientTransport ══ up: datagrams, stream ══▶ ┐
//                                          ◀══ down: datagrams, stream ══╡ VirtualNetwork ── SessionHub
//
// Model of a stream (TCP):
// * It is a reliable SimulatedLink with the delay of the datagrams. Retransmission after a loss takes no additional
//   time.
// * Stream and datagrams share one line and its rate limit. Their packets are sent in the order in which they were
//   queued.
// * Connecting takes one round trip.
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

/// Traffic that one client and the server sent to each other, including lost packets.
struct TrafficCounters {
  std::uint64_t datagrams = 0;
  std::uint64_t bytes = 0;         ///< payload of datagrams and streams, without UDP, TCP and IP headers
  std::uint64_t stream_bytes = 0;  ///< payload of streams
};

/// The client's end of a link.
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

  /// Receives the packets that are due at both ends. Must be called before either end sends in this slot.
  void collect(LocalTime now);
  /// Passes the packets that have arrived at the client to its session.
  void deliver(client::ClientSession& session, LocalTime now);

  const net::LinkCounters& datagrams_up() const { return datagrams_up_.counters(); }
  const net::LinkCounters& datagrams_down() const { return datagrams_down_.counters(); }
  const TrafficCounters& traffic() const { return traffic_; }
  /// Returns a histogram of waiting times: for each datagram of the server, the time until the line, which it shares
  /// with the stream, was free.
  const Histogram& waits_down() const { return waits_down_; }
  /// Returns the time of the last arrival at the server.
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
  // Packets that have arrived but are not delivered yet.
  Packets arrived_datagrams_up_;
  Packets arrived_datagrams_down_;
  Packets arrived_stream_up_;
  Packets arrived_stream_down_;
  bool is_open_ = false;  ///< whether the stream is open, as seen by the client
  bool has_datagram_port_ = false;
  std::uint32_t attempt_ = 0;  ///< number of connection attempts so far; stream data of earlier attempts is discarded
  server::ConnectionHandle connection_ = 0;  ///< server's handle of the connection; 0: no connection
  std::uint32_t server_attempt_ = 0;         ///< number of the attempt that created connection_
  bool server_knows_address_ = false;
};

/// The server's end of the links of all clients.
class VirtualNetwork final : public server::ServerTransport {
 public:
  explicit VirtualNetwork(const Clock& clock) : clock_(clock) {}

  /// Adds a client, which may then connect. Its lifetime is that of the network.
  VirtualClientTransport& add_client(const net::LinkParameters& up, const net::LinkParameters& down,
                                     std::uint64_t seed);

  void send_control(server::ConnectionHandle connection, std::span<const std::byte> bytes) override;
  bool send_datagram(server::ConnectionHandle connection, std::span<const std::byte> datagram) override;
  std::size_t queued_control_bytes(server::ConnectionHandle connection) const override;
  void close(server::ConnectionHandle connection) override;

  /// Receives the packets that are due at both ends of every link. Must be the first call in a slot.
  void collect(LocalTime now);
  /// Passes the packets that have arrived at the server to the hub. The clients are processed in the order of
  /// add_client().
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
