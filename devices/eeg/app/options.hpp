// Options that are common to several commands of tandem-eeg, and the functions that add each command.
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

/// Options that select recordings and channels, and that set the length and the step of the windows.
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

/// Reads the labelled recordings whose files the options name. Each file is one session.
/// Fails   std::invalid_argument: a file, a channel or a label is unusable; the message names it
Calibration read_calibration(const RecordingOptions& options);
/// Prints the number of windows with artefacts of each session to standard error.
void print_artefacts(const Calibration& calibration);

void add_features_command(CLI::App& app);
void add_generate_command(CLI::App& app);
void add_train_command(CLI::App& app);
void add_validate_command(CLI::App& app, int& exit_code);
void add_stream_command(CLI::App& app, int& exit_code);

}  // namespace tandem::eeg
