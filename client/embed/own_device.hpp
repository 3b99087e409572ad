// A device that the embedding program drives. The program passes samples to it and reads commands, on its own threads.
//
//   program   feed() ──▶ newest sample ──▶  read()    haptic thread
//             force() ◀── newest command ◀── write()
//
// 1. If the program stops passing samples, the last sample becomes invalid at the age kMaxFeedAge. The client's safety
//    chain then decays the force within kFeedDecay. So the force is zero kZeroWithin after the last sample. When
//    samples arrive again, the force is ramped up from zero.
// 2. Independently of the safety chain, force() returns zero if the last sample or the last command is older than
//    kZeroWithin. It continues to return zero until the haptic thread has called has_released_force(), so that the
//    chain restarts from zero.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>

#include "common/haptics/velocity_estimator.hpp"
#include "common/realtime/mailbox.hpp"
#include "devices/device_profile.hpp"

namespace tandem::client::embed {

/// Age of a sample above which it is invalid: twice the period of the lowest documented sample rate, 200 Hz.
inline constexpr Duration kMaxFeedAge = std::chrono::milliseconds(10);
/// Time in which the force decays to zero after the sample has become invalid (SafetySettings::fault_decay).
inline constexpr Duration kFeedDecay = std::chrono::milliseconds(8);
/// Age of the last sample, or of the last command, above which the displayed force is zero.
inline constexpr Duration kZeroWithin = std::chrono::milliseconds(20);

/// A sample that the program passes to the device. It must be checked by problem_of().
struct FedSample {
  Pose X_DH;
  Twist V_DH;
  bool has_velocity = false;  ///< false: V_DH is ignored, and the velocity is estimated from the poses
  std::uint32_t buttons = 0;
};
/// Returns why a sample is unusable; empty if it is usable.
const char* problem_of(const FedSample& sample) noexcept;

struct ForceCommand {
  Wrench on_hand_D;
  bool is_stale = false;       ///< true: the program or the haptic thread has stalled, and the wrench is zero
  std::uint64_t commands = 0;  ///< number of commands so far; a changed number shows that a command is new
};

class OwnDevice final : public devices::Device {
 public:
  /// Fails   std::invalid_argument: see devices::check_device_spec()
  explicit OwnDevice(devices::DeviceProfile profile);

  const devices::DeviceProfile& profile() const noexcept { return profile_; }

  /// Accepts a sample at the time `now`.
  /// In      sample  problem_of(sample) must be empty; its rotation is normalised
  /// Thread  any except haptic
  void feed(LocalTime now, const FedSample& sample);
  /// Returns the current command.
  /// Thread  any except haptic
  ForceCommand force(LocalTime now);
  /// Closes the device for the client: after this call, read() returns invalid samples with the state kLost.
  /// Thread  any
  void end_feed() noexcept { has_ended_.store(true, std::memory_order_relaxed); }
  /// Reserves the device for one client. Returns false if another client has reserved it.
  bool reserve() noexcept { return !is_reserved_.exchange(true); }
  void unreserve() noexcept { is_reserved_.store(false); }

  const devices::DeviceSpec& spec() const noexcept override { return profile_.spec; }
  devices::DeviceSample read(LocalTime now) noexcept override;
  bool write(LocalTime now, const Wrench& wrench_on_hand_D) noexcept override;
  bool has_released_force() noexcept override { return gave_zero_.exchange(false, std::memory_order_acq_rel); }
  bool may_be_on() const noexcept override { return is_on_.load(std::memory_order_acquire); }

 private:
  struct Command {
    LocalTime written{};
    Wrench on_hand_D;
    std::uint64_t number = 0;
  };

  devices::DeviceProfile profile_;
  std::atomic<bool> has_ended_{false};
  std::atomic<bool> is_reserved_{false};
  /// True: force() has returned zero instead of a command, and has_released_force() has not been called since.
  std::atomic<bool> gave_zero_{false};
  std::atomic<bool> is_on_{false};  ///< true: the last force that force() returned to the program was not zero

  std::mutex feeding_;  ///< serialises feed(); the haptic thread never locks it
  haptics::VelocityEstimator estimator_;
  std::atomic<Duration::rep> fed_at_{kNever};
  realtime::Mailbox<devices::DeviceSample> samples_;

  std::mutex reading_;  ///< serialises the readers of `commands_`; the haptic thread never locks it
  realtime::Mailbox<Command> commands_;
  std::uint64_t command_count_ = 0;  ///< accessed by the haptic thread only

  static constexpr Duration::rep kNever = -1;
};

}  // namespace tandem::client::embed
