// The short sounds of the window, computed as samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tandem::client {

enum class Sound : std::uint8_t { kContact, kGrasp, kRelease, kGoal, kFailure };
inline constexpr std::size_t kSounds = 5;

inline constexpr int kSampleRate_hz = 48'000;
/// Maximum length of a sound. The limit is needed because sounds are played one after the other, so a long sound delays
/// the next.
inline constexpr double kMaxSound_s = 0.25;

/// Returns the samples of a sound, one channel at kSampleRate_hz. Their largest value is at most half of the range.
///
/// Model   Σ_k g_k e^(−t/τ_k) sin(2π f_k t), with a linear attack of 1 ms and a linear end of 5 ms
/// In      gain  loudness; clamped to 0 … 1
std::vector<std::int16_t> samples_of(Sound sound, double gain);

}  // namespace tandem::client
