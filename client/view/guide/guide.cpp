#include "client/view/guide/guide.hpp"

namespace tandem::client {
namespace {

constexpr std::string_view kComparedStage = "hold";
/// Largest motion of the tool between two frames that counts as motion of the hand. A larger motion is caused by a
/// change of the scene.
constexpr double kMaxStep_m = 0.2;

GuideStep next_of(GuideStep step) {
  return step == GuideStep::kEnd ? step : static_cast<GuideStep>(static_cast<int>(step) + 1);
}

GuideStep previous_of(GuideStep step) {
  return step == GuideStep::kTouch ? step : static_cast<GuideStep>(static_cast<int>(step) - 1);
}

/// Returns true if `is_so` has been true for the time `span` up to now. `since` stores the time at which it became
/// true.
bool has_lasted(bool is_so, Duration span, LocalTime now, std::optional<LocalTime>& since) {
  if (!is_so) {
    since.reset();
  } else if (!since) {
    since = now;
  }
  return since && now - *since >= span;
}

}  // namespace

void Guide::begin() {
  progress_.is_on = true;
  go_to(GuideStep::kTouch);
}

void Guide::resume() {
  if (progress_.step == GuideStep::kEnd) return begin();
  progress_.is_on = true;
}

void Guide::skip() {
  do {
    go_to(next_of(progress_.step));
  } while (!is_possible(progress_.step));
}

void Guide::follow(const GuideState& state, LocalTime now) {
  if (!progress_.is_on) return;
  measure(state);
  if (has_lasted(!is_possible(progress_.step), kPatience, now, impossible_since_)) {
    go_to(previous_of(progress_.step));
  } else if (has_lasted(is_done(), kSettled, now, done_since_)) {
    go_to(next_of(progress_.step));
  }
}

void Guide::measure(const GuideState& state) {
  const double moved_m = has_state_ ? (state.p_WT - last_.p_WT).norm() : 0;
  if ((state.is_holding || state.force_n >= kTouchForce_n) && moved_m < kMaxStep_m) stroke_m_ += moved_m;
  if (!state.is_holding) {
    grasp_height_m_.reset();
  } else if (!grasp_height_m_) {
    grasp_height_m_ = state.p_WT.z();
  }
  last_ = state;
  last_.stage = state.stage == kComparedStage ? kComparedStage : std::string_view{};
  has_state_ = true;
}

/// Returns true if the user can do this step, according to the last state.
bool Guide::is_possible(GuideStep step) const {
  switch (step) {
    case GuideStep::kLift:
      return last_.is_holding;
    case GuideStep::kFeel:
      return last_.added_delay >= kMinDelay;
    case GuideStep::kCompare:
      return last_.stage == kComparedStage;
    default:
      return true;
  }
}

bool Guide::is_done() const {
  switch (progress_.step) {
    case GuideStep::kTouch:
      return last_.is_holding || last_.force_n >= kTouchForce_n;
    case GuideStep::kGrasp:
      return last_.is_holding;
    case GuideStep::kLift:
      return grasp_height_m_ && last_.p_WT.z() >= *grasp_height_m_ + kLift_m;
    case GuideStep::kDelay:
      return last_.added_delay >= kMinDelay;
    case GuideStep::kFeel:
    case GuideStep::kCompare:
      return stroke_m_ >= kStroke_m;
    case GuideStep::kHold:
      return last_.stage == kComparedStage;
    case GuideStep::kBack:
      return last_.stage != kComparedStage && last_.added_delay <= kMaxSmallDelay;
    default:
      return false;
  }
}

void Guide::go_to(GuideStep step) {
  progress_.step = step;
  stroke_m_ = 0;
  done_since_.reset();
  impossible_since_.reset();
}

}  // namespace tandem::client
