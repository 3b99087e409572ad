// AR models of a whole force series at the rate of a stream, for fixed coefficients and for the choice of an order.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/haptics/prediction/force_stream.hpp"
#include "lab/studies/prediction/force_series.hpp"

namespace tandem::lab {

/// Force x, y, z and torque x, y, z at an even rate, interpolated linearly between the samples.
/// In      series  at least one sample
std::array<std::vector<double>, 6> even_axes(const ForceSeries& series, double rate_hz);
std::vector<double> differences(const std::vector<double>& series);

/// One model for each axis, fitted to the whole series as `settings` would fit its window.
haptics::ArModels models_of(const ForceSeries& series, const haptics::ForceStreamSettings& settings);

}  // namespace tandem::lab
