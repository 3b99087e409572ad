#include "server/net/asio_server_transport.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "common/net/host_port.hpp"
#include "common/net/socket_rules.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

/// Time for which a closed connection may still send queued bytes, so that its peer can read the goodbye message.
constexpr Duration kLinger = std::chrono::seconds(1);
/// Pause after a failed accept. The usual cause is that no file descriptor is free.
constexpr Duration kAcceptAgain = std::chrono::milliseconds(100);
constexpr int kPortTries = 16;
/// Limit of connections. It exceeds the hub's limit, because closed connections linger. At the limit the connection
/// that has lingered longest is dropped.
constexpr std::size_t kMaxPeers = 512;
/// Minimum interval between two new paths of a user. A path is a source address of the user's datagrams.
constexpr Duration kNewPathAgain = std::chrono::milliseconds(100);
constexpr Duration kCountTurnsFor = std::chrono::milliseconds(10);
/// Longest gap between two turns of the io thread that counts as short. A turn begins after each sending of states. If
/// most gaps are short, received datagrams wait in the kernel until the next turn.
constexpr Duration kOftenEnough = std::chrono::microseconds(300);
/// Number of users whose datagrams are read before the next check for new states. It is small, so that new states are
/// not delayed by the datagrams of all users.
constexpr std::size_t kUsersAtOnce = 4;
// Fractions of the time that consists of short gaps between turns (hysteresis). Above kShareToBegin, datagrams are read
// once per turn. Below kShareToGoOn, they are read on arrival again.
constexpr double kShareToBegin = 0.8, kShareToGoOn = 0.6;

/// Returns the name under which limits of an address are counted: the address itself, or for IPv6 its /64 network. A
/// single host may own all addresses of a /64 network.
std::string name_of(const asio::ip::address& address) {
  if (!address.is_v6()) return address.to_string();
  // A listener on "::" also receives IPv4 connections.
  if (address.to_v6().is_v4_mapped()) {
    return asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6()).to_string();
  }
  const auto bytes = address.to_v6().to_bytes();
  return {bytes.begin(), bytes.begin() + 8};
}

}  // namespace

/// Path of a user's datagrams, identified by their source address.
struct AsioServerTransport::Path {
  Path(udp::endpoint from, std::uint64_t number) : to(std::move(from)), check(number) {}
  ~Path() { close(); }
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;

  bool is_open() const { return socket >= 0; }
  void close() {
    if (is_open()) ::close(std::exchange(socket, -1));
  }

  int socket = -1;  ///< descriptor of a socket connected to the user; -1: the public port is used
  udp::endpoint to;
  net::PathCheck check;
};

struct AsioServerTransport::Peer {
  Peer(tcp::socket connected, ConnectionHandle its_handle, const secure::TlsContext* tls_context)
      : socket(std::move(connected)), linger(socket.get_executor()), handle(its_handle), tls(tls_context) {}

  void close_paths() {
    for (const auto& one : {path, new_path}) {
      if (one != nullptr) one->close();
    }
  }
  /// Returns the path for states: the checked path, or before the first check the path that is being checked.
  Path* destination() const { return path != nullptr ? path.get() : new_path.get(); }

  tcp::socket socket;
  std::shared_ptr<Path> path;      ///< path that has answered the challenge
  std::shared_ptr<Path> new_path;  ///< path that has not answered the challenge yet
  LocalTime new_path_at{};
  asio::steady_timer linger;
  ConnectionHandle handle;
  asio::ip::address address;
  secure::TlsStream tls;
  proto::Bytes unsent;
  bool is_waiting_to_write = false;
  bool is_closing = false;
  net::TokenBucket reads{kConnectionReadTurn};
  net::TokenBucket datagram_turn{kConnectionDatagramTurn};
};

AsioServerTransport::AsioServerTransport(asio::io_context& io, const std::string& address, std::uint16_t port,
                                         const Clock& clock, const secure::TlsContext* tls)
    : io_(io), clock_(clock), tls_(tls), acceptor_(io), udp_(io), accept_again_(io), users_wake_(io) {
  listen(net::numeric_address("cannot listen on", address, tls != nullptr), port);
  users_ = epoll_create1(EPOLL_CLOEXEC);
  if (users_ < 0) throw std::system_error(errno, std::generic_category(), "cannot wait for users' datagrams");
  users_wake_.assign(users_);
}

AsioServerTransport::~AsioServerTransport() {
  if (!users_wake_.is_open()) ::close(users_);
}

