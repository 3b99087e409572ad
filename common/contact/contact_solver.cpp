// One step of the solver:
// 1. load() checks the input and converts it to bodies, couplings and patches with rows.
// 2. find_islands() groups bodies that touch, since only these must be solved together.
// 3. solve_island() minimises the potential of each island (ContactIsland: Newton's method). If the result is not
//    finite, the bodies of the island move as in free flight.
// 4. solve_unyielding() evaluates contacts between bodies that no force moves.
// 5. finish() returns velocities, wrenches and bristles.
#include "common/contact/contact_solver.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/contact/solver/contact_island.hpp"

namespace tandem::contact {
namespace {

/// Island id of contacts between two bodies that no force moves (static or prescribed).
constexpr int kUnyielding = -1;

bool is_usable(const SolverBody& body) {
  return std::isfinite(body.mass_kg) && body.mass_kg > 0 && body.inertia_W.allFinite() && is_finite(body.p_WC) &&
         is_finite(body.V_WC) && is_finite(body.wrench_W);
}

bool is_amount(double x) {
  return std::isfinite(x) && x >= 0;
}

bool is_usable(const SolverPatch& patch) {
  return is_amount(patch.stiffness_n_per_m3) && is_amount(patch.rigid_depth_m) && is_amount(patch.friction) &&
         is_amount(patch.dissipation_s);
}

bool is_usable(const SolverCoupling& coupling) {
  return coupling.law != nullptr && is_finite(coupling.X_WH) && is_finite(coupling.V_WH) && is_finite(coupling.X_WT) &&
         is_amount(coupling.brake_n_s_per_m) && is_amount(coupling.brake_n_m_s_per_rad);
}

/// Converts a body from the caller's input. If the input is invalid, the result is a body that does not move.
IslandBody loaded(const SolverBody& in, double step_s) {
  IslandBody body;
  if (in.is_prescribed) {
    body.is_prescribed = is_finite(in.p_WC) && is_finite(in.V_WC);
    if (!body.is_prescribed) return body;
    body.p_WC = in.p_WC;
    body.velocity << in.V_WC.v, in.V_WC.w;
    return body;
  }
  if (!is_usable(in)) return body;
  const Eigen::LLT<Eigen::Matrix3d> inertia(in.inertia_W);
  if (inertia.info() != Eigen::Success) return body;
  body.mass_kg = in.mass_kg;
  body.inertia_W = in.inertia_W;
  body.inverse_inertia_W = inertia.solve(Eigen::Matrix3d::Identity());
  body.p_WC = in.p_WC;
  body.velocity << in.V_WC.v, in.V_WC.w;
  body.free << in.V_WC.v + step_s / in.mass_kg * in.wrench_W.f,
      in.V_WC.w + step_s * (body.inverse_inertia_W * in.wrench_W.t);
  body.push_n = body.force_of(in.wrench_W);
  body.is_moving = body.free.allFinite() && body.inverse_inertia_W.allFinite() && std::isfinite(body.push_n);
  return body;
}

}  // namespace

struct ContactSolver::Impl {
  explicit Impl(const Limits& limits_in)
      : limits(limits_in), rows(limits.contacts, limits.patches), problem(limits.bodies, rows), bodies(limits.bodies) {
    members.reserve(limits.bodies);
    patches.reserve(limits.patches);
    couplings.reserve(limits.couplings);
  }

  void load(std::span<const SolverBody> bodies_in, std::span<const SolverCoupling> couplings_in,
            std::span<const SolverPatch> patches_in) noexcept;
  void load_patch(const SolverPatch& in, std::size_t index, std::size_t bodies_given) noexcept;
  void find_islands() noexcept;
  void solve_island(int island) noexcept;
  void use_free_flight(std::span<IslandPatch> touched, std::span<IslandCoupling> coupled) noexcept;
  void solve_unyielding() noexcept;
  void finish(std::span<SolverBody> bodies_out, std::span<const SolverPatch> patches_in, std::span<PatchResult> results,
              std::span<Wrench> tool_wrenches_W) const noexcept;

  /// Returns the body with this index; null if the index means a static body, or if the body's input is invalid.
  IslandBody* body_of(int index) {
    if (index < 0 || index >= body_count) return nullptr;
    IslandBody& body = bodies[static_cast<std::size_t>(index)];
    return body.is_moving || body.is_prescribed ? &body : nullptr;
  }

