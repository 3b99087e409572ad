#include "lab/experiment/trial_grid.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr std::uint64_t kDefaultSeeds = 3;

/// One block of the grid: a set of axes. Every combination of their values is a trial.
struct Block {
  std::vector<Axis> axes;
  std::optional<std::uint64_t> seeds;
};

Axis axis(std::string name, std::initializer_list<json::value> values) {
  return {std::move(name), std::vector<json::value>(values)};
}

Axis axis_of_names(std::string name, const std::vector<std::string_view>& values) {
  Axis result{std::move(name), {}};
  for (const std::string_view value : values) result.values.emplace_back(value);
  return result;
}

/// Returns the stages that can render every scene. Stages that need a proxy world are excluded.
std::vector<std::string_view> general_stages() {
  std::vector<std::string_view> stages = known_stages();
  std::erase_if(stages, client::needs_proxy_world);
  return stages;
}

Axis other_stages() {
  std::vector<std::string_view> stages = general_stages();
  std::erase(stages, default_stage());
  return axis_of_names("stage", stages);
}

std::vector<Block> default_blocks() {
  return {{{axis("stage", {json::value(default_stage())}), axis("passivity", {true}),
            axis("link.rtt_ms", {0, 10, 25, 50, 100, 200, 300}), axis("link.jitter_ms", {0, 10}),
            axis("link.loss", {0, 0.05})},
           std::nullopt},
          {{other_stages(), axis("predictor", {"none"}), axis("passivity", {false}),
            axis("link.rtt_ms", {0, 30, 100, 300}), axis("link.jitter_ms", {0}), axis("link.loss", {0})},
           1}};
}

std::vector<Block> full_blocks() {
  return {{{axis_of_names("stage", general_stages()), axis_of_names("predictor", known_predictors()),
            axis("passivity", {true, false}), axis("link.rtt_ms", {0, 10, 25, 30, 50, 100, 200, 300}),
            axis("link.jitter_ms", {0, 10}), axis("link.loss", {0, 0.05})},
           std::nullopt}};
}

/// Returns the axis for a field of the grid. `"stage": "others"` stands for all stages that can render every scene,
/// except the default stage.
Axis axis_of(const std::string& name, const json::value& value) {
  if (name == "stage" && value == json::value("others")) return other_stages();
  Axis result{name, {}};
  if (value.is_array()) {
    result.values.assign(value.get_array().begin(), value.get_array().end());
  } else {
    result.values.push_back(value);
  }
  return result;
}

Block block_of(const json::object& block, const ExperimentFile& file, std::size_t index) {
  const std::string where = file.origin + ": grid[" + std::to_string(index) + "].";
  Block result;
  for (const auto& field : block) {
    const std::string name = current_name(field.key());
    if (name == "seeds") {
      result.seeds = JsonFields(block, file.origin).whole_number("seeds", 1, kMaxSeeds);
      continue;
    }
    result.axes.push_back(axis_of(name, field.value()));
    if (result.axes.back().values.empty()) {
      throw std::invalid_argument(where + name + " is an empty list; it must have one value or more");
    }
  }
  return result;
}

std::vector<Block> blocks_of_file(const ExperimentFile& file, const json::value& grid) {
  if (!grid.is_array()) throw std::invalid_argument(file.origin + ": grid must be a list of objects");
  std::vector<Block> blocks;
  for (const json::value& block : grid.get_array()) {
    if (!block.is_object()) throw std::invalid_argument(file.origin + ": grid must be a list of objects");
    blocks.push_back(block_of(block.get_object(), file, blocks.size()));
  }
  if (blocks.empty()) blocks.push_back({{}, 1});  // runs the file unchanged
  return blocks;
}

std::vector<Block> blocks_of(const ExperimentFile& file, const GridRequest& request) {
  if (request.is_single) return {{{}, 1}};
  if (request.is_full) return full_blocks();
  const json::value* grid = file.document.if_contains("grid");
  return grid != nullptr ? blocks_of_file(file, *grid) : default_blocks();
}

/// Adds the axes of the command line to a block. They replace axes of the block with the same name.
void apply_request(Block& block, const GridRequest& request) {
  for (const Axis& axis : request.axes) {
    std::erase_if(block.axes, [&](const Axis& own) { return own.name == axis.name; });
    block.axes.push_back(axis);
  }
}

