#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "client/haptics/stages/force_blend.hpp"
#include "client/haptics/stages/makers.hpp"
#include "client/model/local_model.hpp"
#include "common/haptics/prediction/force_stream.hpp"

namespace tandem::client {
namespace {

/// Maximum displayed residual, as a fraction of the coupling's force and torque limits.
constexpr double kResidualShare = 1.0 / 3;

LocalModelInput model_input(const StageInput& input) {
  LocalModelInput result;
  result.input = input.tick;
  result.now = input.now;
  result.handle = input.handle;
  result.buttons = input.buttons;
  result.newest = input.newest;
  result.is_new = input.is_new;
  result.scene = input.scene;
  return result;
}

/// Predictor of the residual (server wrench minus local wrench), weighted by the accuracy of its recent predictions.
///
/// Model   r̂(t) = g r̄(t)
///         r   residual; the newest known value is one loop delay old
///         r̄   r after a low-pass filter, whose time constant ("lag of r̄") is kTime_s plus the loop delay
///         g   gain 0 … kMaxShare, separate for force and torque. It is the regression coefficient of r on the r̄ of
///             one loop delay earlier, over kMemory_s, regularised towards 0 (kForceWorth, kTorqueWorth). So persistent
///             errors (a wrong mass, a soft body) are compensated, and unpredictable errors are not displayed
///         D   duration for which the residual lasts: (Σ r²)² / Σ r⁴ over kLastingMemory_s
///         If other users are present but none has a hand on the same body, g is multiplied by a factor. The factor
///         rises from 0 to 1 as D rises from kFirst to kAll times the lag of r̄. Without this factor, a single
///         unpredicted motion of another user's hand would count as a persistent error until the motion stops.
/// Source  direct autoregression of order one over the loop; D is a participation ratio; the constants are our choice
class ScoredResidual {
 public:
  /// In      common_share  result of LocalModel::common_share()
  Wrench step(const std::optional<Wrench>& newest, Duration loop, double common_share, double period_s) noexcept;
  void reset() noexcept { *this = ScoredResidual(); }

 private:
  static constexpr double kTime_s = 0.15;
  static constexpr double kMemory_s = 1.5;
  static constexpr double kMaxShare = 0.9;
  static constexpr double kLastingMemory_s = 5;
  static constexpr double kFirst = 3, kAll = 6;
  static constexpr std::size_t kKept = 512;
  /// Regularisation of the gain [N² s, (N m)² s], added to its denominator Σ r̄². It halves the gain for a residual of
  /// 0.05 N or 2 mN m that has lasted for 0.3 s. Our choice.
  static constexpr double kForceWorth = 0.05 * 0.05 * 0.3;
  static constexpr double kTorqueWorth = 0.002 * 0.002 * 0.3;

  /// Estimator of the gain g, one for the force and one for the torque.
  class Share {
   public:
    explicit Share(double worth) : worth_(worth) {}
    /// In      known  newest known residual r
    ///         then   r̄ of one loop delay earlier; null if it is not known
    void learn(const Vec3& known, const Vec3* then, double period_s) noexcept;
    double of_lag(double lag_s, double common_share) const noexcept;

   private:
    double worth_;
    double came_true_ = 0;            ///< numerator of g: Σ r · r̄
    double predicted_ = 0;            ///< denominator of g: Σ r̄²
    double square_ = 0, fourth_ = 0;  ///< Σ r² and Σ r⁴; D = square_² / fourth_
  };

