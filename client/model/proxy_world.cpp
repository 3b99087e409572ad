#include "client/model/proxy_world.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>

#include "common/base/progress.hpp"
#include "common/contact/field/primitive_fields.hpp"
#include "common/geometry/surface_asset.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "proto/placement.hpp"
#include "proto/scene_ranges.hpp"

namespace tandem::client {
namespace {

using contact::ExactField;

/// Range of the ball's radius that GodObjectSettings allows.
constexpr double kMinRadius_m = 5e-5;
constexpr double kMaxRadius_m = 0.1;
/// Maximum number of triangles in all distinct meshes of a scene. It limits the memory for their search trees.
constexpr std::size_t kMaxTriangles = 2 * geometry::kMaxSurfaceTriangles;
/// Maximum number of triangles that may share a vertex. It limits the cost of a mesh's normals, which grows with the
/// square of this number. Usual meshes have fewer than a hundred triangles at a vertex.
constexpr int kMaxTrianglesOfVertex = 4096;
/// Minimum edge length of the bounding box of a flat mesh.
constexpr double kMinOutline_m = 1e-6;

bool is_touchable(const wire::Shape& shape) {
  return shape.kind_case() != wire::Shape::KIND_NOT_SET && !shape.has_molecule();
}

std::size_t touchable_shapes(const wire::Scene& scene) {
  std::size_t count = 0;
  for (const wire::Body& body : scene.bodies()) {
    count += static_cast<std::size_t>(std::count_if(body.shapes().begin(), body.shapes().end(), is_touchable));
  }
  return count;
}

/// Returns the exact distance field of a sphere, cylinder, capsule or box.
std::shared_ptr<const ExactField> exact_field(const wire::Shape& shape) {
  if (shape.has_sphere()) return contact::sphere_field(shape.sphere().radius_m());
  if (shape.has_cylinder()) return contact::cylinder_field(shape.cylinder().radius_m(), shape.cylinder().length_m());
  if (shape.has_capsule()) return contact::capsule_field(shape.capsule().radius_m(), shape.capsule().length_m());
  const auto& size = shape.box().size_m();
  return contact::box_field({size[0], size[1], size[2]});
}

/// Returns the radius of the largest ball about the tool's origin inside one of the tool's shapes; ≤ 0 if there is
/// none.
double largest_ball_m(const wire::Tool& tool) {
  double largest_m = 0;
  for (const wire::Shape& shape : tool.shapes()) {
    if (shape.has_mesh() || !is_touchable(shape)) continue;
    const Pose X_TS = proto::pose_from_placement(shape.placement());
    largest_m = std::max(largest_m, -exact_field(shape)->distance_m(X_TS.inverse().p));
  }
  return largest_m;
}

/// Returns the state of a frame that is rigidly attached to the moving frame `frame` at the pose `part`.
RigidState fixed_in(const RigidState& frame, const Pose& part) {
  return {frame.X * part, {frame.V.v + frame.V.w.cross(frame.X.q * part.p), frame.V.w}};
}

}  // namespace

struct ProxyWorld::Part {
  std::size_t body = 0;
  Pose X_BS;
  /// Region that the ball must have left before an excluded shape becomes an obstacle. The region is the shape itself,
  /// or the bounding box of a mesh.
  std::shared_ptr<const ExactField> outline;
  Pose X_SO;
  bool is_left_out = false;
};

namespace {

/// A shape as an obstacle for the ball.
struct TouchedShape {
  std::shared_ptr<const haptics::ProxyMesh> mesh;  ///< mesh of the obstacle; if null, `outline` is the obstacle
  std::shared_ptr<const ExactField> outline;
  Pose X_SO;
};
/// Loaded meshes, indexed by the hash of their surface asset.
using TouchedMeshes = std::map<std::string, TouchedShape>;

/// Returns the maximum number of triangles that share a vertex.
int largest_fan(const geometry::TriangleMesh& mesh) {
  std::vector<int> fans(mesh.vertices.size());
  int largest = 0;
  for (const auto& triangle : mesh.triangles) {
    for (const int index : triangle) largest = std::max(largest, ++fans[static_cast<std::size_t>(index)]);
  }
  return largest;
}

TouchedShape load_mesh(const wire::Mesh& message, const AssetMap& assets, const std::string& field) {
  const std::string name = field + ": the surface of " + message.file();
  if (message.surface_sha256().empty()) throw std::runtime_error(name + " is too large for the server to offer it");
  const proto::Bytes* const bytes = find_asset(assets, message.surface_sha256());
  if (bytes == nullptr) throw std::runtime_error(name + " is not here");
  const auto surface = geometry::surface_from(*bytes);
  if (!surface) throw std::runtime_error(name + " cannot be read");
  if (const int fan = largest_fan(*surface); fan > kMaxTrianglesOfVertex) {
    throw std::runtime_error(name + " has " + std::to_string(fan) + " triangles at one vertex; it must have at most " +
                             std::to_string(kMaxTrianglesOfVertex));
  }
  Eigen::AlignedBox3d box;
  for (const auto& triangle : surface->triangles) {
    for (const int index : triangle) box.extend(surface->vertices[static_cast<std::size_t>(index)]);
  }
  return {std::make_shared<const haptics::ProxyMesh>(*surface),
          contact::box_field(box.sizes().cwiseMax(kMinOutline_m)),
          {box.center(), Quat::Identity()}};
}

TouchedShape touched(const wire::Shape& shape, const AssetMap& assets, TouchedMeshes& meshes,
                     const std::string& field) {
  if (!shape.has_mesh()) return {nullptr, exact_field(shape), {}};
  TouchedShape& mesh = meshes[shape.mesh().surface_sha256()];
  if (mesh.mesh != nullptr) return mesh;
  mesh = load_mesh(shape.mesh(), assets, field);
  std::size_t triangles = 0;
  for (const auto& [hash, one] : meshes) triangles += one.mesh->triangle_count();
  if (triangles > kMaxTriangles) {
    throw std::runtime_error(field + ": the number of triangles up to here is " + std::to_string(triangles) +
                             "; it must be at most " + std::to_string(kMaxTriangles));
  }
  return mesh;
}

haptics::ProxyObstacle obstacle_of(const TouchedShape& shape, const Pose& X_WS, double tool_friction,
                                   double body_friction) {
  haptics::ProxyObstacle obstacle;
  obstacle.mesh = shape.mesh;
  if (shape.mesh == nullptr) obstacle.primitive = shape.outline;
  obstacle.static_friction = obstacle.dynamic_friction = std::sqrt(tool_friction * body_friction);
  obstacle.X_WB = X_WS;
  return obstacle;
}

std::string note_of(const wire::Scene& scene, std::size_t shapes, double radius_m, bool is_of_tool) {
  const auto is_molecule = [](const wire::Shape& shape) { return shape.has_molecule(); };
  const auto has_molecule = [&](const wire::Body& body) {
    return std::any_of(body.shapes().begin(), body.shapes().end(), is_molecule);
  };
  std::ostringstream text;
  text << "the hand touches " << shapes << (shapes == 1 ? " shape" : " shapes") << " with a ball of " << 1e3 * radius_m
       << " mm radius (" << (is_of_tool ? "the largest in its tool" : "its tool has none about its origin")
       << "), without torque; held bodies, other tools and effects are not felt";
  if (std::any_of(scene.bodies().begin(), scene.bodies().end(), has_molecule)) text << ", nor the molecules here";
  if (scene.soft_bodies_size() > 0) text << ", nor the soft bodies here: use stage local-model for these";
  return text.str();
}

}  // namespace

ProxyWorld::ProxyWorld(const wire::Joined& joined, const AssetMap& assets) {
  const wire::Scene& scene = joined.scene();
  const wire::Tool& tool = scene.tools(static_cast<int>(joined.tool()));
  if (const std::string problem = proto::find_range_problem(scene, "scene"); !problem.empty()) {
    throw std::runtime_error(problem);
  }
  if (tool.shapes_size() > proto::kMaxShapes) throw std::runtime_error("scene.tools.shapes are too many");
  std::vector<haptics::ProxyObstacle> obstacles;
  TouchedMeshes meshes;
  for (const wire::Body& body : scene.bodies()) {
    const std::size_t index = bodies_.size();
    const std::string field = "scene.bodies[" + std::to_string(index) + "]";
    const Pose X_WB = proto::pose_from_placement(body.placement());
    bodies_.push_back({X_WB, {}});
    is_known_.push_back(body.mass_kg() > 0 ? 0 : 1);
    for (const wire::Shape& shape : body.shapes()) {
      if (!is_touchable(shape)) continue;
      call_off_point();
      const TouchedShape what = touched(shape, assets, meshes, field + ".shapes");
      const Pose X_BS = proto::pose_from_placement(shape.placement());
      obstacles.push_back(obstacle_of(what, X_WB * X_BS, tool.friction(), body.friction()));
      parts_.push_back({index, X_BS, what.outline, what.X_SO});
    }
  }
  received_at_.resize(bodies_.size());
  motions_.resize(parts_.size());
  const double largest_m = largest_ball_m(tool);
  const bool has_own_ball = largest_m >= kMinRadius_m;
  const double radius_m = has_own_ball ? std::min(largest_m, kMaxRadius_m) : kDefaultRadius_m;
  note_ = note_of(scene, parts_.size(), radius_m, has_own_ball);
  const Vec3 start_W = proto::pose_from_placement(tool.placement()).p;
  ball_ = std::make_unique<haptics::GodObject>(haptics::GodObjectSettings{.radius_m = radius_m}, std::move(obstacles),
                                               start_W);
}

ProxyWorld::~ProxyWorld() = default;

// A new state is detected by its step number. A flag "new in this tick" would not suffice: the function is not called
// in ticks with an invalid sample, and the state may have arrived in such a tick.
const haptics::ProxyState& ProxyWorld::step(const Vec3& p_WH, const ReceivedUpdate& newest, LocalTime now,
                                            std::uint64_t absent_bodies) noexcept {
  absent_bodies_ = absent_bodies;
  if (!has_begun_ || newest.update.step != taken_) receive(newest);
  move_parts(now);
  if (!has_begun_) begin(newest.update);
  const haptics::ProxyState& state = ball_->update(p_WH, motions_);
  leave_out(newest.update.held_body, state.p_W);
  return state;
}

// Starts the ball at the tool. The bodies must be moved first (update()); then the ball is placed (reset()).
void ProxyWorld::begin(const proto::ServerUpdate& newest) noexcept {
  leave_out(newest.held_body, newest.tool.X.p);
  ball_->update(newest.tool.X.p, motions_);
  ball_->reset(newest.tool.X.p);
  has_begun_ = true;
}

// Stores the received states of bodies. An update need not contain every body; a missing body keeps its last received
// state.
void ProxyWorld::receive(const ReceivedUpdate& newest) noexcept {
  if (newest.received - last_received_ > kForgotten) has_begun_ = false;
  taken_ = newest.update.step;
  last_received_ = newest.received;
  for (const proto::BodyState& received : newest.update.bodies) {
    const std::size_t index = received.id.value - 1;  // an invalid id (0) wraps to the largest index, which is skipped
    if (index >= bodies_.size()) continue;
    bodies_[index] = received.state;
    received_at_[index] = newest.received;
    is_known_[index] = 1;
  }
}

void ProxyWorld::move_parts(LocalTime now) noexcept {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    RigidState body = bodies_[part.body];
    const bool is_moving = !body.V.v.isZero(0) || !body.V.w.isZero(0);
    const Duration since = std::clamp(now - received_at_[part.body], Duration{0}, kCarriedOn);
    if (is_moving) body.X = integrate(body.X, body.V, to_seconds(since));
    motions_[i] = fixed_in(body, part.X_BS);
  }
}

