// The newest samples of six series as they came, at times that nobody promised to be even.
#pragma once

#include <array>
#include <cstddef>

#include "common/base/spatial.hpp"
#include "common/base/time.hpp"

namespace tandem::haptics {

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// A ring of time-stamped samples, read at any time by straight lines between neighbours.
///
/// Limits  samples denser than an eighth of `period` replace the newest, so that the ring always spans kCapacity/8
///         periods; before the oldest sample its value is given, after the newest the newest's
/// Thread  haptic: no allocation
class SampleHistory {
 public:
  static constexpr std::size_t kCapacity = 320;

  explicit SampleHistory(Duration period) : least_spacing_(period / 8) {}

  std::size_t size() const noexcept { return count_; }
  LocalTime newest_at() const noexcept { return back(0).at; }
  const Vector6& newest() const noexcept { return back(0).value; }

  /// In      at  later than newest_at()
  void add(LocalTime at, const Vector6& value) noexcept {
    if (count_ < 2 || back(0).at - back(1).at >= least_spacing_) {
      newest_ = (newest_ + 1) % kCapacity;
      count_ = count_ < kCapacity ? count_ + 1 : kCapacity;
    }
    samples_[newest_] = {at, value};
  }
  void keep_newest(std::size_t count) noexcept { count_ = count_ < count ? count_ : count; }

  Vector6 at(LocalTime time) const noexcept {
    std::size_t older = 0;
    while (older < count_ && back(older).at > time) ++older;
    if (older == 0) return newest();
    if (older == count_) return back(count_ - 1).value;
    const Sample& a = back(older);
    const Sample& b = back(older - 1);
    const double u = static_cast<double>((time - a.at).count()) / static_cast<double>((b.at - a.at).count());
    return a.value + u * (b.value - a.value);
  }

 private:
  struct Sample {
    LocalTime at{};
    Vector6 value = Vector6::Zero();
  };
  const Sample& back(std::size_t age) const noexcept { return samples_[(newest_ + kCapacity - age) % kCapacity]; }

  Duration least_spacing_;
  std::array<Sample, kCapacity> samples_;
  std::size_t count_ = 0;
  std::size_t newest_ = 0;
};

}  // namespace tandem::haptics
