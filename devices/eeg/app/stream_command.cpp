// The command stream: the signal of a trained model from a source, at a constant rate.
#include <iostream>
#include <stdexcept>

#include "client/signals/app/signal_options.hpp"
#include "common/base/units.hpp"
#include "devices/eeg/app/options.hpp"
#include "devices/eeg/app/room_sink.hpp"
#include "devices/eeg/classifier/signal.hpp"
#include "devices/eeg/sources/cortex_source.hpp"
#include "devices/eeg/sources/edf_file.hpp"
#include "devices/eeg/sources/generator.hpp"
#include "devices/eeg/sources/lsl_source.hpp"
#include "devices/eeg/sources/recorded_source.hpp"

namespace tandem::eeg {
namespace {

struct StreamOptions {
  std::string source;
  std::filesystem::path model;
  std::filesystem::path file;
  std::filesystem::path credentials;
  CortexSettings cortex;
  LslSettings lsl;
  GeneratorSettings generator;
  double rate_hz = 2;
  std::size_t step = 128;
  std::string duration;
  bool is_immediate = false;
  client::SignalOptions room;
};

std::unique_ptr<EegSource> open_source(StreamOptions& options, const Model& model) {
  if (options.source == "cortex") {
    if (options.credentials.empty())
      throw std::invalid_argument("--source cortex needs --credentials FILE.json with client_id and client_secret");
    options.cortex.credentials = read_cortex_credentials(options.credentials);
    return open_cortex(options.cortex);
  }
  if (options.source == "lsl") return open_lsl(options.lsl);
  if (options.source == "file") {
    if (options.file.empty()) throw std::invalid_argument("--source file needs --file FILE");
    return std::make_unique<RecordedSource>(read_recording(options.file, model.format.channels), !options.is_immediate);
  }
  options.generator.channels = model.format.channels;
  options.generator.rate_hz = model.format.rate_hz;
  options.generator.window = model.settings.window;
  return std::make_unique<RecordedSource>(generate(options.generator), !options.is_immediate);
}

/// Reads the source and sends one report per period, until the source has ended or `duration_s` has passed.
void stream(EegSource& source, ValenceSignal& signal, SignalSink& sink, double rate_hz, double duration_s) {
  const std::size_t channels = source.format().channels.size();
  const Duration period = from_seconds(1 / rate_hz);
  const SteadyClock clock;
  const LocalTime start = clock.now();
  std::size_t frames = 0;
  std::vector<double> values;
  bool continues = true;
  while (continues) {
    values.clear();
    continues = source.read(values, period);
    frames += values.size() / channels;
    const LocalTime now{source.is_live() ? clock.now() - start
                                         : from_seconds(static_cast<double>(frames) / source.format().rate_hz)};
    signal.append_all(values, now);
    sink.send(signal.report(now));
    continues = continues && to_seconds(now.time_since_epoch()) < duration_s;
  }
}

int run_stream(StreamOptions& options) {
  if (!(options.rate_hz >= 0.1 && options.rate_hz <= 100))
    throw std::invalid_argument("--rate must be 0.1 to 100 reports per second");
  const double duration_s = options.duration.empty() ? std::numeric_limits<double>::infinity()
                                                     : to_seconds(parse_duration(options.duration, "s"));
  Model model = load_model(options.model);
  model.settings.step = options.step;
  const std::unique_ptr<EegSource> source = open_source(options, model);
  ValenceSignal signal(std::move(model), source->format(), "--source " + options.source);
  JsonLineSink lines(std::cout);
  std::unique_ptr<RoomSink> room;
  if (options.room.has_server()) {
    if (options.is_immediate)
      throw std::invalid_argument("--immediate: a room needs signals in real time; leave it out");
    client::SignalConnectionSettings settings = client::connection_of(options.room);
    settings.on_log = [](const std::string& line) { std::cerr << "tandem-eeg: " << line << std::endl; };
    room = std::make_unique<RoomSink>(lines, std::move(settings));
  }
  SignalSink& sink = room ? static_cast<SignalSink&>(*room) : lines;
  int exit_code = 0;
  try {
    stream(*source, signal, sink, options.rate_hz, duration_s);
    if (room) room->finish();
  } catch (const std::runtime_error& lost) {
    std::cerr << "tandem-eeg: " << lost.what() << std::endl;
    exit_code = 1;
  }
  std::cerr << signal.artefacts().text();
  return exit_code;
}

}  // namespace

void add_stream_command(CLI::App& app, int& exit_code) {
  CLI::App* const command = app.add_subcommand(
      "stream", "prints the signal 'valence' of a trained model as lines of JSON, and sends it to a room");
  const auto options = std::make_shared<StreamOptions>();
  command->add_option("--source", options->source, "where the EEG comes from")
      ->required()
      ->check(CLI::IsMember({"cortex", "lsl", "file", "generator"}).description(""))
      ->type_name("cortex|lsl|file|generator");
  command->add_option("--model", options->model, "model that tandem-eeg train has made for this person")
      ->required()
      ->type_name("FILE.json");
  command->add_option("--rate", options->rate_hz, "reports [per second]")->capture_default_str();
  command->add_option("--step", options->step, "from one window to the next [samples]")->capture_default_str();
  command->add_option("--duration", options->duration, "until it ends, with unit [until the source ends]")
      ->type_name("TIME");
  command->add_option("--file", options->file, "recording for --source file")->type_name("FILE");
  command->add_flag("--immediate", options->is_immediate, "do not wait in real time for a file or the generator");
  command->add_option("--cortex", options->cortex.url, "address of Emotiv's Cortex service, on this machine")
      ->capture_default_str()
      ->type_name("wss://HOST:PORT");
  command->add_option("--credentials", options->credentials, "client_id and client_secret of the application at Emotiv")
      ->type_name("FILE.json");
  command->add_option("--headset", options->cortex.headset, "id of the Emotiv headset [the first]");
  command->add_option("--library", options->lsl.library, "liblsl for --source lsl [as the system finds it]")
      ->type_name("FILE");
  command->add_option("--stream", options->lsl.stream, "name of the LSL stream [the first of the type EEG]");
  client::add_signal_options(*command, options->room);
  command->add_option("--seed", options->generator.seed, "seed of --source generator")->capture_default_str();
  command->add_option("--bayes-accuracy", options->generator.bayes_accuracy, "of --source generator")
      ->capture_default_str();
  command->footer(
      "Fields: value -1 (negative) to 1 (positive), null before the first window without artefacts; confidence 0.5 to "
      "1; "
      "age_s since the last sample that the value depends on; artefacts of the newest window.\n"
      "With --join, --pin, --ca or --insecure it also sends the signal to the game of a room.\n"
      "Exit code: 0 done, 1 the source or the room was lost, 2 bad input or set-up.");
  command->callback([=, &exit_code] { exit_code = run_stream(*options); });
}

}  // namespace tandem::eeg
