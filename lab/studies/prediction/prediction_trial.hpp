// A force series shown to a hand through one prediction: what comes in, when, and how far off what is shown is.
#pragma once

#include <chrono>
#include <vector>

#include "common/haptics/prediction/force_stream.hpp"
#include "lab/studies/prediction/force_series.hpp"

namespace tandem::lab {

/// Of one quantity of three components.
struct ErrorFigures {
  double mean = 0;      ///< of |shown − true|
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

/// The truth between two samples of an uneven series is the straight line.
/// In      sample_period  of an even series, those that are sent; 0: all are
///         delay  age of a sample when it comes in
PredictionErrors predict_series(const ForceSeries& series, haptics::ForceStream& stream,
                                Duration sample_period = std::chrono::milliseconds(5), Duration delay = Duration{0});

}  // namespace tandem::lab
