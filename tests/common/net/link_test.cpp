#include "common/net/link.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>

namespace tandem::net {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kSeed = 20240711;

std::vector<std::byte> packet(std::uint32_t number, std::size_t size = sizeof(std::uint32_t)) {
  std::vector<std::byte> bytes(size);
  for (std::size_t i = 0; i < sizeof number; ++i) bytes[i] = static_cast<std::byte>(number >> (8 * i));
  return bytes;
}

std::uint32_t number_of(const std::vector<std::byte>& bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < sizeof number; ++i) number |= static_cast<std::uint32_t>(bytes[i]) << (8 * i);
  return number;
}

struct Arrival {
  std::uint32_t number;
  LocalTime at;
};

// Sends `count` packets with a spacing of `gap`, and returns their arrivals.
std::vector<Arrival> run(SimulatedLink& link, std::uint32_t count, Duration gap, std::size_t size = 4) {
  std::vector<Arrival> arrivals;
  const auto receive_until = [&](LocalTime end) {
    for (auto due = link.next_due(); due && *due <= end; due = link.next_due()) {
      while (const auto bytes = link.receive(*due)) arrivals.push_back({number_of(*bytes), *due});
    }
  };
  for (std::uint32_t i = 0; i < count; ++i) {
    const LocalTime now{gap * i};
    receive_until(now);
    link.send(now, packet(i, size));
  }
  receive_until(LocalTime::max());
  return arrivals;
}

// Returns the delay of each packet. Reordering is allowed, so that no packet waits for an earlier one.
std::vector<double> measured_delays_s(LinkParameters parameters, std::uint32_t count) {
  parameters.allows_reordering = true;
  parameters.queue_limit = count;
  SimulatedLink link(parameters, kSeed, 1);
  std::vector<double> delays(count);
  for (const Arrival& arrival : run(link, count, milliseconds(1))) {
    delays.at(arrival.number) = to_seconds(arrival.at - LocalTime(milliseconds(1) * arrival.number));
  }
  return delays;
}

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double deviation_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// Returns the Kolmogorov-Smirnov statistic: the largest difference between the empirical distribution function and
// `cdf`.
double distance_to(std::vector<double> values, const std::function<double(double)>& cdf) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  double distance = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double expected = cdf(values[i]);
    const auto rank = static_cast<double>(i);
    distance = std::max({distance, expected - rank / n, (rank + 1) / n - expected});
  }
  return distance;
}

// Returns the largest difference e between the distribution of n values and the true one that is exceeded with a
// probability of 1e-9. It follows from the Dvoretzky-Kiefer-Wolfowitz-Massart inequality, P(difference > e) ≤ 2 exp(−2
// n e²).
double dkw_bound(std::size_t n) {
  return std::sqrt(std::log(2 / 1e-9) / (2.0 * static_cast<double>(n)));
}

TEST(SimulatedLink, FixedDelayIsExact) {
  LinkParameters parameters;
  parameters.delay = milliseconds(25);
  for (const double delay_s : measured_delays_s(parameters, 1000)) EXPECT_EQ(delay_s, 0.025);
}

TEST(SimulatedLink, NormalDelaysFollowTheConfiguredMeanAndDeviation) {
  LinkParameters parameters;
  parameters.delay = milliseconds(50);
  parameters.jitter = milliseconds(5);
  constexpr std::uint32_t kCount = 40000;
  const auto delays = measured_delays_s(parameters, kCount);
  ASSERT_EQ(delays.size(), kCount);
  // Tolerance: six standard errors, which are σ/√n for a mean and σ/√(2n) for the standard deviation of a normal
  // distribution.
  EXPECT_NEAR(mean_of(delays), 0.050, 6 * 0.005 / std::sqrt(kCount));
  EXPECT_NEAR(deviation_of(delays), 0.005, 6 * 0.005 / std::sqrt(2.0 * kCount));
  EXPECT_LT(distance_to(delays, [](double x) { return 0.5 * std::erfc((0.050 - x) / (0.005 * std::sqrt(2.0))); }),
            dkw_bound(kCount));
}

