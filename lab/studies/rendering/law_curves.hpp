// What a law is at rest, along one line: the curve by which laws are made equal before they are compared.
#pragma once

#include <string_view>
#include <vector>

#include "common/haptics/coupling/laws.hpp"
#include "lab/report/plot.hpp"

namespace tandem::lab {

/// F_max and ε of the published comparisons.
inline constexpr double kForceLimit_n = 6.5;
inline constexpr double kSoftness = 0.2;

/// Of the tool along d while the handle moves on (pushing) or back; the damper does nothing.
double elastic_force_n(const haptics::CouplingLaw& law, double d_m, bool is_pushing);

/// Where a pushed handle is when the law pulls with `force_n`: the inverse of its curve.
/// Fails   std::invalid_argument: unknown law, or one that never pulls so hard
double displacement_m(std::string_view law, const haptics::CouplingParameters& coupling, double force_n);

/// `coupling` with the k_t at which force / displacement at `at_n` is `secant_n_per_m`. Every curve depends on k_t d
/// alone, so there is one.
haptics::CouplingParameters with_secant_stiffness(std::string_view law, haptics::CouplingParameters coupling,
                                                  double secant_n_per_m, double at_n);

/// Displacement at the steepest place of the pushing curve: what decides whether the sampled loop is stable.
double steepest_displacement_m(std::string_view law, const haptics::CouplingParameters& coupling);

/// Laws keep their colour through all figures; active ones are dashed.
Series series_of(std::string_view law, std::vector<double> x, std::vector<double> y);

}  // namespace tandem::lab
