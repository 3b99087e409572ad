#include "client/session/scene_from_wire.hpp"

#include <cmath>

#include "common/haptics/coupling/laws.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/placement.hpp"
#include "proto/state.hpp"

namespace tandem::client {
namespace {

// Beyond these a scene is not one for hands, and products of the numbers lose their precision.
constexpr double kMaxPlacementM = 1e4;
constexpr double kMaxAngleDeg = 1e4;
constexpr double kMinScale = 1e-6;
constexpr double kMaxScale = 1e6;

std::string complaint(const std::string& field, double value, const std::string& remedy) {
  return field + " is " + std::to_string(value) + "; " + remedy;
}

std::string check_numbers(const google::protobuf::RepeatedField<double>& numbers, const std::string& field,
                          double limit) {
  if (numbers.size() != 0 && numbers.size() != 3) {
    return field + " has " + std::to_string(numbers.size()) + " numbers; it must have 3, or none";
  }
  for (const double number : numbers) {
    if (!std::isfinite(number) || std::abs(number) > limit) {
      return complaint(field, number, "it must be within ±" + std::to_string(limit));
    }
  }
  return {};
}

std::string check_scale(bool is_present, double value, const std::string& field) {
  if (!is_present) return field + " is absent; the server must fill it in";
  if (std::isfinite(value) && value >= kMinScale && value <= kMaxScale) return {};
  return complaint(field, value, "it must be " + std::to_string(kMinScale) + " to " + std::to_string(kMaxScale));
}

std::string fill_workspace(const wire::Workspace& workspace, const std::string& field, WorkspaceMapping& out) {
  const wire::Placement& base = workspace.device_base();
  std::string problem = check_numbers(base.position_m(), field + ".device_base.position_m", kMaxPlacementM);
  if (problem.empty()) {
    problem = check_numbers(base.rotation_xyz_deg(), field + ".device_base.rotation_xyz_deg", kMaxAngleDeg);
  }
  if (problem.empty()) {
    problem = check_scale(workspace.has_position_scale(), workspace.position_scale(), field + ".position_scale");
  }
  if (problem.empty()) {
    problem = check_scale(workspace.has_force_scale(), workspace.force_scale(), field + ".force_scale");
  }
  if (!problem.empty()) return problem;
  out = {proto::pose_from_placement(base), workspace.position_scale(), workspace.force_scale()};
  return {};
}

std::string fill_coupling(const wire::Coupling& coupling, HapticScene& out) {
  const haptics::CouplingLawInfo* law = coupling.law().empty() ? nullptr : haptics::find_coupling_law(coupling.law());
  if (law == nullptr) {
    return "scene.coupling.law is \"" + coupling.law() + "\"; this client knows " +
           haptics::listed_coupling_law_names() + ": use one of the server's version";
  }
  out.law = static_cast<std::size_t>(law - haptics::coupling_laws().data());
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    const std::string name = "scene." + std::string(field.name);
    if (!(coupling.*field.has)()) return name + " is absent; the server must fill it in";
    const double value = (coupling.*field.get)();
    if (!field.accepts(value)) {
      return complaint(name, value, "it must be " + std::to_string(field.low) + " to " + std::to_string(field.high));
    }
    out.coupling.*(field.value) = value;
  }
  return {};
}

}  // namespace

std::string fill_haptic_scene(const wire::Joined& joined, HapticScene& out) {
  const wire::Scene& scene = joined.scene();
  if (joined.user() == 0) return "user is 0; it must be 1 or more";
  if (static_cast<std::size_t>(scene.bodies_size()) > proto::kMaxBodies) {
    return "scene.bodies has " + std::to_string(scene.bodies_size()) + " entries; at most " +
           std::to_string(proto::kMaxBodies);
  }
  if (static_cast<std::size_t>(scene.tools_size()) > proto::kMaxUsers) {
    return "scene.tools has " + std::to_string(scene.tools_size()) + " entries; at most " +
           std::to_string(proto::kMaxUsers);
  }
  if (std::string problem = fill_coupling(scene.coupling(), out); !problem.empty()) return problem;
  out.may_drive = out.may_display = joined.role() == wire::ROLE_MANIPULATOR;
  if (!out.may_drive) return {};
  if (joined.tool() >= static_cast<std::uint32_t>(scene.tools_size())) {
    return "tool is " + std::to_string(joined.tool()) + "; the scene has " + std::to_string(scene.tools_size()) +
           " tools";
  }
  const auto tool = static_cast<int>(joined.tool());
  return fill_workspace(scene.tools(tool).workspace(), "scene.tools[" + std::to_string(tool) + "].workspace",
                        out.workspace);
}

}  // namespace tandem::client
