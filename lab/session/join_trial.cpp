#include "lab/session/join_trial.hpp"

#include "lab/session/virtual_session.hpp"

namespace tandem::lab {
namespace {

double milliseconds(Duration duration) {
  return 1e3 * to_seconds(duration);
}

JoinFigures figures_of(const Experiment& experiment, const SessionTrace& trace) {
  const UserTrace& user = trace.users.front();
  const bool is_fetching_over = experiment.assets != "here" && user.local_after;
  const Duration watched = is_fetching_over ? *user.local_after : trace.joined_after + experiment.duration;
  JoinFigures figures;
  figures.assets = experiment.assets;
  if (user.local_after) figures.local_after_s = to_seconds(*user.local_after);
  figures.stream_bytes = static_cast<double>(user.stream_bytes);
  figures.wait_p99_ms = milliseconds(user.state_waits.quantile(0.99));
  figures.wait_max_ms = milliseconds(user.state_waits.max());
  figures.states_per_s = static_cast<double>(user.state_waits.count()) / to_seconds(watched);
  return figures;
}

}  // namespace

std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene) {
  std::vector<JoinFigures> figures;
  for (const std::string_view delivery : asset_deliveries()) {
    experiment.assets = delivery;
    figures.push_back(figures_of(experiment, run_virtual_session(experiment, scene)));
  }
  return figures;
}

}  // namespace tandem::lab