TEST(SimulatedLink, NormalDelaysAreCutOffAtZeroAndNowhereElse) {
  LinkParameters parameters;
  parameters.jitter = milliseconds(5);
  constexpr std::uint32_t kCount = 20000;
  const auto delays = measured_delays_s(parameters, kCount);
  EXPECT_GE(*std::min_element(delays.begin(), delays.end()), 0);
  // For a standard normal variable N, max(0, σN) has the mean σ/√(2π) and a standard deviation below σ.
  EXPECT_NEAR(mean_of(delays), 0.005 / std::sqrt(2 * std::numbers::pi), 6 * 0.005 / std::sqrt(kCount));
}

TEST(SimulatedLink, ParetoDelaysFollowTheClosedFormWithItsHeavyTail) {
  LinkParameters parameters;
  parameters.delay = milliseconds(20);
  parameters.jitter = milliseconds(4);
  parameters.distribution = JitterDistribution::kPareto;
  constexpr std::uint32_t kCount = 40000;
  const auto delays = measured_delays_s(parameters, kCount);
  // A Pareto variable with shape 3 has σ = scale·√3/2. Its sample deviation converges too slowly for a test, so the
  // whole distribution is compared.
  const double scale_s = 0.004 / (std::sqrt(3.0) / 2);
  EXPECT_LT(distance_to(delays, [&](double x) { return 1 - std::pow(1 + (x - 0.020) / scale_s, -3.0); }),
            dkw_bound(kCount));
  EXPECT_NEAR(mean_of(delays), 0.020 + 0.004 / std::sqrt(3.0), 6 * 0.004 / std::sqrt(kCount));
  EXPECT_GE(*std::min_element(delays.begin(), delays.end()), 0.020);
  // Counts delays above 62.3 ms, i.e. more than 10 standard deviations above the mean. A distribution without a heavy
  // tail has none. Here the probability is (1 + 0.0423/scale)⁻³ ≈ 1e-3, so 38 delays are expected.
  const auto far = std::count_if(delays.begin(), delays.end(), [](double x) { return x > 0.0623; });
  EXPECT_NEAR(static_cast<double>(far), kCount * std::pow(1 + 0.0423 / scale_s, -3.0), 6 * std::sqrt(40.0));
}

TEST(SimulatedLink, TraceDelaysComeInTurnAndStartAgain) {
  LinkParameters parameters;
  parameters.distribution = JitterDistribution::kTrace;
  parameters.trace = {milliseconds(1), milliseconds(7), milliseconds(3)};
  SimulatedLink link(parameters, kSeed, 1);
  const auto arrivals = run(link, 7, milliseconds(20));
  std::vector<Duration> delays;
  for (const Arrival& arrival : arrivals) delays.push_back(arrival.at - LocalTime(milliseconds(20) * arrival.number));
  using std::chrono_literals::operator""ms;
  EXPECT_THAT(delays, testing::ElementsAre(1ms, 7ms, 3ms, 1ms, 7ms, 3ms, 1ms));
}

/// Returns the autocorrelation of the values at distance `lag`.
double correlation_at(const std::vector<double>& values, std::size_t lag) {
  const double mean = mean_of(values);
  double sum = 0, square = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    square += (values[i] - mean) * (values[i] - mean);
    if (i + lag < values.size()) sum += (values[i] - mean) * (values[i + lag] - mean);
  }
  return sum / square;
}

