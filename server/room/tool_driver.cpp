#include "server/room/tool_driver.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/haptics/wave/wave_port.hpp"
#include "common/physics/joints/delayed_joint.hpp"
#include "server/assets/scene_coupling.hpp"
#include "server/room/input_playout.hpp"

namespace tandem::server {
namespace {

/// Of a user that leaves gaps on purpose the handle is extrapolated for so long: the longest such gap (kDeadbandFloor),
/// and what the network adds to it.
constexpr Duration kExtrapolatedFor = std::chrono::milliseconds(15);
/// After another user's hand was on the same body, it counts as shared for so long: hands that touch it in turns do not
/// switch what joins them.
constexpr Duration kSharedFor = std::chrono::milliseconds(500);
constexpr Duration kUnknownLoop = std::chrono::milliseconds(200);

void report_energy(ToolPort& port, const UserInput& input) noexcept {
  if (!input.newest.handle_valid) return;
  port.report(input.newest.energy_from_hand_j, input.newest.energy_to_hand_j, to_seconds(input.since_last));
}

/// ClientMode::kHandle: the coupling pulls the tool to the newest handle.
class HandleDriver final : public ToolDriver {
 public:
  explicit HandleDriver(ToolPort& port) : port_(port) {}

  void take(const UserInput& input, Duration /*now*/) noexcept override { report_energy(port_, input); }
  std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept override {
    input.answered = input.newest.input_tick;
    RigidState handle = input.newest.handle;
    if (input.has_gaps) {
      handle.X = integrate(handle.X, handle.V, to_seconds(std::min(now - input.arrived, kExtrapolatedFor)));
    }
    port_.set_handle(handle);
    return std::nullopt;
  }

 private:
  ToolPort& port_;
};

/// ClientMode::kLocalModel: inputs are played out at a constant delay, and delayed joints join the client's copies of
/// what the tool touches to the bodies here.
class PlayoutDriver final : public ToolDriver {
 public:
  PlayoutDriver(Duration period, physics::World& world, ToolPort& port, BodySharing& sharing)
      : period_(period), world_(world), port_(port), sharing_(sharing), playout_(to_seconds(period)) {}

  bool delays_buttons() const noexcept override { return true; }
  void take(const UserInput& input, Duration now) noexcept override {
    sharing_.set_loop(port_.tool(), input.loop());
    if (input.newest.handle_valid) playout_.take(input.newest, now);
  }
  std::optional<std::uint32_t> drive(UserInput& input, Duration now) noexcept override {
    const auto played = playout_.play(now);
    if (!played) return std::nullopt;
    input.answered = played->tick;
    port_.report(played->energy_from_hand_j, played->energy_to_hand_j, to_seconds(period_));
    port_.set_handle(played->handle);
    join_copies(*played, input.loop(), now);
    return played->buttons;
  }
  void describe(proto::ServerUpdate& update) const noexcept override {
    update.joint_share = joint_.share();
    update.playout = playout_.delay();
    update.slowest_loop = slowest_loop_;
  }
  void stop() noexcept override {
    joint_.disengage();
    slowest_loop_ = Duration{0};
    playout_.reset();
  }
  void reset() noexcept override {
    stop();
    joint_ = physics::DelayedJoint(kSharedFor);
    sharing_.set_loop(port_.tool(), Duration{0});
  }

 private:
  /// The client takes a weight back when it is told that nobody else holds the body, and what it does then is here a
  /// loop after.
  void join_copies(const PlayedInput& played, Duration loop, Duration now) noexcept {
    slowest_loop_ = sharing_.slowest_loop(port_.tool());
    const BodyId held = port_.state().held;
    const bool is_held = held.is_valid();
    const std::size_t others = is_held ? sharing_.other_holders(held, port_.tool()) : 0;
    joint_.step(now, period_, {slowest_loop_ > Duration{0}, is_held, others}, loop);
    boost::container::static_vector<physics::Joint, kMaxCopies> joints;
    boost::container::static_vector<double, kMaxCopies> weights;
    for (const CopyTarget& copy : played.copies) {
      weights.push_back(copy.body == held ? joint_.weight_on_copy() : 0);
      const Vec3 pressing_W = world_.body(copy.body).X.q * copy.pressing_B;
      joints.push_back(physics::DelayedJoint::joint(loop, slowest_loop_, pressing_W));
    }
    world_.join_copies(port_.tool(), played.tool, played.copies, joints, joint_.share(), weights);
  }

  Duration period_;
  physics::World& world_;
  ToolPort& port_;
  BodySharing& sharing_;
  InputPlayout playout_;
  physics::DelayedJoint joint_{kSharedFor};
  Duration slowest_loop_{0};  ///< of all who share a body with this user
};

/// ClientMode::kWave: the waves move a virtual handle, which the coupling pulls the tool to, and its answer becomes the
/// wave back; where the hand is, only keeps that handle from drifting away. Both ends keep account, so a client that
/// uses another impedance gets reflections, but no energy.
class WaveDriver final : public ToolDriver {
 public:
  WaveDriver(std::shared_ptr<const LoadedScene> scene, Duration period, ToolPort& port,
             const haptics::CouplingParameters& coupling)
      : scene_(std::move(scene)), step_s_(to_seconds(period)), port_(port), coupling_(coupling) {}

  void take(const UserInput& input, Duration /*now*/) noexcept override { report_energy(port_, input); }
  std::optional<std::uint32_t> drive(UserInput& input, Duration /*now*/) noexcept override {
    const BodyId held = port_.state().held;
    const auto body = held.is_valid() ? std::optional<std::size_t>(held.value - 1) : std::nullopt;
    const haptics::CouplingParameters in_force =
        physics::coupling_in_force(scene_->world.coupling, coupling_, moved_mass(*scene_, port_.tool(), body));
    input.answered = input.newest.input_tick;
    wave_.receive(input.newest.sent.time_since_epoch(), input.newest.wave);
    const Pose& X_WH = wave_.move(input.newest.handle.X, in_force, step_s_);
    port_.set_handle({X_WH, wave_.velocity()});
    return std::nullopt;
  }
  void settle() noexcept override { wave_.settle(-port_.state().wrench_on_hand_W, step_s_); }
  void describe(proto::ServerUpdate& update) const noexcept override { update.wave = wave_.sum_towards_hand(); }
  void stop() noexcept override { wave_.reset(); }

 private:
  std::shared_ptr<const LoadedScene> scene_;
  double step_s_;
  ToolPort& port_;
  const haptics::CouplingParameters& coupling_;
  haptics::WaveToolPort wave_{haptics::WaveImpedance{}, haptics::WavePlayer::Settings{}};
};

}  // namespace

Duration UserInput::loop() const {
  return newest.round_trip > Duration{0} ? newest.round_trip : kUnknownLoop;
}

ToolDrivers make_tool_drivers(std::shared_ptr<const LoadedScene> scene, Duration period, physics::World& world,
                              ToolPort& port, BodySharing& sharing, const haptics::CouplingParameters& coupling) {
  ToolDrivers drivers;
  const auto of = [&drivers](proto::ClientMode mode) -> auto& {
    return drivers.at(static_cast<std::size_t>(mode));
  };
  of(proto::ClientMode::kHandle) = std::make_unique<HandleDriver>(port);
  of(proto::ClientMode::kLocalModel) = std::make_unique<PlayoutDriver>(period, world, port, sharing);
  of(proto::ClientMode::kWave) = std::make_unique<WaveDriver>(std::move(scene), period, port, coupling);
  return drivers;
}

}  // namespace tandem::server
