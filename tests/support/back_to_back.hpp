// The product's session hub, rooms and client sessions in one process under a virtual clock. Messages arrive after a
// fixed delay. There are no sockets and no threads.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "client/session/session.hpp"
#include "common/base/random.hpp"
#include "server/session/session_hub.hpp"
#include "tests/support/scene_of.hpp"

namespace tandem::test {

class BackToBack;

/// One client with its link to the server. Its clock is `clock_lead` ahead of the server's clock.
class WiredClient final : public client::ClientTransport {
 public:
  WiredClient(BackToBack& net, client::SessionSettings settings, Duration clock_lead)
      : net_(net), clock_lead_(clock_lead), session(std::move(settings), *this, mailboxes) {}

  LocalTime own_time() const;
  void run();
  /// Publishes an update, in the role of the haptic thread, with the handle at `X_WH`.
  void publish_handle(const Pose& X_WH, std::uint32_t buttons = 0, const Twist& V_WH = {}) {
    proto::ClientUpdate update;
    update.input_tick = Tick{++tick};
    update.handle = {X_WH, V_WH};
    update.handle_valid = true;
    update.buttons = buttons;
    mailboxes.outbox.publish(update);
  }
  /// Returns the newest received update, or null.
  const proto::ServerUpdate* newest() {
    has_newest_ |= mailboxes.inbox.poll();
    return has_newest_ ? &mailboxes.inbox.front().update : nullptr;
  }
  /// Closes the connection at both ends without a message.
  void cut();

  void connect(LocalTime now) override;
  void send_control(std::span<const std::byte> bytes) override;
  bool send_datagram(std::span<const std::byte> datagram) override;
  void set_datagram_port(std::uint16_t) override {}
  std::size_t queued_control_bytes() const override { return 0; }
  void close() override;

 private:
  friend class BackToBack;
  struct Packet {
    LocalTime due;
    bool is_control;
    proto::Bytes bytes;
  };
  void deliver_up(const Packet& packet);
  void deliver_down(const Packet& packet);

  BackToBack& net_;
  Duration clock_lead_;
  server::ConnectionHandle handle_ = 0;  ///< 0 if not connected
  bool is_connect_requested_ = false;
  /// true: the server has closed the connection; the stream ends after the packets in transit
  bool ends_after_queue_ = false;
  bool has_newest_ = false;
  std::deque<Packet> up_;
  std::deque<Packet> down_;

 public:
  client::ClientMailboxes mailboxes;
  client::ClientSession session;  // declared last, because it uses the members above
  std::uint64_t tick = 0;
};

class BackToBack final : public server::ServerTransport {
 public:
  explicit BackToBack(const std::string& scene_json, Duration delay = Duration{0})
      : one_way(delay), scene_(scene_of(scene_json)) {
    start_server();
  }

  void start_server() {
    room = std::make_unique<server::Room>(RoomId{1}, scene_->description.name(), scene_);
    server::HubSettings settings;
    settings.connection_ids = [ids = Random(++servers_started_)]() mutable { return ids.next_u64(); };
    hub = std::make_unique<server::SessionHub>(settings, std::vector<server::Room*>{room.get()}, *this);
  }
  /// Ends every connection without a message, like kill −9.
  void kill_server() {
    hub.reset();
    for (const auto& client : clients) client->cut();
  }

  WiredClient& add_client(client::SessionSettings settings, Duration clock_lead = Duration{0}) {
    clients.push_back(std::make_unique<WiredClient>(*this, std::move(settings), clock_lead));
    clients.back()->session.start(clients.back()->own_time());
    return *clients.back();
  }

  /// Runs for some milliseconds. In each of them the room steps; then the hub and the sessions poll.
  void run(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      now += std::chrono::milliseconds(1);
      if (hub != nullptr) {
        room->step(server_time_of_own_clock(now));
        hub->poll(VirtualClock(now));
      }
      for (const auto& client : clients) client->run();
    }
  }

  void send_control(server::ConnectionHandle connection, std::span<const std::byte> bytes) override {
    send_down(connection, true, bytes);
  }
  bool send_datagram(server::ConnectionHandle connection, std::span<const std::byte> datagram) override {
    send_down(connection, false, datagram);
    return true;
  }
  std::size_t queued_control_bytes(server::ConnectionHandle) const override { return 0; }
  void close(server::ConnectionHandle connection) override {
    if (WiredClient* client = find(connection)) client->ends_after_queue_ = true;
  }

