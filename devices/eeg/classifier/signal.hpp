// A named signal computed from a stream of EEG, and where it is sent.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>

#include "common/base/time.hpp"
#include "devices/eeg/classifier/model.hpp"

namespace tandem::eeg {

/// Value of a signal at one time.
struct SignalReport {
  std::string name;
  LocalTime time{};             ///< when it is reported
  std::optional<double> value;  ///< -1 … 1; nothing until the first window without artefacts
  double confidence = 0;        ///< 0.5 … 1; 0 without a value
  Duration age{};               ///< time since the last sample that the value depends on
  std::string artefacts;        ///< flags of the newest window, "F7 flat, O1 step"; empty if it had none
};

/// Receiver of a signal.
class SignalSink {
 public:
  virtual ~SignalSink() = default;
  virtual void send(const SignalReport& report) = 0;
};

/// Writes each report as one line of JSON, and flushes it.
class JsonLineSink final : public SignalSink {
 public:
  explicit JsonLineSink(std::ostream& out) : out_(out) {}
  void send(const SignalReport& report) override;

 private:
  std::ostream& out_;
};

/// Computes the signal `valence`. A window with artefacts does not change the value, and its age grows.
class ValenceSignal {
 public:
  /// Fails   std::invalid_argument: channels or rate differ from the model
  ValenceSignal(Model model, const StreamFormat& format, const std::string& origin);

  /// Takes one sample of each channel [µV], recorded at `time`.
  void append(std::span<const double> frame_uv, LocalTime time);
  /// Takes the samples of one read (EegSource::read()). The last one was recorded at `end`, the others before it at the
  /// rate of the source.
  void append_all(std::span<const double> frames_uv, LocalTime end);
  SignalReport report(LocalTime now) const;
  const ArtefactCount& artefacts() const { return count_; }

 private:
  Model model_;
  WindowReader reader_;
  ArtefactCount count_;
  std::optional<Valence> valence_;
  LocalTime evaluated_{};
  std::string newest_artefacts_;
};

}  // namespace tandem::eeg
