#include <algorithm>
#include <chrono>

#include "client/haptics/stages/makers.hpp"
#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::client {
namespace {

// Thresholds of contact detection: contact begins above the first and ends below the second (hysteresis). Our choice:
// above the force of damping and noise on a free tool, and below a perceptible contact force.
constexpr double kTouching_n = 0.10, kFree_n = 0.05;
constexpr double kTouching_n_m = 0.005, kFree_n_m = 0.0025;

/// Upper limit of the age of a wrench sample. A wrench of this age is not displayed, because the safety chain has
/// removed the force long before.
constexpr Duration kMaxSampleAge = std::chrono::seconds(1);

/// Returns the time of the server's step `update.stepped` on this machine's clock.
///
/// The result is clamped to the time of reception, because a wrench cannot be newer than the datagram that contains it.
/// The clamp is needed because the estimated clock offset may be wrong by years before the first exchange of time
/// stamps, or after an erroneous one. A sample with a time in the future would make the stream reject all later
/// samples.
LocalTime stepped_at(const ReceivedUpdate& received) {
  const LocalTime by_server(received.update.stepped.time_since_epoch() - received.clock_offset);
  return std::clamp(by_server, received.received - kMaxSampleAge, received.received);
}

class ForceStreamStage final : public Stage {
 public:
  explicit ForceStreamStage(std::string_view name) : stream_(haptics::force_stream_settings(name)) {}
  std::string_view name() const noexcept override { return haptics::name_of(stream_.settings().method); }

  StageOutput tick(const StageInput& input) noexcept override {
    StageOutput output;
    if (input.newest == nullptr) return output;
    if (input.is_new) {
      const Wrench& wrench = input.newest->update.wrench_on_hand_W;
      const bool was_contact = is_contact_;
      is_contact_ = is_contact(wrench, was_contact);
      const std::uint64_t samples_before = stream_.figures().resampled;
      stream_.push(stepped_at(*input.newest), wrench, is_contact_ != was_contact);
      output.samples = stream_.figures().resampled - samples_before;
    }
    output.wrench_on_hand_W = stream_.at(input.now);
    output.is_predicting = true;
    return output;
  }

  void reset() noexcept override {
    stream_.reset();
    is_contact_ = false;
  }
  void service() noexcept override { stream_.fit(); }

 private:
  haptics::ForceStream stream_;
  bool is_contact_ = false;
};

}  // namespace

std::unique_ptr<Stage> make_force_stream_stage(const StageSettings& settings) {
  return std::make_unique<ForceStreamStage>(settings.name);
}

bool is_contact(const Wrench& wrench, bool was_contact) noexcept {
  const double force_n = wrench.f.norm(), torque_n_m = wrench.t.norm();
  return was_contact ? force_n > kFree_n || torque_n_m > kFree_n_m
                     : force_n > kTouching_n || torque_n_m > kTouching_n_m;
}

}  // namespace tandem::client
