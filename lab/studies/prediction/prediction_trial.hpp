// A force series shown to a hand through one prediction: what comes in, when, and how far off what is shown is.
#pragma once

#include <cstddef>
#include <vector>

#include "common/haptics/prediction/force_stream.hpp"
#include "lab/studies/prediction/force_series.hpp"

namespace tandem::lab {

struct PredictionTrial {
  Duration tick{from_seconds(0.001)};           ///< of the haptic loop
  Duration sample_period{from_seconds(0.005)};  ///< of an even series, those that are sent; 0: all are
  Duration delay{0};                            ///< age of a sample when it comes in
};

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
  std::vector<Vec3> shown_n;  ///< every tick, when asked for
  std::vector<Vec3> true_n;
};

/// The truth between two samples of an uneven series is the straight line.
/// In      keeps_trace  also fills shown_n and true_n
PredictionErrors predict_series(const ForceSeries& series, const PredictionTrial& trial, haptics::ForceStream& stream,
                                bool keeps_trace = false);

}  // namespace tandem::lab
