#include "lab/session/session_settings.hpp"

#include <limits>
#include <utility>

#include "client/session/asset_store.hpp"
#include "common/base/random.hpp"

namespace tandem::lab {

std::shared_ptr<client::AssetStore> assets_of(const server::LoadedScene& scene) {
  auto store = client::memory_asset_store();
  for (const server::Asset& asset : scene.assets) store->keep(asset.sha256, asset.bytes);
  return store;
}

std::shared_ptr<client::AssetStore> assets_of(const Experiment& experiment, const server::LoadedScene& scene) {
  return experiment.assets == "here" ? assets_of(scene) : nullptr;
}

client::ClientSettings client_settings(const ExperimentUser& user, std::shared_ptr<client::AssetStore> assets) {
  client::ClientSettings settings;
  settings.haptics.stage.name = user.pipeline.stage;
  settings.haptics.stage.predictor = user.pipeline.predictor;
  settings.haptics.stage.passivity = user.pipeline.passivity;
  settings.haptics.coupling_bounds = devices::coupling_bounds(user.device);
  settings.session.user_name = user.name;
  settings.session.role = user.role == server::UserRole::kOperator      ? wire::ROLE_OPERATOR
                          : user.role == server::UserRole::kManipulator ? wire::ROLE_MANIPULATOR
                                                                        : wire::ROLE_OBSERVER;
  settings.session.workspace.scale = user.motion_scale;
  settings.session.state_over_tcp = user.state_over_tcp;
  settings.session.deadband = user.pipeline.deadband;
  settings.session.asset_store = std::move(assets);
  settings.local_model.errors = user.pipeline.model;
  return settings;
}

client::ClientSettings client_settings(const Experiment& experiment, const ExperimentUser& user,
                                       std::shared_ptr<client::AssetStore> assets) {
  client::ClientSettings settings = client_settings(user, std::move(assets));
  settings.session.fetches_one_at_a_time = experiment.assets == "fetched-in-turn";
  return settings;
}

server::HubSettings hub_settings(std::uint64_t seed) {
  server::HubSettings settings;
  settings.connection_ids = [ids = Random(seed)]() mutable { return ids.next_u64(); };
  return settings;
}

double passivity_dissipated_j(const client::HapticCore& core, const Pipeline& pipeline) {
  return pipeline.passivity ? core.record().passivity_withheld_j : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace tandem::lab
