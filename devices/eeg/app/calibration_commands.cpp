// Commands that work on recordings: features, generate, train, validate.
#include <fstream>
#include <iostream>
#include <map>
#include <stdexcept>

#include "common/base/json_pretty.hpp"
#include "devices/eeg/app/options.hpp"
#include "devices/eeg/classifier/validation.hpp"
#include "devices/eeg/sources/edf_file.hpp"
#include "devices/eeg/sources/generator.hpp"

namespace tandem::eeg {
namespace {

/// Returns a text as a CSV field. It is quoted as in RFC 4180 if it contains a comma, a quote or a line end.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + '"';
}

void write_header(const std::vector<std::string>& channels, std::ostream& out) {
  out << "file,start_s,artefacts";
  for (const std::string& channel : channels) {
    for (const std::string_view name : kFeatureNames) out << ',' << csv_field(channel + '.' + std::string(name));
  }
  out << '\n';
}

void write_window(const Window& window, const Recording& recording, const std::string& file, std::ostream& out) {
  std::string artefacts;
  for (std::size_t i = 0; i < window.flags.size(); ++i) {
    if (window.flags[i] == 0) continue;
    artefacts += (artefacts.empty() ? "" : " ") + recording.format.channels[i] + ":" + artefact_text(window.flags[i]);
  }
  out << csv_field(file) << ',' << static_cast<double>(window.first_sample) / recording.format.rate_hz << ','
      << csv_field(artefacts);
  for (const double value : window.features) out << ',' << value;
  out << '\n';
}

void write_features(const RecordingOptions& options, std::ostream& out) {
  out.precision(17);
  std::vector<std::string> channels;
  for (const std::filesystem::path& file : options.files) {
    const Recording recording = read_recording(file, options.channels);
    if (channels.empty()) {
      channels = recording.format.channels;
      write_header(channels, out);
    } else if (recording.format.channels != channels) {
      throw std::invalid_argument(file.string() + ": channels differ from those of " + options.files.front().string() +
                                  ", which are the columns; choose the same ones by --channels");
    }
    ArtefactCount count(channels);
    for (const Window& window : windows_of(recording, options.windows)) {
      count.add(window);
      write_window(window, recording, file.string(), out);
    }
    std::cerr << file.string() << ": " << count.text();
  }
}

void run_features(const RecordingOptions& options, const std::filesystem::path& out) {
  if (out.empty()) return write_features(options, std::cout);
  std::ofstream file(out);
  write_features(options, file);
  file.close();
  if (!file) throw std::invalid_argument(out.string() + ": cannot be written; check its folder and its permissions");
}

void run_generate(const GeneratorSettings& settings, const std::filesystem::path& out) {
  const std::string ending = out.extension().string();
  if (ending != ".edf" && ending != ".bdf")
    throw std::invalid_argument("--out: '" + out.string() + "' must end in .edf (16 bits) or .bdf (24 bits)");
  write_edf(out, edf_from(generate(settings), ending == ".bdf"));
}

struct ValidateOptions {
  RecordingOptions recordings;
  std::filesystem::path model;
  SplitBy split = SplitBy::kSessions;
  std::size_t folds = 5;
  double penalty = kDefaultPenalty;
  std::size_t permutations = kDefaultPermutations;
  std::uint64_t seed = 1;
  bool prints_json = false;
};

Accuracy accuracy_with(ValidateOptions& options) {
  if (!options.model.empty()) {
    const Model model = load_model(options.model);
    options.recordings.windows = model.settings;
    options.recordings.channels = model.format.channels;
    options.recordings.labels = {model.labels.negative, model.labels.positive};
    const Calibration test = read_calibration(options.recordings);
    print_artefacts(test);
    check_source(model, test.format, test.sessions.front());
    return validate(model, test, options.permutations, options.seed);
  }
  const Calibration calibration = read_calibration(options.recordings);
  print_artefacts(calibration);
  const std::vector<Fold> folds = split(calibration, options.split, options.folds, options.seed);
  return validate(calibration, folds, options.penalty, options.permutations, options.seed);
}

int run_validate(ValidateOptions& options) {
  const Accuracy accuracy = accuracy_with(options);
  if (options.prints_json) {
    std::cout << pretty_json(boost::json::object{{"windows", accuracy.windows},
                                                 {"correct", accuracy.correct},
                                                 {"accuracy", accuracy.share},
                                                 {"chance_low", accuracy.chance_low},
                                                 {"chance_high", accuracy.chance_high},
                                                 {"p_value", accuracy.p_value},
                                                 {"is_above_chance", accuracy.is_above_chance()}});
  } else {
    std::cout << "accuracy on held-out data: " << accuracy.share << " (" << accuracy.correct << " of "
              << accuracy.windows << " windows)\n95 % of label permutations: " << accuracy.chance_low << " to "
              << accuracy.chance_high << ", p = " << accuracy.p_value << '\n'
              << (accuracy.is_above_chance() ? "above chance\n" : "not above chance: do not use this classifier\n");
  }
  return accuracy.is_above_chance() ? 0 : 1;
}

}  // namespace

