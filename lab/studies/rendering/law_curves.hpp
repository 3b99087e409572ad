// Static force curve of a law along one line, used to give laws equal stiffness before they are compared.
#pragma once

#include <string_view>
#include <vector>

#include "common/haptics/coupling/laws.hpp"
#include "lab/report/plot.hpp"

namespace tandem::lab {

/// F_max and ε of the published comparisons.
inline constexpr double kForceLimit_n = 6.5;
inline constexpr double kSoftness = 0.2;

/// Elastic force on the tool along d while the handle moves on (pushing) or back, without damping.
double elastic_force_n(const haptics::CouplingLaw& law, double d_m, bool is_pushing);

/// Displacement of a pushed handle at which the law pulls with `force_n`: the inverse of its curve.
/// Fails   std::invalid_argument: unknown law, or `force_n` beyond the law's range
double displacement_m(std::string_view law, const haptics::CouplingParameters& coupling, double force_n);

/// Returns `coupling` with the k_t for which force / displacement at `at_n` equals `secant_n_per_m`. It is unique,
/// because every curve depends on k_t d alone.
haptics::CouplingParameters with_secant_stiffness(std::string_view law, haptics::CouplingParameters coupling,
                                                  double secant_n_per_m, double at_n);

/// Displacement at the steepest point of the pushing curve, which decides the stability of the sampled loop.
double steepest_displacement_m(std::string_view law, const haptics::CouplingParameters& coupling);

/// A plot series whose colour is fixed for each law; active laws are dashed.
Series series_of(std::string_view law, std::vector<double> x, std::vector<double> y);

}  // namespace tandem::lab
