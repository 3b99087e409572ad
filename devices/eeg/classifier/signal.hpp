// Computes a named signal from a stream of EEG and sends it to a receiver.
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
  LocalTime time{};             ///< time of the report
  std::optional<double> value;  ///< value from -1 to 1; empty until the first window without artefacts
  double confidence = 0;        ///< confidence in the value, 0.5 to 1; 0 if there is no value
  Duration age{};               ///< time since the last sample that the value depends on
  std::string artefacts;        ///< artefacts of the newest window, for example "F7 flat, O1 step"
};

/// Interface of a receiver of signal reports.
class SignalSink {
 public:
  virtual ~SignalSink() = default;
  virtual void send(const SignalReport& report) = 0;
};

/// Writes each report as one line of JSON, and flushes the stream.
class JsonLineSink final : public SignalSink {
 public:
  explicit JsonLineSink(std::ostream& out) : out_(out) {}
  void send(const SignalReport& report) override;

 private:
  std::ostream& out_;
};

/// Computes the signal `valence`. During windows with artefacts, the value of the last good window is reported, with an
/// increasing age.
class ValenceSignal {
 public:
  /// Fails   std::invalid_argument: channels or rate differ from the model
  ValenceSignal(Model model, const StreamFormat& format, const std::string& origin);

  /// Accepts one sample of each channel [µV], recorded at `time`.
  void append(std::span<const double> frame_uv, LocalTime time);
  /// Accepts the samples of one call of EegSource::read(). The last sample was recorded at the time `end`, each earlier
  /// one a sampling period before its successor.
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
