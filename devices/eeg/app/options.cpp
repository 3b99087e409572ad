#include "devices/eeg/app/options.hpp"

#include <iostream>
#include <stdexcept>

#include "devices/eeg/sources/edf_file.hpp"

namespace tandem::eeg {

void add_file_options(CLI::App& command, RecordingOptions& options) {
  command.add_option("files", options.files, "recordings in EDF+ or BDF+, one for each session")
      ->required()
      ->type_name("FILE");
  command.add_option("--channels", options.channels, "channels to use, in this order [all whose unit is a voltage]")
      ->delimiter(',')
      ->type_name("NAME,NAME,...");
}

void add_window_options(CLI::App& command, WindowSettings& settings) {
  command.add_option("--low", settings.low_hz, "lower edge of the band-pass [Hz]")->capture_default_str();
  command.add_option("--high", settings.high_hz, "upper edge of the band-pass [Hz]")->capture_default_str();
  command.add_option("--window", settings.window, "length of a window [samples]")->capture_default_str();
  command.add_option("--step", settings.step, "from one window to the next [samples]")->capture_default_str();
  command
      .add_option("--max-amplitude", settings.limits.amplitude_uv,
                  "largest magnitude of filtered EEG; above it a window has an artefact [uV]")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e6).description(""));
  command
      .add_option("--max-line-share", settings.limits.line_share,
                  "largest share of power near 50 or 60 Hz; above it a contact is bad")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1.0).description(""));
}

void add_label_options(CLI::App& command, RecordingOptions& options) {
  command.add_option("--labels", options.labels, "annotations that begin the negative and the positive state")
      ->delimiter(',')
      ->expected(2)
      ->capture_default_str()
      ->type_name("NEGATIVE,POSITIVE");
  command.add_flag("--label-files", options.has_label_files,
                   "read the labels of FILE from FILE.csv, lines onset_s,duration_s,label, not from its annotations");
}

Calibration read_calibration(const RecordingOptions& options) {
  Calibration calibration{.format = {},
                          .settings = options.windows,
                          .labels = {options.labels.front(), options.labels.back()},
                          .sessions = {},
                          .session_fingerprints = {},
                          .blocks = {},
                          .windows = {},
                          .artefacts = {}};
  for (const std::filesystem::path& file : options.files) {
    Recording recording = read_recording(file, options.channels);
    if (options.has_label_files) recording.annotations = read_label_file(file.string() + ".csv");
    add_session(calibration, recording);
  }
  return calibration;
}

void print_artefacts(const Calibration& calibration) {
  for (std::size_t i = 0; i < calibration.sessions.size(); ++i)
    std::cerr << calibration.sessions[i] << ": " << calibration.artefacts[i].text();
  if (calibration.too_short_blocks > 0)
    std::cerr << calibration.too_short_blocks << " labelled blocks are shorter than a window and not used\n";
}

}  // namespace tandem::eeg
