// A Falcon from the first byte to the force at the hand, in steps.
//
//   closed ─▶ probing ──reply──────────────────────────────▶ running ─▶ homing (red) ─▶ pulled out (blue) ─▶ ready (green)
//     ▲         │ none after 20 tries                           ▲
//     │         ▼                                               │ a reply
//     │      loader (10 times: 0A 43 0D until 0A 44 2C 0D) ─▶ upload (each byte comes back) ─▶ probing
//     └── the line fails, or 100 ms without a reply ── from anywhere
//
// What fails is tried again from the loader, ten times, with pauses that double from 0.1 s to 2 s, then every 5 s.
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
  DeviceSpec spec;  ///< limits; what there is of axes and buttons is the driver's
  /// Of the device's maker; empty: it is not loaded.
  std::vector<std::uint8_t> firmware;
  double motor_counts_per_n_m = 3000;
};

/// Base frame D: x right, y away from the user, z up, its origin 0.125 m out of the device's own.
///
/// Model   angles of the encoders → forward kinematics (warm start) → p_DH; its velocity by VelocityEstimator over
///         steps of DeviceSpec::position_step_m; force → τ = J⁻ᵀ F → motor counts, scaled together to ±4095.
///         Zero force unless every arm knows its zero and, where it learnt that just now, before the grip was pulled out to
///         z = 0.170 m of the device's own frame: nobody is pushed who still leans on the stop. Encoders that do not change by a count for 3 s while 1 N or more is
///         shown are frozen: a hand trembles by more.
/// Thread  the device's
class FalconDriver final : public DeviceDriver {
 public:
  /// The port may be null: then it is opened with the steps, as after it was unplugged.
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
  LocalTime loader_due_{};  ///< its next attempt
  int tries_ = 0;           ///< in this phase
  int attempts_ = 0;        ///< to load the firmware
  std::size_t uploaded_ = 0;
  std::size_t echoed_ = 0;
  FalconPacketParser parser_;
  std::array<std::uint8_t, 64> bytes_{};
  LocalTime replied_{};
  DeviceSample last_;  ///< of a homed device
  bool is_homed_ = false;
  bool has_homing_begun_ = false;
  bool is_in_ = false;  ///< was homed just now, and is to be pulled out before it is ready
  LocalTime homing_since_{};
  Vec3 p_m_ = Vec3(0, 0, 0.125);  ///< in the device's own frame
  bool has_pose_ = false;
  haptics::VelocityEstimator velocity_;
  FalconCounts encoders_ = FalconCounts::Zero();
  double force_n_ = 0;  ///< sent last
  bool may_be_on_ = false;
  LocalTime changed_{};
  bool is_frozen_ = false;
};

}  // namespace tandem::devices
