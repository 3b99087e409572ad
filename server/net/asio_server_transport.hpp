// The server's sockets: one TCP listener, its connections, and one UDP socket on the same port number.
//
// All code runs on the thread of the io_context, so there are no locks. There is one exception: a room thread that
// helps with sending calls ServerTransport::send_datagram().
// * TCP: bytes are passed to the kernel at once. Bytes that the kernel does not accept stay in a buffer. The session
//   hub monitors the size of this buffer and closes the connection of a peer that does not read.
// * UDP: a datagram that the kernel does not accept is discarded.
//
// A turn of this thread lasts from one sending of states to the next (begin_turn()). Each source of work has a limit
// per turn, a token bucket, so that no connection delays another:
//
//   source            limit                    effect of the limit
//   listener          kAcceptTurn              further connections wait in the kernel
//   TLS handshakes    kHandshakeTurn           first messages of further peers wait in the kernel
//   TCP connection    kConnectionReadTurn      bytes wait in the kernel, also while messages of the connection wait
//                                              in the hub. kReadTurn limits all connections together
//   UDP public port   kStrangersTurn           further datagrams are dropped. Only garbage and the first datagrams of a
//                                              user arrive at this port
//   UDP path, user's  kConnectionDatagramTurn  further datagrams wait in the kernel. A path has its own socket, so a
//                                              flood at the public port cannot fill its kernel buffer
//
// While turns are rare, each datagram of a user wakes this thread. If there are several turns per millisecond,
// datagrams are read only at the beginning of a turn, because a wake-up costs more than reading.
//
// Each TCP socket passes its bytes through a secure::TlsStream. With --insecure that stream does not encrypt, and the
// server is bound to loopback. A path is a source address of a user's datagrams. If the source address changes, the
// server sends a challenge to the new path (common/net/path_check.hpp). The old path stays in use until the challenge
// is answered, and is then replaced.
//
// A source at its limit is not polled until the next turn (begin_turn()). Datagrams of a flood beyond the limit stay in
// the kernel, which drops them without cost for this thread.
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
/// Thread  the thread that runs the io_context; send_datagram() as in ServerTransport
class AsioServerTransport final : public ServerTransport {
 public:
  /// Opens the port (0: any free one) for TCP and UDP.
  /// In      tls  null: no encryption, loopback only; otherwise it must outlive the transport
  /// Fails   std::invalid_argument: the address is invalid, or it is not loopback and there is no TLS;
  ///         std::runtime_error: the port is in use or not allowed; the message names the remedy
  AsioServerTransport(boost::asio::io_context& io, const std::string& address, std::uint16_t port, const Clock& clock,
                      const secure::TlsContext* tls);
  ~AsioServerTransport() override;

  std::uint16_t port() const { return port_; }
  /// Starts to accept connections and receive datagrams for `hub`.
  void serve(SessionHub& hub);
  void stop_accepting();
  /// Resumes reading from the sources that reached their limits in the last turn. Call it after sending states.
  void begin_turn();
  /// Reads datagrams of a few users if datagrams are read in turns. Returns true if more datagrams may be unread.
  bool read_some_users();
  /// Number of open connections, including closed ones that still send queued bytes.
  std::size_t open_connections() const { return peers_.size(); }
  /// Number of connections that ended because of a TLS error, in the handshake or later.
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
  void rest(std::function<void()> resume) { resting_.push_back(std::move(resume)); }
  void make_room();
  bool must_wait(const Peer& peer, LocalTime now) const;
  bool read_some(const PeerPointer& peer);
  void receive_bytes(const PeerPointer& peer, std::span<const std::byte> bytes);
  void await_datagrams();
  void count_turn(LocalTime now);
  void await_users();
  bool read_users();
  void read_path(const PeerPointer& peer, const std::shared_ptr<Path>& path);
  void expect_of(Path& path, ConnectionHandle peer, bool is_new, bool expects);
  void receive_datagram(std::span<const std::byte> datagram, const boost::asio::ip::udp::endpoint& from);
  void note_path(const PeerPointer& peer, const AcceptedDatagram& datagram, std::size_t bytes,
                 const boost::asio::ip::udp::endpoint& from);
  void open_path(const PeerPointer& peer, const boost::asio::ip::udp::endpoint& to);
  void challenge(Peer& peer);
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
  int users_ = -1;  ///< epoll descriptor of all users' sockets
  /// The same descriptor as users_, registered with the io_context while datagrams wake this thread.
  boost::asio::posix::stream_descriptor users_wake_;
  bool reads_in_turns_ = false;
  bool has_unread_users_ = false;  ///< whether datagrams of users may be unread since the last begin_turn()
  LocalTime turned_{}, turns_from_{};
  Duration often_{0};  ///< sum of the short gaps between turns since turns_from_
  std::array<std::byte, kReadBytes> incoming_{};
  proto::Bytes plain_;  ///< decrypted bytes of the current connection
};

}  // namespace tandem::server
