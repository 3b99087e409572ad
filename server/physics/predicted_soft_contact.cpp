#include "server/physics/predicted_soft_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tandem::server {
namespace {

/// Decay length of the weights in the plane fit. A sample has the weight exp(−(distance − least distance) / kPlane_m).
constexpr double kPlane_m = 1e-3;
/// Distance to the surface below which an object is about to touch. Such an object is not pressed into the copy of the
/// body, because its real contact would come before the measurement ends.
constexpr double kMinGap_m = 1e-3;
/// Displacement of an object up to which the stiffness that was measured for it remains valid.
constexpr double kSamePlace_m = 5e-3;
/// Trust radius of a predicted contact: largest displacement of the object for which the linear prediction is valid.
constexpr double kTrust_m = 1e-2;
/// Range of accepted stiffness. A softer contact could not be felt, and a stiffer one cannot come from a soft body.
constexpr double kMinStiffness_n_per_m = 1;
constexpr double kMaxStiffness_n_per_m = 2000;

}  // namespace

/// Surface of the body near an approaching object.
struct PredictedSoftContact::Surface {
  double gap_m = 0;
  Vec3 normal_W = Vec3::UnitZ();  ///< towards the object
  Vec3 lever_W = Vec3::Zero();    ///< predicted contact point relative to the object's origin
};

/// A sample of the body near an object.
struct PredictedSoftContact::Near {
  double distance_m = 0;
  Vec3 p_W;
  Vec3 out_W;  ///< outward direction from the object
};

struct PredictedSoftContact::Watched {
  std::optional<Surface> surface;
  std::optional<double> stiffness_n_per_m;
  Vec3 p_WT = Vec3::Zero();  ///< position of the object when the stiffness was measured
};

PredictedSoftContact::PredictedSoftContact(const SoftModel& model, const Vec3& gravity_m_per_s2, int sweeps,
                                           std::size_t things)
    : pressed_(model, gravity_m_per_s2, sweeps), watched_(things) {
  p_W_.reserve(model.samples.size());
  near_.reserve(model.samples.size());
}

PredictedSoftContact::~PredictedSoftContact() = default;

std::optional<PredictedSoftContact::Surface> PredictedSoftContact::surface_near(const SoftBody& body,
                                                                                const SoftThing& thing) {
  near_.clear();
  double least = kReach_m;
  for (const physics::TouchModel::Part& part : thing.model->parts) {
    const Pose X_WS = thing.X_WT * part.X_BS;
    const double radius_m = part.shape->radius_m();
    for (std::size_t i = 0; i < p_W_.size(); ++i) {
      const Vec3 from_W = p_W_[i] - X_WS.p;
      if (from_W.norm() > radius_m + least + 5 * kPlane_m || body.inverse_mass(body.model().samples[i]) <= 0) continue;
      const contact::DistanceSample found = part.shape->field->sample(X_WS.q.conjugate() * from_W);
      least = std::min(least, found.distance_m);
      near_.push_back({found.distance_m, p_W_[i], X_WS.q * found.gradient.normalized()});
    }
  }
  if (near_.empty() || !(least < kReach_m)) return std::nullopt;
  Surface surface{least, Vec3::Zero(), Vec3::Zero()};
  double sum = 0;
  for (const Near& near : near_) {
    const double weight = std::exp(-(near.distance_m - least) / kPlane_m);
    surface.normal_W -= weight * near.out_W;
    surface.lever_W += weight * (near.p_W - near.distance_m * near.out_W - thing.X_WT.p);
    sum += weight;
  }
  if (!(surface.normal_W.norm() > 0.5 * sum)) return std::nullopt;
  surface.normal_W.normalize();
  surface.lever_W /= sum;
  return surface;
}

