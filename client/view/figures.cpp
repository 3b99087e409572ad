#include "client/view/figures.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::client {
namespace {

constexpr Duration kBetweenCounts = std::chrono::milliseconds(200);
constexpr Duration kMemory = std::chrono::seconds(2);
/// Maximum time between two frames over which the curves are continued. A longer gap adds no values.
constexpr Duration kMaxFrame = std::chrono::milliseconds(500);

double in_ms(Duration duration) {
  return to_seconds(duration) * 1e3;
}

template <class Value>
void forget_old(std::vector<std::pair<LocalTime, Value>>& values, LocalTime now) {
  std::erase_if(values, [now](const auto& value) { return now - value.first > kMemory; });
}

double share_lost(const net::LinkCounters& now, const net::LinkCounters& then) {
  if (now.sent <= then.sent || now.lost < then.lost) return 0;
  return static_cast<double>(now.lost - then.lost) / static_cast<double>(now.sent - then.sent);
}

/// Returns the pose of the second molecule in the frame of the first, from a saved pose.
Pose pose_of(const wire::KeptPose& kept) {
  const auto& n = kept.in_first();
  return {{n[0], n[1], n[2]}, Quat(n[3], n[4], n[5], n[6])};
}

}  // namespace

Pose felt_pose(const DrawnScene& scene, const View* view, std::size_t body) {
  if (view == nullptr) return scene.bodies[body].X_WB_start;
  const auto found = std::ranges::find(view->bodies, body_id_at(body), &proto::BodyState::id);
  return found == view->bodies.end() ? scene.bodies[body].X_WB_start : found->state.X;
}

void Curve::add(double value) {
  values_[next_] = static_cast<float>(value);
  next_ = (next_ + 1) % kLength;
}

double Curve::largest() const {
  return *std::ranges::max_element(values_);
}

void Figures::add(const TickRecord& record) {
  force_max_ = std::max(force_max_, record.displayed_on_hand_D.f.norm());
  torque_max_ = std::max(torque_max_, record.displayed_on_hand_D.t.norm());
  if (last_.tick.value != 0) tick_max_ms_ = std::max(tick_max_ms_, in_ms(record.at - last_.at));
  last_ = record;
  if (record.at >= step_end_) finish_step();
}

void Figures::finish_step() {
  step_end_ = std::max(step_end_, last_.at - kStep) + kStep;
  force_n.add(std::exchange(force_max_, 0));
  torque_n_m.add(std::exchange(torque_max_, 0));
  longest_tick_ms.add(std::exchange(tick_max_ms_, 0));
  state_age_ms.add(std::max(0.0, in_ms(last_.state_age)));
}

void Figures::add(const View* view, const ClientIoSnapshot& io, LocalTime now) {
  if (view != nullptr && view->has_state) add_transit(*view, now);
  add_link(io, now);
  next_step_ = std::max(next_step_, now - kMaxFrame);
  for (; next_step_ <= now; next_step_ += kStep) {
    round_trip_ms.add(io.clock.is_known ? in_ms(io.clock.round_trip) : 0);
    residual_n.add(view != nullptr ? view->residual_on_hand_W.f.norm() : 0);
  }
}

void Figures::add_molecules(const DrawnScene& scene, const View* view, const ClientIoSnapshot& io, LocalTime now) {
  if (now < next_count_) return;
  next_count_ = now + kBetweenCounts;
  std::size_t found = 0;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    if (scene.bodies[i].molecule == nullptr) continue;
    if (found < molecules.size()) molecules[found] = i;
    ++found;
  }
  has_molecules = found == molecules.size() && io.joined != nullptr;
  if (!has_molecules) return hydrogen_bonds.clear();
  Pose X_AB = felt_pose(scene, view, molecules[0]).inverse() * felt_pose(scene, view, molecules[1]);
  X_AB.p /= io.joined->scene().molecular_field().metres_per_angstrom();
  const docking::Molecule& a = *scene.bodies[molecules[0]].molecule;
  const docking::Molecule& b = *scene.bodies[molecules[1]].molecule;
  contacts = docking::atom_contacts(a, b, X_AB).size();
  hydrogen_bonds = docking::hydrogen_bonds(a, b, X_AB);
  rmsd_angstrom.reset();
  if (io.kept_poses != nullptr) rmsd_angstrom = docking::rmsd_angstrom(b, X_AB, pose_of(io.kept_poses->front()));
}

// A transit time is the difference between the local time of arrival and the server's time of sending. The unknown
// offset between the clocks does not affect the standard deviation of transit times.
void Figures::add_transit(const View& view, LocalTime now) {
  forget_old(transits_ms_, now);
  if (view.newest.update.step != transit_of_) {
    const Duration received = view.newest.received.time_since_epoch(),
                   sent = view.newest.update.sent.time_since_epoch();
    transits_ms_.emplace_back(now, in_ms(received - sent));
  }
  transit_of_ = view.newest.update.step;
  if (transits_ms_.empty()) return;
  const auto count = static_cast<double>(transits_ms_.size());
  const double first = transits_ms_.front().second;
  double sum = 0, square_sum = 0;
  for (const auto& [at, value] : transits_ms_) {
    sum += value - first;
    square_sum += (value - first) * (value - first);
  }
  jitter_ms = std::sqrt(std::max(0.0, square_sum / count - sum / count * (sum / count)));
}

void Figures::add_link(const ClientIoSnapshot& io, LocalTime now) {
  forget_old(traffic_, now);
  traffic_.emplace_back(now, io.links);
  loss_up = share_lost(io.links.up, traffic_.front().second.up);
  loss_down = share_lost(io.links.down, traffic_.front().second.down);
}

}  // namespace tandem::client