TEST(SimulatedLink, CorrelatedJitterHasTheSameDistributionAndForgetsExponentially) {
  LinkParameters parameters;
  parameters.delay = milliseconds(100);
  parameters.jitter = milliseconds(5);
  parameters.jitter_correlation = milliseconds(20);
  constexpr std::uint32_t kCount = 400000;
  const auto delays = measured_delays_s(parameters, kCount);
  // Number of independent values, for the tolerances: the total duration divided by twice the correlation time, i.e.
  // 10,000.
  const double independent = kCount / 40.0;
  EXPECT_NEAR(mean_of(delays), 0.100, 6 * 0.005 / std::sqrt(independent));
  EXPECT_NEAR(deviation_of(delays), 0.005, 6 * 0.005 / std::sqrt(independent));
  EXPECT_NEAR(correlation_at(delays, 1), std::exp(-1.0 / 20), 0.01);
  EXPECT_NEAR(correlation_at(delays, 20), std::exp(-1.0), 6 / std::sqrt(independent));
  EXPECT_NEAR(correlation_at(delays, 200), 0, 6 / std::sqrt(independent));
}

TEST(SimulatedLink, CorrelatedParetoKeepsItsTail) {
  LinkParameters parameters;
  parameters.delay = milliseconds(20);
  parameters.jitter = milliseconds(4);
  parameters.distribution = JitterDistribution::kPareto;
  parameters.jitter_correlation = milliseconds(2);
  constexpr std::uint32_t kCount = 80000;
  const double scale_s = 0.004 / (std::sqrt(3.0) / 2);
  // Values 20 ms apart (ten correlation times) are independent.
  std::vector<double> apart;
  const auto delays = measured_delays_s(parameters, kCount);
  for (std::size_t i = 0; i < delays.size(); i += 20) apart.push_back(delays[i]);
  EXPECT_LT(distance_to(apart, [&](double x) { return 1 - std::pow(1 + (x - 0.020) / scale_s, -3.0); }),
            dkw_bound(apart.size()));
}

TEST(SimulatedLink, ADelayPathIsAddedStraightBetweenItsPointsAndBeginsAgain) {
  LinkParameters parameters;
  parameters.delay = milliseconds(5);
  parameters.delay_path.points = {{milliseconds(0), milliseconds(0)},
                                  {milliseconds(100), milliseconds(10)},
                                  {milliseconds(100), milliseconds(50)},
                                  {milliseconds(200), milliseconds(50)}};
  parameters.delay_path.starts_anywhere = false;
  const auto delays = measured_delays_s(parameters, 400);
  for (const std::size_t begin : {std::size_t{0}, std::size_t{200}}) {
    EXPECT_NEAR(delays[begin], 0.005, 1e-9);
    EXPECT_NEAR(delays[begin + 50], 0.010, 1e-9);
    EXPECT_NEAR(delays[begin + 100], 0.055, 1e-9) << "a step";
    EXPECT_NEAR(delays[begin + 199], 0.055, 1e-9);
  }
  parameters.delay_path.starts_anywhere = true;
  EXPECT_NE(measured_delays_s(parameters, 400), delays) << "begins elsewhere";
  EXPECT_EQ(measured_delays_s(parameters, 400), measured_delays_s(parameters, 400))
      << "equal seeds must give equal delays";
}

TEST(SimulatedLink, RefusesAnInvalidDelayPath) {
  const auto problem_of = [](std::vector<DelayPath::Point> points) {
    LinkParameters parameters;
    parameters.delay_path.points = std::move(points);
    return parameters.problem();
  };
  EXPECT_EQ(problem_of({}), "");
  EXPECT_THAT(problem_of({{milliseconds(1), milliseconds(1)}}), testing::HasSubstr("begun at 0 s"));
  EXPECT_THAT(problem_of({{milliseconds(0), milliseconds(1)}}), testing::HasSubstr("longer"));
  EXPECT_THAT(problem_of({{milliseconds(0), milliseconds(-1)}}), testing::HasSubstr("delays of 0 to 10000 ms"));
  EXPECT_THAT(problem_of({{milliseconds(0), {}}, {milliseconds(2), {}}, {milliseconds(1), {}}}),
              testing::HasSubstr("in order of time"));
}

