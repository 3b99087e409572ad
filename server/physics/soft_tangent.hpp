// Derivative of the force of soft bodies with respect to the pose of a touching rigid object. It is computed by
// repeating the sweeps of a step on the derivatives. Private to the soft world.
#pragma once

#include <span>
#include <vector>

#include "common/contact/contact_reduction.hpp"
#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Forward differentiation of a SoftStep with respect to the pose X of one object: translation, then rotation about the
/// object's origin, in W.
///
/// Model   δx of every node is a 3×6 matrix, initially 0 because the prediction does not depend on X. The derivatives
///         of the sums of each contact are initially 0, too. Bullet moves a link along its vector Δ by Δ (l₀² − |Δ|²) /
///         (c₀ (l₀² + |Δ|²)). This expression is differentiated at the link's position in that sweep, which is
///         therefore computed again.
///         Let δm = s [1, −r×] − δp be the motion of the object's surface relative to the sample p, with lever r and
///         the fraction s of the object's motion done so far. A normal correction gives δ(λ n) = n nᵀ δm / w − λ H δm,
///         H = ∂n/∂p. With P = 1 − n nᵀ, sticking friction F gives δF = δF + P δm / w =: δG. Let G be the friction
///         needed to stick. Friction that slides along t, with F = μ Σλ t, gives δF = μ t δΣλ + (|F|/|G|) (1 − t tᵀ)
///         δG.
///         K = −∂W/∂X = Σ [1; r×] δ(push) / h², summed over the pushes of that object; W is its wrench. The first push
///         contributes m/h². Each later sweep adds the part that links and volume have reversed since the last sweep.
///         Position-based stiffness therefore depends on rate, mass and sweeps. The result is the symmetric part of
///         K, with its negative eigenvalues set to zero.
/// Source  derived for this project
/// Limit   Levers, volume gradient and the set of pushes are those of the step, so contacts that begin or end are not
///         considered. Nodes more than kRings links away from the pushed nodes, and nodes beyond the first kMaxPatch,
///         are fixed.
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
