#include "lab/session/virtual_network.hpp"

#include <utility>

namespace tandem::lab {
namespace {

// Kinds of packets by which a reliable link simulates a TCP connection. Each packet has a header with its kind and the
// number of the connection attempt.
enum class Chunk : std::uint8_t { kConnect, kAccepted, kBytes, kEnd };
constexpr std::size_t kChunkHeaderBytes = 5;

void send_chunk(net::SimulatedLink& link, LocalTime now, Chunk kind, std::uint32_t attempt,
                std::span<const std::byte> bytes = {}) {
  std::vector<std::byte> chunk;
  chunk.reserve(kChunkHeaderBytes + bytes.size());
  chunk.push_back(static_cast<std::byte>(kind));
  for (int shift = 0; shift < 32; shift += 8) chunk.push_back(static_cast<std::byte>(attempt >> shift));
  chunk.insert(chunk.end(), bytes.begin(), bytes.end());
  link.send(now, chunk);
}

Chunk kind_of(std::span<const std::byte> chunk) {
  return static_cast<Chunk>(chunk[0]);
}

std::uint32_t attempt_of(std::span<const std::byte> chunk) {
  std::uint32_t attempt = 0;
  for (std::size_t i = 0; i < 4; ++i) attempt |= std::to_integer<std::uint32_t>(chunk[1 + i]) << (8 * i);
  return attempt;
}

void collect_from(net::SimulatedLink& link, LocalTime now, std::vector<std::vector<std::byte>>& arrived) {
  while (auto packet = link.receive(now)) arrived.push_back(std::move(*packet));
}

std::span<const std::byte> bytes_of(std::span<const std::byte> chunk) {
  return chunk.subspan(kChunkHeaderBytes);
}

}  // namespace

VirtualClientTransport::VirtualClientTransport(const Clock& clock, net::LinkParameters up, net::LinkParameters down,
                                               std::uint64_t seed, std::uint64_t first_stream)
    : clock_(clock),
      datagrams_up_(up, seed, first_stream),
      datagrams_down_(down, seed, first_stream + 1),
      stream_up_(net::SimulatedLink::reliable(std::move(up), seed, first_stream + 2)),
      stream_down_(net::SimulatedLink::reliable(std::move(down), seed, first_stream + 3)) {
  stream_up_.share_line(datagrams_up_);
  stream_down_.share_line(datagrams_down_);
}

void VirtualClientTransport::connect(LocalTime now) {
  ++attempt_;
  is_open_ = true;
  send_chunk(stream_up_, now, Chunk::kConnect, attempt_);
}

void VirtualClientTransport::send_control(std::span<const std::byte> bytes) {
  if (!is_open_) return;
  count_stream(bytes.size());
  send_chunk(stream_up_, clock_.now(), Chunk::kBytes, attempt_, bytes);
}

bool VirtualClientTransport::send_datagram(std::span<const std::byte> datagram) {
  if (!is_open_ || !has_datagram_port_) return false;
  count_datagram(datagram.size());
  datagrams_up_.send(clock_.now(), datagram);
  return true;
}

std::size_t VirtualClientTransport::queued_control_bytes() const {
  return stream_up_.queued_bytes(clock_.now());
}

void VirtualClientTransport::close() {
  if (!is_open_) return;
  is_open_ = false;
  has_datagram_port_ = false;
  send_chunk(stream_up_, clock_.now(), Chunk::kEnd, attempt_);
}

void VirtualClientTransport::collect(LocalTime now) {
  collect_from(datagrams_up_, now, arrived_datagrams_up_);
  collect_from(datagrams_down_, now, arrived_datagrams_down_);
  collect_from(stream_up_, now, arrived_stream_up_);
  collect_from(stream_down_, now, arrived_stream_down_);
  if (!arrived_datagrams_up_.empty() || !arrived_stream_up_.empty()) received_at_server_ = now;
}

void VirtualClientTransport::deliver(client::ClientSession& session, LocalTime now) {
  for (const auto& chunk : std::exchange(arrived_stream_down_, {})) {
    if (!is_open_ || attempt_of(chunk) != attempt_) continue;
    switch (kind_of(chunk)) {
      case Chunk::kAccepted:
        session.on_connected(now);
        break;
      case Chunk::kBytes:
        session.on_control_bytes(bytes_of(chunk), now);
        break;
      case Chunk::kEnd:
        is_open_ = false;
        session.on_disconnected(now, "the server closed the connection");
        break;
      case Chunk::kConnect:
        break;
    }
  }
  for (const auto& datagram : std::exchange(arrived_datagrams_down_, {})) {
    if (is_open_) session.on_datagram(datagram, now);
  }
}

VirtualClientTransport& VirtualNetwork::add_client(const net::LinkParameters& up, const net::LinkParameters& down,
                                                   std::uint64_t seed) {
  constexpr std::uint64_t kStreamsPerClient = 4;
  clients_.push_back(
      std::make_unique<VirtualClientTransport>(clock_, up, down, seed, kStreamsPerClient * clients_.size()));
  return *clients_.back();
}

VirtualClientTransport* VirtualNetwork::client_of(server::ConnectionHandle connection) const {
  for (const auto& client : clients_) {
    if (connection != 0 && client->connection_ == connection) return client.get();
  }
  return nullptr;
}

void VirtualNetwork::send_control(server::ConnectionHandle connection, std::span<const std::byte> bytes) {
  if (auto* client = client_of(connection)) {
    client->count_stream(bytes.size());
    send_chunk(client->stream_down_, clock_.now(), Chunk::kBytes, client->server_attempt_, bytes);
  }
}

bool VirtualNetwork::send_datagram(server::ConnectionHandle connection, std::span<const std::byte> datagram) {
  auto* client = client_of(connection);
  if (client == nullptr || !client->server_knows_address_) return false;
  client->count_datagram(datagram.size());
  client->waits_down_.record(client->datagrams_down_.line_wait(clock_.now()));
  client->datagrams_down_.send(clock_.now(), datagram);
  return true;
}

std::size_t VirtualNetwork::queued_control_bytes(server::ConnectionHandle connection) const {
  const auto* client = client_of(connection);
  return client == nullptr ? 0 : client->stream_down_.queued_bytes(clock_.now());
}

void VirtualNetwork::close(server::ConnectionHandle connection) {
  if (auto* client = client_of(connection)) {
    send_chunk(client->stream_down_, clock_.now(), Chunk::kEnd, client->server_attempt_);
    client->connection_ = 0;
  }
}

void VirtualNetwork::collect(LocalTime now) {
  for (const auto& client : clients_) client->collect(now);
}

void VirtualNetwork::deliver(server::SessionHub& hub, LocalTime now) {
  for (const auto& client : clients_) {
    deliver_stream(*client, hub, now);
    deliver_datagrams(*client, hub, now);
  }
}

void VirtualNetwork::deliver_stream(VirtualClientTransport& client, server::SessionHub& hub, LocalTime now) {
  for (const auto& chunk : std::exchange(client.arrived_stream_up_, {})) {
    switch (kind_of(chunk)) {
      case Chunk::kConnect:
        client.connection_ = ++last_connection_;
        client.server_attempt_ = attempt_of(chunk);
        client.server_knows_address_ = false;
        send_chunk(client.stream_down_, now, Chunk::kAccepted, client.server_attempt_);
        hub.on_connected(client.connection_, now);
        break;
      case Chunk::kBytes:
        if (client.connection_ != 0) hub.on_control_bytes(client.connection_, bytes_of(chunk), now);
        break;
      case Chunk::kEnd:
        if (client.connection_ != 0) hub.on_disconnected(std::exchange(client.connection_, 0), now);
        break;
      case Chunk::kAccepted:
        break;
    }
  }
}

void VirtualNetwork::deliver_datagrams(VirtualClientTransport& client, server::SessionHub& hub, LocalTime now) {
  for (const auto& datagram : std::exchange(client.arrived_datagrams_up_, {})) {
    const auto is_of_this_client = [&](server::ConnectionHandle connection) {
      return connection == client.connection_;
    };
    if (hub.on_datagram(datagram, now, is_of_this_client).connection != 0) client.server_knows_address_ = true;
  }
}

}  // namespace tandem::lab
