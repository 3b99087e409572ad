#include "server/physics/soft_tangent.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

namespace tandem::server {
namespace {

constexpr std::size_t kHeld = std::numeric_limits<std::size_t>::max();
/// Lever arm that converts torques to forces, so that the eigenvalues of a 6×6 stiffness are comparable.
constexpr double kLever_m = 0.02;

Eigen::Matrix3d cross_matrix(const Vec3& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

/// Returns the nearest symmetric matrix without negative eigenvalues. Distances of matrices are measured after torques
/// have been divided by kLever_m.
Mat6 never_negative(Mat6 stiffness) {
  Vec6 scale;
  scale << 1, 1, 1, kLever_m, kLever_m, kLever_m;
  const Mat6 even = scale.cwiseInverse().asDiagonal() * Mat6((stiffness + stiffness.transpose()) / 2) *
                    scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(even);
  const Mat6 positive =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
  const Mat6 scaled = scale.asDiagonal() * positive * scale.asDiagonal();
  return (scaled + scaled.transpose()) / 2;
}

}  // namespace

struct SoftTangent::Link {
  std::array<int, 2> nodes{};
  std::array<std::size_t, 2> places{};  ///< indices of the nodes in the patch; kHeld: a fixed node
  double rest2_m2 = 0;                  ///< Bullet's c₁: rest length squared
  double mobility = 0;                  ///< Bullet's c₀: (w_a + w_b) / stiffness
};

/// Derivatives of the sums of normal and of friction corrections that a contact accumulates over the sweeps.
struct SoftTangent::Sums {
  Row normal = Row::Zero();
  Change friction = Change::Zero();
};

SoftTangent::SoftTangent(const SoftModel& model)
    : model_(model), neighbours_(model.nodes_W.size()), place_(model.nodes_W.size(), kHeld) {
  for (const auto& [a, b] : model.links) {
    neighbours_[static_cast<std::size_t>(a)].push_back(b);
    neighbours_[static_cast<std::size_t>(b)].push_back(a);
  }
}

SoftTangent::~SoftTangent() = default;

/// Selects the patch: the nodes whose motion is differentiated. Nodes that the object has pushed come first, then their
/// neighbours, ring by ring. All other nodes count as fixed.
bool SoftTangent::choose_patch(const SoftStep& step, int thing) {
  patch_.clear();
  std::fill(place_.begin(), place_.end(), kHeld);
  const auto add = [this](int node) {
    std::size_t& place = place_[static_cast<std::size_t>(node)];
    if (place != kHeld || patch_.size() >= kMaxPatch) return;
    place = patch_.size();
    patch_.push_back(node);
  };
  for (const SoftPush& push : step.pushes()) {
    if (push.thing != thing) continue;
    const SoftSample& sample = model_.samples[static_cast<std::size_t>(push.sample)];
    for (std::size_t i = 0; i < 3; ++i) {
      if (sample.weights[i] > 0) add(sample.nodes[i]);
    }
  }
  std::size_t ring_begin = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const std::size_t ring_end = patch_.size();
    for (std::size_t i = ring_begin; i < ring_end; ++i) {
      for (const int neighbour : neighbours_[static_cast<std::size_t>(patch_[i])]) add(neighbour);
    }
    ring_begin = ring_end;
  }
  return !patch_.empty();
}

void SoftTangent::link_patch(const SoftBody& body) {
  links_.clear();
  for (int i = 0; i < body.bullet().m_links.size(); ++i) {
    const std::array<int, 2>& nodes = model_.links[static_cast<std::size_t>(i)];
    const std::array<std::size_t, 2> places{place_[static_cast<std::size_t>(nodes[0])],
                                            place_[static_cast<std::size_t>(nodes[1])]};
    const btSoftBody::Link& bullet = body.bullet().m_links[i];
    if ((places[0] == kHeld && places[1] == kHeld) || bullet.m_c0 <= 0) continue;
    links_.push_back({nodes, places, bullet.m_c1, bullet.m_c0});
  }
}

void SoftTangent::sweep_links(const SoftBody& body, std::span<const Vec3> nodes_W) {
  nodes_W_.assign(nodes_W.begin(), nodes_W.end());
  for (const Link& link : links_) {
    const auto [a, b] = link.places;
    Vec3& p_a = nodes_W_[static_cast<std::size_t>(link.nodes[0])];
    Vec3& p_b = nodes_W_[static_cast<std::size_t>(link.nodes[1])];
    Change change = Change::Zero();
    if (b != kHeld) change += change_[b];
    if (a != kHeld) change -= change_[a];
    const Vec3 way = p_b - p_a;
    const double sum = link.rest2_m2 + way.squaredNorm();
    const double gain = (link.rest2_m2 - way.squaredNorm()) / (link.mobility * sum);
    const double slope = -4 * link.rest2_m2 / (link.mobility * sum * sum);
    const Row stretch = slope * (way.transpose() * change);
    const Change mend = gain * change + way * stretch;
    const double mass_a = body.inverse_mass(link.nodes[0]), mass_b = body.inverse_mass(link.nodes[1]);
    p_a -= (gain * mass_a) * way;
    p_b += (gain * mass_b) * way;
    if (a != kHeld) change_[a] -= mass_a * mend;
    if (b != kHeld) change_[b] += mass_b * mend;
  }
}

void SoftTangent::sweep_volume(const SoftBody& body) {
  if (model_.traits.volume_stiffness <= 0) return;
  const std::vector<Vec3>& gradient = body.volume_gradient();
  Row error = Row::Zero();
  for (std::size_t i = 0; i < patch_.size(); ++i) {
    error += gradient[static_cast<std::size_t>(patch_[i])].transpose() * change_[i];
  }
  for (std::size_t i = 0; i < patch_.size(); ++i) {
    const double gain = body.volume_gain() * body.inverse_mass(patch_[i]);
    change_[i] -= gain * gradient[static_cast<std::size_t>(patch_[i])] * error;
  }
}

bool SoftTangent::find_lead(const SoftPush& push, bool is_own_push, Change& lead) const {
  lead.setZero();
  if (is_own_push) {
    lead.leftCols<3>() = push.way_share * Eigen::Matrix3d::Identity();
    lead.rightCols<3>() = -push.way_share * cross_matrix(push.lever_W);
  }
  const SoftSample& sample = model_.samples[static_cast<std::size_t>(push.sample)];
  bool is_in_patch = false;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t place = place_[static_cast<std::size_t>(sample.nodes[i])];
    if (place == kHeld || sample.weights[i] <= 0) continue;
    lead -= sample.weights[i] * change_[place];
    is_in_patch = true;
  }
  return is_in_patch;
}