void add_features_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("features", "writes the features of each window of recordings as CSV");
  const auto options = std::make_shared<RecordingOptions>();
  const auto out = std::make_shared<std::filesystem::path>();
  add_file_options(*command, *options);
  add_window_options(*command, options->windows);
  command->add_option("--out", *out, "file to write [standard output]")->type_name("FILE.csv");
  command->callback([=] { run_features(*options, *out); });
}

void add_generate_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("generate", "writes synthetic EEG of two states, with their labels");
  const auto settings = std::make_shared<GeneratorSettings>();
  const auto out = std::make_shared<std::filesystem::path>();
  command->add_option("--out", *out, "file to write: EDF+ (.edf) or BDF+ (.bdf)")->required()->type_name("FILE");
  command->add_option("--seed", settings->seed, "seed of the person")->capture_default_str();
  command->add_option("--session", settings->session, "number of the session; each has other noise")
      ->capture_default_str();
  command->add_option("--sample-rate", settings->rate_hz, "samples per second [Hz]")->capture_default_str();
  command->add_option("--channels", settings->channels, "names of the channels")
      ->delimiter(',')
      ->type_name("NAME,NAME,...");
  command->add_option("--blocks", settings->blocks, "number of blocks, half of them in each state")
      ->capture_default_str();
  command->add_option("--windows", settings->windows_per_block, "windows in a block")->capture_default_str();
  command->add_option("--window", settings->window, "length of a window [samples]")->capture_default_str();
  command
      ->add_option("--bayes-accuracy", settings->bayes_accuracy,
                   "largest possible accuracy for a window; 0.5: no effect of the state")
      ->capture_default_str();
  command
      ->add_option("--block-effect", settings->block_effect,
                   "differences between blocks that are not due to the state, in standard deviations of a window")
      ->capture_default_str();
  command->add_option("--blinks", settings->blinks_per_min, "blinks [per minute]")->capture_default_str();
  command->add_option("--bad-contacts", settings->bad_contacts_per_hour, "bad contacts of 10 s [per hour]")
      ->capture_default_str();
  command->callback([=] { run_generate(*settings, *out); });
}

void add_train_command(CLI::App& app) {
  CLI::App* const command = app.add_subcommand("train", "trains the classifier of one person from labelled sessions");
  const auto options = std::make_shared<RecordingOptions>();
  const auto out = std::make_shared<std::filesystem::path>();
  const auto penalty = std::make_shared<double>(kDefaultPenalty);
  add_file_options(*command, *options);
  add_label_options(*command, *options);
  add_window_options(*command, options->windows);
  command->add_option("--model", *out, "file to write")->required()->type_name("FILE.json");
  command->add_option("--penalty", *penalty, "penalty C of the support vector machine")->capture_default_str();
  command->callback([=] {
    const Calibration calibration = read_calibration(*options);
    print_artefacts(calibration);
    save_model(train(calibration, *penalty), *out);
    std::cerr << "trained with " << calibration.windows.size() << " windows of " << calibration.blocks.size()
              << " blocks; check it by tandem-eeg validate --model " << out->string() << " OTHER_SESSION\n";
  });
}

void add_validate_command(CLI::App& app, int& exit_code) {
  CLI::App* const command =
      app.add_subcommand("validate", "measures the accuracy on sessions or blocks that were not used for training");
  const auto options = std::make_shared<ValidateOptions>();
  add_file_options(*command, options->recordings);
  add_label_options(*command, options->recordings);
  add_window_options(*command, options->recordings.windows);
  command
      ->add_option("--model", options->model,
                   "test this model with the files, by its own channels, labels and windows; otherwise each part of a "
                   "split is the test once, with a classifier trained with the others")
      ->type_name("FILE.json");
  const std::map<std::string, SplitBy> splits{
      {"sessions", SplitBy::kSessions}, {"blocks", SplitBy::kBlocks}, {"windows", SplitBy::kWindows}};
  command
      ->add_option("--split", options->split, "what is held out; windows shares blocks and is refused with the reason")
      ->transform(CLI::CheckedTransformer(splits).description(""))
      ->default_str("sessions")
      ->type_name("sessions|blocks|windows");
  command->add_option("--folds", options->folds, "parts of a split by blocks")->capture_default_str();
  command->add_option("--penalty", options->penalty, "penalty C of the support vector machine")->capture_default_str();
  command->add_option("--permutations", options->permutations, "permutations of the labels for the band of chance")
      ->capture_default_str();
  command->add_option("--seed", options->seed, "seed of the split and of the permutations")->capture_default_str();
  command->add_flag("--json", options->prints_json, "print one JSON object");
  command->footer("Exit code: 0 above chance, 1 not above chance, 2 bad input or set-up.");
  command->callback([=, &exit_code] { exit_code = run_validate(*options); });
}

}  // namespace tandem::eeg
