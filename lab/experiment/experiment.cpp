#include "lab/experiment/experiment.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <stdexcept>
#include <utility>

#include "client/app/parameters_json.hpp"
#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "lab/experiment/delay_path.hpp"
#include "lab/experiment/quantities.hpp"
#include "server/assets/scene_library.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

// Maximum of the product of a trial's duration and its number of users [s]. It limits the memory of a trial to about
// 0.7 GB: each of 1000 ticks per second and user occupies 0.6 kB until the trial has been evaluated.
constexpr double kMaxUserSeconds = 1200;
constexpr double kLongest_s = 600;
// Largest seed. Programs that read JSON numbers as double precision may round larger ones.
constexpr std::uint64_t kMaxSeed = 1ULL << 53U;

/// Names of the roles, in the order of server::UserRole.
constexpr std::array<std::string_view, 3> kRoles{"manipulator", "observer", "operator"};

Duration from_milliseconds(double value) {
  return from_seconds(value * 1e-3);
}
double in_milliseconds(Duration value) {
  return to_seconds(value) * 1e3;
}

Duration phase_of(JsonFields& fields, std::string_view name, Duration otherwise) {
  const double milliseconds = fields.number(name, in_milliseconds(otherwise), 0, 0.75);
  const double slots = milliseconds * 4;
  if (slots != static_cast<double>(static_cast<int>(slots))) fields.fail(name, "it must be 0, 0.25, 0.5 or 0.75");
  return kSlot * static_cast<int>(slots);
}

net::LinkParameters link_of(JsonFields link, const std::filesystem::path& directory) {
  net::LinkParameters result;
  result.delay = from_milliseconds(link.number("rtt_ms", 0, 0, 20000) / 2);
  result.jitter = from_milliseconds(link.number("jitter_ms", 0, 0, 10000));
  result.jitter_correlation = from_milliseconds(link.number("jitter_correlation_ms", 0, 0, 10000));
  try {
    result.delay_path = delay_path_called(link.text("delay_path", ""), directory);
  } catch (const std::invalid_argument& error) {
    link.fail("delay_path", error.what());
  }
  result.distribution =
      static_cast<net::JitterDistribution>(link.choice("distribution", 0, {"normal", "pareto", "trace"}));
  for (const double delay_ms : link.numbers("trace_ms", 0, 10000)) result.trace.push_back(from_milliseconds(delay_ms));
  if (result.distribution == net::JitterDistribution::kTrace && result.trace.empty()) {
    link.fail("trace_ms", "distribution \"trace\" needs a list of one delay or more");
  }
  result.allows_reordering = link.boolean("reordering", false);
  result.loss = link.number("loss", 0, 0, net::kMaxLoss);
  result.mean_bad_period = from_milliseconds(link.number("bad_period_ms", 20, 0.1, 10000));
  result.duplication = link.number("duplication", 0, 0, 1);
  result.rate_limit_bytes_per_s = link.number("rate_limit_bytes_per_s", 0, 0, 1e12);
  result.queue_limit = link.whole_number("queue_limit", result.queue_limit, 1'000'000);
  if (result.queue_limit == 0) link.fail("queue_limit", "it must be 1 or more");
  link.finish();
  return result;
}

