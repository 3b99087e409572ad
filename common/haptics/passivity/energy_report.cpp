#include "common/haptics/passivity/energy_report.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::haptics {

double EnergyReport::accept(double in_j, double out_j, double elapsed_s, double could_do_j) noexcept {
  // These comparisons also reject NaN.
  const bool is_sound = std::isfinite(in_j) && std::isfinite(out_j) && in_j >= in_j_ && out_j >= out_j_;
  if (!is_sound) {
    ++dropped_;
    return 0;
  }
  if (std::isfinite(elapsed_s)) unused_s_ = std::clamp(unused_s_ + elapsed_s, unused_s_, kMaxAtOnce_s);
  if (could_do_j > 0) unclaimed_j_ += could_do_j;
  const double gained_j = has_report_ ? std::min({in_j - in_j_, max_power_w_ * unused_s_, unclaimed_j_}) : 0.0;
  const double spent_j = has_report_ ? out_j - out_j_ : 0.0;
  unused_s_ = std::max(0.0, unused_s_ - gained_j / max_power_w_);
  unclaimed_j_ = std::min(unclaimed_j_ - gained_j, kMaxUnclaimed_j);
  has_report_ = true;
  in_j_ = in_j;
  out_j_ = out_j;
  return gained_j - spent_j;
}

}  // namespace tandem::haptics
