// Band-pass filter of the EEG.
#pragma once

#include <array>
#include <complex>

namespace tandem::eeg {

/// Order of the low-pass prototype. The band-pass has twice as many poles.
inline constexpr int kPrototypeOrder = 4;

/// One second-order section, in transposed direct form II. Its zeros are at 1 and -1.
struct FilterSection {
  double b0 = 0;  ///< numerator b0 (1 - z⁻²)
  double a1 = 0, a2 = 0;
  double s1 = 0, s2 = 0;  ///< state

  double step(double x);
};

/// Butterworth band-pass by the bilinear transform, with both edges prewarped.
///
/// Model    |H(f)|² = 1 / (1 + ((Ω² − Ω₁Ω₂) / ((Ω₂ − Ω₁) Ω))^(2N)), Ω = tan(π f / rate), N = kPrototypeOrder
/// Source   Oppenheim, Schafer, "Discrete-Time Signal Processing", 3rd ed., 2010, §7.2 and appendix B
class BandPass {
 public:
  /// Fails   std::invalid_argument: not 0 < low_hz < high_hz < rate_hz / 2; the message names the values
  BandPass(double low_hz, double high_hz, double rate_hz);

  /// Filters the next sample. The first sample counts as the level before the start, so that a constant offset causes
  /// no transient.
  double step(double x);
  std::complex<double> response(double frequency_hz) const;

 private:
  std::array<FilterSection, kPrototypeOrder> sections_;
  double rate_hz_;
  double level_ = 0;
  bool has_level_ = false;
};

}  // namespace tandem::eeg
