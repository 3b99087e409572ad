// Static force curve of a law along one line. It serves to give laws equal stiffness before they are compared.
#pragma once

#include <string_view>
#include <vector>

#include "common/haptics/coupling/laws.hpp"
#include "lab/report/plot.hpp"

namespace tandem::lab {

/// Force limit F_max and softness ε of the published comparisons.
inline constexpr double kForceLimit_n = 6.5;
inline constexpr double kSoftness = 0.2;

/// Returns the elastic force on the tool along the displacement d, without damping, while the handle moves forward
/// (pushing) or back.
double elastic_force_n(const haptics::CouplingLaw& law, double d_m, bool is_pushing);

/// Returns the displacement of a pushed handle at which the law gives the force `force_n`: the inverse of its curve.
/// Fails   std::invalid_argument: the law is unknown, or `force_n` is outside the law's range
double displacement_m(std::string_view law, const haptics::CouplingParameters& coupling, double force_n);

/// Returns `coupling` with the stiffness k_t for which the law's curve has the secant stiffness `secant_n_per_m` (force
/// / displacement) at the force `at_n`. The solution is unique, because the force of every law depends only on the
/// product of k_t and displacement.
haptics::CouplingParameters with_secant_stiffness(std::string_view law, haptics::CouplingParameters coupling,
                                                  double secant_n_per_m, double at_n);

/// Returns the displacement at the steepest point of the pushing curve. The slope at this point determines the
/// stability of the sampled loop.
double steepest_displacement_m(std::string_view law, const haptics::CouplingParameters& coupling);

/// Returns a plot series. Its style depends only on the law.
Series series_of(std::string_view law, std::vector<double> x, std::vector<double> y);

}  // namespace tandem::lab
