#include "common/haptics/coupling/law_fade.hpp"

#include <algorithm>

namespace tandem::haptics {
namespace {

std::vector<std::unique_ptr<CouplingLaw>> all_laws() {
  std::vector<std::unique_ptr<CouplingLaw>> laws;
  for (const CouplingLawInfo& law : coupling_laws()) laws.push_back(law.make(CouplingParameters{}));
  return laws;
}

}  // namespace

LawFade::LawFade(const CouplingLawInfo& law, const CouplingParameters& parameters)
    : laws_(all_laws()), ramp_(parameters), shown_(parameters) {
  jump_to(law, parameters);
}

/// Returns this object's instance of a law. The constructor has created one instance of each law.
CouplingLaw* LawFade::made(const CouplingLawInfo& law) const noexcept {
  return laws_[static_cast<std::size_t>(&law - coupling_laws().data())].get();
}

void LawFade::jump_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept {
  wanted_ = current_ = &law;
  from_ = to_ = made(law);
  to_->set_parameters(parameters);
  share_ = 1;
  ramp_.jump_to(parameters);
  shown_.jump_to(parameters);
}

void LawFade::fade_to(const CouplingLawInfo& law, const CouplingParameters& parameters) noexcept {
  if (&law != wanted_ && !are_exchangeable(*wanted_, law)) return;
  wanted_ = &law;
  shown_.fade_to(parameters);
  begin();
}

void LawFade::begin() noexcept {
  if (wanted_ == current_) return ramp_.fade_to(target());
  if (share_ < 1) return;
  from_ = to_;
  to_ = made(*wanted_);
  current_ = wanted_;
  ramp_.jump_to(target());
  to_->set_parameters(target());
  share_ = 0;
}

void LawFade::advance(double step_s) noexcept {
  shown_.advance(step_s);
  if (ramp_.advance(step_s)) to_->set_parameters(ramp_.now());
  if (share_ >= 1) return;
  share_ = std::min(1.0, share_ + std::max(0.0, step_s) / kLawFade_s);
  if (share_ >= 1) begin();
}

Wrench LawFade::wrench_on_tool_W(const CouplingState& state) const noexcept {
  return from_->wrench_on_tool_W(state) * (1 - share_) + to_->wrench_on_tool_W(state) * share_;
}

CouplingGradient LawFade::gradient(const CouplingState& state) const noexcept {
  const CouplingGradient from = from_->gradient(state), to = to_->gradient(state);
  CouplingGradient mixed;
  for (const auto block : {&CouplingGradient::force_by_d, &CouplingGradient::force_by_v,
                           &CouplingGradient::torque_by_theta, &CouplingGradient::torque_by_w}) {
    mixed.*block = (1 - share_) * from.*block + share_ * to.*block;
  }
  return mixed;
}

}  // namespace tandem::haptics
