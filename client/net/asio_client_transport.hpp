// The client's sockets, and the simulated links that may stand between them and the session.
//
//   session ──▶ [link up] ──▶ socket        both links absent: bytes go straight through
//   session ◀── [link down] ◀── socket      present: held until due, by one timer on the io thread
//
// Control bytes go through a secure::TlsStream between link and socket; with --insecure that leaves them as they are.
// State and control have a link each way (control: reliable). Each connection gets sockets and links of its own, so
// nothing of an old one can reach the session. What the TCP socket does not take waits here, and state over TCP is
// only sent when nothing waits.
#pragma once

#include <boost/asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "client/net/connector.hpp"
#include "client/session/session.hpp"
#include "common/net/link.hpp"

namespace tandem::client {

/// A link to simulate inside the client, for control and state alike (control bytes are never lost or reordered).
struct SimulatedLinks {
  net::LinkParameters up;    ///< client to server
  net::LinkParameters down;  ///< server to client
  std::uint64_t seed = 1;
};

/// What went through the simulated links, all connections together.
struct LinkTraffic {
  net::LinkCounters up;  ///< datagrams
  net::LinkCounters down;
  net::LinkCounters control_up;  ///< chunks of the control stream; with state over TCP, the state too
  net::LinkCounters control_down;
};

/// ClientTransport over Asio.
///
/// Thread  the one that runs the io_context
class AsioClientTransport final : public ClientTransport {
 public:
  /// In      host     a numeric address; with `trust` also the name of a host, which is looked up when it connects
  ///         trust    by what the server is known; none: nothing is encrypted, loopback only
  ///         resolve  the addresses of a name
  /// Fails   std::invalid_argument: another address, a file that holds no authority, or a bad link parameter
  AsioClientTransport(boost::asio::io_context& io, const std::string& host, std::uint16_t port,
                      const std::optional<secure::Trust>& trust, std::optional<SimulatedLinks> links,
                      const Clock& clock, Resolve resolve = resolve_by_system);
  ~AsioClientTransport() override;

  /// Whom to call; before the first connect().
  void attach(ClientSession& session) { session_ = &session; }
  /// True when no closed connection still has bytes to send.
  bool is_drained() const;
  /// Simulated links have these parameters from now on, up and down. Ignored when there were none from the
  /// start.
  /// Fails   std::invalid_argument: a bad parameter
  void set_links(const net::LinkParameters& both);
  const LinkTraffic& link_traffic() const { return link_traffic_; }

  void connect(LocalTime now) override;
  void send_control(std::span<const std::byte> bytes) override;
  bool send_datagram(std::span<const std::byte> datagram) override;
  std::optional<secure::Exported> exported(std::string_view label, std::span<const std::byte> context) override;
  void set_datagram_port(std::uint16_t port) override;
  std::size_t queued_control_bytes() const override;
  std::string connecting_to() const override { return connector_.progress(); }
  void close() override;

 private:
  struct Connection;
  using ConnectionPointer = std::shared_ptr<Connection>;

  void renew();
  void accepted(boost::asio::ip::tcp::socket socket, const net::Address& address);
  void connected(const ConnectionPointer& connection);
  void established();
  void set_up_failed(const ConnectionPointer& connection, net::AttemptFailure failure, const std::string& why);
  void read(const ConnectionPointer& connection);
  void take_bytes(const ConnectionPointer& connection, std::span<const std::byte> bytes);
  void deliver_control(const ConnectionPointer& connection, std::span<const std::byte> bytes);
  void await_datagrams(const ConnectionPointer& connection);
  void receive_datagrams(Connection& connection);
  void flush(const ConnectionPointer& connection);
  void lost(const ConnectionPointer& connection, const std::string& why);
  void report_loss_when_due(Connection& connection);
  void pump(const ConnectionPointer& connection);
  void deliver_due(Connection& connection, LocalTime now);
  void schedule_pump(const ConnectionPointer& connection);
  void finish_when_drained(Connection& connection);
  static void abort(Connection& connection);
  bool is_current(const Connection& connection) const { return current_.get() == &connection; }
  void count_links(const Connection& connection);

  boost::asio::io_context& io_;
  std::uint16_t port_;
  std::optional<secure::TlsContext> tls_;  ///< none: nothing is encrypted
  std::optional<SimulatedLinks> links_;
  const Clock& clock_;
  ClientSession* session_ = nullptr;
  ConnectionPointer current_;
  std::weak_ptr<Connection> closing_;
  std::uint64_t connections_ = 0;
  LinkTraffic link_traffic_;
  Connector connector_;
};

}  // namespace tandem::client
