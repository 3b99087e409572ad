#include "server/room/tool_driver.hpp"

#include <algorithm>
#include <chrono>

#include "common/haptics/wave/wave_port.hpp"
#include "server/room/input_playout.hpp"

namespace tandem::server {
namespace {

/// Longest extrapolation of a handle between the inputs of a client with a deadband: the longest gap (kDeadbandFloor)
/// plus jitter.
constexpr Duration kExtrapolatedFor = std::chrono::milliseconds(15);

void report_energy(ToolPort& port, const UserInput& input) noexcept {
  if (!input.newest.handle_valid) return;
  port.report(input.newest.handle.X, input.newest.energy_from_hand_j, input.newest.energy_to_hand_j,
              to_seconds(input.since_last));
}

/// Driver for ClientMode::kHandle. The coupling pulls the tool to the newest handle.
class HandleDriver final : public ToolDriver {
 public:
  explicit HandleDriver(ToolPort& port) : port_(port) {}

  void receive(const UserInput& input, Duration /*now*/) noexcept override { report_energy(port_, input); }
  std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept override {
    input.answered = input.newest.input_tick;
    RigidState handle = input.newest.handle;
    if (input.has_gaps) {
      handle.X = integrate(handle.X, handle.V, to_seconds(std::min(now - input.arrived, kExtrapolatedFor)));
    }
    port_.set_handle(handle);
    input.on_hand_W = port_.state().wrench_on_hand_W;
    return std::nullopt;
  }

 private:
  ToolPort& port_;
};

/// Driver for ClientMode::kLocalModel. Inputs are played out at a constant delay.
class PlayoutDriver final : public ToolDriver {
 public:
  PlayoutDriver(Duration period, ToolPort& port) : period_(period), port_(port), playout_(to_seconds(period)) {}

  bool delays_buttons() const noexcept override { return true; }
  void receive(const UserInput& input, Duration now) noexcept override {
    if (input.newest.handle_valid) playout_.receive(input.newest, now);
  }
  std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept override {
    auto played = playout_.play(now);
    if (!played) return std::nullopt;
    if (played->has_underrun && port_.runs_on()) playout_.run_on(*played);
    input.answered = played->tick;
    input.on_hand_W = played->on_hand_W;
    port_.report(played->handle.X, played->energy_from_hand_j, played->energy_to_hand_j, to_seconds(period_));
    port_.set_handle(played->handle);
    return played->buttons;
  }
  void describe(proto::OwnUpdate& update) const noexcept override { update.playout = playout_.delay(); }
  void stop() noexcept override { playout_.reset(); }

 private:
  Duration period_;
  ToolPort& port_;
  InputPlayout playout_;
};

/// Driver for ClientMode::kWave, for connections with delay.
/// 1. The received waves move a virtual handle, and the coupling pulls the tool to it.
/// 2. The coupling's force is sent back as a wave.
/// 3. The hand's position serves only to correct drift of the virtual handle.
/// Client and server each keep an energy balance. A client that assumes a different wave impedance thus reflects waves,
/// but creates no energy.
class WaveDriver final : public ToolDriver {
 public:
  WaveDriver(Duration period, ToolPort& port) : step_s_(to_seconds(period)), port_(port) {}

  void receive(const UserInput& input, Duration /*now*/) noexcept override { report_energy(port_, input); }
  std::optional<std::uint32_t> drive(UserInput& input, Duration /*now*/) noexcept override {
    input.answered = input.newest.input_tick;
    wave_.receive(input.newest.sent.time_since_epoch(), input.newest.wave);
    const Pose& X_WH = wave_.move(input.newest.handle.X, port_.coupling(), step_s_);
    port_.set_handle({X_WH, wave_.velocity()});
    return std::nullopt;
  }
  void settle() noexcept override { wave_.settle(-port_.state().wrench_on_hand_W, step_s_); }
  void describe(proto::OwnUpdate& update) const noexcept override { update.wave = wave_.sum_towards_hand(); }
  void stop() noexcept override { wave_.reset(); }

 private:
  double step_s_;
  ToolPort& port_;
  haptics::WaveToolPort wave_{haptics::WaveImpedance{}, haptics::WavePlayer::Settings{}};
};

}  // namespace

ToolDrivers make_tool_drivers(Duration period, ToolPort& port) {
  ToolDrivers drivers;
  const auto driver_of = [&drivers](proto::ClientMode mode) -> auto& {
    return drivers.at(static_cast<std::size_t>(mode));
  };
  driver_of(proto::ClientMode::kHandle) = std::make_unique<HandleDriver>(port);
  driver_of(proto::ClientMode::kLocalModel) = std::make_unique<PlayoutDriver>(period, port);
  driver_of(proto::ClientMode::kWave) = std::make_unique<WaveDriver>(period, port);
  return drivers;
}

}  // namespace tandem::server