TEST(SimulatedLink, KeepsTheOrderUnlessReorderingIsAllowed) {
  LinkParameters parameters;
  parameters.delay = milliseconds(20);
  parameters.jitter = milliseconds(5);
  const auto is_in_order = [](const std::vector<Arrival>& arrivals) {
    return std::is_sorted(arrivals.begin(), arrivals.end(),
                          [](const Arrival& a, const Arrival& b) { return a.number < b.number; });
  };
  SimulatedLink ordered(parameters, kSeed, 1);
  const auto in_order = run(ordered, 5000, milliseconds(1));
  EXPECT_EQ(in_order.size(), 5000U);
  EXPECT_TRUE(is_in_order(in_order));
  parameters.allows_reordering = true;
  SimulatedLink unordered(parameters, kSeed, 1);
  const auto out_of_order = run(unordered, 5000, milliseconds(1));
  EXPECT_EQ(out_of_order.size(), 5000U);
  EXPECT_FALSE(is_in_order(out_of_order));
}

TEST(SimulatedLink, LosesTheConfiguredFractionInPeriodsOfTheConfiguredLength) {
  LinkParameters parameters;
  parameters.loss = 0.05;
  SimulatedLink link(parameters, kSeed, 3);
  constexpr std::uint32_t kCount = 2'000'000;
  constexpr Duration kGap = microseconds(500);
  const auto arrivals = run(link, kCount, kGap);
  const auto lost = static_cast<double>(kCount - arrivals.size());
  EXPECT_EQ(link.counters().lost, kCount - arrivals.size());

  // Tolerance of the loss fraction. The link changes between a good and a bad state (a two-state Markov chain) and is
  // bad for the fraction p of the time. In a time T, the observed fraction has the variance 2 p (1−p) t_c / T. The
  // correlation time t_c follows from the mean durations: 1/t_c = 1/bad + 1/good.
  const double bad_s = 0.020;
  const double good_s = bad_s * 0.95 / 0.05;
  const double correlation_s = 1 / (1 / bad_s + 1 / good_s);
  const double total_s = to_seconds(kGap * kCount);
  const double sigma = std::sqrt(2 * 0.05 * 0.95 * correlation_s / total_s);
  EXPECT_NEAR(lost / kCount, 0.05, 5 * sigma);

  // Expected length of a run of losses. A bad period of length L contains L/gap packets on average. It is visible if it
  // contains at least one packet. For exponential lengths, the visible runs have a mean of 1 / (1 − exp(−gap/mean))
  // packets.
  double runs = 0;
  for (std::size_t i = 1; i < arrivals.size(); ++i) {
    if (arrivals[i].number != arrivals[i - 1].number + 1) ++runs;
  }
  const double mean_run_s = lost / runs * to_seconds(kGap);
  const double expected_s = to_seconds(kGap) / (1 - std::exp(-to_seconds(kGap) / bad_s));
  // Tolerance: five standard errors of an exponential mean, which are mean/√n each. Good periods shorter than two
  // packets join two runs, which changes the mean by less than 0.2 %.
  EXPECT_NEAR(mean_run_s, expected_s, (5 / std::sqrt(runs) + 0.002) * expected_s);
}

TEST(SimulatedLink, LossDoesNotDependOnHowOftenPacketsAreSent) {
  LinkParameters parameters;
  parameters.loss = 0.2;
  for (const Duration gap : {Duration(milliseconds(1)), Duration(milliseconds(100))}) {
    SimulatedLink link(parameters, kSeed, 4);
    constexpr std::uint32_t kCount = 200'000;
    run(link, kCount, gap);
    // Tolerance: five standard errors for the shorter gap, 1 ms. Then losses are correlated over 16 packets. The loss
    // fraction of n packets has the variance 2 p (1−p) 16 / n, with its true value p = 0.2.
    const double sigma = std::sqrt(0.2 * 0.8 * 2 * 16 / kCount);
    EXPECT_NEAR(static_cast<double>(link.counters().lost) / kCount, 0.2, 5 * sigma) << "gap " << to_seconds(gap);
  }
}

