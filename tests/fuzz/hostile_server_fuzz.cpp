// Any bytes as what a server says, to a whole client with its local model and a device, without sockets or a clock:
// whatever comes, the force at the hand is finite, below the device's limit, and changes no faster than it may.
#include <cmath>
#include <cstdint>
#include <memory>

#include "client/client.hpp"
#include "proto/control_framing.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/fuzz/check.hpp"
#include "tests/fuzz/server_script.hpp"

namespace {

using namespace tandem;
using fuzz::check;

constexpr Duration kTick = std::chrono::milliseconds(1);
constexpr int kMaxTicks = 400;

/// The connection is there as soon as it is wanted; nothing that is sent arrives.
class Line final : public client::ClientTransport {
 public:
  void connect(LocalTime) override { is_wanted = true; }
  void send_control(std::span<const std::byte>) override {}
  bool send_datagram(std::span<const std::byte>) override { return true; }
  void set_datagram_port(std::uint16_t) override {}
  std::size_t queued_control_bytes() const override { return 0; }
  void close() override {}

  bool is_wanted = false;
};

client::ClientSettings settings() {
  client::ClientSettings settings;
  settings.haptics.stage.name = "local-model";
  settings.session.wants_soft_shapes = true;
  return settings;
}

class Victim {
 public:
  Victim() : device_(Vec3::Constant(0.2)), client_(settings(), device_, line_) { client_.session().start(now_); }

  void suffer(const fuzz::ScriptedAct& next) {
    connect();
    switch (next.act) {
      case fuzz::ServerAct::kMessage:
        say(next.bytes);
        break;
      case fuzz::ServerAct::kStream:
        client_.session().on_control_bytes(next.bytes, now_);
        break;
      case fuzz::ServerAct::kDatagram:
        client_.session().on_datagram(next.bytes, now_);
        break;
      case fuzz::ServerAct::kState:
        tell(next.bytes);
        break;
      case fuzz::ServerAct::kHangUp:
        client_.session().on_disconnected(now_, "the server hung up");
        break;
      default:
        for (std::size_t i = 1; i < next.bytes.size(); ++i) tick();
    }
    tick();
  }

 private:
  void connect() {
    if (line_.is_wanted) client_.session().on_connected(now_);
    line_.is_wanted = false;
  }

  void say(std::span<const std::byte> payload) {
    wire::ServerControl message;
    if (proto::parse_control(payload, message) && message.has_welcome()) welcome_ = message.welcome();
    proto::Bytes frame;
    for (std::size_t i = proto::kFrameLengthBytes; i-- > 0;)
      frame.push_back(static_cast<std::byte>(payload.size() >> (8 * i)));
    frame.insert(frame.end(), payload.begin(), payload.end());
    client_.session().on_control_bytes(frame, now_);
  }

  void tell(std::span<const std::byte> payload) {
    proto::Bytes datagram;
    const auto epoch = static_cast<std::uint8_t>(welcome_.epoch());
    proto::append_header(
        {proto::DatagramType::kServerUpdate, epoch, ConnectionId{welcome_.connection_id()}, ++sequence_}, datagram);
    datagram.insert(datagram.end(), payload.begin(), payload.end());
    client_.session().on_datagram(datagram, now_);
  }

  void tick() {
    if (++ticks_ > kMaxTicks) return;
    now_ += kTick;
    device_.sample.X_DH.p.z() = -0.02 * std::sin(0.02 * static_cast<double>(ticks_));
    client_.haptics().tick(now_);
    client_.poll(now_);
    const devices::DeviceSpec& spec = device_.spec();
    const Wrench before = std::exchange(shown_, device_.last);
    check(device_.all_finite && shown_.f.norm() <= spec.force_limit_n + kRounding &&
          shown_.t.norm() <= spec.torque_limit_n_m + kRounding);
    const double may_step_n = spec.slew_limit_n_per_s * to_seconds(kTick);
    const bool falls = shown_.f.norm() <= before.f.norm();
    check(falls || (shown_.f - before.f).norm() <= may_step_n + kRounding);
  }

  static constexpr double kRounding = 1e-9;
  LocalTime now_{std::chrono::seconds(10)};
  Line line_;
  client::ScriptedDevice device_;
  client::Client client_;
  wire::Welcome welcome_;
  std::uint64_t sequence_ = 0;
  int ticks_ = 0;
  Wrench shown_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Victim victim;
  std::span<const std::byte> script = std::as_bytes(std::span(data, size));
  while (!script.empty()) victim.suffer(fuzz::next_act(script));
  return 0;
}
