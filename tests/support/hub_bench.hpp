// A session hub with its rooms under a virtual clock, and simulated clients that can send any message.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/base/random.hpp"
#include "proto/control_framing.hpp"
#include "proto/state_codec.hpp"
#include "server/session/session_hub.hpp"
#include "tests/support/scene_of.hpp"

namespace tandem::test {

/// A scene with two tools. One graspable box floats between them within the reach of both.
inline std::string two_hands_scene(const std::string& name = "bench") {
  return R"({"name": ")" + name + R"(",
    "bodies": [{"name": "box", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}], "mass_kg": 0.1,
                "graspable": true, "gravity": false}],
    "tools": [{"name": "a", "placement": {"position_m": [-0.02, 0, 0]}},
              {"name": "b", "placement": {"position_m": [0.02, 0, 0]}}],
    "coupling": {"law": "spring-damper", "stiffness_n_per_m": 200, "damping_n_s_per_m": 2},
    "limits": {"observers": 1}})";
}

/// Records all messages and datagrams that the hub sends.
class RecordingTransport final : public server::ServerTransport {
 public:
  void send_control(server::ConnectionHandle connection, std::span<const std::byte> bytes) override {
    readers[connection].feed(bytes);
    while (const auto payload = readers[connection].next()) {
      if (!proto::parse_control(*payload, messages[connection].emplace_back())) messages[connection].pop_back();
    }
  }
  bool send_datagram(server::ConnectionHandle connection, std::span<const std::byte> datagram) override {
    if (!takes_datagrams) return false;
    if (std::this_thread::get_id() != home) ++sent_elsewhere;
    datagrams[connection].emplace_back(datagram.begin(), datagram.end());
    return true;
  }
  std::size_t queued_control_bytes(server::ConnectionHandle) const override { return queued; }
  void close(server::ConnectionHandle connection) override { closed.insert(connection); }
  std::optional<secure::Exported> exported(server::ConnectionHandle connection, std::string_view label,
                                           std::span<const std::byte>) override {
    if (!is_encrypted) return std::nullopt;
    return export_of(connection, label);
  }
  /// Returns key material as both ends of a TLS connection would derive it from the connection. It differs for each
  /// connection and each purpose (`label`).
  static secure::Exported export_of(server::ConnectionHandle connection, std::string_view label) {
    secure::Exported exported;
    exported.secret.bytes()[0] = static_cast<std::byte>(connection);
    exported.secret.bytes()[1] = static_cast<std::byte>(label == secure::kResumeExport);
    return exported;
  }

  const std::thread::id home = std::this_thread::get_id();
  std::atomic<std::size_t> sent_elsewhere{0};  ///< number of datagrams that a thread other than `home` sent
  std::map<server::ConnectionHandle, proto::FrameReader> readers;
  std::map<server::ConnectionHandle, std::vector<wire::ServerControl>> messages;
  std::map<server::ConnectionHandle, std::vector<proto::Bytes>> datagrams;
  std::set<server::ConnectionHandle> closed;
  std::size_t queued = 0;
  bool takes_datagrams = true;
  bool is_encrypted = false;
};

/// Returns a control message with request number 42 and the fields that `fill` sets.
inline wire::ClientControl message_of(const std::function<void(wire::ClientControl&)>& fill) {
  wire::ClientControl message;
  message.set_request(42);
  fill(message);
  return message;
}

/// One simulated client.
struct BenchClient {
  server::ConnectionHandle handle = 0;
  ConnectionId connection;
  std::uint8_t epoch = 0;
  std::uint64_t sequence = 0;
  std::uint64_t tick = 0;
  wire::Joined joined;
};

class HubBench {
 public:
  explicit HubBench(server::HubSettings settings = {}, std::vector<std::string> scenes = {two_hands_scene()},
                    const server::RoomOptions& options = {}) {
    for (const std::string& json : scenes) {
      const auto scene = scene_of(json);
      rooms.push_back(std::make_unique<server::Room>(RoomId{static_cast<std::uint32_t>(rooms.size() + 1)},
                                                     scene->description.name(), scene, options));
    }
    std::vector<server::Room*> pointers;
    for (const auto& room : rooms) pointers.push_back(room.get());
    if (!settings.connection_ids) settings.connection_ids = [ids = Random(1)]() mutable { return ids.next_u64(); };
    hub = std::make_unique<server::SessionHub>(settings, pointers, transport);
    hub->on_log = [this](std::string_view, const std::string& line) { log.push_back(line); };
  }

