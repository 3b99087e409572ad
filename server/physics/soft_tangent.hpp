// Derivative of the force of soft bodies by the pose of a touching rigid object. It repeats the sweeps of the step on
// small changes. Private to the soft world.
#pragma once

#include <span>
#include <vector>

#include "common/contact/contact_reduction.hpp"
#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Forward differentiation of a SoftStep by the pose X of one object (translation, then rotation about its origin, in
/// W).
///
/// Model   δx of every node is a 3×6 matrix, initially 0 (the prediction does not depend on X), as are the sums of each
///         contact. Bullet moves a link along Δ by Δ (l₀² − |Δ|²) / (c₀ (l₀² + |Δ|²)); it is differentiated at its
///         position in that sweep, so the sweep is repeated. δm = s [1, −r×] − δp is the lead of the object's
///         surface over the sample (s: the share of the object's motion done by then). A pressing contact gives
///           δ(λ n) = n nᵀ δm / w − λ H δm,   H = ∂n/∂p.
///         With P = 1 − n nᵀ, sticking friction F gives δF = δF + P δm / w =: δG. Friction that slides along t, with
///         F = μ Σλ t and G the friction needed to stick, gives δF = μ t δΣλ + (|F|/|G|) (1 − t tᵀ) δG.
///         K = −∂W/∂X = Σ [1; r×] δ(push) / h² over the pushes of that object. Its first push gives m/h². Each sweep
///         adds the part that links and volume took back in between, so position-based stiffness depends on rate,
///         mass and sweeps. The result is the symmetric part of K with its negative eigenvalues set to zero.
/// Source  our derivation
/// Limit   levers, volume gradient and the set of pushes are those of the step (no new contact); nodes farther than
///         kRings links from the pushed nodes, or beyond kMaxPatch, are fixed
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
  /// Computes the lead of the object over the sample. Returns false if the sample is not in the patch.
  bool find_lead(const SoftPush& push, bool is_own_push, Change& lead) const;
  Change pushed(const SoftPush& push, const Change& lead);
  void push(const SoftStep& step, const SoftPush& push, bool is_own_push);

  const SoftModel& model_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<int> patch_;          ///< node indices
  std::vector<std::size_t> place_;  ///< index in the patch by node; kHeld: none
  std::vector<Change> change_;      ///< parallel to patch_
  std::vector<Vec3> nodes_W_;       ///< all nodes, during a sweep over the links
  std::vector<Link> links_;
  std::vector<Sums> sums_;  ///< parallel to the candidates of the step
  Mat6 sum_ = Mat6::Zero();
};

}  // namespace tandem::server
