// The server's sockets: one TCP listener, its connections, and one UDP socket on the same port number.
//
// Everything runs on the one thread that runs the io_context, so there is no lock here; datagrams may be sent by who helps it
// (ServerTransport::send_datagram()). TCP writes go to the kernel
// at once as far as it takes them and the rest waits in a buffer whose size the session hub watches: a reader that
// does not read is ended by the hub, never waited for. UDP is freshest-only: what the kernel does not take is lost.
//
// Nobody holds up anybody:
//
//   listener          kAcceptTurn              the rest waits in the kernel
//   TLS, begun        kHandshakeTurn           the first words of the others wait in the kernel
//   TCP, each         kConnectionReadTurn      kReadTurn for all; none while messages of it wait in the hub
//   UDP, the port     kStrangersTurn           anybody's datagrams: garbage, and the first ones of a user
//   UDP, each user    kConnectionDatagramTurn  a socket of his own, connected to where his datagrams come from: the
//                                              kernel keeps them in a buffer that no flood at the port fills
//
// Where turns are rare a user's datagram wakes this thread; where they come several times a millisecond all are read at the next
// one, for waking up costs more than reading does.
//
// What passes on the TCP sockets goes through a secure::TlsStream each; with --insecure that leaves bytes as they are, and
// only then is the server bound to loopback. Where a user's datagrams come from is a path: a new one is used beside the old
// until it has said back what the server asks (common/net/path_check.hpp), then instead of it.
//
// What has used up its turn is not waited for until the next one (begin_turn()): a flood stays in the kernel, which
// drops it there, and costs this thread no more than its turn.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/time.hpp"
#include "common/net/path_check.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::server {

/// ServerTransport over Asio.
///
/// Thread  the one that runs the io_context; send_datagram() as ServerTransport has it
class AsioServerTransport final : public ServerTransport {
 public:
  /// Opens the port (0: any free one) for TCP and UDP.
  /// In      tls  null: nothing is encrypted, loopback only; else outlives the transport
  /// Fails   std::invalid_argument: not an address, or not loopback without TLS;
  ///         std::runtime_error: port in use or not allowed, with the remedy
  AsioServerTransport(boost::asio::io_context& io, const std::string& address, std::uint16_t port, const Clock& clock,
                      const secure::TlsContext* tls);
  ~AsioServerTransport() override;

  std::uint16_t port() const { return port_; }
  /// Starts to accept and to receive for `hub`.
  void serve(SessionHub& hub);
  void stop_accepting();
  /// Goes on with what waits for its turn. Call it whenever states have been sent.
  void begin_turn();
  /// Reads what some users have sent, where their datagrams wait for turns. Out: there may be more.
  bool read_some_users();
  /// Connections that are open, those that only send what is queued included.
  std::size_t open_connections() const { return peers_.size(); }
  /// Connections that ended because their TLS did not come about or broke.
  std::uint64_t failed_handshakes() const { return failed_handshakes_; }

  void send_control(ConnectionHandle connection, std::span<const std::byte> bytes) override;
  bool send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) override;
  std::size_t queued_control_bytes(ConnectionHandle connection) const override;
  std::optional<secure::Exported> exported(ConnectionHandle connection, std::string_view label,
                                           std::span<const std::byte> context) override;
  void close(ConnectionHandle connection) override;

 private:
  struct Path;
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
  bool must_wait(const Peer& peer, LocalTime now) const;
  bool read_some(const PeerPointer& peer);
  void take_bytes(const PeerPointer& peer, std::span<const std::byte> bytes);
  void await_datagrams();
  void count_turn(LocalTime now);
  void await_users();
  bool read_users();
  void read_path(const PeerPointer& peer, const std::shared_ptr<Path>& path);
  void expect_of(Path& path, ConnectionHandle peer, bool is_new, bool expects);
  void take_datagram(std::span<const std::byte> datagram, const boost::asio::ip::udp::endpoint& from);
  void note_path(const PeerPointer& peer, const AcceptedDatagram& datagram, std::size_t bytes,
                 const boost::asio::ip::udp::endpoint& from);
  void open_path(const PeerPointer& peer, const boost::asio::ip::udp::endpoint& to);
  void ask(Peer& peer);
  bool send_on(Path& path, std::span<const std::byte> datagram);

  boost::asio::io_context& io_;
  const Clock& clock_;
  const secure::TlsContext* tls_;
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
  net::TokenBucket handshakes_{kHandshakeTurn};
  std::uint64_t failed_handshakes_ = 0;
  std::vector<std::function<void()>> resting_;
  int users_ = -1;  ///< epoll's descriptor of all users' sockets
  /// Of the same, while their datagrams wake this thread.
  boost::asio::posix::stream_descriptor users_wake_;
  bool reads_in_turns_ = false;
  bool has_unread_users_ = false;  ///< of this turn
  LocalTime turned_{}, turns_from_{};
  Duration often_{0};  ///< since turns_from_, in which turns came often
  std::array<std::byte, kReadBytes> incoming_{};
  proto::Bytes plain_;  ///< of the connection that is being read
};

}  // namespace tandem::server
