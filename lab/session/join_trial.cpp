#include "lab/session/join_trial.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "lab/session/virtual_session.hpp"

namespace tandem::lab {
namespace {

/// A tick counts in the comparison only if the force of the trial "here" is at least this value at this tick.
constexpr double kMinForce_n = 0.5;
/// Time in which the client blends from one local model to its successor.
constexpr Duration kGoingOver = std::chrono::milliseconds(400);

/// Data of the first user of a trial.
struct JoinTrial {
  SessionTrace trace;
  std::vector<Vec3> tool_W;  ///< tool position at each tick according to the local model
  /// times at which the first local model (coarse_at) and the first local model with all assets (full_at) exist; 0:
  /// before the hands started
  Duration coarse_at{0}, full_at{0};
};

JoinTrial run_trial(const Experiment& experiment, const std::shared_ptr<const server::LoadedScene>& scene) {
  JoinTrial trial;
  const OnTick note_tool = [&trial](std::size_t user, const client::TickRecord& record, int) {
    if (user == 0) trial.tool_W.push_back(record.local_tool_W.X.p);
  };
  const OnClient note_model = [&trial](std::size_t user, Duration time, client::Client& client) {
    if (user != 0) return;
    if (!client.local_after()) trial.coarse_at = time;
    if (!client.full_local_after()) trial.full_at = time;
  };
  trial.trace = run_virtual_session(experiment, scene, note_tool, note_model);
  return trial;
}

double stage_force_n(const TickSample& tick) {
  return tick.stage_D.f.norm();
}

double largest_step_n(const std::vector<TickSample>& ticks, Duration from) {
  double largest = 0;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    if (ticks[i].time < from || ticks[i].time > from + kGoingOver) continue;
    largest = std::max(largest, (ticks[i].stage_D.f - ticks[i - 1].stage_D.f).norm());
  }
  return largest;
}

/// Compares a trial, tick by tick, with the trial `here`, in which the user has all assets from the start. A tick is
/// compared if the local model has only coarse assets at this tick and the client has finished blending to it.
void compare_coarse(const JoinTrial& trial, const JoinTrial& here, JoinFigures& figures) {
  const std::vector<TickSample>&ticks = trial.trace.users.front().ticks, &usual = here.trace.users.front().ticks;
  double error = 0, square = 0, apart = 0;
  for (std::size_t i = 0; i < std::min(ticks.size(), usual.size()); ++i) {
    if (ticks[i].time <= trial.full_at) figures.going_over_n = stage_force_n(ticks[i]);
    const bool is_coarse = ticks[i].time > trial.coarse_at + kGoingOver && ticks[i].time <= trial.full_at;
    if (!is_coarse || stage_force_n(usual[i]) < kMinForce_n) continue;
    ++figures.coarse_ticks;
    error += (ticks[i].stage_D.f - usual[i].stage_D.f).squaredNorm();
    square += usual[i].stage_D.f.squaredNorm();
    apart += (trial.tool_W[i] - here.tool_W[i]).squaredNorm();
  }
  figures.step_n = largest_step_n(ticks, trial.full_at);
  figures.usual_step_n = largest_step_n(usual, trial.full_at);
  if (figures.coarse_ticks == 0) return;
  figures.coarse_force_share = std::sqrt(error / square);
  figures.coarse_mm = 1e3 * std::sqrt(apart / static_cast<double>(figures.coarse_ticks));
}

JoinFigures figures_of(const Experiment& experiment, const SessionTrace& trace) {
  const UserTrace& user = trace.users.front();
  const bool is_fetching_over = experiment.assets != "here" && user.full_local_after;
  const Duration watched = is_fetching_over ? *user.full_local_after : trace.joined_after + experiment.duration;
  JoinFigures figures;
  figures.assets = experiment.assets;
  if (user.local_after) figures.local_after_s = to_seconds(*user.local_after);
  if (user.full_local_after) figures.full_local_after_s = to_seconds(*user.full_local_after);
  figures.stream_bytes = static_cast<double>(user.stream_bytes);
  figures.wait_p99_ms = to_milliseconds(user.state_waits.quantile(0.99));
  figures.wait_max_ms = to_milliseconds(user.state_waits.max());
  figures.states_per_s = static_cast<double>(user.state_waits.count()) / to_seconds(watched);
  return figures;
}

}  // namespace

std::vector<JoinFigures> measure_join(Experiment experiment, const std::shared_ptr<const server::LoadedScene>& scene) {
  std::vector<JoinFigures> figures;
  experiment.assets = "here";
  const JoinTrial here = run_trial(experiment, scene);
  for (const std::string_view delivery : asset_deliveries()) {
    experiment.assets = delivery;
    if (delivery == "here") {
      figures.push_back(figures_of(experiment, here.trace));
      continue;
    }
    const JoinTrial trial = run_trial(experiment, scene);
    figures.push_back(figures_of(experiment, trial.trace));
    compare_coarse(trial, here, figures.back());
  }
  return figures;
}

}  // namespace tandem::lab
