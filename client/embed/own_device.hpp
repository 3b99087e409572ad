// A device that the embedding program drives: the program feeds samples and reads commands, on threads of its own.
//
//   program   feed() ──▶ newest sample ──▶  read()    haptic thread
//             force() ◀── newest command ◀── write()
//
// 1. If the feed stalls, samples are invalid from kMaxFeedAge on. The safety chain of the client then decays the force
//    within kFeedDecay, so that it is zero kZeroWithin after the last sample. It returns by the start ramp.
// 2. Independently of the chain, force() gives zero if the last sample or the last command is older than kZeroWithin.
//    It then returns zero until the haptic thread has called has_released_force(), so that the chain restarts from zero.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <utility>

#include "common/haptics/velocity_estimator.hpp"
#include "common/realtime/mailbox.hpp"
#include "devices/device_profile.hpp"

namespace tandem::client::embed {

/// Age of a sample above which it is invalid. Twice the period of the slowest documented feed, 200 Hz.
inline constexpr Duration kMaxFeedAge = std::chrono::milliseconds(10);
/// Time in which the force decays from then on (SafetySettings::fault_decay).
inline constexpr Duration kFeedDecay = std::chrono::milliseconds(8);
/// Time after the last sample, or the last command, from which the force is zero.
inline constexpr Duration kZeroWithin = std::chrono::milliseconds(20);

/// Sample of the program, checked by problem_of().
struct FedSample {
  Pose X_DH;
  Twist V_DH;
  bool has_velocity = false;  ///< false: V_DH is estimated
  std::uint32_t buttons = 0;
};
/// Returns why a sample is unusable; empty if it is usable.
const char* problem_of(const FedSample& sample) noexcept;

struct ForceCommand {
  Wrench on_hand_D;
  bool is_stale = false;       ///< feed or haptic thread has stalled; the wrench is zero
  std::uint64_t commands = 0;  ///< number of commands so far
};

class OwnDevice final : public devices::Device {
 public:
  /// Fails   std::invalid_argument: see devices::check_device_spec()
  explicit OwnDevice(devices::DeviceProfile profile);

  const devices::DeviceProfile& profile() const noexcept { return profile_; }

  /// In      sample  usable by problem_of(); its rotation is normalised here
  /// Thread  any except haptic
  void feed(LocalTime now, const FedSample& sample);
  /// Thread  any except haptic
  ForceCommand force(LocalTime now);
  /// Ends the feed: samples are invalid from now on.
  /// Thread  any
  void end_feed() noexcept { has_ended_.store(true, std::memory_order_relaxed); }
  /// Reserves the device for one client; false if it has one.
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
  std::atomic<bool> gave_zero_{false};  ///< zero has replaced a command, and the haptic thread was not informed yet
  std::atomic<bool> is_on_{false};      ///< the program has last read a force other than zero

  std::mutex feeding_;  ///< protects the next two; never taken by the haptic thread
  haptics::VelocityEstimator estimator_;
  std::atomic<Duration::rep> fed_at_{kNever};
  realtime::Mailbox<devices::DeviceSample> samples_;

  std::mutex reading_;  ///< protects the read side of `commands_`; never taken by the haptic thread
  realtime::Mailbox<Command> commands_;
  std::uint64_t command_count_ = 0;  ///< used by the haptic thread only

  static constexpr Duration::rep kNever = -1;
};

}  // namespace tandem::client::embed
