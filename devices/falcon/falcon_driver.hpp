// Driver of a Novint Falcon. It proceeds in steps, from opening the device to displaying the force.
//
//   closed ─▶ probing ──reply─────────────────────────▶ running ─▶ homing (red) ─▶ pulled out (blue) ─▶ ready (green)
//     ▲         │ none after 20 tries                      ▲
//     │         ▼                                          │ a reply
//     │      loader (10 times: 0A 43 0D until 0A 44 2C 0D) ─▶ upload (each byte is echoed) ─▶ probing
//     └── the line fails, or 100 ms without a reply ── from any state
//
// After a failure the driver tries again from the loader phase: ten times after pauses that double from 0.1 s to 2 s,
// then every 5 s.
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
  DeviceSpec spec;  ///< limits of the device; the driver itself sets axes and buttons
  /// Firmware by the device's manufacturer. Empty: the driver loads no firmware.
  std::vector<std::uint8_t> firmware;
  double motor_counts_per_n_m = 3000;  ///< see DeviceOptions
};

/// Detects frozen encoders: all counts are unchanged for 3 s at a force of 1 N or more. With a hand at the device this
/// cannot happen, because the tremor of a hand exceeds one count.
class EncoderWatch {
 public:
  /// Begins the detection, at the first reply of the device: the counts may now be unchanged for 3 s.
  void start(LocalTime now) noexcept {
    changed_ = now;
    are_frozen_ = false;
  }
  /// In      force_n  magnitude of the last force sent [N]
  void note(LocalTime now, const FalconCounts& encoders, double force_n) noexcept;
  bool are_frozen() const noexcept { return are_frozen_; }

 private:
  FalconCounts encoders_ = FalconCounts::Zero();
  LocalTime changed_{};  ///< time of the last change of a count, or of the last force below 1 N
  bool are_frozen_ = false;
};

/// Driver of one Falcon. Base frame D: x right, y away from the user, z up. The origin of D is 0.125 m in front of the
/// origin of the device's frame.
///
/// Model   Pose: forward kinematics, started from the last position, computes p_DH from the encoder angles.
///         VelocityEstimator computes the velocity from positions with the resolution DeviceSpec::position_step_m.
///         Force: the joint torques are τ = J⁻ᵀ F. They are converted to motor counts; if a count exceeds ±4095, all
///         three are scaled down together.
///         The force is zero in four cases:
///         1. An arm is not homed.
///         2. The user has not pulled the grip out to z = 0.170 m in the device's frame since homing. A force could
///            otherwise push a hand that still presses the grip against the stop.
///         3. The encoders count as frozen: they have not changed for 3 s at a force of 1 N or more, although the
///            tremor of a hand would change them.
///         4. The forward kinematics has found no pose for the newest encoder angles.
/// Thread  the thread of the device
class FalconDriver final : public DeviceDriver {
 public:
  /// In      port  an open port; null: the first step() opens a port, as it does after unplugging
  /// Fails   std::invalid_argument: the motor counts are out of range
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
  LocalTime loader_due_{};  ///< time of the next attempt to contact the loader
  int tries_ = 0;           ///< number of attempts in the present phase
  int attempts_ = 0;        ///< number of attempts to load the firmware
  std::size_t uploaded_ = 0;
  std::size_t echoed_ = 0;
  FalconPacketParser parser_;
  std::array<std::uint8_t, 64> bytes_{};
  LocalTime replied_{};
  DeviceSample last_;  ///< last sample that was received while all arms were homed
  bool is_homed_ = false;
  bool has_homing_begun_ = false;
  bool is_in_ = false;  ///< true: the user has not pulled the grip out since homing, so the device is not ready
  LocalTime homing_since_{};
  Vec3 p_m_ = Vec3(0, 0, 0.125);  ///< position of the grip in the device's frame [m]
  bool has_pose_ = false;
  haptics::VelocityEstimator velocity_;
  EncoderWatch encoders_;
  double force_n_ = 0;  ///< magnitude of the last force sent [N]
  bool may_be_on_ = false;
};

}  // namespace tandem::devices
