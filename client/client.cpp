#include "client/client.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "client/haptics/stages/stage.hpp"
#include "client/model/proxy_world.hpp"
#include "client/session/scene_from_wire.hpp"
#include "common/base/progress.hpp"
#include "common/geometry/surface_asset.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::client {

struct Client::Made {
  std::unique_ptr<Rendering> rendering;
  AssetLevel level = AssetLevel::kNone;  ///< level of the assets from which the model was built
  ContactShapes shapes;                  ///< shapes of the local model
  std::string problem;  ///< reason why the model that the stage needs could not be built; empty if there is no problem
};

namespace {

/// Returns the kinds of assets that a stage needs.
std::vector<std::string> asset_kinds_of(const std::string& stage) {
  if (needs_local_model(stage)) return {"contact", "molecule"};
  if (needs_proxy_world(stage)) return {geometry::kSurfaceAssetKind};
  return {};
}

SessionSettings session_settings(const ClientSettings& settings) {
  SessionSettings session = settings.session;
  const double scale = settings.session.workspace.scale;
  session.coupling_bounds =
      haptics::coupling_bounds_in_world(settings.haptics.coupling_bounds, WorkspaceMapping{{}, scale, scale});
  session.asset_kinds = asset_kinds_of(settings.haptics.stage.name);
  return session;
}

/// Maximum duration of one step of the local model. The rest of the 1 ms period remains for the device and the stage.
constexpr Duration kMaxModelStep = std::chrono::microseconds(900);

}  // namespace

Client::Client(const ClientSettings& settings, devices::Device& device, ClientTransport& transport)
    : settings_(settings),
      core_(settings.haptics, device, mailboxes_),
      session_(session_settings(settings), transport, mailboxes_) {
  session_.find_scene_problem = [this](const wire::Joined& joined) { return problem_of_stage(joined); };
  session_.on_assets = [this] {
    stage_note_.clear();
    is_stage_wanted_ = is_stage_wanted_ || makes_something();
    begin_when_possible();
  };
}

// Cancels a running build. The destructor of the future then waits only for the current step of the build.
Client::~Client() {
  call_off_making_.request_stop();
}

bool Client::makes_something() const {
  const std::string& stage = settings_.haptics.stage.name;
  return (needs_local_model(stage) || needs_proxy_world(stage)) && has_tool(session_.joined()->role());
}

std::string Client::problem_of_stage(const wire::Joined& joined) const {
  if (!needs_proxy_world(settings_.haptics.stage.name)) return {};
  const std::string problem = proxy_problem(joined);
  return problem.empty() ? problem : "stage god-object: " + problem;
}

void Client::poll(LocalTime now) {
  note_join(now);
  begin_when_possible();
  accept_made();
  hand_over();
  note_local(now);
  session_.poll(now);
  core_.service();
}

void Client::send(const ClientCommand& command, LocalTime now) {
  if (const auto* const change = std::get_if<command::SetStage>(&command)) return set_stage(change->stage);
  session_.send(std::get<SessionCommand>(command), now);
}

void Client::set_stage(const StageSettings& stage) {
  const StageSettings before = settings_.haptics.stage;
  require_stage(stage);
  settings_.haptics.stage = stage;
  const std::string problem = session_.joined() == nullptr ? "" : problem_of_stage(*session_.joined());
  if (!problem.empty()) {
    settings_.haptics.stage = before;
    stage_note_ = problem;
    return;
  }
  core_.control_passivity(stage.passivity);
  if (stage.name == before.name && stage.predictor == before.predictor && stage.wave == before.wave) return;
  is_stage_wanted_ = true;
  session_.set_asset_kinds(asset_kinds_of(stage.name));
}

void Client::begin_when_possible() {
  if (!is_stage_wanted_ || making_.valid() || session_.asset_level() == AssetLevel::kNone) return;
  is_stage_wanted_ = false;
  begin_rendering();
}

