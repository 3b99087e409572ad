#include "client/client.hpp"

#include <chrono>
#include <exception>
#include <utility>

#include "client/haptics/stages/stage.hpp"
#include "client/model/local_world.hpp"
#include "client/model/proxy_world.hpp"
#include "client/session/scene_from_wire.hpp"
#include "common/geometry/surface_asset.hpp"
#include "common/realtime/realtime.hpp"

namespace tandem::client {

struct Client::MadeModel {
  std::uint32_t generation = 0;  ///< of the scene that it is of
  std::unique_ptr<LocalModel> model;
  std::unique_ptr<ProxyWorld> proxy_world;
  std::string problem;  ///< why there is none

  /// Also where there is nothing to take.
  bool is_taken_by(HapticCore& core) {
    return (model == nullptr || core.offer_model(generation, model)) &&
           (proxy_world == nullptr || core.offer_model(generation, proxy_world));
  }
};

namespace {

/// What the stage asks of the session.
SessionSettings session_settings(const ClientSettings& settings) {
  SessionSettings session = settings.session;
  session.coupling_bounds = settings.haptics.coupling_bounds;
  if (needs_local_model(settings.haptics.stage.name)) session.asset_kinds = {"contact", "molecule"};
  if (!needs_proxy_world(settings.haptics.stage.name)) return session;
  session.asset_kinds = {geometry::kSurfaceAssetKind};
  session.find_scene_problem = [](const wire::Joined& joined) {
    const std::string problem = proxy_problem(joined);
    return problem.empty() ? problem : "stage god-object: " + problem;
  };
  return session;
}

/// Of the tick's 1 ms: the rest is the device's, and the stages'.
constexpr Duration kMaxModelStep = std::chrono::microseconds(900);

}  // namespace

Client::Client(const ClientSettings& settings, devices::Device& device, ClientTransport& transport)
    : settings_(settings),
      core_(settings.haptics, device, mailboxes_),
      session_(session_settings(settings), transport, mailboxes_) {
  const std::string& stage = settings.haptics.stage.name;
  if (needs_local_model(stage) || needs_proxy_world(stage)) session_.on_assets = [this] { begin_model(); };
}

Client::~Client() = default;

void Client::poll(LocalTime now) {
  take_made_model();
  hand_over_model();
  session_.poll(now);
  core_.service();
}

void Client::begin_model() {
  stage_note_.clear();
  if (!has_tool(session_.joined()->role())) return;
  const auto make = [settings = settings_.local_model, is_aside = settings_.makes_models_aside,
                     has_ball = needs_proxy_world(settings_.haptics.stage.name),
                     generation = session_.scene_generation(), joined = *session_.joined(),
                     assets = session_.assets()] {
    // The thread comes with the priority of the one that started it: a second of work there would starve the sockets.
    if (is_aside) realtime::drop_realtime();
    auto made = std::make_unique<MadeModel>();
    made->generation = generation;
    try {
      if (has_ball) {
        made->proxy_world = std::make_unique<ProxyWorld>(joined, assets);
      } else {
        const auto world = make_local_world(joined, assets);
        if (is_aside) require_in_time(world, kMaxModelStep);
        made->model = std::make_unique<LocalModel>(world, joined.tool(), settings);
      }
    } catch (const std::exception& error) {
      made->problem = printable(error.what());
    }
    return made;
  };
  // A future that is replaced waits for its thread: at most for one model.
  making_ = std::async(settings_.makes_models_aside ? std::launch::async : std::launch::deferred, make);
  if (settings_.makes_models_aside) return;
  making_.wait();
  take_made_model();
  hand_over_model();
}

void Client::take_made_model() {
  if (!making_.valid() || making_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  made_ = making_.get();
  if (made_->generation != session_.scene_generation()) {
    made_.reset();
    return;
  }
  const bool is_new_problem = made_->problem != model_problem_;
  model_problem_ = made_->problem;
  if (made_->proxy_world != nullptr) {
    stage_note_ = "stage god-object: " + made_->proxy_world->note();
  } else if (needs_proxy_world(settings_.haptics.stage.name)) {
    stage_note_ = "stage god-object: no force is displayed, for a ball cannot touch this scene: " + model_problem_;
  } else if (!model_problem_.empty() && is_new_problem && session_.on_log) {
    session_.on_log("no local model of this scene, the late pose is shown instead: " + model_problem_);
  }
}

// Refused while the haptic thread has not yet entered a newer scene than that of the model before the last.
void Client::hand_over_model() {
  if (made_ == nullptr) return;
  const bool is_of_this_scene = made_->generation == session_.scene_generation();
  if (!is_of_this_scene || made_->is_taken_by(core_)) made_.reset();
}

}  // namespace tandem::client
