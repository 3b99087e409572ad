// The server's sockets: one TCP listener, its connections, and one UDP socket on the same port number.
//
// Everything runs on the one thread that runs the io_context, so there is no lock here. TCP writes go to the kernel
// at once as far as it takes them and the rest waits in a buffer whose size the session hub watches: a reader that
// does not read is ended by the hub, never waited for. UDP is freshest-only: what the kernel does not take is lost.
//
// Nobody holds up anybody:
//
//   listener          kAcceptTurn              the rest waits in the kernel
//   TCP, each         kConnectionReadTurn      kReadTurn for all; none while messages of it wait in the hub
//   UDP, the port     kStrangersTurn           anybody's datagrams: garbage, and the first ones of a user
//   UDP, each user    kConnectionDatagramTurn  a socket of his own, connected to where his datagrams come from: the
//                                              kernel keeps them in a buffer that no flood at the port fills
//
// What has used up its turn is not waited for until the next one (begin_turn()): a flood stays in the kernel, which
// drops it there, and costs this thread no more than its turn.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

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
  /// Goes on with what waits for its turn. Call it once states have been sent, about each millisecond.
  void begin_turn();
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
  void rest(std::function<void()> go_on) { resting_.push_back(std::move(go_on)); }
  void make_room();
  bool read_some(const PeerPointer& peer);
  void await_datagrams();
  void await_own_datagrams(const PeerPointer& peer);
  void receive_from(boost::asio::ip::udp::socket& socket, net::TokenBucket& turn);
  void take_datagram(std::span<const std::byte> datagram, const boost::asio::ip::udp::endpoint& from);
  void give_own_socket(const PeerPointer& peer);

  boost::asio::io_context& io_;
  const Clock& clock_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::ip::udp::socket udp_;
  boost::asio::steady_timer accept_again_;
  std::uint16_t port_ = 0;
  SessionHub* hub_ = nullptr;
  ConnectionHandle last_handle_ = 0;
  std::map<ConnectionHandle, PeerPointer> peers_;
  net::TokenBucket accepts_{kAcceptTurn};
  net::TokenBucket reads_{kReadTurn};
  net::TokenBucket strangers_{kStrangersTurn};
  std::vector<std::function<void()>> resting_;
  std::array<std::byte, kReadBytes> incoming_{};
};

}  // namespace tandem::server
