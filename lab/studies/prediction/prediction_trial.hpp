// A force series displayed through one predictor: received samples, their times, and the error of the displayed force.
#pragma once

#include <chrono>
#include <vector>

#include "common/haptics/prediction/force_stream.hpp"
#include "lab/studies/prediction/force_series.hpp"

namespace tandem::lab {

/// Error figures of one quantity with three components.
struct ErrorFigures {
  double mean = 0;      ///< mean of |shown − true|
  double variance = 0;  ///< mean of |e − ē|²
  double rms = 0;
  double largest = 0;
};

struct PredictionErrors {
  ErrorFigures force;     ///< N
  ErrorFigures torque;    ///< N·m
  double step_max_n = 0;  ///< largest change of the shown force from tick to tick
  double step_rms_n = 0;
  haptics::ForceStreamFigures stream;
  std::vector<Vec3> shown_n;  ///< every tick of 1 ms
  std::vector<Vec3> true_n;
};

/// The true value between two samples of an uneven series is linearly interpolated.
/// In      sample_period  period of the sent samples of an even series; 0: all samples are sent
///         delay  age of a sample when it is received
PredictionErrors predict_series(const ForceSeries& series, haptics::ForceStream& stream,
                                Duration sample_period = std::chrono::milliseconds(5), Duration delay = Duration{0});

}  // namespace tandem::lab
