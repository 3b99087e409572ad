#include "client/net/asio_client_transport.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <stdexcept>

#include "client/net/stamped_receive.hpp"
#include "common/net/socket_rules.hpp"

namespace tandem::client {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

/// Maximum time for which a closed connection may still send: its queue, and with simulated links the delayed bytes.
constexpr Duration kLinger = std::chrono::milliseconds(500);
/// Maximum number of datagrams read in one wake-up. Normally all waiting datagrams are read, because only the newest
/// matters.
constexpr int kDatagramsPerWake = 1024;
/// Number of successive read errors after which reading pauses for kErrorPause. A single error may be an ICMP error of
/// an earlier send, which is reported once. More errors in succession mean that the socket has failed. The loss of the
/// server is detected on the TCP connection, not here.
constexpr int kMaxErrorsPerWake = 16;
constexpr Duration kErrorPause = std::chrono::milliseconds(10);
constexpr std::uint64_t kLinksPerConnection = 4;

/// The four simulated links of one connection: up and down, each for datagrams and for control bytes.
struct Links {
  Links(const SimulatedLinks& links, std::uint64_t first_stream)
      : up(links.up, links.seed, first_stream),
        down(links.down, links.seed, first_stream + 1),
        control_up(net::SimulatedLink::reliable(links.up, links.seed, first_stream + 2)),
        control_down(net::SimulatedLink::reliable(links.down, links.seed, first_stream + 3)) {
    control_up.share_line(up);
    control_down.share_line(down);
  }

  std::optional<LocalTime> next_due() const {
    std::optional<LocalTime> earliest;
    for (const net::SimulatedLink* link : {&up, &down, &control_up, &control_down}) {
      const auto due = link->next_due();
      if (due && (!earliest || *due < *earliest)) earliest = due;
    }
    return earliest;
  }

  void set_parameters(const net::LinkParameters& to_server, const net::LinkParameters& to_client) {
    up.set_parameters(to_server);
    control_up.set_parameters(to_server);
    down.set_parameters(to_client);
    control_down.set_parameters(to_client);
  }

  net::SimulatedLink up;
  net::SimulatedLink down;
  net::SimulatedLink control_up;
  net::SimulatedLink control_down;
};

void add(net::LinkCounters& sum, const net::LinkCounters& counters) {
  sum.sent += counters.sent;
  sum.delivered += counters.delivered;
  sum.lost += counters.lost;
  sum.duplicated += counters.duplicated;
  sum.queue_full += counters.queue_full;
}

}  // namespace

struct AsioClientTransport::Connection {
  Connection(asio::io_context& io, const secure::TlsContext* tls_context)
      : stream(io), tls(tls_context), datagrams(io), error_pause(io), pump_timer(io), linger(io) {}

  tcp::socket stream;
  net::Address address;  ///< address of the TCP connection, and destination of datagrams
  secure::TlsStream tls;
  udp::socket datagrams;
  StampedReceiver receiver;  ///< reads from `datagrams`
  asio::steady_timer error_pause;
  asio::steady_timer pump_timer;
  std::optional<LocalTime> pump_due;  ///< time at which pump_timer expires; empty: the timer is not running
  asio::steady_timer linger;
  std::unique_ptr<Links> links;
  LinkTraffic before;  // traffic of the links of earlier connections
  proto::Bytes unsent;
  proto::Bytes plain;  ///< buffer for the decrypted bytes of one read
  bool is_waiting_to_write = false;
  bool is_connected = false;
  bool is_closing = false;
  bool has_sent_all = false;
  std::optional<std::string> lost_because;  // reason why the stream has ended, until it is reported
  std::array<std::byte, 64 * 1024> incoming{};
};

AsioClientTransport::AsioClientTransport(asio::io_context& io, const std::string& host, std::uint16_t port,
                                         const std::optional<secure::Trust>& trust, std::optional<SimulatedLinks> links,
                                         const Clock& clock, Resolve resolve)
    : io_(io),
      port_(port),
      tls_(trust ? std::optional(secure::TlsContext::client(*trust)) : std::nullopt),
      links_(std::move(links)),
      clock_(clock),
      connector_(
          io, host, port, trust.has_value(), std::move(resolve), clock,
          [this](tcp::socket socket, const net::Address& address) { accepted(std::move(socket), address); },
          [this](const std::string& why) {
            if (current_ != nullptr) lost(current_, why);
          }) {
  if (!links_) return;
  for (const auto& [name, link] : {std::pair("up", &links_->up), std::pair("down", &links_->down)}) {
    if (const std::string problem = link->problem(); !problem.empty()) {
      throw std::invalid_argument("simulated link " + std::string(name) + ": " + problem);
    }
  }
}

