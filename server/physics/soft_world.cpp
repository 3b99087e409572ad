#include "server/physics/soft_world.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <semaphore>
#include <thread>
#include <utility>

#include "common/realtime/realtime.hpp"
#include "server/physics/predicted_soft_contact.hpp"
#include "server/physics/soft_step.hpp"
#include "server/physics/soft_tangent.hpp"

namespace tandem::server {
namespace {

/// Number of sweeps of a soft step. A correction spreads by about one node per sweep, so 16 sweeps suffice for a pad of
/// the size of a hand.
constexpr int kSweeps = 16;
/// Displacement of a tool in a soft period above which the tool is assumed to have jumped, e.g. by a reset. It then
/// does not push aside the nodes between the two poses.
constexpr double kMaxWay_m = 0.3;
/// Lower and upper limit of the trust radius of a linear contact.
constexpr double kMinTrust_m = 1e-3;
constexpr double kMaxTrust_m = 1e-2;

struct Result {
  std::vector<SoftContact> contacts;
  std::vector<std::vector<Vec3>> nodes_W;
  TickFaults faults = 0;
  double seconds = 0;
};

/// One soft body with its derivative and its predicted contacts.
struct SteppedBody {
  SteppedBody(const SoftModel& model, const Vec3& gravity_m_per_s2, std::size_t things)
      : step(model, gravity_m_per_s2, kSweeps),
        tangent(model),
        predicted_contact(model, gravity_m_per_s2, kSweeps, things) {}
  SoftStep step;
  SoftTangent tangent;
  PredictedSoftContact predicted_contact;
};

/// Computes soft steps on the calling thread, without regard to time.
class Stepper {
 public:
  explicit Stepper(const SoftWorldSettings& settings)
      : settings_(settings),
        step_s_(soft_period_steps(settings.room_rate_hz, settings.rate_hz) / settings.room_rate_hz),
        was_present_(settings.tools.size(), false) {
    for (const SoftModel& model : settings.bodies) {
      bodies_.push_back(std::make_unique<SteppedBody>(model, settings.gravity_m_per_s2, settings.tools.size()));
    }
    for (const SoftRigid& tool : settings.tools) things_.push_back({&tool.model, tool.friction, false, {}, {}});
    for (const SoftRigid& obstacle : settings.obstacles) {
      things_.push_back({&obstacle.model, obstacle.friction, true, obstacle.X_WT, obstacle.X_WT});
    }
    reactions_.resize(things_.size());
  }

  void step(std::span<const std::optional<Pose>> X_WT, Result& result) {
    if (settings_.before_step) settings_.before_step();
    const auto begin = std::chrono::steady_clock::now();
    result.faults = 0;
    result.contacts.assign(settings_.tools.size(), SoftContact{});
    for (std::size_t i = 0; i < X_WT.size(); ++i) result.contacts[i].X_WT0 = X_WT[i].value_or(Pose{});
    move_things(X_WT);
    for (std::size_t b = 0; b < bodies_.size(); ++b) step_body(*bodies_[b], result);
    finish_contacts(result);
    predict_contacts(result);
    copy_nodes(result);
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

  void set_nodes(std::size_t body, std::span<const Vec3> nodes_W) { bodies_[body]->step.body().set_nodes(nodes_W); }

  void copy_nodes(Result& result) const {
    result.nodes_W.resize(bodies_.size());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const SoftBody& body = bodies_[b]->step.body();
      result.nodes_W[b].resize(static_cast<std::size_t>(body.node_count()));
      for (int i = 0; i < body.node_count(); ++i) result.nodes_W[b][static_cast<std::size_t>(i)] = body.position(i);
    }
  }

 private:
  void move_things(std::span<const std::optional<Pose>> X_WT) {
    for (std::size_t i = 0; i < X_WT.size(); ++i) {
      SoftThing& thing = things_[i];
      const Pose X = X_WT[i].value_or(Pose{});
      thing.is_present = X_WT[i] && is_finite(X) && thing.model->can_be_touched();
      const bool has_come = !was_present_[i] || (X.p - thing.X_WT.p).norm() > kMaxWay_m;
      thing.X_WT_before = has_come ? X : thing.X_WT;
      thing.X_WT = X;
      was_present_[i] = thing.is_present;
    }
  }