  BenchClient connect() {
    BenchClient client;
    client.handle = ++last_handle;
    hub->on_connected(client.handle, now);
    return client;
  }

  void send(const BenchClient& client, const wire::ClientControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    hub->on_control_bytes(client.handle, frame, now);
  }

  /// Returns the messages that the hub has sent to the client since the last call.
  std::vector<wire::ServerControl> drain(const BenchClient& client) {
    return std::exchange(transport.messages[client.handle], {});
  }
  std::vector<proto::Bytes> drain_datagrams(const BenchClient& client) {
    return std::exchange(transport.datagrams[client.handle], {});
  }

  void greet(BenchClient& client, const std::string& capability = "state-udp") {
    wire::ClientControl hello;
    hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
    hello.mutable_hello()->add_capabilities(capability);
    send(client, hello);
    for (const wire::ServerControl& message : drain(client)) {
      client.connection = ConnectionId{message.welcome().connection_id()};
      client.epoch = static_cast<std::uint8_t>(message.welcome().epoch());
    }
  }

  static wire::ClientControl join_message(const std::string& name, wire::Role role = wire::ROLE_MANIPULATOR,
                                          const std::string& room = "") {
    wire::ClientControl join;
    join.set_request(7);
    join.mutable_join()->set_room(room);
    join.mutable_join()->set_user_name(name);
    join.mutable_join()->set_role(role);
    return join;
  }

  /// Connects a client, sends its greeting and its join. The returned client has the server's reply in `joined`; if the
  /// join was refused, its user is 0.
  BenchClient join(const std::string& name, wire::Role role = wire::ROLE_MANIPULATOR,
                   const std::string& capability = "state-udp") {
    BenchClient client = connect();
    greet(client, capability);
    send(client, join_message(name, role));
    for (const wire::ServerControl& message : drain(client)) {
      if (message.has_joined()) client.joined = message.joined();
    }
    return client;
  }

  /// Returns an input with the handle at the initial pose of the tool, so that the coupling exerts no force.
  proto::ClientUpdate resting_input(BenchClient& client) {
    proto::ClientUpdate update;
    update.input_tick = Tick{++client.tick};
    update.handle_valid = client.joined.role() != wire::ROLE_OBSERVER;
    if (update.handle_valid) update.handle.X = rooms.front()->scene().world.tools[client.joined.tool()].X_WT;
    update.sent = now;
    return update;
  }

  proto::Bytes datagram_of(BenchClient& client, const proto::ClientUpdate& update) {
    proto::Bytes datagram;
    proto::append_header({proto::DatagramType::kClientUpdate, client.epoch, client.connection, ++client.sequence},
                         datagram);
    proto::append_client_update(update, datagram);
    return datagram;
  }

  server::ConnectionHandle deliver(const proto::Bytes& datagram) {
    return hub->on_datagram(datagram, now, {}).connection;
  }
  server::ConnectionHandle send_state(BenchClient& client) {
    return deliver(datagram_of(client, resting_input(client)));
  }

  /// Advances the clock by 1 ms: each room runs one step, then the hub polls.
  void step() {
    now += std::chrono::milliseconds(1);
    for (const auto& room : rooms) room->step(server_time_of_own_clock(now));
    hub->poll(VirtualClock(now));
  }
  void step(int times) {
    for (int i = 0; i < times; ++i) step();
  }

  /// Returns the last update sent to the client; empty if there is none.
  std::optional<proto::ServerUpdate> newest_update(const BenchClient& client) {
    const std::vector<proto::Bytes>& sent = transport.datagrams[client.handle];
    proto::ServerUpdate update;
    if (sent.empty() || proto::parse_server_update(proto::payload_of(sent.back()), update) != proto::DropReason::kNone)
      return std::nullopt;
    return update;
  }

  LocalTime now{std::chrono::seconds(100)};
  RecordingTransport transport;
  std::vector<std::unique_ptr<server::Room>> rooms;
  std::unique_ptr<server::SessionHub> hub;
  std::vector<std::string> log;
  server::ConnectionHandle last_handle = 0;
};

/// Returns the names of the messages, with the code of each error: "error ERROR_ROOM_FULL, goodbye".
inline std::string described(const std::vector<wire::ServerControl>& messages) {
  std::string text;
  for (const wire::ServerControl& message : messages) {
    if (!text.empty()) text += ", ";
    const auto* field = message.GetDescriptor()->FindFieldByNumber(message.message_case());
    text += field == nullptr ? "nothing" : field->name();
    if (message.has_error()) text += " " + wire::ErrorCode_Name(message.error().code());
  }
  return text;
}

}  // namespace tandem::test
