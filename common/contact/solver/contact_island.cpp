// Newton's method on one island (bodies that touch each other). Each iteration has three parts:
// 1. evaluate() computes the residual M (V − V*) − h Σ wrenches, and assemble() its derivative.
// 2. BlockCholesky computes the step of V that would make the linearised residual zero.
// 3. search_line() takes the fraction of this step that lowers the potential.
#include "common/contact/solver/contact_island.hpp"

#include <algorithm>
#include <cmath>

namespace tandem::contact {
namespace {

/// Newton's method ends when the residual velocity is below this value, in the norm of the kinetic energy. Later steps
/// do not correct the residual, so it acts as an acceleration error: 1e-8 m/s² at 1 kHz. Rounding errors are smaller.
constexpr double kTolerance_m_per_s = 1e-11;
/// Number of first iterations in which each friction limit is μ times the normal force of the iterate. After these,
/// limits and forces have usually converged to a few parts in a thousand.
constexpr std::uint32_t kFollowingIterations = 4;
/// Maximum number of times that an island is solved again with updated friction limits.
constexpr std::uint32_t kRounds = 3;
/// Number of iterations with the exact laws of couplings, which suffices for most islands. If more are needed,
/// couplings are linearised.
constexpr std::uint32_t kExactIterations = 12;
/// The line search ends when the slope of the potential is at most this fraction of the slope at its start.
constexpr double kSlopeLeft = 0.1;
constexpr int kLineSearchSteps = 12;
/// Ratio of the hard floor's stiffness to the island's mass / h², with the step h. A contact that arrives at 1 m/s
/// penetrates the floor by h · 1 m/s / (1 + kHardness), which is 0.09 mm at 1 kHz.
constexpr double kHardness = 10;
/// Permitted depth of one contact in the hard floor [m], if all forces on the island at the start of a step press on
/// this contact.
constexpr double kHardGive_m = 2e-5;

Twist twist_of(const Vec6& v) {
  return {v.head<3>(), v.tail<3>()};
}

Vec6 vector_of(const Wrench& w) {
  return (Vec6() << w.f, w.t).finished();
}

/// Returns the twist of the body's point at `about_W`. Null represents the static world, whose twist is zero.
Twist twist_at(const IslandBody* body, const Vec3& about_W) {
  if (body == nullptr) return {};
  const Vec3 w = body->velocity.tail<3>();
  return {body->velocity.head<3>() + w.cross(about_W - body->p_WC), w};
}

/// Converts a wrench about `about_W` to a wrench about the body's centre.
Vec6 at_centre(const IslandBody& body, const Wrench& wrench, const Vec3& about_W) {
  return (Vec6() << wrench.f, wrench.t + (about_W - body.p_WC).cross(wrench.f)).finished();
}

/// Returns the matrix that converts a twist of the body's centre to the twist at `about_W`.
Mat6 shift_to(const Vec3& about_W, const IslandBody& body) {
  const Vec3 r = about_W - body.p_WC;
  Mat6 shift = Mat6::Identity();
  shift.topRightCorner<3, 3>() << 0, r.z(), -r.y(), -r.z(), 0, r.x(), r.y(), -r.x(), 0;
  return shift;
}

}  // namespace

/// Result of one iteration.
enum class ContactIsland::Progress : std::uint8_t { kMore, kDone, kFailed };

Twist relative_twist(const IslandPatch& patch) {
  const Twist of_a = twist_at(patch.a, patch.terms.about_W), of_b = twist_at(patch.b, patch.terms.about_W);
  return {of_a.v - of_b.v, of_a.w - of_b.w};
}

Vec6 IslandBody::momentum(const Vec6& v) const {
  return (Vec6() << mass_kg * v.head<3>(), inertia_W * v.tail<3>()).finished();
}

double IslandBody::residual_energy() const {
  return residual.head<3>().squaredNorm() / mass_kg + residual.tail<3>().dot(inverse_inertia_W * residual.tail<3>());
}

double IslandBody::force_of(const Wrench& wrench) const {
  const double gyration_m = std::sqrt(inertia_W.trace() / (2 * mass_kg));
  return wrench.f.norm() + wrench.t.norm() / gyration_m;
}

ContactIsland::ContactIsland(std::size_t bodies, ContactRows& rows)
    : rows_(rows), system_(bodies), start_(bodies), direction_(bodies) {}

void ContactIsland::begin(double step_s, std::span<IslandBody* const> bodies, std::span<IslandPatch> patches,
                          std::span<IslandCoupling> couplings) noexcept {
  step_s_ = step_s;
  bodies_ = bodies;
  patches_ = patches;
  couplings_ = couplings;
  iterations_ = 0;
  mass_kg_ = 0;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i]->row = i;
    mass_kg_ += bodies_[i]->mass_kg;
  }
  set_hardness();
}