void Client::begin_rendering() {
  const StageSettings& stage = settings_.haptics.stage;
  call_off_making_ = std::stop_source();
  const auto make = [settings = settings_.local_model, is_aside = settings_.makes_models_aside, stage,
                     makes = makes_something(), level = session_.asset_level(),
                     generation = session_.scene_generation(), stop = call_off_making_.get_token(),
                     at_point = settings_.at_point_of_making, joined = *session_.joined(), assets = session_.assets(),
                     shapes = shapes_]() mutable {
    // A new thread inherits the real-time priority of its creator, the io thread. A build takes up to a second, and at
    // this priority it would block the io thread. So the priority is dropped.
    if (is_aside) realtime::drop_realtime();
    const CallOffScope scope(stop, at_point);
    auto made = std::make_unique<Made>();
    made->rendering = std::make_unique<Rendering>();
    made->rendering->stage = make_stage(stage);
    made->rendering->generation = generation;
    made->level = level;
    if (!makes) return made;
    try {
      if (needs_proxy_world(stage.name)) {
        made->rendering->proxy_world = std::make_unique<ProxyWorld>(joined, assets);
      } else {
        const auto world = make_local_world(joined, assets, shapes);
        // The model must be created before require_in_time(), so that the check shares the molecular grid of the model
        // instead of building a second grid.
        auto model = std::make_unique<LocalModel>(world, joined.tool(), settings);
        if (is_aside) require_in_time(world, kMaxModelStep);
        made->rendering->local_model = std::move(model);
        made->shapes = std::move(shapes);
      }
    } catch (const std::exception& error) {
      made->problem = printable(error.what());
    }
    return made;
  };
  making_generation_ = session_.scene_generation();
  making_ = std::async(settings_.makes_models_aside ? std::launch::async : std::launch::deferred, make);
  if (settings_.makes_models_aside) return;
  making_.wait();
  accept_made();
  hand_over();
}

void Client::accept_made() {
  // A build that is still running for a previous scene is useless, so it is cancelled.
  if (making_.valid() && making_generation_ != session_.scene_generation()) call_off_making_.request_stop();
  if (!making_.valid() || making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  made_ = making_.get();
  if (!made_->shapes.empty()) shapes_ = std::move(made_->shapes);
  if (made_->rendering->generation != session_.scene_generation()) {
    made_.reset();
    return;
  }
  note_problem();
}

void Client::note_problem() {
  const bool is_new_problem = made_->problem != model_problem_;
  model_problem_ = made_->problem;
  if (made_->rendering->proxy_world != nullptr) {
    stage_note_ = "stage god-object: " + made_->rendering->proxy_world->note();
  } else if (needs_proxy_world(settings_.haptics.stage.name)) {
    stage_note_ = "stage god-object: no force is displayed, for a ball cannot touch this scene: " + model_problem_;
  } else if (!model_problem_.empty() && is_new_problem && session_.on_event) {
    session_.on_event(event::Log{"no local model of this scene, the late pose is shown instead: " + model_problem_});
  }
}

// Offers the finished rendering. offer() returns false until the haptic thread has changed to the rendering offered
// last, because until then an older rendering may be in use. In that case, the next call of hand_over() tries again.
void Client::hand_over() {
  if (made_ == nullptr) return;
  const bool is_of_this_scene = made_->rendering->generation == session_.scene_generation();
  const bool has_model = made_->rendering->local_model != nullptr;
  // If the build from full assets has failed, the working model built from coarse assets remains in use.
  const bool has_coarse = offered_ != 0 && offered_generation_ == session_.scene_generation() &&
                          offered_level_ == AssetLevel::kCoarse && offered_stage_ == settings_.haptics.stage.name;
  if (!made_->problem.empty() && has_coarse) {
    made_.reset();
    return;
  }
  if (is_of_this_scene && !core_.offer(made_->rendering)) return;
  if (is_of_this_scene && has_model) {
    offered_ = core_.offered();
    offered_level_ = made_->level;
    offered_stage_ = settings_.haptics.stage.name;
    offered_generation_ = session_.scene_generation();
  }
  made_.reset();
}

void Client::note_join(LocalTime now) {
  if (session_.status().state != SessionState::kActive || session_.scene_generation() == joined_generation_) return;
  joined_generation_ = session_.scene_generation();
  joined_at_ = now;
  local_after_.reset();
  full_local_after_.reset();
}

void Client::note_local(LocalTime now) {
  const bool is_offered = offered_ != 0 && offered_generation_ == joined_generation_;
  if (full_local_after_ || !is_offered || core_.shown_locally() < offered_) return;
  if (!local_after_) local_after_ = now - joined_at_;
  if (offered_level_ == AssetLevel::kFull) full_local_after_ = now - joined_at_;
}

}  // namespace tandem::client