AsioClientTransport::~AsioClientTransport() = default;

bool AsioClientTransport::is_drained() const {
  return closing_.expired();
}

void AsioClientTransport::set_links(const net::LinkParameters& both) {
  if (!links_) return;
  links_->up = links_->down = both;
  if (current_ != nullptr && current_->links != nullptr) current_->links->set_parameters(both, both);
}

void AsioClientTransport::connect(LocalTime) {
  close();
  const auto connection = std::make_shared<Connection>(io_, tls_ ? &*tls_ : nullptr);
  if (links_) {
    connection->links = std::make_unique<Links>(*links_, kLinksPerConnection * connections_);
    connection->before = link_traffic_;
  }
  ++connections_;
  current_ = connection;
  connector_.start();
}

/// Replaces a connection that could not be set up by a new one. The simulated links are reused, because no bytes have
/// passed through them.
void AsioClientTransport::renew() {
  const ConnectionPointer before = current_;
  current_ = std::make_shared<Connection>(io_, tls_ ? &*tls_ : nullptr);
  current_->links = std::move(before->links);
  current_->before = before->before;
  abort(*before);
}

void AsioClientTransport::accepted(tcp::socket socket, const net::Address& address) {
  if (current_->stream.is_open()) renew();
  current_->stream = std::move(socket);
  current_->address = address;
  connected(current_);
}

void AsioClientTransport::connected(const ConnectionPointer& connection) {
  error_code error;
  connection->stream.non_blocking(true, error);
  if (!error) connection->stream.set_option(tcp::no_delay(true), error);
  if (error) {
    const std::string why = "the connection cannot be set up: " + net::lower_first(error.message());
    return set_up_failed(connection, net::AttemptFailure::kOther, why);
  }
  connection->stream.set_option(net::UnsentLimit(net::kUnsentBytes), error);
  read(connection);
  connection->tls.start(connection->unsent);
  flush(connection);
  if (connection->tls.is_plain()) established();
}

/// Called when both ends are authenticated. No further address is tried from then on.
void AsioClientTransport::established() {
  current_->is_connected = true;
  connector_.set_up();
  session_->on_connected(clock_.now());
}

void AsioClientTransport::set_up_failed(const ConnectionPointer& connection, net::AttemptFailure failure,
                                        const std::string& why) {
  if (!is_current(*connection)) return;
  renew();
  connector_.set_up_failed(failure, why);
}

void AsioClientTransport::read(const ConnectionPointer& connection) {
  connection->stream.async_read_some(
      asio::buffer(connection->incoming), [this, connection](const error_code& error, std::size_t size) {
        if (!is_current(*connection)) {
          // While closing, received bytes are discarded. The only event of interest is the end of the server's stream.
          if (error) abort(*connection);
          if (!error) read(connection);
          return;
        }
        if (error) {
          const std::string why = net::lower_first(error.message());
          if (!connection->is_connected) return set_up_failed(connection, net::AttemptFailure::kLost, why);
          return lost(connection, "the connection to " + connector_.server_name() + " was lost: " + why);
        }
        receive_bytes(connection, std::span(connection->incoming).first(size));
        read(connection);
      });
}

void AsioClientTransport::receive_bytes(const ConnectionPointer& connection, std::span<const std::byte> bytes) {
  connection->plain.clear();
  const bool is_good = connection->tls.receive(bytes, connection->plain, connection->unsent);
  flush(connection);
  if (!is_good && !connection->is_connected) {
    return set_up_failed(connection, net::AttemptFailure::kUntrusted, connection->tls.problem());
  }
  if (!connection->is_connected && connection->tls.is_established()) established();
  deliver_control(connection, connection->plain);
  if (!is_good) {
    lost(connection, "the connection to " + connector_.server_name() + " was lost: " + connection->tls.problem());
  }
}

void AsioClientTransport::deliver_control(const ConnectionPointer& connection, std::span<const std::byte> bytes) {
  if (bytes.empty() || !is_current(*connection)) return;
  if (connection->links != nullptr) {
    connection->links->control_down.send(clock_.now(), bytes);
    schedule_pump(connection);
  } else {
    session_->on_control_bytes(bytes, clock_.now());
  }
}

