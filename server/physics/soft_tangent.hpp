// Derivative of the force of soft bodies with respect to the pose of a touching rigid object. It is computed by
// repeating the sweeps of a step on the derivatives. Private to the soft world.
#pragma once

#include <span>
#include <vector>

#include "common/contact/contact_reduction.hpp"
#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Computes the derivative of a SoftStep with respect to the pose X of one object: translation, then rotation about the
/// object's origin, in world axes.
///
/// Model   δ is the derivative with respect to X; other symbols are those of SoftStep. δx of every node is a 3×6
///         matrix. It is initially 0, because the prediction does not depend on X. The derivatives of the sums of each
///         contact are initially 0, too.
///         1. Link: Bullet moves a link along its vector Δ by Δ (l₀² − |Δ|²) / (c₀ (l₀² + |Δ|²)). l₀ is the rest
///            length, and c₀ is the sum of the inverse masses divided by the stiffness. The expression is
///            differentiated at the position of the link in that sweep. This position is computed again.
///         2. Contact: δm = s [1, −r×] − δp is the motion of the object's surface relative to the sample p. r is the
///            lever, and s is the fraction of the object's motion done so far.
///         3. Normal correction: δ(λ n) = n nᵀ δm / w − λ H δm, with H = ∂n/∂p.
///         4. Sticking friction F: δF ← δF + P δm / w =: δG, with P = 1 − n nᵀ. G is the friction needed to stick.
///         5. Sliding friction F = μ Σλ t along the unit vector t: δF = μ t δΣλ + (|F|/|G|) (1 − t tᵀ) δG.
///         6. Stiffness: K = −∂W/∂X = Σ [1; r×] δ(push) / h², where W is the object's wrench and the sum is over its
///            pushes. The first push of a contact contributes m/h², with the effective mass m of the sample. Each later
///            push contributes the part of δx that links and volume have reversed since the sweep before. The stiffness
///            of a position-based solver thus depends on rate, mass and number of sweeps. The result is the symmetric
///            part of K, with its negative eigenvalues set to zero.
/// Source  derived for this project
/// Limit   Levers, volume gradient and the set of pushes are those of the step, so contacts that begin or end are not
///         considered. Fixed nodes: those more than kRings links away from a pushed node, and those that exceed the
///         limit kMaxPatch.
class SoftTangent {
 public:
  static constexpr int kRings = 2;
  static constexpr std::size_t kMaxPatch = 96;

  explicit SoftTangent(const SoftModel& model);
  ~SoftTangent();

  /// Returns −∂W/∂X of `thing` in the last step; zero without contact.
  Mat6 stiffness(const SoftStep& step, int thing, double step_s);

 private:
  using Change = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;

  using Row = Eigen::Matrix<double, 1, 6>;

  struct Link;
  struct Sums;

  bool choose_patch(const SoftStep& step, int thing);
  void link_patch(const SoftBody& body);
  void sweep_links(const SoftBody& body, std::span<const Vec3> nodes_W);
  void sweep_volume(const SoftBody& body);
  /// Computes the motion of the object's surface relative to the sample. Returns false if no node of the sample is in
  /// the patch.
  bool find_lead(const SoftPush& push, bool is_own_push, Change& lead) const;
  Change pushed(const SoftPush& push, const Change& lead);
  void push(const SoftStep& step, const SoftPush& push, bool is_own_push);

  const SoftModel& model_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<int> patch_;          ///< indices of the nodes that are not fixed
  std::vector<std::size_t> place_;  ///< index in the patch for each node; kHeld: not in the patch
  std::vector<Change> change_;      ///< parallel to patch_
  std::vector<Vec3> nodes_W_;       ///< positions of all nodes, during a sweep over the links
  std::vector<Link> links_;
  std::vector<Sums> sums_;  ///< parallel to the candidates of the step
  Mat6 sum_ = Mat6::Zero();
};

}  // namespace tandem::server