void ProxyWorld::leave_out(BodyId held, const Vec3& p_W) noexcept {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    Part& part = parts_[i];
    const bool is_absent = (absent_bodies_ >> part.body & 1U) != 0;
    const bool is_out = held == body_id_at(part.body) || is_known_[part.body] == 0 || is_absent;
    if (!is_out && !part.is_left_out) continue;
    const Vec3 p_O = (motions_[i].X * part.X_SO).inverse() * p_W;
    part.is_left_out = is_out || part.outline->distance_m(p_O) < radius_m();
    ball_->set_present(i, !part.is_left_out);
  }
}

std::string proxy_problem(const wire::Joined& joined) {
  if (joined.role() == wire::ROLE_OBSERVER) return {};
  const wire::Scene& scene = joined.scene();
  const haptics::CouplingLawInfo* const law = haptics::find_coupling_law(scene.coupling().law());
  if (law == nullptr || law->tool == haptics::ToolDynamics::kAtHandle) {
    return "coupling law " + scene.coupling().law() + " has no spring between hand and ball; use stage hold";
  }
  const std::size_t count = touchable_shapes(scene);
  const std::string remedy = "; use stage local-model";
  if (count == 0) return "a ball can touch none of its bodies, which are molecules or soft" + remedy;
  if (count <= haptics::GodObject::kMaxObstacles) return {};
  return "its bodies have " + std::to_string(count) + " shapes; a ball can touch at most " +
         std::to_string(haptics::GodObject::kMaxObstacles) + remedy;
}

}  // namespace tandem::client