devices::HandParameters hand_parameters_of(JsonFields hand) {
  devices::HandParameters result;
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

devices::HandPath hand_of(JsonFields& user, const std::string& name, const std::filesystem::path& directory) {
  if (std::filesystem::path(name).extension() == ".json") return devices::load_hand_path(directory / name);
  try {
    return devices::named_hand_path(name);
  } catch (const std::invalid_argument& error) {
    user.fail("hand", std::string(error.what()) + "; or name a .json file");
  }
}

devices::DeviceProfile device_of(JsonFields& user, const std::filesystem::path& directory) {
  const std::string name = user.text("device", "sim");
  try {
    return devices::find_device_profile(name.ends_with(".json") ? (directory / name).string() : name);
  } catch (const std::invalid_argument& error) {
    user.fail("device", error.what());
  }
}

std::string one_of(JsonFields& fields, std::string_view name, const std::string& otherwise,
                   const std::vector<std::string_view>& choices) {
  return fields.has(name) ? std::string(choices[fields.choice(name, 0, choices)]) : otherwise;
}

/// Reads the pipeline of the whole experiment or of one user. Missing fields keep their values in `result`.
Pipeline pipeline_of(JsonFields& fields, Pipeline result) {
  result.stage = one_of(fields, "stage", result.stage, known_stages());
  result.predictor = one_of(fields, "predictor", result.predictor, known_predictors());
  result.passivity = fields.boolean("passivity", result.passivity);
  result.deadband = fields.number("deadband", result.deadband, 0, 0.5);
  if (fields.has("model")) {
    JsonFields model = fields.object("model");
    result.model.mass_scale = model.number("mass_scale", result.model.mass_scale, 0.01, 100);
    result.model.friction_scale = model.number("friction_scale", result.model.friction_scale, 0, 100);
    result.model.shape_shift_m = model.vector("shape_shift_m", result.model.shape_shift_m, 0.1);
    model.finish();
  }
  return result;
}

json::object object_in(const json::object& object, std::string_view name) {
  const json::value* value = object.if_contains(name);
  return value != nullptr && value->is_object() ? value->get_object() : json::object();
}

/// Returns a copy of `base` in which the fields of `changes` are added or replaced.
json::object with(json::object base, const json::object& changes) {
  for (const auto& field : changes) base[field.key()] = field.value();
  return base;
}

/// The experiment's defaults and its file, which are needed to read the fields of a user.
struct UserContext {
  const ExperimentFile& file;
  const Pipeline& pipeline;
  json::object link;
};

/// Reads the links of one user. The uplink is the experiment's link with the changes in the user's `link`. The downlink
/// is the uplink with the changes in the user's `downlink`.
void read_links(JsonFields& user, const json::object& document, std::size_t index, const UserContext& context,
                ExperimentUser& result) {
  const std::string path = "users[" + std::to_string(index) + "].";
  user.object("link");  // checks that both values are objects; their fields are read below
  user.object("downlink");
  const json::object up = with(context.link, object_in(document, "link"));
  const json::object down = with(up, object_in(document, "downlink"));
  result.up = link_of(JsonFields(up, context.file.origin, path + "link"), context.file.directory);
  result.down = link_of(JsonFields(down, context.file.origin, path + "downlink"), context.file.directory);
  if (result.state_over_tcp && (result.up.spoils_datagrams() || result.down.spoils_datagrams())) {
    user.fail("transport",
              "over a stream nothing is lost, doubled or reordered; leave out loss, duplication and "
              "reordering, or use udp");
  }
}

ExperimentUser user_of(JsonFields& user, const json::object& document, std::size_t index, const UserContext& context) {
  ExperimentUser result;
  const std::filesystem::path& directory = context.file.directory;
  result.name = user.required_text("name");
  result.role = static_cast<server::UserRole>(user.choice("role", 0, {kRoles.begin(), kRoles.end()}));
  result.hand_name = user.text("hand", "rest");
  result.pace = user.number("pace", 1, 0.1, 10);
  result.hand = hand_of(user, result.hand_name, directory).paced(result.pace);
  result.hand_parameters = hand_parameters_of(user.object("hand_parameters"));
  result.device = device_of(user, directory);
  result.is_bounded = user.boolean("bounded", false);
  result.motion_scale = user.number("motion_scale", 1, 0.1, 10);
  result.pipeline = pipeline_of(user, context.pipeline);
  result.state_over_tcp = user.choice("transport", 0, {"udp", "tcp"}) == 1;
  read_links(user, document, index, context, result);
  result.tick_phase = phase_of(user, "tick_phase_ms", kSlot * static_cast<int>(1 + index % 3));
  user.finish();
  return result;
}

std::vector<ExperimentUser> users_of(JsonFields& file, const UserContext& context) {
  std::vector<ExperimentUser> users;
  std::set<std::string> names;
  std::vector<JsonFields> list = file.objects("users", 1, proto::kMaxUsers);
  const json::array& documents = context.file.document.at("users").get_array();
  for (std::size_t i = 0; i < list.size(); ++i) {
    users.push_back(user_of(list[i], documents[i].get_object(), i, context));
    if (!names.insert(users.back().name).second) list[i].fail("name", "each user needs a name of its own");
  }
  return users;
}

std::optional<OutcomeRule> outcome_of(JsonFields& file, const std::vector<ExperimentUser>& users) {
  if (!file.has("outcome")) return std::nullopt;
  JsonFields fields = file.object("outcome");
  OutcomeRule rule;
  rule.body = fields.required_text("body");
  if (fields.has("ends_at_m")) {
    constexpr double kFarthest_m = 10;
    rule.ends_at_W = fields.vector("ends_at_m", Vec3::Zero(), kFarthest_m);
    rule.ends_within_m = fields.required_number("within_m", 0, kFarthest_m);
    fields.finish();
    return rule;
  }
  rule.lifted_above_m = fields.required_number("lifted_above_m", 0, 10);
  rule.during = fields.required_text("during");
  const auto& phases = users.front().hand.phases();
  if (std::find(phases.begin(), phases.end(), rule.during) == phases.end()) {
    std::string known;
    for (const std::string& phase : phases) known.append(known.empty() ? "" : ", ").append(phase);
    fields.fail("during", "the first user's hand has no such phase; it has: " + known);
  }
  fields.finish();
  return rule;
}

json::object json_of(const OutcomeRule& rule) {
  if (!rule.ends_at_W) {
    return {{"body", rule.body}, {"lifted_above_m", rule.lifted_above_m}, {"during", rule.during}};
  }
  const Vec3& p = *rule.ends_at_W;
  return {{"body", rule.body}, {"ends_at_m", json::array{p.x(), p.y(), p.z()}}, {"within_m", rule.ends_within_m}};
}

/// Collects all changes to the scene file. The fields `law` and `coupling` of an experiment count as such changes.
json::object scene_changes_of(JsonFields& file, const json::object& document) {
  json::object changes = object_in(document, "scene_changes");
  file.object("scene_changes");
  if (const std::string law = file.text("law", ""); !law.empty()) changes["coupling.law"] = law;
  file.object("coupling");
  for (const auto& field : object_in(document, "coupling")) {
    changes["coupling." + std::string(field.key())] = field.value();
  }
  return changes;
}

// Accepts the fields that define the set of trials, so that they are not reported as unknown. They are not part of a
// single trial; lab/experiment/trial_grid reads them.
void skip_grid(JsonFields& file) {
  file.whole_number("seeds", 1, kMaxSeeds);
  file.has("grid");
}

json::value* list_element(json::array& list, const std::string& name) {
  for (json::value& element : list) {
    if (element.is_object() && element.get_object().if_contains("name") != nullptr &&
        element.get_object().at("name") == json::value(name)) {
      return &element;
    }
  }
  const bool is_number = !name.empty() && name.find_first_not_of("0123456789") == std::string::npos && name.size() < 6;
  if (!is_number) return nullptr;
  const std::size_t index = std::stoul(name);
  return index < list.size() ? &list[index] : nullptr;
}

[[noreturn]] void refuse_change(const std::string& name, const std::string& part) {
  throw std::invalid_argument("scene." + name + ": the scene has no " + part +
                              " there; bodies and tools go by their names or numbers, e.g. scene.bodies.cube.friction");
}

void change(json::value& scene, const std::string& name, const json::value& value) {
  json::value* at = &scene;
  const std::vector<std::string> parts = parts_of_name(name);
  for (const std::string& part : parts) {
    if (at->is_array()) {
      at = list_element(at->get_array(), part);
      if (at == nullptr) refuse_change(name, "\"" + part + "\"");
    } else if (at->is_object()) {
      at = &at->get_object()[part];
      if (at->is_null() && &part != &parts.back()) at->emplace_object();
    } else {
      refuse_change(name, "\"" + part + "\"");
    }
  }
  *at = value;
}

json::object user_json(const ExperimentUser& user) {
  json::object result{{"name", user.name},
                      {"role", role_name(user.role)},
                      {"hand", user.hand_name},
                      {"hand_parameters", client::to_json(user.hand_parameters)},
                      {"device", user.device.name},
                      {"bounded", user.is_bounded},
                      {"motion_scale", user.motion_scale},
                      {"pace", user.pace},
                      {"transport", user.state_over_tcp ? "tcp" : "udp"},
                      {"tick_phase_ms", in_milliseconds(user.tick_phase)},
                      {"link", link_json(user.up)},
                      {"downlink", link_json(user.down)}};
  return with(std::move(result), pipeline_json(user.pipeline));
}

}  // namespace