  void step_body(SteppedBody& body, Result& result) {
    std::fill(reactions_.begin(), reactions_.end(), SoftReaction{});
    if (body.step.step(step_s_, settings_.speed_limit_m_per_s, things_, reactions_)) {
      result.faults |= kFaultSpeedLimited;
    }
    if (!body.step.body().is_finite()) {
      body.step.body().reset();
      result.faults |= kFaultNotFinite;
      return;
    }
    for (std::size_t i = 0; i < settings_.tools.size(); ++i) {
      const SoftReaction& reaction = reactions_[i];
      if (!(reaction.impulse_sum > 0)) continue;
      SoftContact& contact = result.contacts[i];
      contact.wrench_W += reaction.impulse_W * (1 / step_s_);
      contact.stiffness += body.tangent.stiffness(body.step, static_cast<int>(i), step_s_);
      contact.lever_m = std::max(contact.lever_m, reaction.lever_sum_m / reaction.impulse_sum);
    }
    body.predicted_contact.advance(body.step, step_s_, settings_.speed_limit_m_per_s, things_);
  }

  /// Sets the trust radius of each contact to f/k: the depth at which a linear spring with the contact's stiffness k
  /// has the contact's force f.
  void finish_contacts(Result& result) const {
    for (SoftContact& contact : result.contacts) {
      const double force = contact.wrench_W.f.norm();
      if (!(force > 0)) continue;
      const Vec3 along = contact.wrench_W.f / force;
      const double stiffness = along.dot(contact.stiffness.topLeftCorner<3, 3>() * along);
      const double depth = stiffness > 0 ? force / stiffness : kMaxTrust_m;
      contact.trust_radius_m = std::clamp(depth, kMinTrust_m, kMaxTrust_m);
      const bool is_sound = is_finite(contact.wrench_W) && contact.stiffness.allFinite();
      if (!is_sound) contact = SoftContact{{}, Mat6::Zero(), contact.X_WT0, 0, 0};
      if (!is_sound) result.faults |= kFaultNotFinite;
    }
  }

  void predict_contacts(Result& result) const {
    for (std::size_t i = 0; i < result.contacts.size(); ++i) {
      const auto nearest = std::min_element(bodies_.begin(), bodies_.end(), [i](const auto& a, const auto& b) {
        return a->predicted_contact.gap_m(i) < b->predicted_contact.gap_m(i);
      });
      if (nearest == bodies_.end()) continue;
      result.contacts[i] = (*nearest)->predicted_contact.predict(i, things_[i].X_WT, result.contacts[i]);
    }
  }

  const SoftWorldSettings& settings_;
  double step_s_;
  std::vector<std::unique_ptr<SteppedBody>> bodies_;
  std::vector<SoftThing> things_;
  std::vector<SoftReaction> reactions_;
  std::vector<bool> was_present_;
};

}  // namespace

int soft_period_steps(double room_rate_hz, double rate_hz) {
  return std::max(1, static_cast<int>(std::lround(room_rate_hz / rate_hz)));
}

struct SoftWorld::Impl {
  Impl(SoftWorldSettings s, bool steps_aside)
      : settings(std::move(s)),
        period(soft_period_steps(settings.room_rate_hz, settings.rate_hz)),
        stepper(settings),
        input(settings.tools.size()) {
    stepper.copy_nodes(taken);
    taken.contacts.resize(settings.tools.size());
    made = taken;
    if (!steps_aside) return;
    worker = std::thread([this] {
      // This thread is created by the thread of a room that is reset, and would inherit its real-time priority.
      realtime::drop_realtime();
      work();
    });
  }
  ~Impl() {
    if (!worker.joinable()) return;
    is_ending.store(true, std::memory_order_relaxed);
    work_to_do.release();
    worker.join();
  }