void AsioServerTransport::listen(const asio::ip::address& address, std::uint16_t port) {
  error_code error;
  // A listener on "::" accepts IPv4 too, regardless of the machine's default (net.ipv6.bindv6only).
  const auto accept_both_families = [&address, &error](auto& socket) {
    if (!error && address.is_v6()) socket.set_option(asio::ip::v6_only(false), error);
  };
  // A TCP port that is free may be in use for UDP, so the choice of any free port may need several attempts.
  for (int attempt = 0; attempt < (port == 0 ? kPortTries : 1); ++attempt) {
    acceptor_ = tcp::acceptor(io_);
    udp_ = udp::socket(io_);
    const tcp::endpoint wanted(address, port);
    acceptor_.open(wanted.protocol(), error);
    if (error) break;
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    accept_both_families(acceptor_);
    if (!error) acceptor_.bind(wanted, error);
    if (!error) acceptor_.listen(tcp::acceptor::max_listen_connections, error);
    if (error) continue;
    port_ = acceptor_.local_endpoint().port();
    udp_.open(address.is_v6() ? udp::v6() : udp::v4());
    udp_.set_option(net::SharedPort(true));
    accept_both_families(udp_);
    if (!error) udp_.bind(udp::endpoint(address, port_), error);
    if (error) continue;
    udp_.non_blocking(true);
    return;
  }
  const bool is_taken = error == asio::error::address_in_use || error == asio::error::access_denied;
  throw std::runtime_error(
      "cannot listen on " + net::text_of(address.to_string(), port) + ": " + net::lower_first(error.message()) +
      (is_taken ? "; stop the program that has this TCP or UDP port, or choose another with --port "
                  "(0: any)"
                : "; give an address that this machine has with --bind"));
}

void AsioServerTransport::serve(SessionHub& hub) {
  hub_ = &hub;
  accept();
  await_datagrams();
  await_users();
}

void AsioServerTransport::stop_accepting() {
  error_code ignored;
  acceptor_.close(ignored);
  accept_again_.cancel();
}

void AsioServerTransport::begin_turn() {
  count_turn(clock_.now());
  for (const auto& resume : std::exchange(resting_, {})) resume();
  has_unread_users_ = reads_in_turns_;
}

bool AsioServerTransport::read_some_users() {
  if (has_unread_users_) has_unread_users_ = read_users() && reads_in_turns_;
  return has_unread_users_;
}

/// Decides whether users' datagrams are read in turns or on arrival, by the fraction of the time that consists of short
/// gaps between turns. The number of turns would not be a safe criterion. If turns come in bursts, a datagram that
/// waits for the next burst misses its step.
void AsioServerTransport::count_turn(LocalTime now) {
  const Duration gap = now - std::exchange(turned_, now);
  if (gap <= kOftenEnough) often_ += gap;
  if (now < turns_from_ + kCountTurnsFor) return;
  const double share =
      to_seconds(std::exchange(often_, Duration{0})) / to_seconds(now - std::exchange(turns_from_, now));
  const bool in_turns = share > (reads_in_turns_ ? kShareToGoOn : kShareToBegin);
  if (in_turns == reads_in_turns_) return;
  reads_in_turns_ = in_turns;
  if (in_turns) {
    users_wake_.release();
  } else {
    users_wake_.assign(users_);
    await_users();
  }
}

void AsioServerTransport::accept() {
  if (!acceptor_.is_open()) return;
  if (!accepts_.has_some(clock_.now())) return rest([this] { accept(); });
  acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      accepts_.consume(1, clock_.now());
      welcome(std::move(socket));
      accept();
      return;
    }
    accept_again_.expires_after(kAcceptAgain);
    accept_again_.async_wait([this](const error_code& stopped) {
      if (!stopped) accept();
    });
  });
}

void AsioServerTransport::welcome(tcp::socket socket) {
  make_room();
  error_code error;
  const auto peer = std::make_shared<Peer>(std::move(socket), ++last_handle_, tls_);
  peer->address = peer->socket.remote_endpoint(error).address();
  if (!error) peer->socket.non_blocking(true, error);
  if (!error) peer->socket.set_option(tcp::no_delay(true), error);
  if (error) return;
  peer->socket.set_option(net::UnsentLimit(net::kUnsentBytes), error);
  peers_[peer->handle] = peer;
  hub_->on_connected(peer->handle, clock_.now(), name_of(peer->address));
  read(peer);
}

