// The guided first minute: a sequence of tasks (steps) for a new user, from the first touch to the comparison of two
// stages under delay. The state of the session shows when a task is done. No display and no clock are needed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// Name of the shipped scene in which the guide takes place.
inline constexpr std::string_view kGuideScene = "crate";

/// Steps of the guide, in their order:
/// * kTouch, kGrasp, kLift: touch the crate, grab it, lift it together with the partner
/// * kDelay, kFeel: add a delay, and feel its effect
/// * kHold, kCompare: select the stage "hold", and feel the difference
/// * kBack: restore stage and delay; kEnd: the guide is finished
enum class GuideStep : std::uint8_t { kTouch, kGrasp, kLift, kDelay, kFeel, kHold, kCompare, kBack, kEnd };
/// Names of the steps in the stored settings of the window, indexed by GuideStep.
inline constexpr std::array<const char*, 9> kGuideStepNames{"touch", "grasp",   "lift", "delay", "feel",
                                                            "hold",  "compare", "back", "end"};
/// Number of steps with a task; kEnd has none.
inline constexpr std::size_t kGuideTasks = kGuideStepNames.size() - 1;

/// Progress of a user, stored from one run to the next.
struct GuideProgress {
  bool is_on = false;
  GuideStep step = GuideStep::kTouch;

  bool operator==(const GuideProgress&) const = default;
};

/// State of the session from which the guide recognises that the user has completed a step.
struct GuideState {
  double force_n = 0;  ///< displayed force on the hand [N]
  bool is_holding = false;
  Vec3 p_WT = Vec3::Zero();     ///< displayed position of the user's tool
  Duration added_delay{0};      ///< delay of the simulated link in each direction
  std::string_view stage = {};  ///< name of the active stage; must outlive the call that receives it
};

/// Leads the user through the steps. Some steps have a precondition; lifting, for instance, requires a held body. If
/// the precondition is lost for kPatience, the guide returns to the step before.
///
/// Thread  the one that runs the window
class Guide {
 public:
  static constexpr double kTouchForce_n = 0.3;  ///< above the forces of free motion
  static constexpr double kLift_m = 0.02;
  static constexpr double kStroke_m = 0.1;  ///< path length of the tool after which a step of feeling counts as done
  static constexpr Duration kMinDelay{std::chrono::milliseconds(150)};  ///< the user is asked to set 200 ms
  static constexpr Duration kMaxSmallDelay{std::chrono::milliseconds(20)};
  static constexpr Duration kPatience{std::chrono::seconds(1)};
  /// Time for which a condition must hold, so that a bounce or a slider in motion does not count.
  static constexpr Duration kSettled{std::chrono::milliseconds(200)};

  explicit Guide(GuideProgress progress = {}) : progress_(progress) {}

  const GuideProgress& progress() const { return progress_; }
  bool is_on() const { return progress_.is_on; }
  /// Begins with the first step.
  void begin();
  /// Shows the guide again, at the step at which it was ended. If that was the last step, begins with the first.
  void resume();
  void end() { progress_.is_on = false; }
  /// Continues with the next step that is possible in the last state.
  void skip();
  /// Evaluates the state of a frame. Does nothing while the guide is off.
  void follow(const GuideState& state, LocalTime now);

 private:
  bool is_possible(GuideStep step) const;
  bool is_done() const;
  void measure(const GuideState& state);
  void go_to(GuideStep step);

  GuideProgress progress_;
  GuideState last_;
  std::optional<double> grasp_height_m_;  ///< height of the tool when it grabbed the body
  double stroke_m_ = 0;                   ///< path length of the tool in this step, with a force or a held body
  bool has_state_ = false;
  std::optional<LocalTime> done_since_;
  std::optional<LocalTime> impossible_since_;
};

}  // namespace tandem::client
