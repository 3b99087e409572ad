#include "server/net/asio_server_transport.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "common/net/socket_rules.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

/// How long a closed connection may take to read its goodbye.
constexpr Duration kLinger = std::chrono::seconds(1);
/// After an accept that failed (mostly: no file descriptor free).
constexpr Duration kAcceptAgain = std::chrono::milliseconds(100);
constexpr int kPortTries = 16;
/// Above the hub's own limit, for connections that only linger; beyond it the oldest of these goes.
constexpr std::size_t kMaxPeers = 512;
/// A user who comes from ever new places gets no socket of his own for each.
constexpr Duration kOwnSocketAgain = std::chrono::milliseconds(100);

/// What shares the limits of an address: a host, or of IPv6 the network that one host may have for itself (64 bits).
std::string name_of(const asio::ip::address& address) {
  if (!address.is_v6()) return address.to_string();
  const auto bytes = address.to_v6().to_bytes();
  return {bytes.begin(), bytes.begin() + 8};
}

}  // namespace

struct AsioServerTransport::Peer {
  Peer(tcp::socket connected, ConnectionHandle its_handle)
      : socket(std::move(connected)),
        datagrams(socket.get_executor()),
        linger(socket.get_executor()),
        handle(its_handle) {}

  tcp::socket socket;
  udp::socket datagrams;  ///< his own, once it is known where he sends from
  asio::steady_timer linger;
  ConnectionHandle handle;
  asio::ip::address address;
  std::optional<udp::endpoint> datagrams_from;
  std::optional<udp::endpoint> own_socket_to;
  LocalTime own_socket_at{};
  proto::Bytes unsent;
  bool is_waiting_to_write = false;
  bool is_closing = false;
  net::TokenBucket reads{kConnectionReadTurn};
  net::TokenBucket datagram_turn{kConnectionDatagramTurn};
};

AsioServerTransport::AsioServerTransport(asio::io_context& io, const std::string& address, std::uint16_t port,
                                         const Clock& clock)
    : io_(io), clock_(clock), acceptor_(io), udp_(io), accept_again_(io) {
  listen(net::loopback_address("cannot listen on", address), port);
}

AsioServerTransport::~AsioServerTransport() = default;

void AsioServerTransport::listen(const asio::ip::address& address, std::uint16_t port) {
  error_code error;
  // A free TCP port may be taken for UDP, so "any port" takes a few tries.
  for (int attempt = 0; attempt < (port == 0 ? kPortTries : 1); ++attempt) {
    acceptor_ = tcp::acceptor(io_);
    udp_ = udp::socket(io_);
    const tcp::endpoint wanted(address, port);
    acceptor_.open(wanted.protocol());
    acceptor_.set_option(tcp::acceptor::reuse_address(true));
    acceptor_.bind(wanted, error);
    if (!error) acceptor_.listen(tcp::acceptor::max_listen_connections, error);
    if (error) continue;
    port_ = acceptor_.local_endpoint().port();
    udp_.open(address.is_v6() ? udp::v6() : udp::v4());
    udp_.set_option(net::SharedPort(true));
    udp_.bind(udp::endpoint(address, port_), error);
    if (error) continue;
    udp_.non_blocking(true);
    return;
  }
  throw std::runtime_error("cannot listen on " + address.to_string() + ":" + std::to_string(port) + ": " +
                           net::lower_first(error.message()) +
                           "; stop the program that has this TCP or UDP port, or choose another with --port (0: any)");
}

void AsioServerTransport::serve(SessionHub& hub) {
  hub_ = &hub;
  accept();
  await_datagrams();
}

void AsioServerTransport::stop_accepting() {
  error_code ignored;
  acceptor_.close(ignored);
  accept_again_.cancel();
}

void AsioServerTransport::begin_turn() {
  for (const auto& go_on : std::exchange(resting_, {})) go_on();
}

void AsioServerTransport::accept() {
  if (!acceptor_.is_open()) return;
  if (!accepts_.has_some(clock_.now())) return rest([this] { accept(); });
  acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      accepts_.take(1, clock_.now());
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
  const auto peer = std::make_shared<Peer>(std::move(socket), ++last_handle_);
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
  if (hub_->is_behind(peer->handle) || !peer->reads.has_some(now) || !reads_.has_some(now)) {
    return rest([this, peer] { read(peer); });
  }
  peer->socket.async_wait(tcp::socket::wait_read, [this, peer](const error_code& error) {
    if (error == asio::error::operation_aborted) return;
    if (read_some(peer)) read(peer);
  });
}

/// False when the stream has ended.
bool AsioServerTransport::read_some(const PeerPointer& peer) {
  const LocalTime now = clock_.now();
  peer->reads.take(1, now);
  reads_.take(1, now);
  error_code error;
  const std::size_t size = peer->socket.read_some(asio::buffer(incoming_), error);
  if (error == asio::error::would_block) return true;
  if (error) {
    drop(peer);
    return false;
  }
  if (!peer->is_closing) hub_->on_control_bytes(peer->handle, std::span(incoming_).first(size), now);
  return true;
}

