#include "lab/experiment.hpp"

#include <set>
#include <stdexcept>
#include <utility>

#include "client/stage.hpp"
#include "common/json/fields.hpp"
#include "server/net/scene_library.hpp"

namespace tandem::lab {
namespace {

// A tick of a user takes about 0.3 kB of memory until the trial's files are written.
constexpr double kMostUserSeconds = 1200;
constexpr double kLongest_s = 600;
// A JSON number above this may have lost its last digits on the way through other programs.
constexpr std::uint64_t kLargestSeed = 1ULL << 53U;

Duration from_milliseconds(double value) {
  return from_seconds(value * 1e-3);
}

Duration phase_of(JsonFields& fields, std::string_view name, Duration otherwise) {
  const double milliseconds = fields.number(name, to_seconds(otherwise) * 1e3, 0, 0.75);
  const double slots = milliseconds * 4;
  if (slots != static_cast<double>(static_cast<int>(slots))) fields.fail(name, "it must be 0, 0.25, 0.5 or 0.75");
  return kSlot * static_cast<int>(slots);
}

LinkParameters link_of(JsonFields link) {
  LinkParameters result;
  result.delay = from_milliseconds(link.number("delay_ms", 0, 0, 10000));
  result.jitter = from_milliseconds(link.number("jitter_ms", 0, 0, 10000));
  result.distribution = static_cast<JitterDistribution>(link.choice("distribution", 0, {"normal", "pareto", "trace"}));
  for (const double delay_ms : link.numbers("trace_ms", 0, 10000)) result.trace.push_back(from_milliseconds(delay_ms));
  if (result.distribution == JitterDistribution::kTrace && result.trace.empty()) {
    link.fail("trace_ms", "distribution \"trace\" needs a list of one delay or more");
  }
  result.allows_reordering = link.boolean("reordering", false);
  result.loss = link.number("loss", 0, 0, kLargestLoss);
  result.mean_bad_period = from_milliseconds(link.number("bad_period_ms", 20, 0.1, 10000));
  result.duplication = link.number("duplication", 0, 0, 1);
  result.rate_limit_bytes_per_s = link.number("rate_limit_bytes_per_s", 0, 0, 1e12);
  result.queue_limit = link.whole_number("queue_limit", result.queue_limit, 1'000'000);
  if (result.queue_limit == 0) link.fail("queue_limit", "it must be 1 or more");
  link.finish();
  return result;
}

HandParameters hand_parameters_of(JsonFields hand) {
  HandParameters result;
  result.mass_kg = hand.number("mass_kg", result.mass_kg, 0.01, 10);
  result.stiffness_n_per_m = hand.number("stiffness_n_per_m", result.stiffness_n_per_m, 0, 10000);
  result.damping_n_s_per_m = hand.number("damping_n_s_per_m", result.damping_n_s_per_m, 0, 1000);
  result.inertia_kg_m2 = hand.number("inertia_kg_m2", result.inertia_kg_m2, 1e-5, 1);
  result.stiffness_n_m_per_rad = hand.number("stiffness_n_m_per_rad", result.stiffness_n_m_per_rad, 0, 50);
  result.damping_n_m_s_per_rad = hand.number("damping_n_m_s_per_rad", result.damping_n_m_s_per_rad, 0, 10);
  result.tremor_rms_n = hand.number("tremor_rms_n", result.tremor_rms_n, 0, 10);
  result.tremor_hz = hand.number("tremor_hz", result.tremor_hz, 0.5, 50);
  result.encoder_step_m = hand.number("encoder_step_m", result.encoder_step_m, 0, 0.01);
  result.encoder_step_rad = hand.number("encoder_step_rad", result.encoder_step_rad, 0, 0.1);
  hand.finish();
  return result;
}

HandPath hand_of(JsonFields& user, const std::string& name, const std::filesystem::path& directory) {
  if (std::filesystem::path(name).extension() == ".json") return load_hand_path(directory / name);
  try {
    return named_hand_path(name);
  } catch (const std::invalid_argument& error) {
    user.fail("hand", std::string(error.what()) + "; or name a .json file");
  }
}

DeviceProfile device_of(JsonFields& user, const std::filesystem::path& directory) {
  const std::string name = user.text("device", "sim");
  try {
    return find_device_profile(name.ends_with(".json") ? (directory / name).string() : name);
  } catch (const std::invalid_argument& error) {
    user.fail("device", error.what());
  }
}

ExperimentUser user_of(JsonFields& user, std::size_t index, const std::filesystem::path& directory) {
  ExperimentUser result;
  result.name = user.required_text("name");
  result.role = user.choice("role", 0, {"manipulator", "observer"}) == 0 ? UserRole::kManipulator : UserRole::kObserver;
  result.hand_name = user.text("hand", "rest");
  result.hand = hand_of(user, result.hand_name, directory);
  result.hand_parameters = hand_parameters_of(user.object("hand_parameters"));
  result.device = device_of(user, directory);
  result.stage = stage_names()[user.choice("stage", 0, stage_names())];
  result.transport = user.choice("transport", 0, {"udp", "tcp"}) == 0 ? StateTransport::kUdp : StateTransport::kTcp;
  result.up = link_of(user.object("link"));
  result.down = user.has("downlink") ? link_of(user.object("downlink")) : result.up;
  if (result.transport == StateTransport::kTcp && (result.up.spoils_datagrams() || result.down.spoils_datagrams())) {
    user.fail("transport",
              "over a stream nothing is lost, doubled or reordered; leave out loss, duplication and "
              "reordering, or use udp");
  }
  result.tick_phase = phase_of(user, "tick_phase_ms", kSlot * static_cast<int>(1 + index % 3));
  user.finish();
  return result;
}

}  // namespace

std::filesystem::path scene_path(const std::string& scene, const std::filesystem::path& directory) {
  const std::filesystem::path beside = directory / scene;
  return find_scene(std::filesystem::is_regular_file(beside) ? beside.string() : scene, scene_folders());
}

Experiment parse_experiment(std::string_view json, const std::string& origin, const std::filesystem::path& directory) {
  JsonFields file(parse_json(json, origin), origin);
  Experiment result;
  result.name = file.required_text("name");
  result.description = file.text("description", "");
  try {
    result.scene = scene_path(file.required_text("scene"), directory);
  } catch (const SceneError& error) {
    throw std::invalid_argument(origin + ": scene: " + error.what());
  }
  result.duration = from_seconds(file.number("duration_s", to_seconds(result.duration), 0.1, kLongest_s));
  result.seed = file.whole_number("seed", result.seed, kLargestSeed);
  result.server_phase = phase_of(file, "server_phase_ms", result.server_phase);
  result.sample_period = std::chrono::milliseconds(file.whole_number("sample_period_ms", 10, 1000));
  if (result.sample_period <= Duration(0)) file.fail("sample_period_ms", "it must be a whole number from 1 to 1000");
  std::set<std::string> names;
  for (JsonFields& user : file.objects("users", 1, kMaxUsers)) {
    result.users.push_back(user_of(user, result.users.size(), directory));
    if (!names.insert(result.users.back().name).second) user.fail("name", "each user needs a name of its own");
  }
  file.finish();
  if (to_seconds(result.duration) * static_cast<double>(result.users.size()) > kMostUserSeconds) {
    file.fail("duration_s", "duration times users must be at most 1200 s");
  }
  return result;
}

Experiment load_experiment(const std::filesystem::path& file) {
  return parse_experiment(read_text_file(file), file.string(), file.parent_path());
}

}  // namespace tandem::lab
