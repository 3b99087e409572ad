// The client's sockets, and the optional simulated links between them and the session.
//
//   session ──▶ [link up] ──▶ socket        without links: bytes pass unchanged
//   session ◀── [link down] ◀── socket      with links: bytes are delayed until due, by one timer on the io thread
//
// * Control bytes pass through a secure::TlsStream between link and socket; --insecure disables TLS.
// * State and control each have a simulated link in each direction; the control links are reliable.
// * Each connection has sockets and links of its own, so that no bytes of an old connection reach the session.
// * Control bytes that the TCP socket does not accept are queued. State over TCP is sent only when this queue is empty.
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

/// Network links simulated inside the client, for control and state. Control bytes are never lost or reordered.
struct SimulatedLinks {
  net::LinkParameters up;    ///< direction from client to server
  net::LinkParameters down;  ///< direction from server to client
  std::uint64_t seed = 1;
};

/// Traffic of the simulated links, summed over all connections.
struct LinkTraffic {
  net::LinkCounters up;  ///< datagrams to the server
  net::LinkCounters down;
  net::LinkCounters control_up;  ///< chunks of the control stream, including state that is sent over TCP
  net::LinkCounters control_down;
};

/// ClientTransport with sockets of Boost.Asio.
///
/// Thread  the thread that runs the io_context
class AsioClientTransport final : public ClientTransport {
 public:
  /// In      host     a numeric address; with `trust` also a host name, which is looked up by each connect()
  ///         trust    key or authorities that authenticate the server; empty: no TLS, and only loopback addresses
  ///         resolve  function that looks up names
  /// Fails   std::invalid_argument: the address is not allowed, the file contains no authority, or a link parameter is
  ///         invalid
  AsioClientTransport(boost::asio::io_context& io, const std::string& host, std::uint16_t port,
                      const std::optional<secure::Trust>& trust, std::optional<SimulatedLinks> links,
                      const Clock& clock, Resolve resolve = resolve_by_system);
  ~AsioClientTransport() override;

  /// Sets the session that receives the callbacks. Call it before the first connect().
  void attach(TransportListener& session) { session_ = &session; }
  /// Returns true once closed connections have no bytes left to send.
  bool is_drained() const;
  /// Changes the parameters of the simulated links in both directions. Ignored if the transport was constructed without
  /// links.
  /// Fails   std::invalid_argument: an invalid parameter
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
  void receive_bytes(const ConnectionPointer& connection, std::span<const std::byte> bytes);
  void deliver_control(const ConnectionPointer& connection, std::span<const std::byte> bytes);
  void await_datagrams(const ConnectionPointer& connection);
  bool receive_datagrams(Connection& connection);
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
  std::optional<secure::TlsContext> tls_;  ///< context of the TLS connections; empty: no TLS
  std::optional<SimulatedLinks> links_;
  const Clock& clock_;
  TransportListener* session_ = nullptr;
  ConnectionPointer current_;
  std::weak_ptr<Connection> closing_;
  std::uint64_t connections_ = 0;
  LinkTraffic link_traffic_;
  Connector connector_;
};

}  // namespace tandem::client
