// How the force of soft bodies changes when the rigid thing they touch moves: the derivative of a soft step, by running
// the step's own sweeps once more on small changes. Private to the soft world.
#pragma once

#include <span>
#include <vector>

#include "common/contact/contact_reduction.hpp"
#include "server/physics/soft_step.hpp"

namespace tandem::server {

/// Forward differentiation of a SoftStep by the pose X of one thing (translation, then rotation about its origin, in
/// W).
///
/// Model   δx of every node is a 3×6 matrix, 0 before the step (prediction does not know X), and so are the sums of
///         each contact. A link, moved by Bullet along Δ by Δ (l₀² − |Δ|²) / (c₀ (l₀² + |Δ|²)), is differentiated
///         where it was then: the sweep over the links is done again. With the way that the thing's surface is ahead,
///         δm = s [1, −r×] − δp (s: the share of the thing's way done by then), a pressing contact gives
///           δ(λ n) = n nᵀ δm / w − λ H δm,   H = ∂n/∂p;
///         friction F that sticks, P = 1 − n nᵀ: δF = δF + P δm / w =: δG; that slides along t, with F = μ Σλ t and
///         G what it would take to stick: δF = μ t δΣλ + (|F|/|G|) (1 − t tᵀ) δG.
///         K = −∂W/∂X = Σ [1; r×] δ(push) / h² over the pushes of that thing. Its first push gives m/h², and each sweep
///         adds what the links and the volume took back from it in between: that is how position-based stiffness
///         depends on rate, mass and sweeps. The symmetric part of K is taken, and its negative eigenvalues are put
///         to zero.
/// Source  our derivation
/// Limit   levers, volume gradient and the set of pushes are those of the step (no new contact); nodes farther than
///         kRings links from those that the thing pushes are held, as are those beyond kMaxPatch
class SoftTangent {
 public:
  static constexpr int kRings = 2;
  static constexpr std::size_t kMaxPatch = 96;

  explicit SoftTangent(const SoftModel& model);
  ~SoftTangent();

  /// −∂W/∂X of `thing` in the last step; zero without contact.
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
  /// By how much more the thing has moved there than the sample. False: the sample is not in the patch.
  bool find_lead(const SoftPush& push, bool is_own_push, Change& lead) const;
  Change pushed(const SoftPush& push, const Change& lead);
  void push(const SoftStep& step, const SoftPush& push, bool is_own_push);

  const SoftModel& model_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<int> patch_;          ///< nodes
  std::vector<std::size_t> place_;  ///< of each node in the patch; kHeld: none
  std::vector<Change> change_;      ///< of each node of the patch
  std::vector<Vec3> nodes_W_;       ///< all, during a sweep over the links
  std::vector<Link> links_;
  std::vector<Sums> sums_;  ///< of each candidate of the step
  Mat6 sum_ = Mat6::Zero();
};

}  // namespace tandem::server
