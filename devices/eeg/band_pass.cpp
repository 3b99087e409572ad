#include "devices/eeg/band_pass.hpp"

#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>

namespace tandem::eeg {
namespace {

using Complex = std::complex<double>;

void check_edges(double low_hz, double high_hz, double rate_hz) {
  if (low_hz > 0 && low_hz < high_hz && high_hz < rate_hz / 2) return;
  std::ostringstream text;
  text << "a band of " << low_hz << " Hz to " << high_hz << " Hz is not possible at " << rate_hz
       << " samples per second; its edges must rise and lie between 0 and half the rate";
  throw std::invalid_argument(text.str());
}

/// Returns the second-order section with the given pole (in the z plane) and its complex conjugate.
FilterSection section_of(Complex pole) {
  return {.b0 = 1, .a1 = -2 * pole.real(), .a2 = std::norm(pole)};
}

Complex response_of(const FilterSection& section, Complex z_inverse) {
  const Complex z2 = z_inverse * z_inverse;
  return section.b0 * (1.0 - z2) / (1.0 + section.a1 * z_inverse + section.a2 * z2);
}

}  // namespace

double FilterSection::step(double x) {
  const double y = b0 * x + s1;
  s1 = s2 - a1 * y;
  s2 = -b0 * x - a2 * y;
  return y;
}

BandPass::BandPass(double low_hz, double high_hz, double rate_hz) : rate_hz_(rate_hz) {
  check_edges(low_hz, high_hz, rate_hz);
  const double low = std::tan(std::numbers::pi * low_hz / rate_hz);
  const double high = std::tan(std::numbers::pi * high_hz / rate_hz);
  const double width = high - low, centre_squared = low * high;
  // Low-pass to band-pass transformation: each pole p of the low-pass prototype becomes two poles s of the band-pass
  // filter, the roots of s² − p·width·s + centre² = 0. Only poles with a positive imaginary part are computed, because
  // the rest are their conjugates, which section_of() adds.
  std::size_t next = 0;
  for (int k = 0; k < kPrototypeOrder / 2; ++k) {
    const double angle = std::numbers::pi * (2 * k + 1 + kPrototypeOrder) / (2 * kPrototypeOrder);
    const Complex half = std::polar(1.0, angle) * (width / 2);
    const Complex root = std::sqrt(half * half - centre_squared);
    for (const Complex s : {half + root, half - root}) sections_[next++] = section_of((1.0 + s) / (1.0 - s));
  }
  // Each section is scaled to gain 1 at the centre of the band. The whole filter then has gain 1 at this frequency.
  const Complex z_inverse = std::polar(1.0, -2 * std::atan(std::sqrt(centre_squared)));
  for (FilterSection& section : sections_) section.b0 /= std::abs(response_of(section, z_inverse));
}

double BandPass::step(double x) {
  if (!has_level_) level_ = x;
  has_level_ = true;
  double y = x - level_;
  for (FilterSection& section : sections_) y = section.step(y);
  return y;
}

Complex BandPass::response(double frequency_hz) const {
  const Complex z_inverse = std::polar(1.0, -2 * std::numbers::pi * frequency_hz / rate_hz_);
  Complex product = 1;
  for (const FilterSection& section : sections_) product *= response_of(section, z_inverse);
  return product;
}

}  // namespace tandem::eeg
