// Driver of a Falcon, from opening to the force at the hand, in steps.
//
//   closed ─▶ probing ──reply─────────────────────────▶ running ─▶ homing (red) ─▶ pulled out (blue) ─▶ ready (green)
//     ▲         │ none after 20 tries                      ▲
//     │         ▼                                          │ a reply
//     │      loader (10 times: 0A 43 0D until 0A 44 2C 0D) ─▶ upload (each byte is echoed) ─▶ probing
//     └── the line fails, or 100 ms without a reply ── from any state
//
// A failure restarts from the loader, ten times, with pauses that double from 0.1 s to 2 s, then every 5 s.
#pragma once

#include <array>
#include <memory>
#include <string_view>
#include <vector>

#include "common/haptics/velocity_estimator.hpp"
#include "devices/falcon/falcon_packet.hpp"
#include "devices/falcon/falcon_port.hpp"
#include "devices/threaded_device.hpp"

namespace tandem::devices {

struct FalconSettings {
  DeviceSpec spec;  ///< limits; the driver sets axes and buttons
  /// Firmware by the device's maker; empty: the driver loads none.
  std::vector<std::uint8_t> firmware;
  double motor_counts_per_n_m = 3000;
};

/// Base frame D: x right, y away from the user, z up; its origin is 0.125 m in front of the device's own.
///
/// Model   encoder angles → forward kinematics (warm start) → p_DH; its velocity by VelocityEstimator over steps of
///         DeviceSpec::position_step_m; force → τ = J⁻ᵀ F → motor counts, scaled together to ±4095. Zero force unless
///         every arm is homed. After homing the grip must first be pulled out to z = 0.170 m of the device's own frame,
///         so that a hand that still presses on the stop is not pushed. Encoders that do not change by a count for 3 s
///         at a force of 1 N or more are frozen: a hand's tremor is larger.
/// Thread  the device's
class FalconDriver final : public DeviceDriver {
 public:
  /// In      port  may be null; then step() opens it, as after an unplugging
  FalconDriver(FalconSettings settings, OpenFalcon open, std::unique_ptr<FalconPort> port);

  const DeviceSpec& spec() const noexcept override { return settings_.spec; }
  DeviceSample step(LocalTime now, const Wrench& wrench_on_hand_D) override;
  bool may_be_on() const noexcept override { return may_be_on_; }

 private:
  enum class Phase : std::uint8_t { kClosed, kProbing, kLoader, kUpload, kRunning };

  void open(LocalTime now);
  void begin_probing();
  void probe(LocalTime now);
  void begin_loader();
  void greet_loader(LocalTime now);
  void upload(LocalTime now);
  DeviceSample run(LocalTime now, const Wrench& wrench_on_hand_D);
  DeviceSample sample_of(LocalTime now, const FalconReply& reply);
  void note_encoders(LocalTime now, const FalconCounts& encoders);
  DeviceSample homing_sample(LocalTime now);
  FalconCounts motors_for(const Wrench& wrench_on_hand_D);
  bool exchange(const FalconCounts& motors, std::uint8_t lights_and_home, FalconReply& reply);
  bool receive(FalconReply& reply);
  bool set_line(std::uint16_t baud, std::uint16_t latency_ms);
  void fail(LocalTime now, std::string_view reason);
  void lose(LocalTime now, std::string_view reason);

  FalconSettings settings_;
  OpenFalcon open_;
  std::unique_ptr<FalconPort> port_;
  Phase phase_ = Phase::kClosed;
  Absence absence_;
  LocalTime loader_due_{};  ///< time of the next attempt
  int tries_ = 0;           ///< attempts in this phase
  int attempts_ = 0;        ///< attempts to load the firmware
  std::size_t uploaded_ = 0;
  std::size_t echoed_ = 0;
  FalconPacketParser parser_;
  std::array<std::uint8_t, 64> bytes_{};
  LocalTime replied_{};
  DeviceSample last_;  ///< last sample of the homed device
  bool is_homed_ = false;
  bool has_homing_begun_ = false;
  bool is_in_ = false;  ///< was homed just now; to be pulled out before it is ready
  LocalTime homing_since_{};
  Vec3 p_m_ = Vec3(0, 0, 0.125);  ///< position in the device's own frame
  bool has_pose_ = false;
  haptics::VelocityEstimator velocity_;
  FalconCounts encoders_ = FalconCounts::Zero();
  double force_n_ = 0;  ///< magnitude of the last force sent
  bool may_be_on_ = false;
  LocalTime changed_{};
  bool is_frozen_ = false;
};

}  // namespace tandem::devices
