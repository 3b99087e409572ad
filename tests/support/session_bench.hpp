// A client session under a virtual clock, with a simulated server that can send any message.
#pragma once

#include <string>
#include <vector>

#include "client/session/session.hpp"
#include "common/base/mass_properties.hpp"
#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/state_codec.hpp"

namespace tandem::test {

/// Records all messages that the session sends.
class RecordingClientTransport final : public client::ClientTransport {
 public:
  void connect(LocalTime) override { ++connects; }
  void send_control(std::span<const std::byte> bytes) override {
    reader.feed(bytes);
    while (const auto payload = reader.next()) {
      if (!proto::parse_control(*payload, messages.emplace_back())) messages.pop_back();
    }
  }
  bool send_datagram(std::span<const std::byte> datagram) override {
    if (!takes_datagrams) return false;
    datagrams.emplace_back(datagram.begin(), datagram.end());
    return true;
  }
  void set_datagram_port(std::uint16_t its_port) override { port = its_port; }
  std::size_t queued_control_bytes() const override { return queued; }
  std::optional<secure::Exported> exported(std::string_view, std::span<const std::byte>) override {
    return is_encrypted ? std::optional<secure::Exported>(std::in_place) : std::nullopt;
  }
  void close() override { ++closes; }

  proto::FrameReader reader;
  std::vector<wire::ClientControl> messages;
  std::vector<proto::Bytes> datagrams;
  std::uint16_t port = 0;
  std::size_t queued = 0;
  bool takes_datagrams = true;
  bool is_encrypted = false;
  int connects = 0;
  int closes = 0;
};

inline wire::MassProperties on_wire(const MassProperties& mass) {
  wire::MassProperties message;
  message.set_mass_kg(mass.mass_kg);
  if (!(mass.mass_kg > 0)) return message;
  for (const double number : mass.X_BC.p) message.add_centre(number);
  const Quat& q = mass.X_BC.q;
  for (const double number : {q.w(), q.x(), q.y(), q.z()}) message.add_centre(number);
  for (const double moment : mass.principal_inertia_kg_m2) message.add_principal_inertia_kg_m2(moment);
  return message;
}

/// Returns mass properties of a ball with the given radius of gyration. The default radius is the server's value for a
/// small tool.
inline wire::MassProperties ball_on_wire(double mass_kg, double gyration_m = 0.015) {
  return on_wire({mass_kg, {}, Vec3::Constant(mass_kg * gyration_m * gyration_m)});
}

/// Returns a Joined message with only those fields that a client requires.
inline wire::Joined minimal_joined(wire::Role role = wire::ROLE_MANIPULATOR) {
  wire::Joined joined;
  joined.set_user(3);
  joined.set_role(role);
  wire::Scene& scene = *joined.mutable_scene();
  scene.set_name("bench");
  scene.mutable_coupling()->set_law("spring-damper");
  for (const proto::CouplingField& field : proto::kCouplingFields) (scene.mutable_coupling()->*field.set)(1.0);
  wire::Workspace& workspace = *scene.add_tools()->mutable_workspace();
  for (const double x : {0.1, 0.2, 0.3}) workspace.mutable_device_base()->add_position_m(x);
  workspace.set_position_scale(2.0);
  workspace.set_force_scale(0.5);
  *joined.add_tool_masses() = ball_on_wire(0.05);
  return joined;
}

class SessionBench {
 public:
  explicit SessionBench(client::SessionSettings settings = {}) : session(settings, transport, mailboxes) {
    session.on_event = [this](const client::Event& event) {
      if (const std::string line = client::log_line(event); !line.empty()) log.push_back(line);
      if (const auto* const each = std::get_if<client::event::News>(&event)) news = each->text;
      if (const auto* const each = std::get_if<client::event::Refused>(&event)) refused.push_back(each->error.code());
      if (const auto* const each = std::get_if<client::event::PoseAnswered>(&event)) answers.push_back(*each);
      if (const auto* const each = std::get_if<client::event::StateChanged>(&event)) states.push_back(each->state);
    };
    session.start(now);
  }

  void deliver(const wire::ServerControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    session.on_control_bytes(frame, now);
  }
  void deliver_welcome(std::uint64_t connection = 0xABCDEF) {
    wire::ServerControl message;
    message.mutable_welcome()->set_protocol_version(proto::kProtocolVersion);
    message.mutable_welcome()->set_connection_id(connection);
    message.mutable_welcome()->set_epoch(5);
    message.mutable_welcome()->set_datagram_port(4711);
    deliver(message);
  }
  void deliver_joined(const wire::Joined& joined = minimal_joined()) {
    wire::ServerControl message;
    *message.mutable_joined() = joined;
    deliver(message);
  }
  void deliver_error(wire::ErrorCode code, const std::string& text = "no") {
    wire::ServerControl message;
    message.mutable_error()->set_code(code);
    message.mutable_error()->set_text(text);
    deliver(message);
  }
  void join(const wire::Joined& joined = minimal_joined()) {
    session.on_connected(now);
    deliver_welcome();
    deliver_joined(joined);
    transport.messages.clear();
  }

  /// Encodes the update as the server's next datagram. The session's clock is 50 s behind the server's.
  proto::Bytes datagram_of(proto::ServerUpdate update) {
    update.sent = server_time_of_own_clock(now + std::chrono::seconds(50));
    proto::Bytes datagram;
    proto::append_header({proto::DatagramType::kServerUpdate, 5, ConnectionId{0xABCDEF}, ++sequence}, datagram);
    proto::ServerUpdateEncoder().append(update, datagram);
    return datagram;
  }
  proto::ServerUpdate next_update() {
    proto::ServerUpdate update;
    update.step = Step{++step};
    update.stepped = ServerTime(std::chrono::milliseconds(step));
    return update;
  }
  void send_update() { session.on_datagram(datagram_of(next_update()), now); }

  void wait(Duration duration) {
    for (Duration waited{0}; waited < duration; waited += std::chrono::milliseconds(1)) {
      now += std::chrono::milliseconds(1);
      session.poll(now);
    }
  }
  std::string state() const { return std::string(client::name_of(session.status().state)); }
  bool scene_may_display() {
    mailboxes.scene.poll();
    return mailboxes.scene.front().may_display;
  }

  LocalTime now{std::chrono::seconds(10)};
  RecordingClientTransport transport;
  client::ClientMailboxes mailboxes;
  client::ClientSession session;
  std::vector<std::string> log;
  std::string news;  ///< text of the last event
  std::vector<wire::ErrorCode> refused;
  std::vector<client::event::PoseAnswered> answers;
  std::vector<client::SessionState> states;  ///< states that the session has entered, in order
  std::uint64_t sequence = 0;
  std::uint64_t step = 0;
};

/// Returns the names of the messages, such as "hello, join".
inline std::string described(const std::vector<wire::ClientControl>& messages) {
  std::string text;
  for (const wire::ClientControl& message : messages) {
    const auto* field = message.GetDescriptor()->FindFieldByNumber(message.message_case());
    text += (text.empty() ? "" : ", ") + (field == nullptr ? "nothing" : field->name());
  }
  return text;
}

}  // namespace tandem::test
