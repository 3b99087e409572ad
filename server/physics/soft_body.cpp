#include "server/physics/soft_body.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tandem::server {

SoftBody::SoftBody(const SoftModel& model, const Vec3& gravity_m_per_s2)
    : model_(model), volume_gradient_(model.nodes_W.size(), Vec3::Zero()) {
  world_.m_gravity = to_bullet(gravity_m_per_s2);
  world_.air_density = 0;
  body_ = std::make_unique<btSoftBody>(&world_);
  btSoftBody::Material* const material = body_->appendMaterial();
  material->m_kLST = model.traits.stiffness;
  for (std::size_t i = 0; i < model.nodes_W.size(); ++i)
    body_->appendNode(to_bullet(model.nodes_W[i]), model.mass_kg[i]);
  // `false` skips Bullet's check for existing links, whose cost is quadratic in the number of links.
  for (const auto& [a, b] : model.links) body_->appendLink(a, b, material, false);
  rest_volume_m3_ = enclosed_volume_m3(model.nodes_W, model.faces);
}

void SoftBody::predict(double step_s) {
  body_->predictMotion(step_s);
}

void SoftBody::solve_links() {
  btSoftBody::PSolve_Links(body_.get(), 1, 0);
}

/// Returns the current volume, and writes its gradient with respect to every node to volume_gradient_.
double SoftBody::update_volume() {
  const Vec3 origin = position(model_.faces.front()[0]);
  std::fill(volume_gradient_.begin(), volume_gradient_.end(), Vec3(Vec3::Zero()));
  double volume = 0;
  for (const auto& face : model_.faces) {
    const Vec3 a = position(face[0]) - origin, b = position(face[1]) - origin, c = position(face[2]) - origin;
    const Vec3 b_by_c = b.cross(c);
    volume += a.dot(b_by_c) / 6;
    volume_gradient_[static_cast<std::size_t>(face[0])] += b_by_c / 6;
    volume_gradient_[static_cast<std::size_t>(face[1])] += c.cross(a) / 6;
    volume_gradient_[static_cast<std::size_t>(face[2])] += a.cross(b) / 6;
  }
  return volume;
}

void SoftBody::solve_volume() {
  if (model_.traits.volume_stiffness <= 0) return;
  const double error = update_volume() - rest_volume_m3_;
  double sum = 0;
  for (int i = 0; i < node_count(); ++i) {
    sum += inverse_mass(i) * volume_gradient_[static_cast<std::size_t>(i)].squaredNorm();
  }
  volume_gain_ = sum > 0 ? model_.traits.volume_stiffness / sum : 0.0;
  const double step = -volume_gain_ * error;
  for (int i = 0; i < node_count(); ++i) {
    move(i, step * inverse_mass(i) * volume_gradient_[static_cast<std::size_t>(i)]);
  }
}

void SoftBody::damp_links() {
  if (model_.traits.damping <= 0) return;
  for (int i = 0; i < body_->m_links.size(); ++i) {
    btSoftBody::Link& link = body_->m_links[i];
    link.m_c3 = link.m_n[1]->m_x - link.m_n[0]->m_x;
    const double mobility = link.m_n[0]->m_im + link.m_n[1]->m_im;
    const double scale = link.m_c3.length2() * mobility;
    link.m_c2 = scale > 0 ? 1 / scale : 0.0;
  }
  btSoftBody::VSolve_Links(body_.get(), model_.traits.damping);
}

bool SoftBody::finish(double step_s, double speed_limit_m_per_s) {
  for (int i = 0; i < node_count(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    node.m_v = (node.m_x - node.m_q) / step_s;
    node.m_f.setZero();
  }
  damp_links();
  bool is_limited = false;
  for (int i = 0; i < node_count(); ++i) {
    btSoftBody::Node& node = body_->m_nodes[i];
    const double speed = node.m_v.length();
    if (!(speed > speed_limit_m_per_s)) continue;
    node.m_v *= speed_limit_m_per_s / speed;
    is_limited = true;
  }
  return is_limited;
}

void SoftBody::set_nodes(std::span<const Vec3> nodes_W) {
  if (nodes_W.size() != model_.nodes_W.size()) throw std::invalid_argument("a soft body of another number of nodes");
  for (int i = 0; i < node_count(); ++i) {
    if (inverse_mass(i) > 0) set_at_rest(i, to_bullet(nodes_W[static_cast<std::size_t>(i)]));
  }
}

void SoftBody::copy(const SoftBody& other) {
  for (int i = 0; i < node_count(); ++i) set_at_rest(i, other.body_->m_nodes[i].m_x);
}

void SoftBody::set_at_rest(int index, const btVector3& p_W) {
  btSoftBody::Node& node = body_->m_nodes[index];
  node.m_x = node.m_q = p_W;
  node.m_v.setZero();
  node.m_vn.setZero();
  node.m_f.setZero();
}

bool SoftBody::is_finite() const {
  // A node beyond this distance or speed counts as not finite. No scene is so large, and the squares below do not
  // overflow.
  constexpr double kFar_m = 1e6;
  for (int i = 0; i < node_count(); ++i) {
    const btSoftBody::Node& node = body_->m_nodes[i];
    if (!(node.m_x.length2() < kFar_m * kFar_m) || !(node.m_v.length2() < kFar_m * kFar_m)) return false;
  }
  return true;
}

Vec3 SoftBody::position(const SoftSample& sample) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) sum += sample.weights[i] * position(sample.nodes[i]);
  return sum;
}

Vec3 SoftBody::position_before(const SoftSample& sample) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < 3; ++i) sum += sample.weights[i] * position_before(sample.nodes[i]);
  return sum;
}

double SoftBody::inverse_mass(const SoftSample& sample) const {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += sample.weights[i] * sample.weights[i] * inverse_mass(sample.nodes[i]);
  return sum;
}

void SoftBody::push(const SoftSample& sample, const Vec3& push) {
  for (std::size_t i = 0; i < 3; ++i) {
    const double weight = sample.weights[i];
    if (weight > 0) move(sample.nodes[i], weight * inverse_mass(sample.nodes[i]) * push);
  }
}

}  // namespace tandem::server