TEST(SimulatedLink, DeliversTheConfiguredFractionTwice) {
  LinkParameters parameters;
  parameters.duplication = 0.1;
  SimulatedLink link(parameters, kSeed, 5);
  constexpr std::uint32_t kCount = 20000;
  const auto arrivals = run(link, kCount, milliseconds(1));
  EXPECT_EQ(arrivals.size(), kCount + link.counters().duplicated);
  EXPECT_NEAR(static_cast<double>(link.counters().duplicated), 0.1 * kCount, 5 * std::sqrt(kCount * 0.1 * 0.9));
}

TEST(SimulatedLink, SpacesPacketsByTheRateLimit) {
  LinkParameters parameters;
  parameters.delay = milliseconds(10);
  parameters.rate_limit_bytes_per_s = 100'000;
  SimulatedLink link(parameters, kSeed, 6);
  for (std::uint32_t i = 0; i < 20; ++i)
    link.send(LocalTime{}, packet(i, 500));  // each packet occupies the line for 5 ms
  EXPECT_EQ(link.queued_bytes(LocalTime{}), 20U * 500U);
  EXPECT_EQ(link.queued_bytes(LocalTime(milliseconds(25))), 15U * 500U);
  EXPECT_EQ(link.queued_bytes(LocalTime(milliseconds(100))), 0U);
  for (int i = 1; i <= 20; ++i) {
    ASSERT_EQ(link.next_due(), LocalTime(milliseconds(10 + 5 * i)));
    link.receive(*link.next_due());
  }
}

TEST(SimulatedLink, WaitsForPacketsOfOthersOnTheSameLink) {
  LinkParameters parameters;
  parameters.rate_limit_bytes_per_s = 100'000;
  SimulatedLink stream = SimulatedLink::reliable(parameters, kSeed, 6);
  SimulatedLink datagrams(parameters, kSeed, 7);
  SimulatedLink elsewhere(parameters, kSeed, 8);
  stream.share_line(datagrams);
  stream.send(LocalTime{}, packet(0, 2000));  // occupies the line for 20 ms
  datagrams.send(LocalTime{}, packet(1, 500));
  elsewhere.send(LocalTime{}, packet(1, 500));
  stream.send(LocalTime{}, packet(2, 500));
  EXPECT_EQ(datagrams.next_due(), LocalTime(milliseconds(20 + 5)));
  EXPECT_EQ(elsewhere.next_due(), LocalTime(milliseconds(5)));
  ASSERT_TRUE(stream.receive(LocalTime(milliseconds(20))));
  EXPECT_EQ(stream.next_due(), LocalTime(milliseconds(20 + 5 + 5)));
}

TEST(SimulatedLink, DropsPacketsThatTheQueueCannotHold) {
  LinkParameters parameters;
  parameters.delay = milliseconds(10);
  parameters.queue_limit = 8;
  SimulatedLink link(parameters, kSeed, 7);
  for (std::uint32_t i = 0; i < 20; ++i) link.send(LocalTime{}, packet(i));
  EXPECT_EQ(link.counters().queue_full, 12U);
  std::uint32_t next = 0;
  while (const auto bytes = link.receive(LocalTime(milliseconds(10)))) EXPECT_EQ(number_of(*bytes), next++);
  EXPECT_EQ(next, 8U);
}

TEST(SimulatedLink, DeliversNothingBeforeItIsDue) {
  LinkParameters parameters;
  parameters.delay = milliseconds(10);
  SimulatedLink link(parameters, kSeed, 8);
  EXPECT_FALSE(link.next_due().has_value());
  link.send(LocalTime{}, packet(1));
  EXPECT_FALSE(link.receive(LocalTime(milliseconds(10) - Duration(1))).has_value());
  EXPECT_TRUE(link.receive(LocalTime(milliseconds(10))).has_value());
}

