// Bodies that touch each other, solved together: the optimisation inside the contact solver.
#pragma once

#include <span>
#include <vector>

#include "common/contact/block_cholesky.hpp"
#include "common/contact/contact_rows.hpp"
#include "common/contact/coupling_term.hpp"

namespace tandem::contact {

struct IslandBody {
  double mass_kg = 0;
  Eigen::Matrix3d inertia_W = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d inverse_inertia_W = Eigen::Matrix3d::Identity();
  Vec3 p_WC = Vec3::Zero();
  Vec6 free = Vec6::Zero();      ///< V*: without contact and couplings
  Vec6 velocity = Vec6::Zero();  ///< V, the iterate
  Vec6 residual = Vec6::Zero();  ///< M (V − V*) − h Σ wrenches
  double push_n = 0;             ///< force from outside
  int island = 0;
  std::size_t row = 0;         ///< in the system of the island
  bool is_moving = false;      ///< as the solution says
  bool is_prescribed = false;  ///< as the caller says

  Vec6 momentum(const Vec6& v) const;
  /// Of the residual: twice the kinetic energy of the velocity that it would make.
  double residual_energy() const;
  /// Force that moves the body's surface as this wrench does, to its size.
  double force_of(const Wrench& wrench) const;
};

struct IslandPatch {
  PatchTerms terms;
  IslandBody* a = nullptr;  ///< null: static
  IslandBody* b = nullptr;
  int island = 0;
  std::size_t index = 0;  ///< among the caller's patches
  Wrench on_a_W;          ///< about terms.about_W
  bool is_void = false;   ///< its forces are not to be used

  bool moves_a() const { return a != nullptr && a->is_moving; }
  bool moves_b() const { return b != nullptr && b->is_moving; }
};

/// Of A past B, at terms.about_W.
Twist relative_twist(const IslandPatch& patch);

struct IslandCoupling {
  CouplingTerm term;
  IslandBody* body = nullptr;
  int island = 0;
  std::size_t index = 0;  ///< among the caller's couplings
  bool is_void = false;
};

/// Minimises the potential of ContactSolver over the velocities of one island after the other.
class ContactIsland {
 public:
  ContactIsland(std::size_t bodies, ContactRows& rows);

  /// The island to solve. The patches have their rows; the hardness of their floor is set here.
  void begin(double step_s, std::span<IslandBody* const> bodies, std::span<IslandPatch> patches,
             std::span<IslandCoupling> couplings) noexcept;
  /// Newton's method from the bodies' velocities. False: not converged within `iterations`.
  bool solve(std::uint32_t iterations) noexcept;
  std::uint32_t iterations() const { return iterations_; }

 private:
  void set_hardness() noexcept;
  enum class Progress : std::uint8_t;
  Progress iterate() noexcept;
  void linearise() noexcept;
  double enough() const;  ///< residual energy of a solution
  void evaluate() noexcept;
  void assemble() noexcept;
  void add_patch(const IslandPatch& patch) noexcept;
  bool search_line(double slope) noexcept;
  double slope_at(double scale) noexcept;
  double residual_energy() const noexcept;

  ContactRows& rows_;
  BlockCholesky system_;
  std::vector<Vec6> start_;      ///< of the line that is searched
  std::vector<Vec6> direction_;  ///< and where it goes
  double step_s_ = 0;
  double mass_kg_ = 0;
  std::span<IslandBody* const> bodies_;
  std::span<IslandPatch> patches_;
  std::span<IslandCoupling> couplings_;
  std::uint32_t iterations_ = 0;
  FrictionLimit friction_ = FrictionLimit::kFollows;
};

}  // namespace tandem::contact
