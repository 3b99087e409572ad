#include "client/session/joined_scene.hpp"

#include <algorithm>

#include "client/session/scene_from_wire.hpp"
#include "common/net/text.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client {

std::string JoinedScene::accept(const wire::Joined& answer, wire::Role role, LocalTime now) {
  HapticScene offered = scene_;
  if (std::string problem = fill_haptic_scene(answer, offered); !problem.empty()) return problem;
  if (answer.role() != role) return "role is not the requested one";
  joined_ = std::make_unique<wire::Joined>(answer);
  scene_ = offered;
  received_ = scene_.coupling;
  received_law_ = scene_.law;
  received_workspace_ = scene_.workspace;
  scene_.workspace = with_user(received_workspace_, own_workspace_);
  ++scene_.generation;
  game_.begin(joined_->scene());
  scene_.absent_bodies = 0;
  scene_.gravity_m_per_s2.reset();
  held_ = BodyId{};
  watch_.note_grip(held_, Vec3::Zero(), now);
  check();
  return {};
}

void JoinedScene::set_workspace(const WorkspaceSettings& workspace) {
  own_workspace_ = workspace;
  if (joined_ == nullptr) return;
  scene_.workspace = with_user(received_workspace_, own_workspace_);
  check();
  publish();
}

std::string JoinedScene::name_of(BodyId body) const {
  const bool is_in_scene =
      joined_ != nullptr && body.is_valid() && body.value <= std::size_t(joined_->scene().bodies_size());
  return is_in_scene ? joined_->scene().bodies(static_cast<int>(body.value) - 1).name()
                     : "body " + std::to_string(body.value);
}

void JoinedScene::hide() {
  watch_.forget_changes();
  if (!scene_.may_drive) return;
  scene_.may_drive = scene_.may_display = false;
  publish();
}

void JoinedScene::meet(const wire::UserJoined& user) {
  if (!has_tool(user.role()) || user.tool() >= scene_.coupling_bounds.size()) return;
  const haptics::CouplingParameters bounds = proto::read_bounds(user.coupling_bounds());
  const auto is_bound = [&bounds](const proto::CouplingField& field) { return bounds.*field.value >= 0; };
  const bool is_sound = std::ranges::all_of(proto::kCouplingFields, is_bound);
  scene_.coupling_bounds[user.tool()] = is_sound ? bounds : haptics::kNoCouplingBounds;
  publish();
}

void JoinedScene::show(const Vec3& place_W, LocalTime now) {
  if (!has_nudges_ || (nudged_ && now - *nudged_ < kNudgeEvery)) return;
  nudged_ = now;
  ++scene_.places_shown;
  scene_.shown_W = place_W;
  publish();
}

bool JoinedScene::set_start(const wire::RoomStart& start) {
  const std::optional<HandStart> read = read_start(start);
  if (!read) return false;
  scene_.hand_start = *read;
  publish();
  return true;
}

bool JoinedScene::play(const wire::GameState& state) {
  if (!game_.receive(state)) return false;
  const bool is_same =
      scene_.absent_bodies == game_.absent_bodies() && scene_.gravity_m_per_s2 == game_.gravity_m_per_s2();
  scene_.absent_bodies = game_.absent_bodies();
  scene_.gravity_m_per_s2 = game_.gravity_m_per_s2();
  if (!is_same) publish();
  return true;
}

void JoinedScene::hold(BodyId body, LocalTime now) {
  held_ = body;
  watch_.note_change(now);
}

bool JoinedScene::set_parameter(const wire::ParameterSet& parameter, LocalTime now) {
  if (parameter.name() == proto::kLawParameter) return set_law(parameter.text(), now);
  const proto::CouplingField* field = proto::find_coupling_field(parameter.name());
  if (field == nullptr || !field->accepts(parameter.value())) {
    log_("ignored parameter " + parameter.name() + " = " + std::to_string(parameter.value()));
    return false;
  }
  received_.*(field->value) = parameter.value();
  watch_.note_change(now);
  log_(parameter.name() + " is now " + std::to_string(parameter.value()));
  return true;
}

bool JoinedScene::set_law(const std::string& name, LocalTime now) {
  const haptics::CouplingLawInfo* const found = name.empty() ? nullptr : haptics::find_coupling_law(name);
  if (found == nullptr || (found != &law() && !haptics::are_exchangeable(law(), *found))) {
    log_("ignored law " + net::printable(name));
    return false;
  }
  received_law_ = static_cast<std::size_t>(found - haptics::coupling_laws().data());
  watch_.note_change(now);
  log_("the law is now " + name);
  return true;
}

void JoinedScene::check_when_due(LocalTime now) {
  if (!watch_.is_due(now)) return;
  watch_.forget_changes();
  const HapticScene before = scene_;
  // The displayed coupling changes only in this function: it runs after a burst of changes has ended, and checks the
  // new coupling at once.
  scene_.coupling = received_;
  scene_.law = received_law_;
  // The join message is updated too, because a local model that is built later reads the coupling from the message.
  wire::Coupling& in_force = *joined_->mutable_scene()->mutable_coupling();
  in_force.set_law(std::string(law().name));
  for (const proto::CouplingField& field : proto::kCouplingFields) (in_force.*field.set)(received_.*field.value);
  check();
  const bool is_changed = scene_.coupling != before.coupling || scene_.law != before.law;
  if (scene_.may_display != before.may_display || is_changed) publish();
}

// If the coupling is refused, no force is displayed, but the session continues and the hand still drives its tool.
void JoinedScene::check() {
  if (!scene_.may_drive) return;
  const bool may_display = watch_.check(scene_, *joined_, held_);
  if (may_display != scene_.may_display) {
    log_(may_display ? "the coupling is stable on this device again"
                     : "the coupling is unstable on this device: no force is displayed");
  }
  scene_.may_display = may_display;
}

}  // namespace tandem::client