  Wrench known_;
  Wrench smooth_;
  std::array<Wrench, kKept> smooths_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  Share force_{kForceWorth}, torque_{kTorqueWorth};
};

void ScoredResidual::Share::learn(const Vec3& known, const Vec3* then, double period_s) noexcept {
  const double kept = std::exp(-period_s / kMemory_s), lasting_kept = std::exp(-period_s / kLastingMemory_s);
  came_true_ = kept * came_true_ + (then != nullptr ? known.dot(*then) * period_s : 0);
  predicted_ = kept * predicted_ + (then != nullptr ? then->squaredNorm() * period_s : 0);
  const double square = known.squaredNorm();
  square_ = lasting_kept * square_ + square * period_s;
  fourth_ = lasting_kept * fourth_ + square * square * period_s;
}

double ScoredResidual::Share::of_lag(double lag_s, double common_share) const noexcept {
  const double lasting_s = fourth_ > 0 ? square_ / fourth_ * square_ : 0;
  const double alone = std::clamp((lasting_s / lag_s - kFirst) / (kAll - kFirst), 0.0, 1.0);
  const double share = std::clamp(came_true_ / (predicted_ + worth_), 0.0, kMaxShare);
  return share * (common_share + (1 - common_share) * alone);
}

Wrench ScoredResidual::step(const std::optional<Wrench>& newest, Duration loop, double common_share,
                            double period_s) noexcept {
  if (newest && is_finite(*newest)) known_ = *newest;
  const double loop_s = to_seconds(loop), lag_s = kTime_s + loop_s;
  smooth_ += (known_ - smooth_) * std::min(1.0, period_s / lag_s);
  const auto steps = static_cast<std::size_t>(std::lround(loop_s / period_s));
  const bool is_kept = steps > 0 && steps <= count_ && steps < kKept;
  const Wrench* const then = is_kept ? &smooths_[(next_ + kKept - steps) % kKept] : nullptr;
  force_.learn(known_.f, is_kept ? &then->f : nullptr, period_s);
  torque_.learn(known_.t, is_kept ? &then->t : nullptr, period_s);
  smooths_[next_] = smooth_;
  next_ = (next_ + 1) % kKept;
  count_ = std::min(count_ + 1, kKept);
  return {smooth_.f * force_.of_lag(lag_s, common_share), smooth_.t * torque_.of_lag(lag_s, common_share)};
}

class LocalModelStage final : public Stage {
 public:
  /// In      predictor  one of predictor_names()
  explicit LocalModelStage(const std::string& predictor)
      : residual_(haptics::make_force_stream(predictor)), is_scored_(predictor == kScoredPredictor) {}

  std::string_view name() const noexcept override { return "local-model"; }
  StageOutput tick(const StageInput& input) noexcept override;
  void reset() noexcept override;
  void service() noexcept override {
    if (residual_ != nullptr) residual_->fit();
  }

 private:
  bool is_predicting() const noexcept { return residual_ != nullptr || is_scored_; }
  std::uint64_t samples() const noexcept { return residual_ != nullptr ? residual_->figures().resampled : 0; }
  Wrench predicted_residual(const StageInput& input) noexcept;

  std::unique_ptr<haptics::ForceStream> residual_;  ///< predictor of the residual; null for "none" and "scored"
  bool is_scored_;
  ScoredResidual scored_;
  ForceBlend blend_;
  bool was_local_ = false;
  bool has_shown_ = false;  ///< true: an output was displayed before; HapticCore blends in the first output
};

StageOutput LocalModelStage::tick(const StageInput& input) noexcept {
  blend_.advance(input.period_s);
  LocalModel* const model = input.newest == nullptr ? nullptr : input.local_model;
  StageOutput output;
  if (model == nullptr) {
    output = late_pose(input);
  } else {
    LocalModelInput for_model = model_input(input);
    for_model.predicts_partners = is_predicting();
    output.local_wrench_on_hand_W = model->step(for_model);
    const std::uint64_t samples_before = samples();
    const Wrench residual = predicted_residual(input);
    output.samples = samples() - samples_before;
    output.wrench_on_hand_W = output.local_wrench_on_hand_W + residual;
    output.is_predicting = is_predicting();
    output.mode = proto::ClientMode::kLocalModel;
    output.is_local = true;
    output.tool = model->tool();
    output.energy_from_local_j = -model->coupling_work_j();
    output.round_trip = model->loop_delay();
    output.has_watched_body = input.watched.is_valid();
    if (output.has_watched_body) output.watched_body = model->body(input.watched);
  }
  const bool has_jumped = model != nullptr && model->pop_jump();
  if (has_jumped || (has_shown_ && output.is_local != was_local_)) blend_.jump();
  has_shown_ = true;
  was_local_ = output.is_local;
  output.wrench_on_hand_W = blend_.apply(output.wrench_on_hand_W);
  return output;
}

Wrench LocalModelStage::predicted_residual(const StageInput& input) noexcept {
  if (!is_predicting()) return {};
  const LocalModel& model = *input.local_model;
  const auto newest = input.local_model->pop_residual();
  Wrench predicted;
  if (is_scored_) {
    predicted = scored_.step(newest, model.loop_delay(), model.common_share(), input.period_s);
  } else {
    if (newest) residual_->push(model.residual_of(), *newest);
    predicted = residual_->at(input.now);
  }
  return {clamped_to_length(predicted.f, kResidualShare * input.parameters->force_limit_n),
          clamped_to_length(predicted.t, kResidualShare * input.parameters->torque_limit_n_m)};
}

void LocalModelStage::reset() noexcept {
  if (residual_ != nullptr) residual_->reset();
  scored_.reset();
  blend_.reset();
  was_local_ = has_shown_ = false;
}

}  // namespace

std::unique_ptr<Stage> make_local_model_stage(const StageSettings& settings) {
  return std::make_unique<LocalModelStage>(settings.predictor);
}

}  // namespace tandem::client