std::optional<secure::Exported> AsioClientTransport::exported(std::string_view label,
                                                              std::span<const std::byte> context) {
  return current_ == nullptr ? std::nullopt : current_->tls.exported(label, context);
}

void AsioClientTransport::lost(const ConnectionPointer& connection, const std::string& why) {
  connection->lost_because = why;
  report_loss_when_due(*connection);
}

// Reports the end of a stream. With a simulated link, the report waits until the stream's last bytes have passed the
// link, because they may contain a goodbye message.
void AsioClientTransport::report_loss_when_due(Connection& connection) {
  if (!connection.lost_because || !is_current(connection)) return;
  if (connection.links != nullptr && connection.links->control_down.next_due()) return;
  const std::string why = *connection.lost_because;
  const ConnectionPointer kept = std::move(current_);
  current_ = nullptr;
  abort(connection);
  session_->on_disconnected(clock_.now(), why);
}

void AsioClientTransport::set_datagram_port(std::uint16_t port) {
  if (current_ == nullptr) return;
  error_code error;
  const udp::endpoint server(current_->address, port != 0 ? port : port_);
  current_->datagrams.open(server.protocol(), error);
  if (!error) current_->datagrams.non_blocking(true, error);
  // The socket is connected, so that the kernel drops datagrams from other senders.
  if (!error) current_->datagrams.connect(server, error);
  if (error) return;
  current_->receiver = StampedReceiver(current_->datagrams.native_handle(), clock_.now());
  await_datagrams(current_);
}

void AsioClientTransport::await_datagrams(const ConnectionPointer& connection) {
  connection->datagrams.async_wait(udp::socket::wait_read, [this, connection](const error_code& error) {
    if (error || !is_current(*connection)) return;
    const bool is_failing = receive_datagrams(*connection);
    if (!is_current(*connection)) return;
    if (connection->links != nullptr) schedule_pump(connection);
    if (!is_failing) return await_datagrams(connection);
    connection->error_pause.expires_after(kErrorPause);
    connection->error_pause.async_wait([this, connection](const error_code& stopped) {
      if (!stopped && is_current(*connection)) await_datagrams(connection);
    });
  });
}

/// Reads the waiting datagrams. Returns true if the socket cannot be read.
bool AsioClientTransport::receive_datagrams(Connection& connection) {
  // The buffer is one byte longer than the longest datagram, so that a too long datagram is detected instead of
  // truncated.
  std::array<std::byte, proto::kMaxDatagramBytes + 1> buffer;
  int errors = 0;
  for (int taken = 0; taken < kDatagramsPerWake && is_current(connection); ++taken) {
    LocalTime came{};
    const auto received = connection.receiver.receive(buffer, clock_, came);
    if (!received && (errno == EAGAIN || errno == EWOULDBLOCK)) return false;
    if (!received && ++errors == kMaxErrorsPerWake) return true;
    if (!received) continue;
    errors = 0;
    const auto datagram = std::span(buffer).first(*received);
    if (connection.links != nullptr) {
      connection.links->down.send(came, datagram);
    } else {
      session_->on_datagram(datagram, came);
    }
  }
  return false;
}

void AsioClientTransport::send_control(std::span<const std::byte> bytes) {
  if (current_ == nullptr) return;
  if (current_->links != nullptr) {
    current_->links->control_up.send(clock_.now(), bytes);
    schedule_pump(current_);
    return;
  }
  current_->tls.send(bytes, current_->unsent);
  flush(current_);
}

// Write errors are ignored here, because this function may run inside a call of the session and must not call the
// session back. After a write error, the pending read fails as well and reports it.
void AsioClientTransport::flush(const ConnectionPointer& connection) {
  if (connection->is_waiting_to_write || !connection->stream.is_open()) return;
  proto::Bytes& unsent = connection->unsent;
  error_code error;
  std::size_t sent = 0;
  while (!error && sent < unsent.size()) sent += connection->stream.write_some(asio::buffer(unsent) + sent, error);
  unsent.erase(unsent.begin(), unsent.begin() + static_cast<std::ptrdiff_t>(sent));
  if (error == asio::error::would_block) {
    connection->is_waiting_to_write = true;
    connection->stream.async_wait(tcp::socket::wait_write, [this, connection](const error_code& stopped) {
      connection->is_waiting_to_write = false;
      if (!stopped) flush(connection);
    });
    return;
  }
  if (error) unsent.clear();
  finish_when_drained(*connection);
}

