// Settings of client and server for a trial of an experiment. Virtual trials, live trials and benchmarks use the same
// settings.
#pragma once

#include <cstdint>
#include <memory>

#include "client/client.hpp"
#include "lab/experiment/experiment.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::lab {

/// Returns a store that already contains all assets of a scene, so that nothing is fetched.
std::shared_ptr<client::AssetStore> assets_of(const server::LoadedScene& scene);
/// Returns the store of assets_of(scene) if the experiment's asset delivery is "here", i.e. users have all assets from
/// the start. For other deliveries it returns null, and the clients fetch the assets.
std::shared_ptr<client::AssetStore> assets_of(const Experiment& experiment, const server::LoadedScene& scene);

/// Returns the settings of a user's client.
/// In      assets  may be shared by the users of one thread
client::ClientSettings client_settings(const ExperimentUser& user, std::shared_ptr<client::AssetStore> assets);
/// Returns the settings of a user's client with the asset delivery of `experiment`.
client::ClientSettings client_settings(const Experiment& experiment, const ExperimentUser& user,
                                       std::shared_ptr<client::AssetStore> assets);

/// Returns settings for the server of a trial.
/// * Connection ids come from a generator with this seed. They can be guessed, which is acceptable because only the
///   trial's own clients can reach this server.
/// * The port is that of the virtual network. A live server sets another one.
server::HubSettings hub_settings(std::uint64_t seed);

/// Returns the energy that the client's passivity controller has withheld from the hand so far [world joules]; NaN if
/// there is no controller.
double passivity_dissipated_j(const client::HapticCore& core, const Pipeline& pipeline);

}  // namespace tandem::lab