// Computes the stiffness of the hard floor, which carries contacts beyond the rigid depth (ContactRows). It suffices
// for the worst case: one contact of the lightest body must stop the whole island against all forces on it.
void ContactIsland::set_hardness() noexcept {
  double push_n = 0;
  for (const IslandBody* body : bodies_) push_n += body->push_n;
  for (IslandCoupling& coupling : couplings_) {
    push_n += coupling.body->force_of(coupling.term.evaluate(twist_of(coupling.body->velocity)));
  }
  const double hard_n_per_m = kHardness * mass_kg_ / (step_s_ * step_s_) + push_n / kHardGive_m;
  for (IslandPatch& patch : patches_) patch.terms.hard_n_per_m = hard_n_per_m;
}

// Solves the island in up to three stages:
// 1. Each friction limit is μ times the normal force of the current iterate, as in the desired solution. Such forces
//    have no potential, so the iteration may not converge, but it does so in most steps.
// 2. Friction limits are kept constant, and couplings are linearised if necessary. The forces then have a potential,
//    and the iteration converges.
// 3. The kept limits may come from an early iterate whose normal forces are many times too large, for example when
//    sliding bodies collide. Therefore, stage 2 is repeated with the friction limits of the solution found.
bool ContactIsland::solve(std::uint32_t iterations) noexcept {
  friction_ = FrictionLimit::kFollows;
  evaluate();
  std::uint32_t rounds = 0;
  while (iterations_ < iterations) {
    if (iterations_ == kFollowingIterations) friction_ = FrictionLimit::kKept;
    if (iterations_ == kExactIterations) linearise();
    const Progress progress = iterate();
    if (progress == Progress::kMore) continue;
    if (progress == Progress::kFailed || friction_ == FrictionLimit::kFollows || rounds == kRounds)
      return progress == Progress::kDone;
    ++rounds;
    friction_ = FrictionLimit::kFollows;
    evaluate();
    friction_ = FrictionLimit::kKept;
  }
  return residual_energy() <= enough();
}

void ContactIsland::linearise() noexcept {
  for (IslandCoupling& coupling : couplings_) coupling.term.linearise(twist_of(coupling.body->velocity));
}

ContactIsland::Progress ContactIsland::iterate() noexcept {
  if (residual_energy() <= enough()) return Progress::kDone;
  assemble();
  if (!system_.factor()) return Progress::kFailed;
  for (std::size_t k = 0; k < bodies_.size(); ++k) direction_[k] = -bodies_[k]->residual;
  system_.solve({direction_.data(), bodies_.size()});
  double slope = 0;
  for (std::size_t k = 0; k < bodies_.size(); ++k) slope += bodies_[k]->residual.dot(direction_[k]);
  if (!std::isfinite(slope)) return Progress::kFailed;
  if (-slope <= enough()) return Progress::kDone;
  ++iterations_;
  return search_line(slope) ? Progress::kMore : Progress::kFailed;
}

double ContactIsland::enough() const {
  return mass_kg_ * kTolerance_m_per_s * kTolerance_m_per_s;
}

