// The optimisation inside the contact solver: solves all bodies of one island together.
#pragma once

#include <span>
#include <vector>

#include "common/contact/solver/block_cholesky.hpp"
#include "common/contact/solver/contact_rows.hpp"
#include "common/contact/solver/coupling_term.hpp"

namespace tandem::contact {

struct IslandBody {
  double mass_kg = 0;
  Eigen::Matrix3d inertia_W = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d inverse_inertia_W = Eigen::Matrix3d::Identity();
  Vec3 p_WC = Vec3::Zero();
  Vec6 free = Vec6::Zero();      ///< V*: velocity without contact and couplings
  Vec6 velocity = Vec6::Zero();  ///< V, the iterate
  Vec6 residual = Vec6::Zero();  ///< momentum balance M (V − V*) − h Σ wrenches, zero at the solution
  double push_n = 0;             ///< magnitude of the external wrench as a force, see force_of()
  int island = 0;
  std::size_t row = 0;         ///< index of the body's block row in the linear system
  bool is_moving = false;      ///< true: the solver computes the body's velocity
  bool is_prescribed = false;  ///< true: the caller prescribes the body's velocity

  Vec6 momentum(const Vec6& v) const;
  /// Returns the energy norm of the residual: twice the kinetic energy of the velocity that the residual would cause.
  double residual_energy() const;
  /// Returns the magnitude of a wrench as one force. The torque is divided by the body's radius of gyration.
  double force_of(const Wrench& wrench) const;
};

struct IslandPatch {
  PatchTerms terms;
  IslandBody* a = nullptr;  ///< first body of the patch; null: static
  IslandBody* b = nullptr;
  int island = 0;
  std::size_t index = 0;  ///< index among the caller's patches
  Wrench on_a_W;          ///< wrench on A, about terms.about_W
  bool is_void = false;   ///< true: the result of the patch is invalid and is reported as zero force

  bool moves_a() const { return a != nullptr && a->is_moving; }
  bool moves_b() const { return b != nullptr && b->is_moving; }
};

/// Returns the twist of A relative to B, at terms.about_W.
Twist relative_twist(const IslandPatch& patch);

struct IslandCoupling {
  CouplingTerm term;
  IslandBody* body = nullptr;
  int island = 0;
  std::size_t index = 0;  ///< index among the caller's couplings
  bool is_void = false;
};

/// Minimises the potential of ContactSolver over the velocities of one island at a time.
class ContactIsland {
 public:
  ContactIsland(std::size_t bodies, ContactRows& rows);

  /// Selects the island to solve. Computes the stiffness of the hard floor (ContactRows) for its patches, whose rows
  /// must exist already.
  void begin(double step_s, std::span<IslandBody* const> bodies, std::span<IslandPatch> patches,
             std::span<IslandCoupling> couplings) noexcept;
  /// Runs Newton's method from the bodies' velocities. Returns false if it has not converged within `iterations`.
  bool solve(std::uint32_t iterations) noexcept;
  std::uint32_t iterations() const { return iterations_; }

 private:
  void set_hardness() noexcept;
  enum class Progress : std::uint8_t;
  Progress iterate() noexcept;
  void linearise() noexcept;
  double enough() const;  ///< residual energy below which an iterate is a solution
  void evaluate() noexcept;
  void assemble() noexcept;
  void add_patch(const IslandPatch& patch) noexcept;
  bool search_line(double slope) noexcept;
  double slope_at(double scale) noexcept;
  double residual_energy() const noexcept;

  ContactRows& rows_;
  BlockCholesky system_;
  std::vector<Vec6> start_;      ///< velocities at the start of the line search
  std::vector<Vec6> direction_;  ///< direction of the line search
  double step_s_ = 0;
  double mass_kg_ = 0;
  std::span<IslandBody* const> bodies_;
  std::span<IslandPatch> patches_;
  std::span<IslandCoupling> couplings_;
  std::uint32_t iterations_ = 0;
  FrictionLimit friction_ = FrictionLimit::kFollows;
};

}  // namespace tandem::contact
