// The server's sockets: one TCP listener, its connections, and one UDP socket on the same port number.
//
// Everything runs on the one thread that runs the io_context, so there is no lock here. TCP writes go to the kernel
// at once as far as it takes them and the rest waits in a buffer whose size the session hub watches: a reader that
// does not read is ended by the hub, never waited for. UDP is freshest-only: what the kernel does not take is lost.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "common/base/time.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::server {

/// ServerTransport over Asio.
///
/// Thread  the one that runs the io_context
class AsioServerTransport final : public ServerTransport {
 public:
  /// Opens the port (0: any free one) for TCP and UDP.
  /// Fails   std::invalid_argument: not a loopback address (until the transport is secured);
  ///         std::runtime_error: port in use or not allowed, with the remedy
  AsioServerTransport(boost::asio::io_context& io, const std::string& address, std::uint16_t port, const Clock& clock);
  ~AsioServerTransport() override;

  std::uint16_t port() const { return port_; }
  /// Starts to accept and to receive for `hub`.
  void serve(SessionHub& hub);
  void stop_accepting();
  /// Connections that are open, those that only send what is queued included.
  std::size_t open_connections() const { return peers_.size(); }

  void send_control(ConnectionHandle connection, std::span<const std::byte> bytes) override;
  bool send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) override;
  std::size_t queued_control_bytes(ConnectionHandle connection) const override;
  void close(ConnectionHandle connection) override;

 private:
  struct Peer;
  using PeerPointer = std::shared_ptr<Peer>;

  void listen(const boost::asio::ip::address& address, std::uint16_t port);
  void accept();
  void welcome(boost::asio::ip::tcp::socket socket);
  void read(const PeerPointer& peer);
  void flush(const PeerPointer& peer);
  void finish_sending(const PeerPointer& peer);
  void drop(const PeerPointer& peer);
  void await_datagrams();
  void receive_datagrams();

  boost::asio::io_context& io_;
  const Clock& clock_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::ip::udp::socket udp_;
  boost::asio::steady_timer accept_again_;
  std::uint16_t port_ = 0;
  SessionHub* hub_ = nullptr;
  ConnectionHandle last_handle_ = 0;
  std::map<ConnectionHandle, PeerPointer> peers_;
};

}  // namespace tandem::server