void ContactIsland::evaluate() noexcept {
  for (IslandBody* body : bodies_) body->residual = body->momentum(body->velocity - body->free);
  for (IslandCoupling& coupling : couplings_) {
    coupling.body->residual -= step_s_ * vector_of(coupling.term.evaluate(twist_of(coupling.body->velocity)));
  }
  for (IslandPatch& patch : patches_) {
    const Vec3& about_W = patch.terms.about_W;
    patch.on_a_W = rows_.evaluate(patch.terms, relative_twist(patch), friction_);
    if (patch.moves_a()) patch.a->residual -= step_s_ * at_centre(*patch.a, patch.on_a_W, about_W);
    if (patch.moves_b()) patch.b->residual += step_s_ * at_centre(*patch.b, patch.on_a_W, about_W);
  }
}

void ContactIsland::assemble() noexcept {
  system_.reset(bodies_.size());
  for (const IslandBody* body : bodies_) {
    Mat6& own = system_.block(body->row, body->row);
    own.diagonal().head<3>().setConstant(body->mass_kg);
    own.bottomRightCorner<3, 3>() = body->inertia_W;
  }
  for (const IslandCoupling& coupling : couplings_) {
    system_.block(coupling.body->row, coupling.body->row) += step_s_ * coupling.term.derivative();
  }
  for (const IslandPatch& patch : patches_) add_patch(patch);
}

void ContactIsland::add_patch(const IslandPatch& patch) noexcept {
  const Mat6 k = step_s_ * rows_.derivative(patch.terms);
  if (!patch.moves_b()) {  // only A moves, and terms.about_W is its centre
    system_.block(patch.a->row, patch.a->row) += k;
    return;
  }
  const Mat6 shift_b = shift_to(patch.terms.about_W, *patch.b);
  const Mat6 k_b = k * shift_b;
  system_.block(patch.b->row, patch.b->row).noalias() += shift_b.transpose() * k_b;
  if (!patch.moves_a()) return;
  const Mat6 shift_a = shift_to(patch.terms.about_W, *patch.a);
  system_.block(patch.a->row, patch.a->row).noalias() += shift_a.transpose() * (k * shift_a);
  const Mat6 a_b = shift_a.transpose() * k_b;
  if (patch.a->row > patch.b->row) {
    system_.block(patch.a->row, patch.b->row) -= a_b;
  } else {
    system_.block(patch.b->row, patch.a->row) -= a_b.transpose();
  }
}

// Searches the minimum of the potential along the Newton step. The potential is convex, so its slope increases along
// the line. Regula falsi finds the zero of the slope in a bracket. The full step is accepted at once if the slope at
// its end is negative or small.
bool ContactIsland::search_line(double slope) noexcept {
  for (std::size_t k = 0; k < bodies_.size(); ++k) start_[k] = bodies_[k]->velocity;
  const double enough = -kSlopeLeft * slope;
  double low = 0, slope_low = slope, high = 1, slope_high = slope_at(1);
  if (slope_high <= enough) return true;
  for (int i = 0; i < kLineSearchSteps && std::isfinite(slope_high); ++i) {
    const double part = std::clamp(slope_low / (slope_low - slope_high), 0.1, 0.9);
    const double middle = low + part * (high - low);
    const double slope_middle = slope_at(middle);
    if (std::abs(slope_middle) <= enough) return true;
    if (!(slope_middle > 0)) {
      low = middle;
      slope_low = slope_middle;
    } else {
      high = middle;
      slope_high = slope_middle;
    }
  }
  return std::isfinite(slope_at(low > 0 ? low : high));
}

double ContactIsland::slope_at(double scale) noexcept {
  for (std::size_t k = 0; k < bodies_.size(); ++k) bodies_[k]->velocity = start_[k] + scale * direction_[k];
  evaluate();
  double slope = 0;
  for (std::size_t k = 0; k < bodies_.size(); ++k) slope += bodies_[k]->residual.dot(direction_[k]);
  return slope;
}

double ContactIsland::residual_energy() const noexcept {
  double energy = 0;
  for (const IslandBody* body : bodies_) energy += body->residual_energy();
  return energy;
}

}  // namespace tandem::contact