void AsioServerTransport::make_room() {
  if (peers_.size() < kMaxPeers) return;
  const auto oldest = std::ranges::find_if(peers_, [](const auto& entry) { return entry.second->is_closing; });
  if (oldest != peers_.end()) drop(PeerPointer(oldest->second));
}

void AsioServerTransport::read(const PeerPointer& peer) {
  const LocalTime now = clock_.now();
  if (!peer->socket.is_open()) return;
  if (hub_->is_behind(peer->handle) || !peer->reads.has_some(now) || !reads_.has_some(now) || must_wait(*peer, now)) {
    return rest([this, peer] { read(peer); });
  }
  peer->socket.async_wait(tcp::socket::wait_read, [this, peer](const error_code& error) {
    if (error == asio::error::operation_aborted) return;
    if (read_some(peer)) read(peer);
  });
}

/// Returns whether the peer's TLS handshake must wait for the next turn, because the handshakes of this turn are used
/// up.
bool AsioServerTransport::must_wait(const Peer& peer, LocalTime now) const {
  return tls_ != nullptr && !peer.tls.has_answered() && !handshakes_.has_some(now);
}

/// Reads once from a connection. Returns false when its stream has ended.
bool AsioServerTransport::read_some(const PeerPointer& peer) {
  const LocalTime now = clock_.now();
  if (must_wait(*peer, now)) return true;  // other peers have consumed the handshakes of this turn
  peer->reads.consume(1, now);
  reads_.consume(1, now);
  error_code error;
  const std::size_t size = peer->socket.read_some(asio::buffer(incoming_), error);
  if (error == asio::error::would_block) return true;
  if (error) {
    drop(peer);
    return false;
  }
  receive_bytes(peer, std::span(incoming_).first(size));
  return true;
}

void AsioServerTransport::receive_bytes(const PeerPointer& peer, std::span<const std::byte> bytes) {
  if (peer->is_closing) return;
  plain_.clear();
  const bool had_answered = peer->tls.has_answered();
  const bool is_good = peer->tls.receive(bytes, plain_, peer->unsent);
  // An incomplete TLS greeting costs little time, so it does not count against the limit of handshakes.
  if (peer->tls.has_answered() && !had_answered) handshakes_.consume(1, clock_.now());
  if (peer->unsent.size() > kMaxQueuedControlBytes) return drop(peer);
  flush(peer);
  if (!plain_.empty()) hub_->on_control_bytes(peer->handle, plain_, clock_.now());
  if (is_good) return;
  ++failed_handshakes_;
  hub_->on_disconnected(peer->handle, clock_.now(), peer->tls.problem());
  close(peer->handle);  // close() sends queued bytes first, so the peer can read the reason
}

void AsioServerTransport::drop(const PeerPointer& peer) {
  error_code ignored;
  peer->linger.cancel();
  peer->socket.close(ignored);
  peer->close_paths();
  if (peers_.erase(peer->handle) > 0) hub_->on_disconnected(peer->handle, clock_.now());
}

void AsioServerTransport::send_control(ConnectionHandle connection, std::span<const std::byte> bytes) {
  const auto found = peers_.find(connection);
  if (found == peers_.end() || found->second->is_closing) return;
  const PeerPointer& peer = found->second;
  peer->tls.send(bytes, peer->unsent);
  flush(peer);
}

std::optional<secure::Exported> AsioServerTransport::exported(ConnectionHandle connection, std::string_view label,
                                                              std::span<const std::byte> context) {
  const auto found = peers_.find(connection);
  return found == peers_.end() ? std::nullopt : found->second->tls.exported(label, context);
}

// Sends queued bytes. A write error is ignored here, because the pending read fails too. The read reports the error at
// a time when no function of the hub is running.
void AsioServerTransport::flush(const PeerPointer& peer) {
  if (peer->is_waiting_to_write || !peer->socket.is_open()) return;
  error_code error;
  std::size_t sent = 0;
  while (!error && sent < peer->unsent.size()) {
    sent += peer->socket.write_some(asio::buffer(peer->unsent) + sent, error);
  }
  peer->unsent.erase(peer->unsent.begin(), peer->unsent.begin() + static_cast<std::ptrdiff_t>(sent));
  if (error == asio::error::would_block) {
    peer->is_waiting_to_write = true;
    peer->socket.async_wait(tcp::socket::wait_write, [this, peer](const error_code& stopped) {
      peer->is_waiting_to_write = false;
      if (!stopped) flush(peer);
    });
    return;
  }
  if (error) peer->unsent.clear();
  if (peer->is_closing) finish_sending(peer);
}

