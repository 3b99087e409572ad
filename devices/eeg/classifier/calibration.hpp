// Labelled windows from the calibration sessions of one person, as data for training and tests.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "devices/eeg/recording.hpp"
#include "devices/eeg/window_reader.hpp"

namespace tandem::eeg {

/// Texts of the annotations that mark the start of each of the two states.
struct Labels {
  std::string negative = "negative";
  std::string positive = "positive";
};

/// An interval of a recording in which the person's state is constant. Windows of one block resemble each other for
/// reasons other than the state. They must therefore not be split between training and test.
struct Block {
  double begin_s = 0, end_s = 0;
  bool is_positive = false;
};

/// Finds the labelled blocks of a recording. An annotation without a duration lasts until the next label. Two
/// successive blocks of the same state are merged if the pause between them is at most 1 s.
/// Fails   std::invalid_argument: no annotation has one of the labels, or two labels overlap; the message names the
///         labels
std::vector<Block> blocks_of(const Recording& recording, const Labels& labels);

/// Reads annotations from a text file with lines `onset_s,duration_s,label`; the duration may be empty.
/// Fails   std::invalid_argument: the message names the file, the line and the remedy
std::vector<Annotation> read_label_file(const std::filesystem::path& file);

struct LabelledWindow {
  std::vector<double> features;
  bool is_positive = false;
  std::size_t block = 0;  ///< index into Calibration::blocks
};

struct CalibrationBlock {
  std::size_t session = 0;  ///< index into Calibration::sessions
  bool is_positive = false;
  std::string fingerprint;  ///< hash of the samples, equal in copies of the recording
};

/// Data for training or testing a classifier. A session is one recording.
struct Calibration {
  StreamFormat format;
  WindowSettings settings;
  Labels labels;
  std::vector<std::string> sessions;              ///< file name of each recording
  std::vector<std::string> session_fingerprints;  ///< hash of all samples of each session
  std::vector<CalibrationBlock> blocks;
  std::vector<LabelledWindow> windows;   ///< labelled windows without artefacts
  std::vector<ArtefactCount> artefacts;  ///< counts for each session
  std::size_t too_short_blocks = 0;      ///< number of blocks that are unused because they are shorter than a window
};

/// Returns a flag for each block: true if the block has at least one window without artefacts.
std::vector<bool> blocks_with_windows(const Calibration& calibration);

/// Divides the blocks of a recording into windows, and appends these windows as a new session.
/// Fails   std::invalid_argument: channels or rate differ from the previous session, or the calibration already
///         contains the same data
void add_session(Calibration& calibration, const Recording& recording);

}  // namespace tandem::eeg
