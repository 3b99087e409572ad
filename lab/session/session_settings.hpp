// What the two ends of a trial are told by an experiment: the same for trials in virtual time, live trials and benches.
#pragma once

#include <cstdint>
#include <memory>

#include "client/client.hpp"
#include "lab/experiment/experiment.hpp"
#include "server/session/session_hub.hpp"

namespace tandem::lab {

/// All files of a scene, so that nobody has to fetch them.
std::shared_ptr<client::AssetStore> assets_of(const server::LoadedScene& scene);
/// Those if the experiment's users have them from the start; else null.
std::shared_ptr<client::AssetStore> assets_of(const Experiment& experiment, const server::LoadedScene& scene);

/// In      assets  may be shared by users of one thread
client::ClientSettings client_settings(const ExperimentUser& user, std::shared_ptr<client::AssetStore> assets);
/// The same as `experiment` has them.
client::ClientSettings client_settings(const Experiment& experiment, const ExperimentUser& user,
                                       std::shared_ptr<client::AssetStore> assets);

/// Seeded connection ids are good enough for a trial, whose only clients are its own. The port is that of a virtual
/// network; a live server puts its own there.
server::HubSettings hub_settings(std::uint64_t seed);

/// Energy that the client's passivity controller has withheld from the hand so far [world joules]; NaN: it has none.
double passivity_dissipated_j(const client::HapticCore& core, const Pipeline& pipeline);

}  // namespace tandem::lab