std::vector<std::pair<std::uint32_t, LocalTime>> fate_of(std::uint64_t seed, std::uint64_t stream) {
  LinkParameters parameters;
  parameters.delay = milliseconds(20);
  parameters.jitter = milliseconds(5);
  parameters.loss = 0.05;
  parameters.duplication = 0.01;
  SimulatedLink link(parameters, seed, stream);
  std::vector<std::pair<std::uint32_t, LocalTime>> fate;
  for (const Arrival& arrival : run(link, 5000, milliseconds(1))) fate.emplace_back(arrival.number, arrival.at);
  return fate;
}

TEST(SimulatedLink, TheSameSeedGivesTheSameFateAndAnotherSeedOrStreamAnother) {
  EXPECT_EQ(fate_of(1, 2), fate_of(1, 2));
  EXPECT_NE(fate_of(1, 2), fate_of(2, 2));
  EXPECT_NE(fate_of(1, 2), fate_of(1, 3));
}

/// Returns the arrivals of packets that are sent one second apart, so that they cannot influence each other.
std::vector<std::pair<std::uint32_t, LocalTime>> arrivals_of(const LinkParameters& parameters) {
  SimulatedLink link(parameters, kSeed, 10);
  std::vector<std::pair<std::uint32_t, LocalTime>> arrivals;
  for (const Arrival& arrival : run(link, 2000, seconds(1))) arrivals.emplace_back(arrival.number, arrival.at);
  return arrivals;
}

TEST(SimulatedLink, DuplicationAndLossLeaveTheDelaysOfTheOriginalsAsTheyWere) {
  LinkParameters parameters;
  parameters.allows_reordering = true;
  for (const auto distribution :
       {JitterDistribution::kNormal, JitterDistribution::kPareto, JitterDistribution::kTrace}) {
    parameters.distribution = distribution;
    parameters.delay = milliseconds(20);
    parameters.jitter = milliseconds(5);
    parameters.trace = {milliseconds(1), milliseconds(7), milliseconds(3)};
    parameters.duplication = parameters.loss = 0;
    const auto plain = arrivals_of(parameters);
    parameters.duplication = 0.3;
    const auto doubled = arrivals_of(parameters);
    EXPECT_GT(doubled.size(), plain.size());
    EXPECT_TRUE(std::includes(doubled.begin(), doubled.end(), plain.begin(), plain.end()));
    parameters.duplication = 0;
    parameters.loss = 0.3;
    const auto kept = arrivals_of(parameters);
    EXPECT_LT(kept.size(), plain.size());
    EXPECT_TRUE(std::includes(plain.begin(), plain.end(), kept.begin(), kept.end()));
  }
}

TEST(SimulatedLink, AVanishingLossLosesNothing) {
  for (const double loss : {1e-12, 1e-30, std::numeric_limits<double>::denorm_min()}) {
    LinkParameters parameters;
    parameters.loss = loss;
    parameters.mean_bad_period = seconds(10);
    SimulatedLink link(parameters, kSeed, 11);
    EXPECT_EQ(run(link, 1000, milliseconds(1)).size(), 1000U) << loss;
  }
}

TEST(SimulatedLink, AReliableLinkKeepsEveryByteInOrder) {
  LinkParameters parameters;
  parameters.delay = milliseconds(20);
  parameters.jitter = milliseconds(10);
  parameters.loss = 0.5;
  parameters.duplication = 0.5;
  parameters.allows_reordering = true;
  parameters.queue_limit = 2;
  SimulatedLink link = SimulatedLink::reliable(parameters, kSeed, 9);
  const auto arrivals = run(link, 5000, milliseconds(1));
  ASSERT_EQ(arrivals.size(), 5000U);
  for (std::uint32_t i = 0; i < 5000; ++i) EXPECT_EQ(arrivals[i].number, i);
}

