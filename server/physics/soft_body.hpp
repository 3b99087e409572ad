// A soft body in Bullet: nodes, links, and the parts of a position-based step that do not involve other objects.
// Private to the soft world.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <memory>
#include <span>
#include <vector>

#include "server/physics/bullet_convert.hpp"
#include "server/physics/soft_model.hpp"

namespace tandem::server {

/// Position-based soft body. Between predict() and finish() the nodes are at the intermediate positions of the solver.
///
/// Model   x and v are the position and velocity of a node, g is gravity, h the length of a step.
///         1. predict: v ← v + g h, x ← x + v h.
///         2. Sweeps over links and volume, and over contacts (SoftStep), move the nodes. Each correction conserves
///            momentum.
///         3. finish: v ← (x − x_start)/h.
/// Source  Mueller, Heidelberger, Hennix, Ratcliff, "Position based dynamics", 2007. Nodes, links, prediction and link
///         sweeps are those of Bullet. Bullet's own collisions of soft bodies are not used, because they support
///         neither distance fields nor forces on a tool.
class SoftBody {
 public:
  SoftBody(const SoftModel& model, const Vec3& gravity_m_per_s2);
  SoftBody(const SoftBody&) = delete;
  SoftBody& operator=(const SoftBody&) = delete;

  const SoftModel& model() const { return model_; }

  void predict(double step_s);
  /// Performs one sweep over the links.
  void solve_links();
  /// Corrects the enclosed volume towards its initial value.
  ///
  /// Model   Δxᵢ = −κ wᵢ ∇ᵢV (V − V₀) / Σⱼ wⱼ |∇ⱼV|². V and V₀ are the current and initial volume, κ is the volume
  ///         stiffness, and wᵢ = 1/mᵢ is the inverse mass of node i
  void solve_volume();
  /// Computes velocities from positions, damps them along the links and clamps them. Returns true if a node was
  /// clamped.
  bool finish(double step_s, double speed_limit_m_per_s);
  /// Resets the body to its initial state with zero velocity.
  void reset() { set_nodes(model_.nodes_W); }
  /// Sets the positions of all free nodes, with zero velocity.
  /// Fails   std::invalid_argument: wrong number of nodes
  void set_nodes(std::span<const Vec3> nodes_W);
  /// Copies the positions of another body of the same model and sets the velocities to zero.
  void copy(const SoftBody& other);

  bool is_finite() const;
  int node_count() const { return static_cast<int>(model_.nodes_W.size()); }
  Vec3 position(int node) const { return from_bullet(body_->m_nodes[node].m_x); }
  Vec3 position_before(int node) const { return from_bullet(body_->m_nodes[node].m_q); }
  double inverse_mass(int node) const { return body_->m_nodes[node].m_im; }
  void move(int node, const Vec3& by) { body_->m_nodes[node].m_x += to_bullet(by); }

  Vec3 position(const SoftSample& sample) const;
  Vec3 position_before(const SoftSample& sample) const;
  /// Inverse of the effective mass that resists an impulse at the sample; 0 if all nodes of the sample are anchored.
  double inverse_mass(const SoftSample& sample) const;
  /// Displaces a sample: moves each of its nodes i by bᵢ push / mᵢ, with the node's weight bᵢ and mass mᵢ. `push` is in
  /// kg·m.
  void push(const SoftSample& sample, const Vec3& push);

  /// Bullet's body, needed for the derivative of a step.
  const btSoftBody& bullet() const { return *body_; }
  /// Gradient of the volume with respect to each node, from the last solve_volume(). volume_gain() returns κ / Σⱼ
  /// wⱼ|∇ⱼV|² of the same call.
  const std::vector<Vec3>& volume_gradient() const { return volume_gradient_; }
  double volume_gain() const { return volume_gain_; }

 private:
  void set_at_rest(int index, const btVector3& p_W);
  void damp_links();
  double update_volume();

  const SoftModel& model_;
  btSoftBodyWorldInfo world_;
  std::unique_ptr<btSoftBody> body_;
  double rest_volume_m3_ = 0;
  std::vector<Vec3> volume_gradient_;
  double volume_gain_ = 0;
};

}  // namespace tandem::server
