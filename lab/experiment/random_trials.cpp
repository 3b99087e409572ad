#include "lab/experiment/random_trials.hpp"

#include <array>
#include <cmath>

#include "common/base/random.hpp"
#include "lab/experiment/experiment_library.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

Axis setting(const std::string& name, json::value value) {
  return {name, {std::move(value)}};
}

void add_hand(Random& random, const std::string& user, std::vector<Axis>& axes) {
  const std::string hand = "users." + user + ".hand_parameters.";
  const double mass_kg = random.uniform(0.1, 1), stiffness_n_per_m = random.uniform(100, 600);
  const double damping_ratio = random.uniform(0.35, 0.8);
  axes.push_back(setting(hand + "mass_kg", mass_kg));
  axes.push_back(setting(hand + "stiffness_n_per_m", stiffness_n_per_m));
  axes.push_back(setting(hand + "damping_n_s_per_m", 2 * damping_ratio * std::sqrt(stiffness_n_per_m * mass_kg)));
  axes.push_back(setting(hand + "tremor_rms_n", random.uniform(0, 0.05)));
}

void add_link(Random& random, std::vector<Axis>& axes) {
  constexpr std::array kPaths{"drift", "steps", "wifi"};
  axes.push_back(setting("link.rtt_ms", random.uniform(20, 200)));
  axes.push_back(setting("link.jitter_ms", random.uniform(0, 10)));
  axes.push_back(setting("link.loss", random.uniform(0, 0.05)));
  const double correlation_ms = random.uniform(20, 300);
  if (random.uniform() < 0.3) axes.push_back(setting("link.jitter_correlation_ms", correlation_ms));
  const auto path = static_cast<std::size_t>(random.uniform(0, kPaths.size()));
  if (random.uniform() < 0.3) axes.push_back(setting("link.delay_path", kPaths.at(path)));
}

void add_model_errors(Random& random, std::vector<Axis>& axes) {
  const double mass = random.uniform(0.85, 1.15), friction = random.uniform(0.85, 1.15);
  if (random.uniform() >= 0.5) return;
  axes.push_back(setting("model.mass_scale", mass));
  axes.push_back(setting("model.friction_scale", friction));
}

Trial random_trial(const ExperimentFile& file, Random random) {
  const Experiment experiment = parse_experiment(file);
  GridRequest request;
  request.is_single = true;
  request.seeds = 1;
  std::vector<Axis>& axes = request.axes;
  const double pace = random.uniform(0.75, 1.3);
  axes.push_back(setting("pace", pace));
  axes.push_back(setting("duration_s", std::ceil(100 * to_seconds(experiment.duration) / pace) / 100));
  axes.push_back(setting("seed", std::uint64_t{1} + random.next_u32()));
  axes.push_back(setting("stage", json::string(default_stage())));
  axes.push_back(setting("passivity", true));
  axes.push_back(setting("coupling.stiffness_n_per_m", random.uniform(300, 900)));
  add_link(random, axes);
  add_model_errors(random, axes);
  for (const ExperimentUser& user : experiment.users) add_hand(random, user.name, axes);
  return expand(file, request).at(0);
}

}  // namespace

const std::vector<std::string>& contact_cases() {
  static const std::vector<std::string> cases{"wall",
                                              "curve",
                                              "rim",
                                              "bunny",
                                              "push",
                                              "mass",
                                              "squeeze",
                                              "carry_along",
                                              "carry_along_fast",
                                              "carry_across",
                                              "carry_across_fast",
                                              "turn_squeezed",
                                              "two_carry",
                                              "three_hands",
                                              "four_hands",
                                              "tug_of_war",
                                              "turn_together",
                                              "two_blocks",
                                              "two_plates",
                                              "box_on_box",
                                              "peg",
                                              "soft"};
  return cases;
}

std::vector<Trial> random_trials(std::size_t count, std::uint64_t seed) {
  std::vector<ExperimentFile> files;
  for (const std::filesystem::path& file : experiment_files(contact_cases()))
    files.push_back(read_experiment_file(file));
  std::vector<Trial> trials;
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    const auto which = static_cast<std::size_t>(random.uniform(0, static_cast<double>(files.size())));
    trials.push_back(random_trial(files.at(which), random));
  }
  return trials;
}

}  // namespace tandem::lab