std::size_t AsioServerTransport::queued_control_bytes(ConnectionHandle connection) const {
  const auto found = peers_.find(connection);
  return found == peers_.end() ? 0 : found->second->unsent.size();
}

void AsioServerTransport::close(ConnectionHandle connection) {
  const auto found = peers_.find(connection);
  if (found == peers_.end() || found->second->is_closing) return;
  const PeerPointer peer = found->second;
  peer->is_closing = true;
  peer->close_paths();
  peer->tls.close(peer->unsent);
  peer->linger.expires_after(kLinger);
  peer->linger.async_wait([this, peer](const error_code& stopped) {
    if (!stopped) drop(peer);
  });
  flush(peer);
}

// Ends the sending direction only. The connection is closed when the peer ends its stream, because closing it now could
// discard bytes that the peer has not read.
void AsioServerTransport::finish_sending(const PeerPointer& peer) {
  error_code ignored;
  peer->socket.shutdown(tcp::socket::shutdown_send, ignored);
}

bool AsioServerTransport::send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) {
  const auto found = peers_.find(connection);
  if (found == peers_.end()) return false;
  Path* const path = found->second->destination();
  return path != nullptr && send_on(*path, datagram);
}

bool AsioServerTransport::send_on(Path& path, std::span<const std::byte> datagram) {
  if (!path.check.consume(datagram.size())) return false;
  error_code error;
  if (path.is_open()) return ::send(path.socket, datagram.data(), datagram.size(), MSG_NOSIGNAL) >= 0;
  udp_.send_to(asio::const_buffer(datagram.data(), datagram.size()), path.to, 0, error);
  return !error;
}

void AsioServerTransport::await_datagrams() {
  if (!strangers_.has_some(clock_.now())) return rest([this] { await_datagrams(); });
  udp_.async_wait(udp::socket::wait_read, [this](const error_code& error) {
    if (error) return;
    // With one byte more than the largest datagram, a datagram that is too long is detected instead of being truncated.
    std::array<std::byte, proto::kMaxDatagramBytes + 1> buffer;
    udp::endpoint from;
    error_code problem;
    while (problem != asio::error::would_block && strangers_.has_some(clock_.now())) {
      strangers_.consume(1, clock_.now());
      const std::size_t size = udp_.receive_from(asio::buffer(buffer), from, 0, problem);
      if (!problem) receive_datagram(std::span(buffer).first(size), from);  // a problem is the error of an earlier send
    }
    await_datagrams();
  });
}

void AsioServerTransport::await_users() {
  users_wake_.async_wait(asio::posix::stream_descriptor::wait_read, [this](const error_code& error) {
    if (error) return;
    read_users();
    if (!reads_in_turns_) await_users();
  });
}

/// Reads datagrams of up to kUsersAtOnce users. Returns true if more may be unread.
bool AsioServerTransport::read_users() {
  std::array<epoll_event, kUsersAtOnce> ready;
  const int count = epoll_wait(users_, ready.data(), static_cast<int>(ready.size()), 0);
  for (int i = 0; i < count; ++i) {
    const auto found = peers_.find(ready[static_cast<std::size_t>(i)].data.u64);
    if (found == peers_.end()) continue;
    const PeerPointer peer = found->second;
    for (const auto& path : {peer->path, peer->new_path}) {
      if (path != nullptr) read_path(peer, path);
    }
  }
  return count == static_cast<int>(ready.size());
}

void AsioServerTransport::read_path(const PeerPointer& peer, const std::shared_ptr<Path>& path) {
  // Two buffers are used, although usually only one datagram is unread. One system call then also shows that there is
  // no further datagram; a second call would cost as much as a datagram.
  constexpr std::size_t kAtOnce = 2;
  std::array<std::array<std::byte, proto::kMaxDatagramBytes + 1>, kAtOnce> buffers;
  std::array<iovec, kAtOnce> places{};
  std::array<mmsghdr, kAtOnce> datagrams{};
  for (std::size_t i = 0; i < kAtOnce; ++i) {
    places[i] = {buffers[i].data(), buffers[i].size()};
    datagrams[i].msg_hdr.msg_iov = &places[i];
    datagrams[i].msg_hdr.msg_iovlen = 1;
  }
  while (path->is_open()) {
    const LocalTime now = clock_.now();
    if (!peer->datagram_turn.has_some(now)) {
      expect_of(*path, peer->handle, false, false);
      return rest([this, peer, path] { expect_of(*path, peer->handle, false, true); });
    }
    const int count = ::recvmmsg(path->socket, datagrams.data(), kAtOnce, MSG_DONTWAIT, nullptr);
    if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    // A call that reports the error of an earlier send costs as much as a datagram, so it counts as one.
    peer->datagram_turn.consume(std::max(1, count), now);
    for (int i = 0; i < count && path->is_open(); ++i) {
      const auto at = static_cast<std::size_t>(i);
      receive_datagram(std::span(buffers[at]).first(datagrams[at].msg_len), path->to);
    }
    if (count >= 0 && count < static_cast<int>(kAtOnce)) return;
  }
}