SoftTangent::Change SoftTangent::pushed(const SoftPush& push, const Change& lead) {
  Sums& sums = sums_[static_cast<std::size_t>(push.candidate)];
  if (push.kind == SoftPush::Kind::kPress) {
    const Row size = push.mass_kg * (push.normal_W.transpose() * lead);
    sums.normal += size;
    return push.normal_W * size - push.size * push.bend_W * lead;
  }
  const Row normal = push.normal_W.transpose() * lead;
  Change friction = sums.friction + push.mass_kg * (lead - push.normal_W * normal);
  if (push.kind == SoftPush::Kind::kSlide) {
    const Row along = push.slide_W.transpose() * friction;
    friction = push.slide_W * (push.friction * sums.normal) + push.slide_share * (friction - push.slide_W * along);
  }
  const Change change = friction - sums.friction;
  sums.friction = friction;
  return change;
}

void SoftTangent::push(const SoftStep& step, const SoftPush& push, bool is_own_push) {
  Change lead;
  if (!find_lead(push, is_own_push, lead)) return;
  const Change done = pushed(push, lead);
  const SoftSample& sample = model_.samples[static_cast<std::size_t>(push.sample)];
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t place = place_[static_cast<std::size_t>(sample.nodes[i])];
    if (place == kHeld || sample.weights[i] <= 0) continue;
    change_[place] += sample.weights[i] * step.body().inverse_mass(sample.nodes[i]) * done;
  }
  if (!is_own_push) return;
  sum_.topRows<3>() += done;
  sum_.bottomRows<3>() += cross_matrix(push.lever_W) * done;
}

Mat6 SoftTangent::stiffness(const SoftStep& step, int thing, double step_s) {
  if (!choose_patch(step, thing)) return Mat6::Zero();
  link_patch(step.body());
  change_.assign(patch_.size(), Change::Zero());
  sums_.assign(step.candidate_count(), Sums{});
  sum_.setZero();
  auto next = step.pushes().begin();
  for (int sweep = 0; sweep < step.sweeps(); ++sweep) {
    sweep_links(step.body(), step.nodes_at(sweep));
    sweep_volume(step.body());
    for (; next != step.pushes().end() && next->sweep == sweep; ++next) push(step, *next, next->thing == thing);
  }
  return never_negative(sum_ / (step_s * step_s));
}

}  // namespace tandem::server
