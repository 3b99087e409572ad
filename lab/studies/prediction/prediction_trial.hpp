// Passes a force series through one predictor and records the error of the displayed force.
#pragma once

#include <chrono>
#include <vector>

#include "common/haptics/prediction/force_stream.hpp"
#include "lab/studies/prediction/force_series.hpp"

namespace tandem::lab {

/// Error statistics of one quantity with three components.
struct ErrorFigures {
  double mean = 0;      ///< mean of |displayed − true|
  double variance = 0;  ///< mean of |e − ē|², where e = displayed − true, and ē is the mean of e
  double rms = 0;
  double largest = 0;
};

struct PredictionErrors {
  ErrorFigures force;     ///< errors in N
  ErrorFigures torque;    ///< errors in N·m
  double step_max_n = 0;  ///< largest change of the displayed force between two ticks
  double step_rms_n = 0;
  haptics::ForceStreamFigures stream;
  std::vector<Vec3> shown_n;  ///< displayed force, one value for each tick of 1 ms
  std::vector<Vec3> true_n;
};

/// Runs the trial. The true value between two samples is interpolated linearly.
/// In      sample_period  minimum interval between two sent samples; 0: all samples are sent
///         delay          time from the sampling of a force until it is received
PredictionErrors predict_series(const ForceSeries& series, haptics::ForceStream& stream,
                                Duration sample_period = std::chrono::milliseconds(5), Duration delay = Duration{0});

}  // namespace tandem::lab
