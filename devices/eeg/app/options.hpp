// Options that several commands of tandem-eeg share, and the commands themselves.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "devices/eeg/classifier/calibration.hpp"
#include "devices/eeg/window_reader.hpp"

namespace tandem::eeg {

inline constexpr const char* kNotMedical =
    "Not a medical device: its output is for games and research, not for diagnosis or treatment.";

/// Recordings, the channels used, and how they are cut into windows.
struct RecordingOptions {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> channels;
  std::vector<std::string> labels{"negative", "positive"};
  bool has_label_files = false;
  WindowSettings windows;
};

void add_file_options(CLI::App& command, RecordingOptions& options);
void add_window_options(CLI::App& command, WindowSettings& settings);
void add_label_options(CLI::App& command, RecordingOptions& options);

/// Reads the labelled sessions that the options name.
/// Fails   std::invalid_argument
Calibration read_calibration(const RecordingOptions& options);
/// Prints how many windows of each session have artefacts, to standard error.
void print_artefacts(const Calibration& calibration);

void add_features_command(CLI::App& app);
void add_generate_command(CLI::App& app);
void add_train_command(CLI::App& app);
void add_validate_command(CLI::App& app, int& exit_code);
void add_stream_command(CLI::App& app, int& exit_code);

}  // namespace tandem::eeg