  void work() {
    for (;;) {
      work_to_do.acquire();
      if (is_ending.load(std::memory_order_relaxed)) return;
      stepper.step(input, made);
      is_done.store(true, std::memory_order_release);
      is_done.notify_one();
    }
  }

  /// Returns whether the result of the worker is ready. If waits_for_worker is set, waits until it is. Otherwise the
  /// room uses a late result in a later step.
  bool is_ready() {
    if (!worker.joinable() || is_done.load(std::memory_order_acquire)) return true;
    if (!std::exchange(is_known_late, true)) late.fetch_add(1, std::memory_order_relaxed);
    if (settings.waits_for_worker) is_done.wait(false, std::memory_order_acquire);
    return settings.waits_for_worker;
  }

  TickFaults collect() {
    is_known_late = false;
    std::swap(taken, made);
    return taken.faults;
  }

  void begin(std::span<const std::optional<Pose>> X_WT) {
    std::copy_n(X_WT.begin(), std::min(X_WT.size(), input.size()), input.begin());
    if (worker.joinable()) {
      is_done.store(false, std::memory_order_relaxed);
      work_to_do.release();
    } else {
      stepper.step(input, made);
    }
  }

  const SoftWorldSettings settings;
  const int period;
  Stepper stepper;
  std::vector<std::optional<Pose>> input;  ///< poses for the step that the worker computes
  Result made;                             ///< result of the step that the worker computes
  Result taken;                            ///< result that the room uses now
  int steps_left = 0;
  bool is_under_way = false;
  bool is_known_late = false;
  std::atomic<std::uint64_t> late{0};
  std::counting_semaphore<2> work_to_do{0};
  std::atomic<bool> is_done{false};
  std::atomic<bool> is_ending{false};
  std::thread worker;
};

SoftWorld::SoftWorld(SoftWorldSettings settings, bool steps_aside)
    : impl_(std::make_unique<Impl>(std::move(settings), steps_aside)) {}
SoftWorld::~SoftWorld() = default;

TickFaults SoftWorld::advance(std::span<const std::optional<Pose>> X_WT) noexcept {
  Impl& impl = *impl_;
  TickFaults faults = 0;
  if (impl.steps_left > 0) --impl.steps_left;
  if (impl.steps_left == 0) {
    if (impl.is_under_way && !impl.is_ready()) {
      faults = kFaultSoftLate;
    } else {
      if (impl.is_under_way) faults = impl.collect();
      impl.begin(X_WT);
      impl.is_under_way = true;
      impl.steps_left = impl.period;
    }
  }
  // The contact of a tool without a user is cleared, because the next user of that tool would otherwise feel it.
  for (std::size_t i = 0; i < impl.taken.contacts.size() && i < X_WT.size(); ++i) {
    if (!X_WT[i]) impl.taken.contacts[i] = SoftContact{};
  }
  return faults;
}

const SoftContact& SoftWorld::contact(std::size_t tool) const noexcept {
  return impl_->taken.contacts[tool];
}
std::size_t SoftWorld::body_count() const {
  return impl_->settings.bodies.size();
}
std::span<const Vec3> SoftWorld::nodes_W(std::size_t body) const {
  return impl_->taken.nodes_W[body];
}
void SoftWorld::set_nodes(std::size_t body, std::span<const Vec3> nodes_W) {
  impl_->stepper.set_nodes(body, nodes_W);
  impl_->stepper.copy_nodes(impl_->taken);
}
const SoftModel& SoftWorld::model(std::size_t body) const {
  return impl_->settings.bodies[body];
}
int SoftWorld::period_steps() const {
  return impl_->period;
}
std::uint64_t SoftWorld::late_count() const {
  return impl_->late.load(std::memory_order_relaxed);
}
double SoftWorld::last_step_seconds() const {
  return impl_->taken.seconds;
}

}  // namespace tandem::server
