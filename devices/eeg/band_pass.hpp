// Butterworth band-pass filter for one EEG channel.
#pragma once

#include <array>
#include <complex>

namespace tandem::eeg {

/// Order of the low-pass prototype. The band-pass filter has twice as many poles.
inline constexpr int kPrototypeOrder = 4;

/// Second-order section of the filter, in transposed direct form II. Its zeros are at z = 1 and z = -1.
struct FilterSection {
  double b0 = 0;  ///< gain; the numerator is b0 (1 - z⁻²)
  double a1 = 0, a2 = 0;
  double s1 = 0, s2 = 0;  ///< delayed values (the state of the filter)

  double step(double x);
};

/// Butterworth band-pass filter, designed by the bilinear transform with both band edges prewarped.
///
/// Model    |H(f)|² = 1 / (1 + ((Ω² − Ω₁Ω₂) / ((Ω₂ − Ω₁) Ω))^(2N))
///          H(f)    response at the frequency f
///          Ω       tan(π f / rate); Ω₁ and Ω₂ are its values at the lower and the upper band edge
///          N       kPrototypeOrder
/// Source   Oppenheim, Schafer, "Discrete-Time Signal Processing", 3rd ed., 2010, §7.2 and appendix B
class BandPass {
 public:
  /// Fails   std::invalid_argument: not 0 < low_hz < high_hz < rate_hz / 2; the message names the values
  BandPass(double low_hz, double high_hz, double rate_hz);

  /// Filters the next sample. The first sample is subtracted from all samples, so that a constant offset of the signal
  /// causes no transient at the start.
  double step(double x);
  std::complex<double> response(double frequency_hz) const;

 private:
  std::array<FilterSection, kPrototypeOrder> sections_;
  double rate_hz_;
  double level_ = 0;
  bool has_level_ = false;
};

}  // namespace tandem::eeg
