// See run_settings.hpp.
#include "client/app/run_settings.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "client/app/security_options.hpp"
#include "common/geometry/drawing_asset.hpp"

namespace tandem::client {
namespace {

// Amount by which the priority of the io thread is below that of the haptic thread.
constexpr int kIoPriorityBelow = 10;

}  // namespace

ClientIoSettings io_settings(const ClientOptions& options, const haptics::SafetySettings& safety) {
  ClientIoSettings settings = options.io;
  settings.client.session.device = options.device.profile;
  settings.client.haptics.stage = options.stage;
  settings.client.haptics.safety = safety;
  settings.client.haptics.coupling_bounds = devices::coupling_bounds(options.device.profile);
  if (options.realtime_priority > 0) {
    settings.realtime_priority = std::max(1, options.realtime_priority - kIoPriorityBelow);
  }
  settings.client.haptics.feeds_view = options.window.is_open || options.reads_commands;
  if (!options.window.is_open) return settings;
  settings.client.session.wants_soft_shapes = true;
  settings.client.session.drawn_asset_kinds = {geometry::kDrawingAssetKind, "molecule"};
  // A run with a window always has simulated links, because sliders in the window change their parameters.
  if (!settings.links) settings.links = SimulatedLinks{{}, {}, options.seed};
  return settings;
}

ClientOptions options_to_join(ClientOptions options, const JoinTarget& target, const std::string& user,
                              bool is_own_server) {
  SessionSettings& session = options.io.client.session;
  options.io.trust.reset();
  options.io.port = ClientIoSettings{}.port;
  session.token.clear();
  session.room.clear();
  if (!user.empty()) session.user_name = user;
  apply_server(target.address, options.io);
  SecurityOptions security;
  if (target.invitation) security.invitation = proto::text_of(*target.invitation);
  security.is_insecure = !target.invitation;
  if (is_own_server && !target.invitation) session.role = wire::ROLE_OPERATOR;
  apply_security(security, !target.invitation, options.io);
  return options;
}

ClientOptions options_of_next(ClientOptions options) {
  options.trace.clear();
  options.record.clear();
  return options;
}

ClientOptions with_pointer(ClientOptions options) {
  if ((options.window.is_open || options.reads_commands) && options.device.name == "mouse") {
    options.device.pointer = std::make_shared<devices::Pointer>();
  }
  return options;
}

std::shared_ptr<devices::Device> cap_for_camera(const std::string& device_of_hand) {
  const devices::DeviceKind& kind = devices::find_device_kind("spacemouse");
  if (device_of_hand == kind.name) return nullptr;
  const std::vector<devices::FoundDevice> found = kind.find();
  if (std::ranges::none_of(found, [](const auto& each) { return each.problem.empty(); })) return nullptr;
  devices::DeviceOptions options;
  options.name = kind.name;
  options.profile = devices::find_device_profile(std::string(kind.profile));
  options.control = "pose";
  return devices::open_device(options);
}

void check_screenshot(const std::filesystem::path& file) {
  if (file.empty()) return;
  std::error_code error;
  const bool was_there = std::filesystem::exists(file, error);
  if (!std::ofstream(file, std::ios::app)) {
    throw std::invalid_argument("--screenshot: " + file.string() + " cannot be written");
  }
  // Removes the file that the check has created, so that no empty file remains if the run ends before the screenshot.
  if (!was_there) std::filesystem::remove(file, error);
}

std::string joined_lines(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "; ") + line;
  return text;
}

std::string coupling_lines(const std::vector<haptics::StabilityFinding>& findings) {
  std::string text;
  for (const haptics::StabilityFinding& finding : findings) {
    const bool is_refused = finding.verdict == haptics::StabilityVerdict::kUnstable;
    text +=
        std::string("tandem-client: ") + (is_refused ? "no force is displayed: " : "warning: ") + finding.text + "\n";
  }
  return text;
}

std::string stage_line(const StageSettings& stage) {
  return "stage " + stage.name + ", predictor " + stage.predictor + ", passivity " + (stage.passivity ? "on" : "off");
}

}  // namespace tandem::client