std::string_view role_name(server::UserRole role) {
  return kRoles[static_cast<std::size_t>(role)];
}

std::vector<std::string_view> asset_deliveries() {
  return {"here", "fetched", "fetched-in-turn"};
}

json::object link_json(const net::LinkParameters& link) {
  json::object result{{"rtt_ms", 2 * in_milliseconds(link.delay)}};
  for (const auto& field : client::to_json(link)) {
    if (field.key() != "delay_ms") result[field.key()] = field.value();
  }
  if (!result.contains("trace_ms")) result["trace_ms"] = json::array();
  return result;
}

std::filesystem::path scene_path(const std::string& scene, const std::filesystem::path& directory) {
  const std::filesystem::path beside = directory / scene;
  return server::find_scene(std::filesystem::is_regular_file(beside) ? beside.string() : scene,
                            server::scene_folders());
}

ExperimentFile read_experiment_file(const std::filesystem::path& file) {
  const json::value value = parse_json(read_text_file(file), file.string());
  [[maybe_unused]] const JsonFields fields(value, file.string());  // throws if the value is not an object
  return {file.string(), file.parent_path(), with_current_names(value.get_object())};
}

Experiment parse_experiment(const ExperimentFile& source) {
  JsonFields file(source.document, source.origin);
  Experiment result;
  result.name = file.required_text("name");
  result.description = file.text("description", "");
  try {
    result.scene = scene_path(file.required_text("scene"), source.directory);
  } catch (const server::SceneError& error) {
    throw std::invalid_argument(source.origin + ": scene: " + error.what());
  }
  result.scene_changes = scene_changes_of(file, source.document);
  result.duration = from_seconds(file.number("duration_s", to_seconds(result.duration), 0.1, kLongest_s));
  result.seed = file.whole_number("seed", result.seed, kMaxSeed);
  result.server_phase = phase_of(file, "server_phase_ms", result.server_phase);
  result.sample_period = std::chrono::milliseconds(file.whole_number("sample_period_ms", 10, 1000));
  if (result.sample_period <= Duration(0)) file.fail("sample_period_ms", "it must be a whole number from 1 to 1000");
  result.pipeline = pipeline_of(file, result.pipeline);
  result.reference_stage = one_of(file, "reference_stage", truth_stage(), known_stages());
  result.link = link_of(file.object("link"), source.directory);
  result.assets = one_of(file, "assets", result.assets, asset_deliveries());
  result.users = users_of(file, {source, result.pipeline, object_in(source.document, "link")});
  result.outcome = outcome_of(file, result.users);
  skip_grid(file);
  file.finish();
  if (to_seconds(result.duration) * static_cast<double>(result.users.size()) > kMaxUserSeconds) {
    file.fail("duration_s", "duration times users must be at most 1200 s");
  }
  return result;
}

