#include "client/model/model_ledger.hpp"

#include "common/base/work.hpp"

namespace tandem::client {

void ModelLedger::add(BodyId id) {
  bodies_.emplace_back();
  bodies_.back().id = id;
}

void ModelLedger::give_up(std::size_t body) noexcept {
  if (!is_kept_) return;
  Entry& entry = bodies_[body];
  exchanged_j_ -= energy_j(entry);
  entry.is_followed = true;
  entry.has_stepped = false;
}

void ModelLedger::follow(std::size_t body) noexcept {
  if (is_kept_) bodies_[body].followed_j = energy_j(bodies_[body]);
}

void ModelLedger::take(std::size_t body) noexcept {
  if (!is_kept_) return;
  Entry& entry = bodies_[body];
  if (entry.is_followed) exchanged_j_ += entry.followed_j;
  entry.is_followed = false;
  entry.marked_j = energy_j(entry);
}

void ModelLedger::joined(std::size_t body) noexcept {
  if (!is_kept_) return;
  Entry& entry = bodies_[body];
  const double now_j = energy_j(entry);
  exchanged_j_ += now_j - entry.marked_j;
  entry.marked_j = now_j;
}

void ModelLedger::corrected(std::size_t body) noexcept {
  if (is_kept_) corrected_j_ += energy_j(bodies_[body]) - bodies_[body].marked_j;
}

void ModelLedger::take_tool() noexcept {
  if (is_kept_) marked_tool_j_ = world_.energy_of_tool_j(tool_);
}

void ModelLedger::corrected_tool() noexcept {
  if (is_kept_) corrected_j_ += world_.energy_of_tool_j(tool_) - marked_tool_j_;
}

void ModelLedger::begin_step() noexcept {
  if (!is_kept_) return;
  for (Entry& entry : bodies_) entry.now = world_.body(entry.id).X;
}

void ModelLedger::end_step() noexcept {
  if (!is_kept_) return;
  for (Entry& entry : bodies_) {
    if (entry.is_followed) continue;
    const Wrench field_W = world_.field_wrench_W(entry.id);
    // Of the last step only the wrench of its begin was known, and not yet what it was shifted by after.
    if (entry.has_stepped) {
      field_work_j_ += held_work_j((entry.field_W + field_W) * 0.5, entry.before, entry.now) - entry.provisional_j;
    }
    entry.before = entry.now;
    entry.field_W = field_W;
    entry.provisional_j = held_work_j(field_W, entry.now, world_.body(entry.id).X);
    entry.has_stepped = true;
    field_work_j_ += entry.provisional_j;
  }
}

ModelEnergy ModelLedger::energy() const noexcept {
  if (!is_kept_) return {};
  ModelEnergy energy{world_.energy_of_tool_j(tool_), exchanged_j_ + field_work_j_, field_work_j_, corrected_j_,
                     world_.energy_of_joints_j()};
  for (const Entry& entry : bodies_) {
    if (!entry.is_followed) energy.stored_j += energy_j(entry);
  }
  return energy;
}

}  // namespace tandem::client