  Limits limits;
  ContactRows rows;
  ContactIsland problem;
  std::vector<IslandBody> bodies;
  int body_count = 0;
  std::vector<IslandPatch> patches;
  std::vector<IslandCoupling> couplings;
  std::vector<IslandBody*> members;  ///< bodies of the island that is solved
  double step_s = 0;
  SolverReport report;
};

void ContactSolver::Impl::load(std::span<const SolverBody> bodies_in, std::span<const SolverCoupling> couplings_in,
                               std::span<const SolverPatch> patches_in) noexcept {
  report = {};
  rows.clear();
  patches.clear();
  couplings.clear();
  const std::size_t count = std::min(bodies_in.size(), limits.bodies);
  body_count = static_cast<int>(count);
  report.left_out += static_cast<std::uint32_t>(bodies_in.size() - count);
  for (std::size_t i = 0; i < count; ++i) {
    bodies[i] = loaded(bodies_in[i], step_s);
    bodies[i].island = static_cast<int>(i);
    if (!bodies[i].is_moving && !bodies[i].is_prescribed) ++report.ill_formed;
  }
  for (std::size_t i = 0; i < couplings_in.size(); ++i) {
    IslandBody* body = body_of(couplings_in[i].body);
    const bool is_sound = body != nullptr && body->is_moving && is_usable(couplings_in[i]);
    if (!is_sound || couplings.size() == limits.couplings) {
      ++(is_sound ? report.left_out : report.ill_formed);
      continue;
    }
    const SolverBody& of = bodies_in[static_cast<std::size_t>(couplings_in[i].body)];
    couplings.push_back({CouplingTerm(couplings_in[i], of, step_s), body, 0, i});
  }
  for (std::size_t i = 0; i < patches_in.size(); ++i) load_patch(patches_in[i], i, bodies_in.size());
}

void ContactSolver::Impl::load_patch(const SolverPatch& in, std::size_t index, std::size_t bodies_given) noexcept {
  const auto exists = [bodies_given](int body) {
    return body == kStaticBody || (body >= 0 && static_cast<std::size_t>(body) < bodies_given);
  };
  IslandPatch patch;
  patch.a = body_of(in.a);
  patch.b = body_of(in.b);
  patch.index = index;
  const bool is_sound = exists(in.a) && exists(in.b) && patch.a != patch.b && is_usable(in);
  if (!is_sound || patches.size() == limits.patches) {
    ++(is_sound ? report.left_out : report.ill_formed);
    return;
  }
  PatchTerms& terms = patch.terms;
  const bool is_about_a = patch.moves_a() || (patch.a != nullptr && !patch.moves_b());
  terms.about_W = is_about_a ? patch.a->p_WC : patch.b->p_WC;
  terms.step_s = step_s;
  terms.stiffness_n_per_m3 = in.stiffness_n_per_m3;
  terms.dissipation_s = in.dissipation_s;
  terms.friction = in.friction;
  const bool can_yield = patch.moves_a() || patch.moves_b();
  terms.rigid_depth_m = can_yield ? in.rigid_depth_m : std::numeric_limits<double>::max();
  if (rows.append(in.contacts, terms, report.ill_formed)) {
    patches.push_back(patch);
  } else {
    ++report.left_out;
  }
}

// The id of an island is the lowest index of its moving bodies.
void ContactSolver::Impl::find_islands() noexcept {
  for (const IslandPatch& patch : patches) {
    if (!patch.moves_a() || !patch.moves_b() || patch.terms.first == patch.terms.end) continue;
    const auto [keep, drop] = std::minmax(patch.a->island, patch.b->island);
    const int kept = keep, dropped = drop;
    if (kept == dropped) continue;
    for (int i = 0; i < body_count; ++i) {
      int& island = bodies[static_cast<std::size_t>(i)].island;
      if (island == dropped) island = kept;
    }
  }
  for (IslandPatch& patch : patches) {
    patch.island = patch.moves_a() ? patch.a->island : patch.moves_b() ? patch.b->island : kUnyielding;
  }
  for (IslandCoupling& coupling : couplings) coupling.island = coupling.body->island;
  const auto in_order = [](const auto& x, const auto& y) {
    return x.island != y.island ? x.island < y.island : x.index < y.index;
  };
  std::sort(patches.begin(), patches.end(), in_order);
  std::sort(couplings.begin(), couplings.end(), in_order);
}

namespace {

template <typename Entry>
std::span<Entry> of_island(std::vector<Entry>& entries, int island) {
  return {std::ranges::lower_bound(entries, island, {}, &Entry::island),
          std::ranges::upper_bound(entries, island, {}, &Entry::island)};
}

}  // namespace

void ContactSolver::Impl::solve_island(int island) noexcept {
  members.clear();
  for (int i = 0; i < body_count; ++i) {
    IslandBody& body = bodies[static_cast<std::size_t>(i)];
    if (body.is_moving && body.island == island) members.push_back(&body);
  }
  if (members.empty()) return;
  const std::span<IslandPatch> touched = of_island(patches, island);
  const std::span<IslandCoupling> coupled = of_island(couplings, island);
  problem.begin(step_s, members, touched, coupled);
  if (!problem.solve(limits.iterations)) report.has_converged = false;
  report.iterations = std::max(report.iterations, problem.iterations());
  const bool is_sound = std::all_of(members.begin(), members.end(), [](const IslandBody* body) {
    return body->velocity.allFinite() && body->residual.allFinite();
  });
  if (!is_sound) use_free_flight(touched, coupled);
}

void ContactSolver::Impl::use_free_flight(std::span<IslandPatch> touched, std::span<IslandCoupling> coupled) noexcept {
  report.has_converged = false;
  for (IslandBody* body : members) body->velocity = body->free;
  for (IslandPatch& patch : touched) patch.is_void = true;
  for (IslandCoupling& coupling : coupled) coupling.is_void = true;
}

/// Computes the forces of contacts between two bodies whose motion does not depend on forces (static or prescribed).
/// The given velocities determine these forces.
void ContactSolver::Impl::solve_unyielding() noexcept {
  for (IslandPatch& patch : of_island(patches, kUnyielding)) {
    patch.on_a_W = rows.evaluate(patch.terms, relative_twist(patch), FrictionLimit::kFollows);
  }
}

void ContactSolver::Impl::finish(std::span<SolverBody> bodies_out, std::span<const SolverPatch> patches_in,
                                 std::span<PatchResult> results, std::span<Wrench> tool_wrenches_W) const noexcept {
  for (std::size_t i = 0; i < bodies_out.size(); ++i) {
    const bool is_used = i < static_cast<std::size_t>(body_count) && (bodies[i].is_moving || bodies[i].is_prescribed);
    const Vec6 v = is_used ? bodies[i].velocity : Vec6::Zero();
    bodies_out[i].V_WC = {v.head<3>(), v.tail<3>()};
  }
  for (const IslandPatch& patch : patches) {
    const std::span<ContactPoint> contacts = patches_in[patch.index].contacts;
    if (patch.is_void) {
      for (ContactPoint& contact : contacts) contact.bristle_W.setZero();
      continue;
    }
    PatchResult result = rows.finish(patch.terms, contacts);
    if (patch.index >= results.size()) continue;
    result.on_a_W = {patch.on_a_W.f, patch.on_a_W.t + patch.terms.about_W.cross(patch.on_a_W.f)};
    results[patch.index] = result;
  }
  for (const IslandCoupling& coupling : couplings) {
    if (coupling.is_void || coupling.index >= tool_wrenches_W.size()) continue;
    tool_wrenches_W[coupling.index] = coupling.term.on_tool_W();
  }
}

ContactSolver::ContactSolver(const Limits& limits) : impl_(std::make_unique<Impl>(limits)) {}
ContactSolver::~ContactSolver() = default;

SolverReport ContactSolver::step(double step_s, std::span<SolverBody> bodies, std::span<const SolverCoupling> couplings,
                                 std::span<const SolverPatch> patches, std::span<PatchResult> results,
                                 std::span<Wrench> tool_wrenches_W) noexcept {
  std::fill(results.begin(), results.end(), PatchResult{});
  std::fill(tool_wrenches_W.begin(), tool_wrenches_W.end(), Wrench{});
  if (!(step_s > 0) || !std::isfinite(step_s)) return {.has_converged = false};
  Impl& impl = *impl_;
  impl.step_s = step_s;
  impl.load(bodies, couplings, patches);
  impl.find_islands();
  for (int island = 0; island < impl.body_count; ++island) impl.solve_island(island);
  impl.solve_unyielding();
  impl.finish(bodies, patches, results, tool_wrenches_W);
  impl.report.left_out += impl.report.ill_formed;
  return impl.report;
}

}  // namespace tandem::contact