Experiment parse_experiment(std::string_view text, const std::string& origin, const std::filesystem::path& directory) {
  const json::value value = parse_json(text, origin);
  [[maybe_unused]] const JsonFields fields(value, origin);
  return parse_experiment(ExperimentFile{origin, directory, with_current_names(value.get_object())});
}

Experiment load_experiment(const std::filesystem::path& file) {
  return parse_experiment(read_experiment_file(file));
}

json::object experiment_json(const Experiment& experiment) {
  json::object result{{"name", experiment.name},
                      {"description", experiment.description},
                      {"scene", experiment.scene.string()},
                      {"scene_changes", experiment.scene_changes},
                      {"duration_s", to_seconds(experiment.duration)},
                      {"seed", experiment.seed},
                      {"server_phase_ms", in_milliseconds(experiment.server_phase)},
                      {"sample_period_ms", experiment.sample_period / kHapticPeriod},
                      {"reference_stage", experiment.reference_stage},
                      {"link", link_json(experiment.link)},
                      {"assets", experiment.assets}};
  result = with(std::move(result), pipeline_json(experiment.pipeline));
  if (experiment.outcome) result["outcome"] = json_of(*experiment.outcome);
  json::array& users = result["users"].emplace_array();
  for (const ExperimentUser& user : experiment.users) users.push_back(user_json(user));
  return result;
}

std::string scene_text(const Experiment& experiment) {
  if (experiment.scene_changes.empty()) return read_text_file(experiment.scene);
  json::value scene = parse_json(read_text_file(experiment.scene), experiment.scene.string());
  for (const auto& each : experiment.scene_changes) change(scene, std::string(each.key()), each.value());
  return pretty_json(scene);
}

void check_manipulators(const Experiment& experiment, const server::LoadedScene& scene) {
  const auto manipulators = std::ranges::count_if(experiment.users, server::has_tool, &ExperimentUser::role);
  const std::size_t tools = scene.world.tools.size();
  if (static_cast<std::size_t>(manipulators) > tools) {
    throw std::invalid_argument("experiment " + experiment.name + ": users has " + std::to_string(manipulators) +
                                " manipulators, but the scene has " + std::to_string(tools) +
                                (tools == 1 ? " tool" : " tools") + "; make the others observers");
  }
}

std::shared_ptr<const server::LoadedScene> load_experiment_scene(const Experiment& experiment,
                                                                 const server::SceneLoading& loading) {
  if (experiment.scene_changes.empty()) return server::load_scene(experiment.scene, loading);
  return server::load_scene_text(scene_text(experiment), experiment.scene.string(), experiment.scene.parent_path(),
                                 loading);
}

Duration round_trip_of(const ExperimentUser& user) {
  return user.up.delay + user.down.delay;
}

}  // namespace tandem::lab
