// Detection of artefacts and bad electrode contact, which make a window of a channel unfit for classification.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

/// Flags of one window of one channel, as bits that can be combined.
enum Artefact : std::uint8_t {
  kFlat = 1U << 0U,       ///< hardly any signal: no contact, or a disconnected cable
  kClipped = 1U << 1U,    ///< saturated: too many samples at an end of the converter's range
  kAmplitude = 1U << 2U,  ///< larger than EEG can be, for example a blink or a movement
  kLineNoise = 1U << 3U,  ///< mostly mains hum at 50 or 60 Hz: bad contact
  kStep = 1U << 4U,       ///< a jump between two samples: contact was lost or made
  kLost = 1U << 5U,       ///< contains samples that the source lost or interpolated
};
inline constexpr std::array<std::string_view, 6> kArtefactNames{"flat",       "clipped", "amplitude",
                                                                "line_noise", "step",    "lost"};

/// Thresholds of the artefact flags. The defaults were chosen for scalp EEG with amplitudes of 10 to 50 µV.
struct ArtefactLimits {
  double flat_uv = 1.0;          ///< kFlat is set below this peak-to-peak range of the unfiltered signal
  double amplitude_uv = 100.0;   ///< kAmplitude is set above this magnitude of the filtered signal
  double step_uv = 150.0;        ///< kStep is set above this difference of two successive unfiltered samples
  double line_share = 0.5;       ///< kLineNoise is set above this fraction of the unfiltered power near 50 or 60 Hz
  double clipped_share = 0.005;  ///< kClipped is set above this fraction of samples at an end of the converter's range
};

/// Returns the artefact flags of one window of one channel, as bits of Artefact.
///
/// In      raw_uv       unfiltered samples; a lost sample is NaN
///         filtered_uv  the samples of the same window after the band-pass filter
///         range        input range of the converter; empty: unknown, so kClipped is not set
std::uint8_t artefacts_in(std::span<const double> raw_uv, std::span<const double> filtered_uv, double rate_hz,
                          const std::optional<ConverterRange>& range, const ArtefactLimits& limits);

/// Returns the names of the flags, joined by '+'; an empty text if no flag is set.
std::string artefact_text(std::uint8_t flags);

}  // namespace tandem::eeg