  LocalTime now{std::chrono::seconds(1000)};
  Duration one_way;
  bool delivers_datagrams = true;
  /// If set, called with the bytes of each delivery in either direction; may change them.
  std::function<void(proto::Bytes&)> damage;
  std::unique_ptr<server::Room> room;
  std::unique_ptr<server::SessionHub> hub;
  std::vector<std::unique_ptr<WiredClient>> clients;

 private:
  friend class WiredClient;
  WiredClient* find(server::ConnectionHandle connection) {
    for (const auto& client : clients) {
      if (client->handle_ == connection) return client.get();
    }
    return nullptr;
  }
  void send_down(server::ConnectionHandle connection, bool is_control, std::span<const std::byte> bytes) {
    if (WiredClient* client = find(connection)) {
      client->down_.push_back({now + one_way, is_control, proto::Bytes(bytes.begin(), bytes.end())});
    }
  }

  std::shared_ptr<const server::LoadedScene> scene_;
  std::uint64_t servers_started_ = 0;
  server::ConnectionHandle last_handle_ = 0;
};

inline LocalTime WiredClient::own_time() const {
  return net_.now + clock_lead_;
}

inline void WiredClient::connect(LocalTime) {
  close();
  is_connect_requested_ = true;
}

inline void WiredClient::send_control(std::span<const std::byte> bytes) {
  if (handle_ != 0) up_.push_back({net_.now + net_.one_way, true, proto::Bytes(bytes.begin(), bytes.end())});
}

inline bool WiredClient::send_datagram(std::span<const std::byte> datagram) {
  up_.push_back({net_.now + net_.one_way, false, proto::Bytes(datagram.begin(), datagram.end())});
  return true;
}

inline void WiredClient::close() {
  // Messages sent before the connection was closed still arrive, for example a leave message.
  for (const Packet& packet : std::exchange(up_, {})) deliver_up(packet);
  const server::ConnectionHandle old = std::exchange(handle_, 0);
  if (old != 0 && net_.hub != nullptr) net_.hub->on_disconnected(old, net_.now);
  down_.clear();
  is_connect_requested_ = false;
  ends_after_queue_ = false;
}

inline void WiredClient::cut() {
  if (handle_ == 0) return;
  up_.clear();
  close();
  session.on_disconnected(own_time(), "the connection was cut");
}

inline void WiredClient::deliver_up(const Packet& packet) {
  if (net_.hub == nullptr || handle_ == 0) return;
  proto::Bytes bytes = packet.bytes;
  if (net_.damage) net_.damage(bytes);
  if (packet.is_control) {
    net_.hub->on_control_bytes(handle_, bytes, net_.now);
  } else if (net_.delivers_datagrams) {
    net_.hub->on_datagram(bytes, net_.now, {});
  }
}

inline void WiredClient::deliver_down(const Packet& packet) {
  proto::Bytes bytes = packet.bytes;
  if (net_.damage) net_.damage(bytes);
  if (packet.is_control) {
    session.on_control_bytes(bytes, own_time());
  } else if (net_.delivers_datagrams) {
    session.on_datagram(bytes, own_time());
  }
}

inline void WiredClient::run() {
  if (std::exchange(is_connect_requested_, false)) {
    if (net_.hub == nullptr) {
      session.on_disconnected(own_time(), "connection refused");
    } else {
      handle_ = ++net_.last_handle_;
      net_.hub->on_connected(handle_, net_.now);
      session.on_connected(own_time());
    }
  }
  while (!up_.empty() && up_.front().due <= net_.now) {
    const Packet packet = std::move(up_.front());
    up_.pop_front();
    deliver_up(packet);
  }
  while (!down_.empty() && down_.front().due <= net_.now) {
    const Packet packet = std::move(down_.front());
    down_.pop_front();
    deliver_down(packet);
  }
  if (ends_after_queue_ && down_.empty()) {
    close();
    session.on_disconnected(own_time(), "the server closed the connection");
  }
  session.poll(own_time());
}

}  // namespace tandem::test
