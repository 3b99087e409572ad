// A complete client with a device, without sockets or a clock. A fuzz target uses it in the role of its server. The
// force limits of the hand must hold for every input.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <utility>

#include "client/client.hpp"
#include "client/haptics/stages/stage.hpp"
#include "proto/control_framing.hpp"
#include "tests/client/haptics/scripted_device.hpp"
#include "tests/fuzz/check.hpp"

namespace tandem::fuzz {

/// A transport that connects on request and discards all data.
class DeadLine final : public client::ClientTransport {
 public:
  void connect(LocalTime) override { is_wanted = true; }
  void send_control(std::span<const std::byte>) override {}
  bool send_datagram(std::span<const std::byte>) override { return true; }
  void set_datagram_port(std::uint16_t) override {}
  std::size_t queued_control_bytes() const override { return 0; }
  void close() override {}

  bool is_wanted = false;
};

class FuzzedClient {
 public:
  static constexpr int kMaxTicks = 400;

  explicit FuzzedClient(const client::StageSettings& stage)
      : device_(Vec3::Constant(0.2)), client_(settings(stage), device_, line_) {
    client_.session().start(now_);
  }

  client::Client& client() { return client_; }
  client::ClientSession& session() { return client_.session(); }
  LocalTime now() const { return now_; }
  /// Returns whether more ticks may run.
  bool goes_on() const { return ticks_ < kMaxTicks; }

  void connect() {
    if (line_.is_wanted) session().on_connected(now_);
    line_.is_wanted = false;
  }
  /// Passes a control message to the client, in a frame.
  void deliver(std::span<const std::byte> payload) {
    proto::Bytes frame;
    for (std::size_t i = proto::kFrameLengthBytes; i-- > 0;)
      frame.push_back(static_cast<std::byte>(payload.size() >> (8 * i)));
    frame.insert(frame.end(), payload.begin(), payload.end());
    session().on_control_bytes(frame, now_);
  }
  /// Advances the clock without running a tick.
  void stall(Duration duration) { now_ += duration; }

  /// Runs one tick of 1 ms, in which the hand moves up and down. The force must be finite and within the force and slew
  /// limits of the device, and the stage must process no more samples than its bound.
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
    check(client_.haptics().record().stage_samples <= client::kMaxStageSamples);
  }
  /// Returns the last wrench written to the device.
  const Wrench& shown() const { return shown_; }

 private:
  static constexpr Duration kTick = std::chrono::milliseconds(1);
  static constexpr double kRounding = 1e-9;

  static client::ClientSettings settings(const client::StageSettings& stage) {
    client::ClientSettings settings;
    settings.haptics.stage = stage;
    settings.session.wants_soft_shapes = true;
    return settings;
  }

  LocalTime now_{std::chrono::seconds(10)};
  DeadLine line_;
  client::ScriptedDevice device_;
  client::Client client_;
  int ticks_ = 0;
  Wrench shown_;
};

}  // namespace tandem::fuzz
