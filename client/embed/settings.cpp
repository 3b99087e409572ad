#include "client/embed/settings.hpp"

#include <algorithm>
#include <cmath>

#include "client/embed/sized_struct.hpp"
#include "client/session/asset_store.hpp"
#include "common/base/folders.hpp"
#include "common/net/host_port.hpp"
#include "proto/join_token.hpp"

namespace tandem::client::embed {
namespace {

constexpr int kDefaultPriority = 70;
/// Difference between the priorities of the haptic thread and the io thread, as in tandem-client.
constexpr int kIoPriorityBelow = 10;

/// Value for a maximum that the program did not set. It is higher than any real maximum, so that only the bounds for
/// unverified devices apply (devices::coupling_bounds()).
const devices::SourcedLimit kUnknown{1e9, "unverified: the program has not given it"};

[[noreturn]] void refuse(const std::string& text) {
  throw StatusError(TANDEM_BAD_ARGUMENT, text);
}

std::string text_or(const char* text, const char* otherwise = "") {
  return text == nullptr || *text == '\0' ? otherwise : text;
}

/// Returns the value of a setting, or its default `otherwise` if the value is zero.
double number_or(double value, double otherwise, const char* field) {
  if (!std::isfinite(value) || value < 0) {
    refuse(std::string(field) + " is " + std::to_string(value) + "; it must be 0 or a positive number");
  }
  return value > 0 ? value : otherwise;
}

void apply_server(const std::string& text, ClientIoSettings& io) {
  const net::HostPort server = net::host_port_of(text);
  io.host = server.host;
  if (server.port) io.port = *server.port;
}

void apply_token(const proto::Bytes& token, ClientIoSettings& io) {
  const auto claims = proto::peek_token(token);
  if (!claims) refuse("token is no join token; give the whole output of tandem-token");
  io.client.session.token = token;
  io.client.session.role = claims->role();
}

// The error messages do not contain the invitation, because it may be a secret with one mistyped character.
void apply_invitation(const std::string& text, ClientIoSettings& io) {
  const auto invitation = proto::invitation_of(text);
  if (!invitation) refuse("invitation is no invitation; give the whole output of tandem-server --invite");
  apply_server(invitation->server, io);
  io.trust = secure::Trust{.pin = invitation->key};
  apply_token(invitation->token, io);
}

void apply_security(const tandem_client_settings& settings, ClientIoSettings& io) {
  const std::string invitation = text_or(settings.invitation), pin = text_or(settings.pin),
                    authorities = text_or(settings.authorities);
  const bool has_key = !pin.empty() || !authorities.empty();
  if (int{!invitation.empty()} + int{has_key} + int{settings.is_insecure != 0} != 1) {
    refuse(
        "the server must be identified in exactly one way: set invitation; or pin or authorities, with token; or, for "
        "a "
        "server on this machine, is_insecure");
  }
  if (!invitation.empty()) return apply_invitation(invitation, io);
  if (!has_key) return;
  // The zone of an IPv6 address ("%eth0") is removed, because certificates do not contain a zone.
  io.trust = secure::Trust{.ca_file = authorities, .host = io.host.substr(0, io.host.find('%'))};
  if (!pin.empty()) {
    const auto bytes = secure::bytes_of_text(pin);
    secure::KeyId key{};
    if (!bytes || bytes->size() != key.size())
      refuse("pin is no key; give the key that the server prints at its start");
    std::ranges::copy(*bytes, key.begin());
    io.trust->pin = key;
  }
  apply_token(secure::bytes_of_text(text_or(settings.token)).value_or(proto::Bytes{}), io);
}

void apply_role(std::uint32_t role, SessionSettings& session) {
  switch (role) {
    case 0:
      return;
    case TANDEM_MANIPULATOR:
      session.role = wire::ROLE_MANIPULATOR;
      return;
    case TANDEM_OBSERVER:
      session.role = wire::ROLE_OBSERVER;
      return;
    case TANDEM_OPERATOR:
      session.role = wire::ROLE_OPERATOR;
      return;
    default:
      refuse("role is " + std::to_string(role) + "; use TANDEM_MANIPULATOR, TANDEM_OBSERVER or TANDEM_OPERATOR");
  }
}

devices::DeviceOptions device_of(const tandem_client_settings& settings, int realtime_priority) {
  devices::DeviceOptions device;
  device.is_from_program = true;
  device.name = text_or(settings.device, "sim");
  if (device.name == "auto") device.name = devices::choose_device(true, [](const std::string&) {});
  device.hand = text_or(settings.hand, "rest");
  device.realtime_priority = realtime_priority;
  device.firmware = text_or(settings.firmware);
  device.motor_counts_per_n_m =
      number_or(settings.motor_counts_per_n_m, device.motor_counts_per_n_m, "motor_counts_per_n_m");
  if (device.motor_counts_per_n_m < devices::kMinMotorCounts_per_n_m ||
      device.motor_counts_per_n_m > devices::kMaxMotorCounts_per_n_m) {
    refuse("motor_counts_per_n_m is " + std::to_string(settings.motor_counts_per_n_m) +
           "; it must be 100 to 20000, or 0 for 3000");
  }
  device.library = text_or(settings.library);
  device.service = text_or(settings.service, device.service.c_str());
  device.motors = text_or(settings.motors);
  const devices::DeviceKind& kind = devices::find_device_kind(device.name);
  device.profile = devices::find_device_profile(text_or(settings.profile, std::string(kind.profile).c_str()));
  return device;
}

int priority_of(std::int32_t priority) {
  if (priority < -1 || priority > 99) {
    refuse("realtime_priority is " + std::to_string(priority) + "; it must be 1 to 99, 0 for 70, or -1 for none");
  }
  return priority == 0 ? kDefaultPriority : std::max(priority, 0);
}

}  // namespace

devices::DeviceProfile profile_of(const tandem_device_settings& settings) {
  constexpr std::uint32_t kKnown = TANDEM_SENSES_ROTATION | TANDEM_DISPLAYS_TORQUE | TANDEM_DISPLAYS_NO_FORCE;
  if ((settings.abilities & ~kKnown) != 0) {
    refuse("abilities is " + std::to_string(settings.abilities) + "; it contains a bit that is not known");
  }
  const std::string source = text_or(settings.maximum_source, "unverified: the program gave no maximum_source");
  const devices::DeviceSpec defaults;
  devices::DeviceProfile profile;
  devices::DeviceSpec& spec = profile.spec;
  spec.name = text_or(settings.name, "program");
  spec.sensed_rotations = (settings.abilities & TANDEM_SENSES_ROTATION) != 0 ? 3 : 0;
  spec.actuated_translations = (settings.abilities & TANDEM_DISPLAYS_NO_FORCE) != 0 ? 0 : 3;
  spec.actuated_rotations = (settings.abilities & TANDEM_DISPLAYS_TORQUE) != 0 ? 3 : 0;
  spec.force_limit_n = number_or(settings.force_limit_n, defaults.force_limit_n, "force_limit_n");
  spec.torque_limit_n_m = number_or(settings.torque_limit_n_m, defaults.torque_limit_n_m, "torque_limit_n_m");
  const auto maximum = [&source](double value, const char* field) {
    number_or(value, 0, field);
    return value > 0 ? devices::SourcedLimit{value, source} : kUnknown;
  };
  spec.force_maximum_n = maximum(settings.force_maximum_n, "force_maximum_n");
  spec.torque_maximum_n_m = maximum(settings.torque_maximum_n_m, "torque_maximum_n_m");
  for (int i = 0; i < 3; ++i) spec.workspace_m[i] = number_or(settings.workspace_m[i], 0, "workspace_m");
  spec.reach_m = number_or(settings.reach_m, defaults.reach_m, "reach_m");
  spec.speed_limit_m_per_s =
      number_or(settings.speed_limit_m_per_s, defaults.speed_limit_m_per_s, "speed_limit_m_per_s");
  spec.slew_limit_n_per_s = number_or(settings.slew_limit_n_per_s, defaults.slew_limit_n_per_s, "slew_limit_n_per_s");
  spec.slew_limit_n_m_per_s =
      number_or(settings.slew_limit_n_m_per_s, defaults.slew_limit_n_m_per_s, "slew_limit_n_m_per_s");
  spec.position_step_m = number_or(settings.position_step_m, 0, "position_step_m");
  spec.rotation_step_rad = number_or(settings.rotation_step_rad, 0, "rotation_step_rad");
  profile.name = profile.title = spec.name;
  profile.workspace_m = spec.workspace_m;
  profile.stiffness_maximum_n_per_m = maximum(settings.stiffness_maximum_n_per_m, "stiffness_maximum_n_per_m");
  profile.damping_maximum_n_s_per_m = maximum(settings.damping_maximum_n_s_per_m, "damping_maximum_n_s_per_m");
  profile.stiffness_maximum_n_m_per_rad = profile.damping_maximum_n_m_s_per_rad = kUnknown;
  profile.position_step_m = {spec.position_step_m, source};
  profile.rotation_step_rad = {spec.rotation_step_rad, source};
  return profile;
}

ClientConfig config_of(const tandem_client_settings& settings, std::shared_ptr<OwnDevice> own_device) {
  ClientConfig config;
  config.realtime_priority = priority_of(settings.realtime_priority);
  ClientIoSettings& io = config.io;
  apply_server(text_or(settings.server, "127.0.0.1:47800"), io);
  apply_security(settings, io);
  SessionSettings& session = io.client.session;
  session.room = checked_text(text_or(settings.room).c_str(), "room");
  session.user_name = checked_text(text_or(settings.user_name, "user").c_str(), "user_name");
  session.state_over_tcp = settings.uses_tcp != 0;
  apply_role(settings.role, session);
  if (const auto cache = default_cache_directory(); settings.has_no_cache == 0 && !cache.empty()) {
    session.asset_store = disk_asset_store(cache / "assets");
  }

  HapticSettings& haptics = io.client.haptics;
  haptics.feeds_view = true;
  haptics.stage.name = text_or(settings.stage, haptics.stage.name.c_str());
  haptics.stage.predictor = text_or(settings.predictor, haptics.stage.predictor.c_str());
  haptics.stage.passivity = settings.has_no_passivity == 0;
  if (own_device != nullptr) {
    haptics.safety.fault_decay = kFeedDecay;
    config.device.profile = own_device->profile();
  } else {
    config.device = device_of(settings, config.realtime_priority);
  }
  config.own_device = std::move(own_device);
  haptics.coupling_bounds = devices::coupling_bounds(config.device.profile);
  session.device = config.device.profile;
  if (config.realtime_priority > 0) io.realtime_priority = std::max(1, config.realtime_priority - kIoPriorityBelow);
  if (settings.has_simulated_link != 0) io.links = SimulatedLinks{};
  return config;
}

}  // namespace tandem::client::embed
