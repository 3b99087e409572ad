#include <fstream>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "devices/eeg/classifier/model.hpp"

namespace tandem::eeg {
namespace {

namespace json = boost::json;

constexpr std::string_view kFormatName = "tandem-eeg model";
constexpr std::uint64_t kVersion = 2;

json::array list_of(const std::vector<double>& values) {
  return json::array(values.begin(), values.end());
}

json::array texts_of(const std::vector<std::string>& values) {
  json::array list;
  for (const std::string& value : values) list.emplace_back(value);
  return list;
}

/// An artefact threshold: name in the file, member of ArtefactLimits, and largest allowed value.
struct LimitField {
  const char* name;
  double ArtefactLimits::*value;
  double largest;
};
constexpr LimitField kLimitFields[] = {{"flat_uv", &ArtefactLimits::flat_uv, 1e6},
                                       {"amplitude_uv", &ArtefactLimits::amplitude_uv, 1e6},
                                       {"step_uv", &ArtefactLimits::step_uv, 1e6},
                                       {"line_share", &ArtefactLimits::line_share, 1},
                                       {"clipped_share", &ArtefactLimits::clipped_share, 1}};

std::vector<double> numbers_of_length(JsonFields& fields, const char* name, std::size_t length) {
  std::vector<double> values = fields.numbers(name, -1e12, 1e12);
  if (values.size() != length)
    fields.fail(name, "it must have " + std::to_string(length) + " numbers, " + std::to_string(kFeatureCount) +
                          " for each channel");
  return values;
}

void check_features(JsonFields& fields) {
  const std::vector<std::string> names = fields.texts("features");
  if (!std::ranges::equal(names, kFeatureNames))
    fields.fail("features", "this version of the program computes other features; train again");
}

}  // namespace

void save_model(const Model& model, const std::filesystem::path& file) {
  json::object limits;
  for (const LimitField& one : kLimitFields) limits[one.name] = model.settings.limits.*one.value;
  json::array features;
  for (const std::string_view name : kFeatureNames) features.emplace_back(name);
  const json::object root{{"format", kFormatName},
                          {"version", kVersion},
                          {"negative", model.labels.negative},
                          {"positive", model.labels.positive},
                          {"channels", texts_of(model.format.channels)},
                          {"rate_hz", model.format.rate_hz},
                          {"low_hz", model.settings.low_hz},
                          {"high_hz", model.settings.high_hz},
                          {"window", model.settings.window},
                          {"step", model.settings.step},
                          {"artefact_limits", limits},
                          {"features", features},
                          {"mean", list_of(model.mean)},
                          {"scale", list_of(model.scale)},
                          {"weights", list_of(model.weights)},
                          {"bias", model.bias},
                          {"slope", model.slope},
                          {"offset", model.offset},
                          {"trained_blocks", texts_of(model.trained_blocks)},
                          {"trained_sessions", texts_of(model.trained_sessions)}};
  // The model is personal data, so other users' access to the file is removed before anything is written to it.
  std::ofstream out(file);
  std::error_code ignored;
  std::filesystem::permissions(file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, ignored);
  out << pretty_json(root);
  out.close();
  if (!out) throw std::invalid_argument(file.string() + ": cannot be written; check its folder and its permissions");
}

Model load_model(const std::filesystem::path& file) {
  JsonFields fields(parse_json(read_text_file(file), file.string()), file.string());
  if (fields.required_text("format") != kFormatName)
    fields.fail("format", "this is no model of tandem-eeg; make one by tandem-eeg train");
  if (fields.whole_number("version", 0, 1'000'000) != kVersion)
    fields.fail("version", "another version of the program made this model; train again");
  Model model;
  model.labels = {fields.required_text("negative"), fields.required_text("positive")};
  model.format.channels = fields.texts("channels");
  if (model.format.channels.empty() || model.format.channels.size() > kMaxChannels)
    fields.fail("channels", "it must have 1 to " + std::to_string(kMaxChannels) + " names");
  model.format.rate_hz = fields.required_number("rate_hz", 1, kMaxRateHz);
  model.settings.low_hz = fields.required_number("low_hz", 0, kMaxRateHz);
  model.settings.high_hz = fields.required_number("high_hz", 0, kMaxRateHz);
  model.settings.window = static_cast<std::size_t>(fields.whole_number("window", 0, 1U << 16U));
  model.settings.step = static_cast<std::size_t>(fields.whole_number("step", 0, 1U << 16U));
  JsonFields limits = fields.object("artefact_limits");
  for (const LimitField& one : kLimitFields)
    model.settings.limits.*one.value = limits.required_number(one.name, 0, one.largest);
  limits.finish();
  check_features(fields);
  const std::size_t width = kFeatureCount * model.format.channels.size();
  model.mean = numbers_of_length(fields, "mean", width);
  model.scale = numbers_of_length(fields, "scale", width);
  model.weights = numbers_of_length(fields, "weights", width);
  model.bias = fields.required_number("bias", -1e12, 1e12);
  model.slope = fields.required_number("slope", 0, 1e12);
  model.offset = fields.required_number("offset", -1e12, 1e12);
  model.trained_blocks = fields.texts("trained_blocks");
  model.trained_sessions = fields.texts("trained_sessions");
  if (model.trained_sessions.empty())
    fields.fail("trained_sessions", "it must have the hash of each recording of the training; train again");
  fields.finish();
  // This constructor checks the combination of channels, rate and settings. It throws if no training can have produced
  // it.
  const WindowReader possible(model.format, model.settings);
  return model;
}

}  // namespace tandem::eeg
