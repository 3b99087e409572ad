#include "client/session/scene_from_wire.hpp"

#include "common/haptics/coupling/laws.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/placement.hpp"
#include "proto/scene_ranges.hpp"
#include "proto/state.hpp"

namespace tandem::client {
namespace {

std::string fill_workspace(const wire::Workspace& workspace, const std::string& field, WorkspaceMapping& out) {
  if (std::string problem = proto::find_range_problem(workspace, field); !problem.empty()) return problem;
  out = {proto::pose_from_placement(workspace.device_base()), workspace.position_scale(), workspace.force_scale()};
  return {};
}

std::string fill_coupling(const wire::Coupling& coupling, HapticScene& out) {
  const haptics::CouplingLawInfo* law = coupling.law().empty() ? nullptr : haptics::find_coupling_law(coupling.law());
  if (law == nullptr) {
    return "scene.coupling.law is \"" + coupling.law() + "\"; this client supports " +
           haptics::listed_coupling_law_names() + ": use one of the server's version";
  }
  out.law = static_cast<std::size_t>(law - haptics::coupling_laws().data());
  if (std::string problem = proto::find_range_problem(coupling, "scene.coupling"); !problem.empty()) return problem;
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    out.coupling.*(field.value) = (coupling.*field.get)();
  }
  return {};
}

}  // namespace

std::string role_name(wire::Role role) {
  if (role == wire::ROLE_OBSERVER) return "observer";
  return role == wire::ROLE_OPERATOR ? "operator" : "manipulator";
}

std::optional<HandStart> read_start(const wire::RoomStart& start) {
  const bool is_awaited = start.awaited() > 0;
  const bool is_sound = start.awaited() <= proto::kMaxUsers && is_awaited == (start.starts_server_ns() == 0) &&
                        start.starts_server_ns() <= static_cast<std::uint64_t>(proto::kMaxTimestamp.count());
  if (!is_sound) return std::nullopt;
  if (is_awaited) return HandStart{.kind = HandStart::Kind::kAwaited};
  return HandStart{.kind = HandStart::Kind::kAt,
                   .at = ServerTime(Duration(static_cast<Duration::rep>(start.starts_server_ns())))};
}

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
  const auto start = joined.has_start() ? read_start(joined.start()) : HandStart{};
  if (!start) return "start must have either 1 to 16 awaited users or a time of the server";
  out.hand_start = *start;
  out.may_drive = out.may_display = has_tool(joined.role());
  if (!out.may_drive) return {};
  if (joined.tool() >= static_cast<std::uint32_t>(scene.tools_size())) {
    return "tool is " + std::to_string(joined.tool()) + "; the scene has " + std::to_string(scene.tools_size()) +
           " tools";
  }
  out.tool = joined.tool();
  out.coupling_bounds = HapticScene{}.coupling_bounds;
  const auto tool = static_cast<int>(joined.tool());
  return fill_workspace(scene.tools(tool).workspace(), "scene.tools[" + std::to_string(tool) + "].workspace",
                        out.workspace);
}

}  // namespace tandem::client
