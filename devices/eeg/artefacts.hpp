// Artefacts and bad contact, which make a window of a channel unfit for classification.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "devices/eeg/recording.hpp"

namespace tandem::eeg {

/// Bits of the flags of a window of a channel.
enum Artefact : std::uint8_t {
  kFlat = 1U << 0U,       ///< hardly any signal: no contact, or a cable is off
  kClipped = 1U << 1U,    ///< values at the ends of the converter's range
  kAmplitude = 1U << 2U,  ///< larger than EEG: a blink, a movement
  kLineNoise = 1U << 3U,  ///< mostly hum of the mains: bad contact
  kStep = 1U << 4U,       ///< a jump between two samples: contact lost or made
  kLost = 1U << 5U,       ///< samples that the source lost or interpolated
};
inline constexpr std::array<std::string_view, 6> kArtefactNames{"flat",       "clipped", "amplitude",
                                                                "line_noise", "step",    "lost"};

/// The defaults suit scalp EEG of 10 to 50 µV.
struct ArtefactLimits {
  double flat_uv = 1.0;          ///< smallest range of the unfiltered window
  double amplitude_uv = 100.0;   ///< largest magnitude of the filtered window
  double step_uv = 150.0;        ///< largest difference of two successive unfiltered samples
  double line_share = 0.5;       ///< largest share of the unfiltered power near 50 or 60 Hz
  double clipped_share = 0.005;  ///< largest share of samples at an end of the converter's range
};

/// Returns the flags of a window.
///
/// In      raw_uv       unfiltered samples; a lost sample is NaN
///         filtered_uv  the same window, filtered
///         range        of the converter, if it is known
std::uint8_t artefacts_in(std::span<const double> raw_uv, std::span<const double> filtered_uv, double rate_hz,
                          const std::optional<ConverterRange>& range, const ArtefactLimits& limits);

/// Returns the names of the flags, joined by '+'; empty without flags.
std::string artefact_text(std::uint8_t flags);

}  // namespace tandem::eeg