/// Enables or disables epoll events for a path.
void AsioServerTransport::expect_of(Path& path, ConnectionHandle peer, bool is_new, bool expects) {
  if (!path.is_open()) return;
  epoll_event event{};
  event.events = expects ? static_cast<std::uint32_t>(EPOLLIN) : 0U;
  event.data.u64 = peer;
  // If epoll cannot add the socket for lack of memory, the path uses the public port.
  if (epoll_ctl(users_, is_new ? EPOLL_CTL_ADD : EPOLL_CTL_MOD, path.socket, &event) != 0) path.close();
}

void AsioServerTransport::receive_datagram(std::span<const std::byte> datagram, const udp::endpoint& from) {
  // Without encryption, the source address is the only proof that a datagram belongs to a user.
  const auto comes_from_its_user = [this, &from](ConnectionHandle connection) {
    const auto found = peers_.find(connection);
    return found != peers_.end() && (tls_ != nullptr || found->second->address == from.address());
  };
  const AcceptedDatagram accepted = hub_->on_datagram(datagram, clock_.now(), comes_from_its_user);
  const auto found = peers_.find(accepted.connection);
  if (found != peers_.end()) note_path(PeerPointer(found->second), accepted, datagram.size(), from);
}

void AsioServerTransport::note_path(const PeerPointer& peer, const AcceptedDatagram& datagram, std::size_t bytes,
                                    const udp::endpoint& from) {
  if (peer->path != nullptr && peer->path->to == from) return;
  if (peer->new_path == nullptr || peer->new_path->to != from) open_path(peer, from);
  if (peer->new_path == nullptr || peer->new_path->to != from) return;
  net::PathCheck& check = peer->new_path->check;
  check.note_received(bytes);
  if (datagram.path_answer) check.note_answer(*datagram.path_answer);
  if (tls_ == nullptr) check.trust();
  if (!check.is_valid()) return challenge(*peer);
  if (peer->path != nullptr) peer->path->close();
  peer->path = std::exchange(peer->new_path, nullptr);
}

/// Opens a new path, unless the last one was opened less than kNewPathAgain ago.
void AsioServerTransport::open_path(const PeerPointer& peer, const udp::endpoint& to) {
  const LocalTime now = clock_.now();
  if (peer->new_path_at != LocalTime{} && now - peer->new_path_at < kNewPathAgain) return;
  peer->new_path_at = now;
  const auto path = std::make_shared<Path>(to, secure::random_u64());
  if (peer->new_path != nullptr) peer->new_path->close();
  error_code error;
  udp::socket own(io_);
  // The socket is bound to the local address of the TCP connection, because a machine may have several addresses and
  // the user expects this one.
  const udp::endpoint here(peer->socket.local_endpoint(error).address(), port_);
  if (!error) own.open(to.protocol(), error);
  if (!error) own.non_blocking(true, error);
  if (!error) own.set_option(net::SharedPort(true), error);
  if (!error && to.address().is_v6()) own.set_option(asio::ip::v6_only(false), error);
  if (!error) own.bind(here, error);
  if (!error) own.connect(to, error);
  // If any of these calls has failed, the public port is used instead. Asio releases the socket, because it would
  // otherwise wake the thread for each datagram.
  if (!error) path->socket = own.release(error);
  peer->new_path = path;
  expect_of(*path, peer->handle, true, true);
}

void AsioServerTransport::challenge(Peer& peer) {
  Path& path = *peer.new_path;
  const LocalTime now = clock_.now();
  if (!path.check.is_due(now)) return;
  const auto question = hub_->path_challenge(peer.handle, path.check.number(), now);
  if (!question.empty()) send_on(path, question);
}

}  // namespace tandem::server
