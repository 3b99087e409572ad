// Features of one window of one EEG channel, which are the input of the classifier.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace tandem::eeg {

inline constexpr std::size_t kFeatureCount = 7;
/// Names of the features, in the order of features_of() and of the files.
inline constexpr std::array<std::string_view, kFeatureCount> kFeatureNames{"mean",
                                                                           "standard_deviation",
                                                                           "mean_first_difference",
                                                                           "mean_first_difference_normalised",
                                                                           "mean_second_difference",
                                                                           "mean_second_difference_normalised",
                                                                           "fractal_dimension"};

/// Returns six statistical features of a signal X of N samples.
///
/// Model    μ = 1/N Σ X(n)                         mean
///          σ² = 1/(N−1) Σ (X(n) − μ)²             variance
///          δ = 1/(N−1) Σ |X(n+1) − X(n)|          mean first difference
///          γ = 1/(N−2) Σ |X(n+2) − X(n)|          mean second difference
///          δ/σ, γ/σ                               δ and γ of the normalised signal (X − μ)/σ
/// Source   Picard, Vyzas, Healey, "Toward machine emotional intelligence", IEEE Trans. PAMI 23(10), 2001, §3.1
/// Out      μ, σ, δ, δ/σ, γ, γ/σ; for a constant signal the normalised ones are 0
std::array<double, 6> picard_features(std::span<const double> x);

/// Longest interval k of Higuchi's method [samples].
inline constexpr std::size_t kHiguchiMax = 10;

/// Returns the fractal dimension of the graph of a signal, by Higuchi's method.
///
/// Model    L_m(k) = (N − 1)/(k² M) Σ_{i=1}^{M} |x(m + ik) − x(m + (i−1)k)|, M = ⌊(N − m)/k⌋, m = 1 … k
///          N       number of samples
///          L_m(k)  length of the curve through every k-th sample, from sample m on; L(k) is the mean over m
///          The dimension is the slope of ln L(k) against ln(1/k) for k = 1 … k_max, by least squares.
/// Source   Higuchi, "Approach to an irregular time series on the basis of the fractal theory", Physica D 31, 1988
/// In       x  at least 2 k_max samples
/// Out     dimension, about 1 to 2; exactly 1 for a constant signal, whose graph is a straight line
double higuchi_dimension(std::span<const double> x, std::size_t k_max = kHiguchiMax);

/// Returns all features, in the order of kFeatureNames.
std::array<double, kFeatureCount> features_of(std::span<const double> x);

}  // namespace tandem::eeg
