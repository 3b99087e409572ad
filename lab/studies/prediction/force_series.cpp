#include "lab/studies/prediction/force_series.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>

#include "common/base/folders.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "lab/session/simulated_user.hpp"
#include "lab/studies/contact/contact_bench.hpp"
#include "lab/studies/contact/mesh_generators.hpp"
#include "lab/studies/contact/mesh_source.hpp"
#include "lab/studies/contact/reproduce_touch.hpp"
#include "lab/studies/contact/touch_simulation.hpp"
#include "lab/studies/conventions.hpp"
#include "server/assets/scene_library.hpp"
#include "server/physics/gimpact_reference.hpp"

namespace tandem::lab {
namespace {

constexpr double kPegForceLimit_n = 4;

devices::HandPath shipped_path(const std::string& name) {
  return devices::load_hand_path(data_folder() / "paths" / (name + ".json"));
}

TouchSettings peg_settings(double mass_kg) {
  TouchSettings settings;
  settings.mass_kg = mass_kg;
  settings.gravity_m_per_s2 = Vec3(0, 0, -kGravity_m_per_s2);
  settings.coupling.force_limit_n = kPegForceLimit_n;
  return settings;
}

std::vector<ForceSample> samples_of(const TouchTrace& trace) {
  std::vector<ForceSample> samples;
  bool was_touching = false;
  for (const TouchStep& step : trace) {
    const bool is_touching = step.contacts > 0;
    samples.push_back({step.at, step.on_hand_W, is_touching != was_touching});
    was_touching = is_touching;
  }
  return samples;
}

/// A shipped scene and the simulated hands at its tools. The hands are coupled directly to the room, without a network.
struct SceneHands {
  std::string scene;               ///< name of the scene in server/scenes
  std::vector<std::string> paths;  ///< names of the paths in lab/paths, one for each tool
};

/// Returns each scene with the paths that the shipped experiments use in it.
const std::vector<SceneHands>& shipped_hands() {
  static const std::vector<SceneHands> hands{{"wall", {"wall"}},
                                             {"curve", {"curve"}},
                                             {"rim", {"rim"}},
                                             {"bunny", {"bunny"}},
                                             {"squeeze", {"squeeze_near", "squeeze_far"}},
                                             {"docking_helices", {"docking_move", "docking_stay"}},
                                             {"soft_pad", {"soft"}}};
  return hands;
}

/// Simulates the scene and returns the force on the first hand.
ForceSeries scene_series(const SceneHands& hands) {
  const auto scene = server::load_scene(server::find_scene(hands.scene, server::scene_folders()));
  // Passivity control is off. It would limit a tool to the energy that its hand supplies, and the simulated users
  // report no supplied energy.
  const auto room = std::make_unique<server::Room>(RoomId{1}, hands.scene, scene,
                                                   server::RoomOptions{.controls_tool_passivity = false});
  std::vector<std::unique_ptr<SimulatedUser>> seats;
  for (const std::string& path : hands.paths)
    seats.push_back(std::make_unique<SimulatedUser>(*room, seats.size(), shipped_path(path), 1 + seats.size()));
  ForceSeries series{hands.scene, "scene " + hands.scene, {}};
  bool was_touching = false;
  for (Duration at{0}; at < seats.front()->path_length(); at += room->period()) {
    const LocalTime now(at);
    for (const auto& seat : seats) seat->move(now);
    room->step(server_time_of_own_clock(now));
    const physics::TouchSummary touch = room->world().touch(0);
    const bool is_touching = touch.contacts > 0 || touch.soft_force_n > 0;
    for (const auto& seat : seats) {
      const Wrench felt = seat->feel(now);
      if (seat == seats.front()) series.samples.push_back({at, felt, is_touching != was_touching});
    }
    was_touching = is_touching;
  }
  return series;
}

}  // namespace

std::vector<ForceSeries> shipped_series() {
  constexpr double kPeg_kg = 0.1;
  std::vector<ForceSeries> all{peg_series(kPeg_kg)};
  const bool has_bunny = std::filesystem::exists(bunny_file());
  if (has_bunny) all.push_back(bunny_pair_series());
  for (const SceneHands& hands : shipped_hands()) {
    if (hands.scene == "bunny" && !has_bunny) continue;
    all.push_back(scene_series(hands));
  }
  return all;
}

ForceSeries peg_series(double mass_kg) {
  const VirtualClock clock;
  const TouchObject peg = make_touch_object("peg", make_peg(), clock);
  const TouchObject box = make_touch_object("box with hole", make_box_with_hole(), clock);
  const devices::HandPath path = shipped_path("peg_five_steps");
  return {"peg", "peg in hole in five steps",
          samples_of(run_touch(*peg.shape, *box.shape, path, peg_settings(mass_kg), clock))};
}

ForceSeries bunny_pair_series() {
  const VirtualClock clock;
  const TouchObject bunny = make_touch_object("bunny", mesh_from(bunny_file().string(), "the bunny"), clock);
  const TouchSettings settings;
  const devices::HandPath path = touch_path(*bunny.exact, *bunny.exact, bench_plan(settings));
  return {"bunnies", "bunny on bunny: press, slide, twist",
          samples_of(run_touch(*bunny.shape, *bunny.shape, path, settings, clock))};
}

ForceSeries chatter_series(double mass_kg) {
  constexpr double kShortest_s = 0.002, kLongest_s = 0.010, kContact_s = 0.00025;
  const VirtualClock clock;
  const geometry::TriangleMesh peg = make_peg();
  const geometry::TriangleMesh box = make_box_with_hole();
  const devices::HandPath path = shipped_path("peg_five_steps");
  const TouchSettings settings = peg_settings(mass_kg);
  const Eigen::AlignedBox3d bounds = bounds_of(peg);
  const Vec3 inertia = box_inertia_kg_m2(bounds.max() - bounds.min(), mass_kg);
  server::GImpactReference peer(peg, box, mass_kg, inertia, settings.friction, clock);
  haptics::CouplingParameters coupling = damped_for(settings.coupling, mass_kg, inertia);
  const auto law = haptics::make_coupling_law("spring-damper", coupling);
  RigidState tool{path.pose_at(Duration(0)), {}};
  tool.X.p += mass_kg * settings.gravity_m_per_s2 / coupling.stiffness_n_per_m;
  peer.place(tool.X);
  ForceSeries series{"chatter", "peg in hole in GImpact at a variable step", {}};
  double step_s = kShortest_s;
  bool was_touching = false;
  for (Duration at{0}; at < path.length(); at += from_seconds(step_s)) {
    const haptics::CouplingWrenches pull =
        haptics::coupling_wrenches(*law, path.pose_at(at), path.twist_at(at), tool.X, tool.V);
    Wrench on_tool_W = pull.on_tool_W;
    on_tool_W.f += mass_kg * settings.gravity_m_per_s2;
    const server::GImpactReference::Step step = peer.step(on_tool_W, step_s);
    tool = {step.X_WT, step.V_WT};
    const bool is_touching = step.contacts > 0;
    series.samples.push_back({at, pull.on_hand_W, is_touching != was_touching});
    was_touching = is_touching;
    step_s = std::clamp(kShortest_s + kContact_s * static_cast<double>(step.contacts), kShortest_s, kLongest_s);
  }
  return series;
}

double noise_n(const ForceSeries& series) {
  constexpr Duration kHalf = std::chrono::milliseconds(10);
  const auto& samples = series.samples;
  double sum = 0;
  std::size_t count = 0, first = 0, last = 0;
  for (const ForceSample& sample : samples) {
    while (samples[first].at < sample.at - kHalf) ++first;
    while (last < samples.size() && samples[last].at <= sample.at + kHalf) ++last;
    Vec3 mean = Vec3::Zero();
    for (std::size_t i = first; i < last; ++i) mean += samples[i].on_hand_W.f / static_cast<double>(last - first);
    if (sample.on_hand_W.f.norm() <= 0) continue;
    sum += (sample.on_hand_W.f - mean).squaredNorm();
    ++count;
  }
  return count == 0 ? 0 : std::sqrt(sum / static_cast<double>(count));
}

}  // namespace tandem::lab
