#include "client/local/model_ledger.hpp"

#include "common/work.hpp"

namespace tandem {

void ModelLedger::add(BodyId id, bool has_molecule) {
  bodies_.emplace_back();
  bodies_.back().id = id;
  bodies_.back().has_molecule = has_molecule;
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
  for (Entry& entry : bodies_) {
    entry.before = entry.now;
    entry.now = world_.body(entry.id).X;
  }
}

void ModelLedger::end_step() noexcept {
  if (!is_kept_) return;
  double view_j = 0;
  bool is_in_field = false;
  for (Entry& entry : bodies_) {
    if (!entry.has_molecule) continue;
    const Wrench field_W = world_.field_wrench_W(entry.id);
    view_j -= held_work_j((entry.field_W + field_W) * 0.5, entry.before, entry.now);
    entry.field_W = field_W;
    if (entry.is_followed) continue;
    is_in_field = true;
    count_field_work(entry);
  }
  if (is_in_field && was_in_field_) field_j_ += view_j;
  was_in_field_ = is_in_field;
}

void ModelLedger::count_field_work(Entry& entry) noexcept {
  // The wrench of this step's begin is that of the last one's end.
  if (entry.has_stepped) field_work_j_ += 0.5 * (held_work_j(entry.field_W, entry.from, entry.to) - entry.half_known_j);
  entry.from = entry.now;
  entry.to = world_.body(entry.id).X;
  entry.half_known_j = held_work_j(entry.field_W, entry.from, entry.to);
  entry.has_stepped = true;
  field_work_j_ += entry.half_known_j;
}

ModelEnergy ModelLedger::energy() const noexcept {
  if (!is_kept_) return {};
  ModelEnergy energy{world_.energy_of_tool_j(tool_), exchanged_j_ + field_work_j_, field_work_j_, field_j_,
                     corrected_j_};
  for (const Entry& entry : bodies_) {
    if (!entry.is_followed) energy.stored_j += energy_j(entry);
  }
  return energy;
}

}  // namespace tandem