void AsioServerTransport::drop(const PeerPointer& peer) {
  error_code ignored;
  peer->linger.cancel();
  peer->socket.close(ignored);
  peer->datagrams.close(ignored);
  if (peers_.erase(peer->handle) > 0) hub_->on_disconnected(peer->handle, clock_.now());
}

void AsioServerTransport::send_control(ConnectionHandle connection, std::span<const std::byte> bytes) {
  const auto found = peers_.find(connection);
  if (found == peers_.end() || found->second->is_closing) return;
  const PeerPointer& peer = found->second;
  peer->unsent.insert(peer->unsent.end(), bytes.begin(), bytes.end());
  flush(peer);
}

// A write error is left to the pending read, which sees it too: the hub must not be called from inside its own call.
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
  error_code ignored;
  peer->is_closing = true;
  peer->datagrams.close(ignored);
  peer->linger.expires_after(kLinger);
  peer->linger.async_wait([this, peer](const error_code& stopped) {
    if (!stopped) drop(peer);
  });
  flush(peer);
}

// The peer's end of stream follows and ends the connection; closing here could discard what it has not read.
void AsioServerTransport::finish_sending(const PeerPointer& peer) {
  error_code ignored;
  peer->socket.shutdown(tcp::socket::shutdown_send, ignored);
}

bool AsioServerTransport::send_datagram(ConnectionHandle connection, std::span<const std::byte> datagram) {
  const auto found = peers_.find(connection);
  if (found == peers_.end() || !found->second->datagrams_from) return false;
  Peer& peer = *found->second;
  error_code error;
  const asio::const_buffer bytes(datagram.data(), datagram.size());
  if (peer.datagrams.is_open() && peer.own_socket_to == peer.datagrams_from) {
    peer.datagrams.send(bytes, 0, error);
  } else {
    udp_.send_to(bytes, *peer.datagrams_from, 0, error);
  }
  return !error;
}

void AsioServerTransport::await_datagrams() {
  if (!strangers_.has_some(clock_.now())) return rest([this] { await_datagrams(); });
  udp_.async_wait(udp::socket::wait_read, [this](const error_code& error) {
    if (error) return;
    receive_from(udp_, strangers_);
    await_datagrams();
  });
}

void AsioServerTransport::await_own_datagrams(const PeerPointer& peer) {
  if (!peer->datagrams.is_open()) return;
  if (!peer->datagram_turn.has_some(clock_.now())) return rest([this, peer] { await_own_datagrams(peer); });
  peer->datagrams.async_wait(udp::socket::wait_read, [this, peer](const error_code& error) {
    if (error) return;
    receive_from(peer->datagrams, peer->datagram_turn);
    await_own_datagrams(peer);
  });
}

void AsioServerTransport::receive_from(udp::socket& socket, net::TokenBucket& turn) {
  // One byte more than allowed, so that a longer datagram is seen as too long instead of being cut to size.
  std::array<std::byte, proto::kMaxDatagramBytes + 1> buffer;
  udp::endpoint from;
  while (socket.is_open() && turn.has_some(clock_.now())) {
    turn.take(1, clock_.now());
    error_code error;
    const std::size_t size = socket.receive_from(asio::buffer(buffer), from, 0, error);
    if (error == asio::error::would_block) return;
    if (!error) take_datagram(std::span(buffer).first(size), from);  // else a refusal of something sent earlier
  }
}

void AsioServerTransport::take_datagram(std::span<const std::byte> datagram, const udp::endpoint& from) {
  const auto comes_from_its_user = [this, &from](ConnectionHandle connection) {
    const auto found = peers_.find(connection);
    return found != peers_.end() && found->second->address == from.address();
  };
  const ConnectionHandle accepted = hub_->on_datagram(datagram, clock_.now(), comes_from_its_user);
  const auto found = peers_.find(accepted);
  if (found == peers_.end()) return;
  found->second->datagrams_from = from;
  if (found->second->own_socket_to != from) give_own_socket(found->second);
}

// Where it cannot be had, all goes on through the port that everybody knows.
void AsioServerTransport::give_own_socket(const PeerPointer& peer) {
  const LocalTime now = clock_.now();
  if (peer->own_socket_at != LocalTime{} && now - peer->own_socket_at < kOwnSocketAgain) return;
  peer->own_socket_at = now;
  error_code error;
  udp::socket own(io_);
  own.open(peer->datagrams_from->protocol(), error);
  if (!error) own.non_blocking(true, error);
  if (!error) own.set_option(net::SharedPort(true), error);
  if (!error) own.bind(udp_.local_endpoint(error), error);
  if (!error) own.connect(*peer->datagrams_from, error);
  if (error) return;
  peer->own_socket_to = peer->datagrams_from;
  peer->datagrams = std::move(own);
  await_own_datagrams(peer);
}

}  // namespace tandem::server
