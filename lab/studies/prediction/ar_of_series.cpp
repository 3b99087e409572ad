#include "lab/studies/prediction/ar_of_series.hpp"

#include <algorithm>

namespace tandem::lab {

std::array<std::vector<double>, 6> even_axes(const ForceSeries& series, double rate_hz) {
  std::array<std::vector<double>, 6> axes;
  const Duration period = from_seconds(1 / rate_hz);
  std::size_t next = 0;
  for (Duration at = series.samples.front().at; at <= series.samples.back().at; at += period) {
    while (next + 1 < series.samples.size() && series.samples[next + 1].at <= at) ++next;
    const ForceSample& a = series.samples[next];
    const ForceSample& b = series.samples[std::min(next + 1, series.samples.size() - 1)];
    const double u = b.at > a.at ? to_seconds(at - a.at) / to_seconds(b.at - a.at) : 0;
    const Wrench wrench = a.on_hand_W + (b.on_hand_W - a.on_hand_W) * u;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axes[axis].push_back(wrench.f[static_cast<Eigen::Index>(axis)]);
      axes[axis + 3].push_back(wrench.t[static_cast<Eigen::Index>(axis)]);
    }
  }
  return axes;
}

std::vector<double> differences(const std::vector<double>& series) {
  std::vector<double> result;
  for (std::size_t i = 1; i < series.size(); ++i) result.push_back(series[i] - series[i - 1]);
  return result;
}

haptics::ArModels models_of(const ForceSeries& series, const haptics::ForceStreamSettings& settings) {
  const auto axes = even_axes(series, settings.series_rate_hz);
  haptics::ArModels models;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const bool on_differences = settings.is_on_differences;
    models[axis] = haptics::fit_ar(on_differences ? differences(axes[axis]) : axes[axis], settings.order,
                                   settings.ar_fit, !on_differences);
    if (on_differences && models[axis].order == 0) models[axis].mean = 0;
  }
  return models;
}

}  // namespace tandem::lab
