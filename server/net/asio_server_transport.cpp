#include "server/net/asio_server_transport.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <optional>
#include <stdexcept>

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
/// Datagrams taken at one wake-up, so that a flood cannot keep TCP and the timers waiting.
constexpr int kDatagramsPerWake = 256;
constexpr int kPortTries = 16;
/// Above the hub's own limit, for connections that only linger; more are closed without a word.
constexpr std::size_t kMaxPeers = 512;

}  // namespace

struct AsioServerTransport::Peer {
  Peer(tcp::socket connected, ConnectionHandle its_handle)
      : socket(std::move(connected)), linger(socket.get_executor()), handle(its_handle) {}

  tcp::socket socket;
  asio::steady_timer linger;
  ConnectionHandle handle;
  asio::ip::address address;
  std::optional<udp::endpoint> datagrams_from;
  proto::Bytes unsent;
  bool is_waiting_to_write = false;
  bool is_closing = false;
  std::array<std::byte, 16 * 1024> incoming{};
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

void AsioServerTransport::accept() {
  acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
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
  if (peers_.size() >= kMaxPeers) return;
  error_code error;
  const auto peer = std::make_shared<Peer>(std::move(socket), ++last_handle_);
  peer->address = peer->socket.remote_endpoint(error).address();
  if (!error) peer->socket.non_blocking(true, error);
  if (!error) peer->socket.set_option(tcp::no_delay(true), error);
  if (error) return;
  peer->socket.set_option(net::UnsentLimit(net::kUnsentBytes), error);
  peers_[peer->handle] = peer;
  hub_->on_connected(peer->handle, clock_.now());
  read(peer);
}

void AsioServerTransport::read(const PeerPointer& peer) {
  peer->socket.async_read_some(asio::buffer(peer->incoming), [this, peer](const error_code& error, std::size_t size) {
    if (error == asio::error::operation_aborted) return;
    if (error) {
      drop(peer);
      return;
    }
    if (!peer->is_closing) {
      hub_->on_control_bytes(peer->handle, std::span(peer->incoming).first(size), clock_.now());
    }
    read(peer);
  });
}

void AsioServerTransport::drop(const PeerPointer& peer) {
  error_code ignored;
  peer->linger.cancel();
  peer->socket.close(ignored);
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
  peer->is_closing = true;
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
  error_code error;
  udp_.send_to(asio::buffer(datagram.data(), datagram.size()), *found->second->datagrams_from, 0, error);
  return !error;
}

void AsioServerTransport::await_datagrams() {
  udp_.async_wait(udp::socket::wait_read, [this](const error_code& error) {
    if (error) return;
    receive_datagrams();
    await_datagrams();
  });
}

void AsioServerTransport::receive_datagrams() {
  // One byte more than allowed, so that a longer datagram is seen as too long instead of being cut to size.
  std::array<std::byte, proto::kMaxDatagramBytes + 1> buffer;
  udp::endpoint from;
  for (int taken = 0; taken < kDatagramsPerWake; ++taken) {
    error_code error;
    const std::size_t size = udp_.receive_from(asio::buffer(buffer), from, 0, error);
    if (error == asio::error::would_block) return;
    if (error) continue;
    const auto comes_from_its_user = [this, &from](ConnectionHandle connection) {
      const auto found = peers_.find(connection);
      return found != peers_.end() && found->second->address == from.address();
    };
    const ConnectionHandle accepted =
        hub_->on_datagram(std::span(buffer).first(size), clock_.now(), comes_from_its_user);
    if (const auto found = peers_.find(accepted); found != peers_.end()) found->second->datagrams_from = from;
  }
}

}  // namespace tandem::server