bool AsioClientTransport::send_datagram(std::span<const std::byte> datagram) {
  if (current_ == nullptr || !current_->datagrams.is_open()) return false;
  if (current_->links != nullptr) {
    current_->links->up.send(clock_.now(), datagram);
    schedule_pump(current_);
    return true;
  }
  error_code error;
  current_->datagrams.send(asio::buffer(datagram.data(), datagram.size()), 0, error);
  return !error;
}

std::size_t AsioClientTransport::queued_control_bytes() const {
  if (current_ == nullptr) return 0;
  const std::size_t before_the_line =
      current_->links != nullptr ? current_->links->control_up.queued_bytes(clock_.now()) : 0;
  return before_the_line + current_->unsent.size();
}

void AsioClientTransport::close() {
  connector_.cancel();
  if (current_ == nullptr) return;
  const ConnectionPointer connection = std::move(current_);
  current_ = nullptr;
  if (!connection->is_connected) {
    abort(*connection);
    return;
  }
  error_code ignored;
  connection->datagrams.close(ignored);
  connection->error_pause.cancel();
  connection->is_closing = true;
  closing_ = connection;
  connection->linger.expires_after(kLinger);
  connection->linger.async_wait([connection](const error_code& stopped) {
    if (!stopped) abort(*connection);
  });
  finish_when_drained(*connection);
}

// Once everything is sent, closes the sending half only. The server closes its half when it has read everything.
void AsioClientTransport::finish_when_drained(Connection& connection) {
  if (!connection.is_closing || !connection.unsent.empty()) return;
  if (connection.links != nullptr && connection.links->control_up.next_due()) return;
  if (!std::exchange(connection.has_sent_all, true)) connection.tls.close(connection.unsent);
  error_code ignored;
  while (!ignored && !connection.unsent.empty()) {
    const std::size_t sent = connection.stream.write_some(asio::buffer(connection.unsent), ignored);
    connection.unsent.erase(connection.unsent.begin(), connection.unsent.begin() + static_cast<std::ptrdiff_t>(sent));
  }
  connection.stream.shutdown(tcp::socket::shutdown_send, ignored);
}

void AsioClientTransport::abort(Connection& connection) {
  error_code ignored;
  connection.stream.close(ignored);
  connection.datagrams.close(ignored);
  connection.error_pause.cancel();
  connection.pump_timer.cancel();
  connection.linger.cancel();
}

void AsioClientTransport::schedule_pump(const ConnectionPointer& connection) {
  const auto due = connection->links->next_due();
  if (!due) return;
  if (connection->pump_due == *due) return;
  connection->pump_due = *due;
  connection->pump_timer.expires_after(*due - clock_.now());
  connection->pump_timer.async_wait([this, connection](const error_code& moved) {
    if (!moved) pump(connection);
  });
}

void AsioClientTransport::pump(const ConnectionPointer& connection) {
  connection->pump_timer.cancel();
  connection->pump_due.reset();
  Links& links = *connection->links;
  const LocalTime now = clock_.now();
  while (const auto bytes = links.control_up.receive(now)) {
    connection->tls.send(*bytes, connection->unsent);
  }
  flush(connection);
  while (const auto datagram = links.up.receive(now)) {
    error_code lost_on_the_way;
    if (connection->datagrams.is_open()) connection->datagrams.send(asio::buffer(*datagram), 0, lost_on_the_way);
  }
  deliver_due(*connection, now);
  if (is_current(*connection)) count_links(*connection);
  if (connection->stream.is_open()) schedule_pump(connection);
}

void AsioClientTransport::deliver_due(Connection& connection, LocalTime now) {
  Links& links = *connection.links;
  while (const auto bytes = links.control_down.receive(now)) {
    if (is_current(connection)) session_->on_control_bytes(*bytes, clock_.now());
  }
  // The session receives each datagram with the time at which it was due, even if this call is late.
  for (auto due = links.down.next_due(); due && *due <= now; due = links.down.next_due()) {
    const auto datagram = links.down.receive(now);
    if (datagram && is_current(connection)) session_->on_datagram(*datagram, *due);
  }
  report_loss_when_due(connection);
}

void AsioClientTransport::count_links(const Connection& connection) {
  link_traffic_ = connection.before;
  add(link_traffic_.up, connection.links->up.counters());
  add(link_traffic_.down, connection.links->down.counters());
  add(link_traffic_.control_up, connection.links->control_up.counters());
  add(link_traffic_.control_down, connection.links->control_down.counters());
}

}  // namespace tandem::client