/// Adds an axis of consecutive seeds to a block. The first one is the seed in the file or in `--set seed`. A block that
/// already lists several seeds remains unchanged.
void add_seeds(Block& block, const ExperimentFile& file, const GridRequest& request) {
  JsonFields fields(file.document, file.origin);
  std::uint64_t first = fields.whole_number("seed", 1, 1ULL << 53U);
  const std::uint64_t of_file = fields.whole_number("seeds", kDefaultSeeds, kMaxSeeds);
  const auto own = std::find_if(block.axes.begin(), block.axes.end(), [](const Axis& a) { return a.name == "seed"; });
  if (own != block.axes.end()) {
    if (own->values.size() > 1) return;
    first = own->values.front().is_number() ? own->values.front().to_number<std::uint64_t>() : first;
    block.axes.erase(own);
  }
  const std::uint64_t count = request.seeds.value_or(block.seeds.value_or(of_file));
  if (count == 0 || count > kMaxSeeds) {
    throw std::invalid_argument(file.origin + ": seeds is " + std::to_string(count) + "; it must be 1 to " +
                                std::to_string(kMaxSeeds));
  }
  Axis seeds{"seed", {}};
  for (std::uint64_t i = 0; i < count; ++i) seeds.values.emplace_back(first + i);
  block.axes.push_back(std::move(seeds));
}

std::size_t combinations(const Block& block) {
  std::size_t count = 1;
  for (const Axis& axis : block.axes) {
    if (count > kMaxTrials) break;
    count *= axis.values.size();
  }
  return count;
}

/// Returns combination number `index` of a block. The last axis changes fastest.
json::object combination(const Block& block, std::size_t index) {
  json::object settings;
  std::size_t stride = combinations(block);
  for (const Axis& axis : block.axes) {
    stride /= axis.values.size();
    settings[axis.name] = axis.values[index / stride % axis.values.size()];
  }
  return settings;
}

ExperimentFile with_settings(const ExperimentFile& file, const json::object& settings) {
  ExperimentFile result = file;
  result.document.erase("grid");
  result.document.erase("seeds");
  for (const auto& setting : settings) set_quantity(result.document, setting.key(), setting.value());
  return result;
}

void check_names(const Block& block, const json::object& complete, const ExperimentFile& file) {
  for (const Axis& axis : block.axes) {
    try {
      check_quantity(complete, axis.name);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(file.origin + ": " + error.what());
    }
  }
}

/// Parses a document to which `settings` were applied. An error must be caused by a setting, because the document
/// without settings was parsed successfully before. Therefore its message names the settings.
Experiment experiment_with(const json::object& settings, const ExperimentFile& file) {
  try {
    return parse_experiment(file);
  } catch (const std::invalid_argument& error) {
    std::string text;
    for (const auto& setting : settings) {
      text += (text.empty() ? "" : ", ") + std::string(setting.key()) + "=" + compact_json(setting.value());
    }
    throw std::invalid_argument("with " + text + ": " + error.what());
  }
}

void too_many(const ExperimentFile& file) {
  throw std::invalid_argument(file.origin + ": more than " + std::to_string(kMaxTrials) +
                              " trials; leave out values or seeds");
}

Trial at_zero_delay(const Trial& trial, json::object settings) {
  Trial result = trial;
  json::object& document = result.file.document;
  settings.insert(
      {{"predictor", "none"}, {"passivity", false}, {"deadband", 0.0}, {"model", pipeline_json({}).at("model")}});
  for (const auto& each : settings) set_quantity(document, each.key(), each.value());
  document["link"] = json::object();
  for (json::value& user : document.at("users").as_array()) {
    user.as_object().erase("link");
    user.as_object().erase("downlink");
  }
  result.settings.clear();
  result.experiment = parse_experiment(result.file);
  return result;
}

}  // namespace

std::vector<Trial> expand(const ExperimentFile& file, const GridRequest& request) {
  const json::object complete = experiment_json(parse_experiment(file));
  std::vector<Trial> trials;
  std::set<std::string> seen;
  for (Block& block : blocks_of(file, request)) {
    apply_request(block, request);
    check_names(block, complete, file);
    add_seeds(block, file, request);
    const std::size_t count = combinations(block);
    if (count + trials.size() > kMaxTrials) too_many(file);
    for (std::size_t i = 0; i < count; ++i) {
      const json::object settings = combination(block, i);
      ExperimentFile own = with_settings(file, settings);
      Experiment experiment = experiment_with(settings, own);
      if (!seen.insert(compact_json(experiment_json(experiment))).second) continue;
      trials.push_back({std::move(experiment), std::move(own), settings});
    }
  }
  return trials;
}

Trial reference_of(const Trial& trial) {
  return at_zero_delay(trial, {{"stage", trial.experiment.reference_stage}});
}

Trial same_stage_of(const Trial& trial) {
  return at_zero_delay(trial, {});
}

}  // namespace tandem::lab
