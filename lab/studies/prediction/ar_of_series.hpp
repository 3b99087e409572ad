// Autoregressive (AR) models that are fitted to a whole force series at the sampling rate of a stream. They serve as
// predictors with fixed coefficients and help to choose the order of the model.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/haptics/prediction/force_stream.hpp"
#include "lab/studies/prediction/force_series.hpp"

namespace tandem::lab {

/// Returns force x, y, z and torque x, y, z at a constant rate, interpolated linearly between the samples.
/// In      series  has at least one sample
std::array<std::vector<double>, 6> even_axes(const ForceSeries& series, double rate_hz);
std::vector<double> differences(const std::vector<double>& series);

/// Returns one model for each axis, fitted to the whole series in the same way as `settings` fits a window.
haptics::ArModels models_of(const ForceSeries& series, const haptics::ForceStreamSettings& settings);

}  // namespace tandem::lab