TEST(LinkParameters, NameTheFirstBadFieldItsValueAndTheRemedy) {
  struct Case {
    std::function<void(LinkParameters&)> spoil;
    std::string message;
  };
  const double nan = std::nan("");
  const Case cases[] = {
      {[](auto& p) { p.delay = milliseconds(-1); }, "delay is -1; it must be 0 to 10000 ms"},
      {[](auto& p) { p.jitter = seconds(11); }, "jitter is 11000; it must be 0 to 10000 ms"},
      {[](auto& p) { p.distribution = JitterDistribution::kTrace; }, "trace is empty; it must be one delay or more"},
      {[](auto& p) { p.trace = {milliseconds(-2)}; }, "trace is -2; it must be delays of 0 to 10000 ms"},
      {[](auto& p) { p.loss = 1.2; }, "loss is 1.2; it must be 0 to 0.95"},
      {[&](auto& p) { p.loss = nan; }, "loss is nan; it must be 0 to 0.95"},
      {[](auto& p) { p.mean_bad_period = Duration(0); }, "mean_bad_period is 0; it must be 0.1 to 10000 ms"},
      {[](auto& p) { p.duplication = -0.1; }, "duplication is -0.1; it must be 0 to 1"},
      {[&](auto& p) { p.rate_limit_bytes_per_s = nan; },
       "rate_limit_bytes_per_s is nan; it must be 0 (unlimited) or 1 to 1e12"},
      {[](auto& p) { p.queue_limit = 0; }, "queue_limit is 0; it must be 1 or more"},
  };
  EXPECT_EQ(LinkParameters{}.problem(), "");
  for (const Case& each : cases) {
    LinkParameters parameters;
    each.spoil(parameters);
    EXPECT_EQ(parameters.problem(), each.message);
    EXPECT_THROW(SimulatedLink(parameters, 1, 1), std::invalid_argument) << each.message;
  }
}

LinkParameters of_delay(Duration delay) {
  LinkParameters parameters;
  parameters.delay = delay;
  return parameters;
}

LinkParameters of_loss(double loss) {
  LinkParameters parameters;
  parameters.loss = loss;
  return parameters;
}

TEST(SimulatedLink, NewParametersApplyToLaterPackets) {
  SimulatedLink link(of_delay(milliseconds(50)), kSeed, 1);
  link.send(LocalTime{}, packet(1));
  link.set_parameters(of_delay(milliseconds(100)));
  link.send(LocalTime{milliseconds(1)}, packet(2));
  EXPECT_EQ(link.next_due(), LocalTime{milliseconds(50)}) << "packets in flight must keep their delay";
  EXPECT_TRUE(link.receive(LocalTime{milliseconds(50)}));
  EXPECT_EQ(link.next_due(), LocalTime{milliseconds(101)});
  link.set_parameters(of_delay(milliseconds(10)));
  link.send(LocalTime{milliseconds(2)}, packet(3));
  EXPECT_EQ(number_of(*link.receive(LocalTime{milliseconds(101)})), 2U) << "nor is it overtaken";
  EXPECT_EQ(number_of(*link.receive(LocalTime{milliseconds(101)})), 3U);
  link.set_parameters(of_loss(kMaxLoss));
  for (std::uint32_t i = 0; i < 1000; ++i) link.send(LocalTime{milliseconds(200 + i)}, packet(i));
  EXPECT_GT(link.counters().lost, 500U);
  EXPECT_THROW(link.set_parameters(of_loss(2)), std::invalid_argument);
}

TEST(SimulatedLink, AStreamLosesNothingForAnyParameters) {
  SimulatedLink link = SimulatedLink::reliable({}, kSeed, 1);
  link.set_parameters(of_loss(kMaxLoss));
  EXPECT_EQ(run(link, 1000, milliseconds(1)).size(), 1000U);
}

}  // namespace
}  // namespace tandem::net