void PredictedSoftContact::advance(const SoftStep& real, double step_s, double speed_limit_m_per_s,
                                   std::span<const SoftThing> things) {
  const SoftBody& body = real.body();
  p_W_.clear();
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    const bool is_near = things[i].is_present && real.is_near(things[i], kReach_m);
    if (is_near && p_W_.empty()) {
      for (const SoftSample& sample : body.model().samples) p_W_.push_back(body.position(sample));
    }
    watched_[i].surface = is_near ? surface_near(body, things[i]) : std::nullopt;
    if (!watched_[i].surface) watched_[i].stiffness_n_per_m.reset();
  }
  if (steps_ >= kSteps) choose_thing(body, things);
  if (steps_ < kSteps) press(step_s, speed_limit_m_per_s, things);
}

/// Selects the next object to press into the copy: in cyclic order, the next one that does not touch yet and whose
/// stiffness was not measured at its present position.
void PredictedSoftContact::choose_thing(const SoftBody& body, std::span<const SoftThing> things) {
  for (std::size_t i = 1; i <= watched_.size(); ++i) {
    const std::size_t thing = (pressing_ + i) % watched_.size();
    const Watched& watched = watched_[thing];
    if (!watched.surface || watched.surface->gap_m < kMinGap_m) continue;
    if (watched.stiffness_n_per_m && (things[thing].X_WT.p - watched.p_WT).norm() < kSamePlace_m) continue;
    pressing_ = thing;
    normal_W_pressing_ = watched.surface->normal_W;
    p_WT_pressing_ = things[thing].X_WT.p;
    pressed_.body().copy(body);
    X_WT_pressing_ = things[thing].X_WT;
    X_WT_pressing_.p -= watched.surface->normal_W * (watched.surface->gap_m + kDepth_m);
    steps_ = 0;
    return;
  }
}

void PredictedSoftContact::press(double step_s, double speed_limit_m_per_s, std::span<const SoftThing> things) {
  Watched& watched = watched_[pressing_];
  things_.assign(things.begin(), things.end());
  reactions_.assign(things.size(), SoftReaction{});
  SoftThing& thing = things_[pressing_];
  thing.X_WT = thing.X_WT_before = X_WT_pressing_;
  pressed_.step(step_s, speed_limit_m_per_s, things_, reactions_);
  const bool is_sound = pressed_.body().is_finite();
  steps_ = is_sound && watched.surface ? steps_ + 1 : kSteps;
  if (steps_ < kSteps || !is_sound || !watched.surface) return;
  const double force_n = reactions_[pressing_].impulse_W.f.dot(normal_W_pressing_) / step_s;
  watched.stiffness_n_per_m = std::isfinite(force_n) ? std::clamp(force_n / kDepth_m, 0.0, kMaxStiffness_n_per_m) : 0;
  watched.p_WT = p_WT_pressing_;
}

double PredictedSoftContact::gap_m(std::size_t index) const {
  const Watched& watched = watched_[index];
  const bool is_known = watched.surface && watched.stiffness_n_per_m.value_or(0) >= kMinStiffness_n_per_m;
  return is_known ? watched.surface->gap_m : std::numeric_limits<double>::infinity();
}

SoftContact PredictedSoftContact::predict(std::size_t index, const Pose& X_WT, const SoftContact& now) const {
  if (!std::isfinite(gap_m(index))) return now;
  const Surface& surface = *watched_[index].surface;
  const double k = *watched_[index].stiffness_n_per_m;
  const double own_share = now.wrench_W.f.norm() / (k * kDepth_m);
  if (own_share >= 1) return now;
  Vec6 along;
  along << surface.normal_W, surface.lever_W.cross(surface.normal_W);
  SoftContact contact = now;
  contact.stiffness = (1 - own_share) * k * along * along.transpose() + own_share * now.stiffness;
  contact.trust_radius_m = (1 - own_share) * kTrust_m + own_share * now.trust_radius_m;
  contact.lever_m = std::max(surface.lever_W.norm(), now.lever_m);
  if (own_share > 0) return contact;
  const Vec6 pressed = k * kDepth_m * along;
  contact.wrench_W = {pressed.head<3>(), pressed.tail<3>()};
  contact.X_WT0 = X_WT;
  contact.X_WT0.p -= surface.normal_W * (std::max(0.0, surface.gap_m) + kDepth_m);
  return contact;
}

}  // namespace tandem::server
