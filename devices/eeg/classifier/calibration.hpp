// Labelled windows of the calibration sessions of one person.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "devices/eeg/recording.hpp"
#include "devices/eeg/window_reader.hpp"

namespace tandem::eeg {

/// Texts of the annotations that begin a state.
struct Labels {
  std::string negative = "negative";
  std::string positive = "positive";
};

/// An interval of constant state. Windows of one block resemble each other, in either state.
struct Block {
  double begin_s = 0, end_s = 0;
  bool is_positive = false;
};

/// Finds the labelled blocks of a recording. An annotation without a duration lasts until the next label. Blocks of one
/// state that follow each other within a second are one block.
/// Fails   std::invalid_argument: no annotation has one of the labels, or two labels overlap; the message names them
std::vector<Block> blocks_of(const Recording& recording, const Labels& labels);

/// Reads annotations from lines `onset_s,duration_s,label`; the duration may be empty.
/// Fails   std::invalid_argument: the message names the file, the line and the remedy
std::vector<Annotation> read_label_file(const std::filesystem::path& file);

struct LabelledWindow {
  std::vector<double> features;
  bool is_positive = false;
  std::size_t block = 0;  ///< index of Calibration::blocks
};

struct CalibrationBlock {
  std::size_t session = 0;  ///< index of Calibration::sessions
  bool is_positive = false;
  std::string fingerprint;  ///< hash of the samples; a copy of the recording has the same
};

/// Data that a classifier is trained or tested with.
struct Calibration {
  StreamFormat format;
  WindowSettings settings;
  Labels labels;
  std::vector<std::string> sessions;              ///< file names
  std::vector<std::string> session_fingerprints;  ///< hash of all samples of each session
  std::vector<CalibrationBlock> blocks;
  std::vector<LabelledWindow> windows;   ///< without artefacts
  std::vector<ArtefactCount> artefacts;  ///< counts of each session
  std::size_t too_short_blocks = 0;      ///< shorter than a window, not used
};

/// States for each block whether it has a window without artefacts.
std::vector<bool> blocks_with_windows(const Calibration& calibration);

/// Cuts a session into windows, each within one block, and appends them.
/// Fails   std::invalid_argument: channels or rate differ from the previous session, or the same data is there already
void add_session(Calibration& calibration, const Recording& recording);

}  // namespace tandem::eeg
