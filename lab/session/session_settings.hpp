// Settings of the two ends of a trial, from an experiment: the same for virtual trials, live trials and benches.
#pragma once

#include <cstdint>
#include <memory>

#include "client/client.hpp"
#include "lab/experiment/experiment.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::lab {

/// Store with all files of a scene, so that none is fetched.
std::shared_ptr<client::AssetStore> assets_of(const server::LoadedScene& scene);
/// The same store if the experiment's users have the assets from the start; else null.
std::shared_ptr<client::AssetStore> assets_of(const Experiment& experiment, const server::LoadedScene& scene);

/// In      assets  may be shared by users of one thread
client::ClientSettings client_settings(const ExperimentUser& user, std::shared_ptr<client::AssetStore> assets);
/// The same with the asset delivery of `experiment`.
client::ClientSettings client_settings(const Experiment& experiment, const ExperimentUser& user,
                                       std::shared_ptr<client::AssetStore> assets);

/// Seeded connection ids suffice for a trial, which has no foreign clients. The port is that of a virtual network; a
/// live server sets its own.
server::HubSettings hub_settings(std::uint64_t seed);

/// Energy that the client's passivity controller has withheld from the hand so far [world joules]; NaN: no controller.
double passivity_dissipated_j(const client::HapticCore& core, const Pipeline& pipeline);

}  // namespace tandem::lab
