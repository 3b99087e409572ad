// "linear", "ar", "ar-spline": the server's wrench, continued over its age (common/haptics/prediction/force_stream.hpp).
#pragma once

#include "client/haptics/stages/stage.hpp"
#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::client {

/// When what the server says of step `update.stepped` was true, on this machine's clock.
inline LocalTime stepped_at(const ReceivedUpdate& received) {
  return LocalTime(received.update.stepped.time_since_epoch() - received.clock_offset);
}

/// Contact as a wrench shows it: it appears above one force and vanishes below a lower one.
class ContactOnset {
 public:
  /// True when contact appeared or vanished with this wrench.
  bool changes_with(const Wrench& wrench) noexcept;
  void reset() noexcept { is_touching_ = false; }

 private:
  // Ours: above what damping and noise of a free tool show, below what a hand feels as touch.
  static constexpr double kTouching_n = 0.10, kFree_n = 0.05;
  static constexpr double kTouching_n_m = 0.005, kFree_n_m = 0.0025;
  bool is_touching_ = false;
};

/// Predicts the whole wrench: bridges the gap between updates and some milliseconds of delay, no more. In stiff contact
/// the loop closes through the network, whatever the predictor.
///
/// Model   samples are stamped with the instant of the server's step on this machine's clock, so that the horizon is
///         the measured age of the data
class ForceStreamStage final : public Stage {
 public:
  /// Fails   std::invalid_argument: not one of force_stream_names()
  explicit ForceStreamStage(std::string_view name) : stream_(haptics::force_stream_settings(name)) {}
  std::string_view name() const noexcept override { return haptics::name_of(stream_.settings().method); }
  StageOutput tick(const StageInput& input) noexcept override;
  void reset() noexcept override;
  void service() noexcept override { stream_.fit(); }

 private:
  haptics::ForceStream stream_;
  ContactOnset onset_;
};

}  // namespace tandem::client
