// `tandem-lab bench coupling`: measures the duration of coupling law, saturation and safety chain in one haptic tick,
// for every law. The durations are compared with those of a plain spring-damper and of a read of the clock in the same
// run.

#include <CLI/CLI.hpp>
#include <cmath>
#include <functional>
#include <iomanip>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/base/json_pretty.hpp"
#include "common/base/random.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/saturation.hpp"
#include "common/haptics/safety.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/report/check.hpp"

namespace tandem::lab {
namespace {

/// Upper limit for the median duration of a coupling law with its safety chain. It is a small part of a tick (1000 µs),
/// because device, network and local model need most of the time.
constexpr double kMedianBound_us = 2;
/// Number of rounds. The compared laws alternate, so that a change of the processor's clock rate affects all of them.
constexpr int kCouplingRounds = 5;
constexpr std::size_t kTicks = 4096;
constexpr Duration kPeriod{std::chrono::milliseconds(1)};
constexpr std::uint64_t kSeed = 1;

struct CouplingBenchOptions {
  double seconds = 0.5;
  bool prints_json = false;
  bool has_check = false;
};

struct WalkTick {
  Pose X_WH, X_WT;
  Twist V_WH, V_WT;
};

/// A coordinate that fluctuates randomly about zero, as a hand does around its target. The standard deviation is
/// `spread`, the correlation time `memory_s` [s].
///
/// Model   Ornstein–Uhlenbeck process, sampled once per period
class Wander {
 public:
  Wander(double spread, double memory_s) : spread_(spread), keep_(std::exp(-to_seconds(kPeriod) / memory_s)) {}
  Vec3 next(Random& random) {
    const double fresh = spread_ * std::sqrt(1 - keep_ * keep_);
    for (double& x : value_) x = keep_ * x + fresh * random.normal();
    return value_;
  }

 private:
  double spread_;
  double keep_;
  Vec3 value_ = Vec3::Zero();
};

/// Returns random states of a hand and of a tool, one pair for each tick. The tool is up to a few centimetres and half
/// a radian away from the hand. The states cover the flat, the steep and the saturated part of every law's force curve.
std::vector<WalkTick> random_walk() {
  Random random(kSeed);
  Wander place(0.04, 1), turn(0.5, 1), apart(0.012, 0.3), twisted(0.3, 0.3), speed(0.1, 0.1), spin(1, 0.1),
      slip(0.02, 0.02), slip_turn(0.3, 0.02);
  std::vector<WalkTick> walk(kTicks);
  for (WalkTick& tick : walk) {
    tick.X_WT = {place.next(random), quaternion_of(turn.next(random))};
    tick.V_WT = {speed.next(random), spin.next(random)};
    tick.X_WH = {tick.X_WT.p + apart.next(random), quaternion_of(twisted.next(random)) * tick.X_WT.q};
    tick.V_WH = {tick.V_WT.v + slip.next(random), tick.V_WT.w + slip_turn.next(random)};
  }
  return walk;
}

struct CouplingBenchContestant {
  std::string name;
  std::string what;
  bool is_claimed = false;  ///< true: the upper limit kMedianBound_us is checked for this law
  /// Calls the law through an opaque pointer, so that the compiler cannot move the computation out of the timed
  /// section.
  std::function<Wrench(const WalkTick&)> work;
  Histogram times;
};

/// Minimum computation of a tick: a spring-damper without force limit, shortest rotation and safety chain.
Wrench plain_spring(const WalkTick& tick) {
  const haptics::CouplingParameters c;
  return {c.stiffness_n_per_m * (tick.X_WT.p - tick.X_WH.p) + c.damping_n_s_per_m * (tick.V_WT.v - tick.V_WH.v),
          c.damping_n_m_s_per_rad * (tick.V_WT.w - tick.V_WH.w)};
}

/// Limits the contact force as the room does for direct rendering. The argument may be any wrench, because the duration
/// does not depend on its value.
Wrench limited(const Wrench& contact) {
  const haptics::CouplingParameters c;
  return {haptics::saturated(contact.f, c.force_limit_n, c.saturation_softness),
          haptics::saturated(contact.t, c.torque_limit_n_m, c.saturation_softness)};
}

/// The safety chain at full force in virtual time. Each call advances one period.
class Safety {
 public:
  Wrench apply(const Wrench& on_hand) {
    now_ += kPeriod;
    haptics::SafetyInput input;
    input.wrench = on_hand;
    input.has_state = true;
    return chain_.apply(now_, input);
  }

 private:
  haptics::SafetyChain chain_{haptics::SafetySettings{}};
  LocalTime now_{};
};

std::vector<CouplingBenchContestant> contestants() {
  std::vector<CouplingBenchContestant> all;
  all.push_back({"clock", "reading the clock", false, [](const WalkTick&) { return Wrench{}; }, {}});
  all.push_back({"plain", "k d + b v, nothing else", false, &plain_spring, {}});
  all.push_back({"safety",
                 "safety chain alone",
                 false,
                 [safety = std::make_shared<Safety>()](const WalkTick&) { return safety->apply({}); },
                 {}});
  for (const haptics::CouplingLawInfo& info : haptics::coupling_laws()) {
    if (info.tool == haptics::ToolDynamics::kAtHandle) {
      // Direct rendering has no coupling law. Only the limit of the contact force remains.
      const auto tick_of = [safety = std::make_shared<Safety>()](const WalkTick& tick) {
        return safety->apply(limited(plain_spring(tick)));
      };
      all.push_back({std::string(info.name), "saturation, safety chain", true, tick_of, {}});
      continue;
    }
    const std::shared_ptr<const haptics::CouplingLaw> law = info.make({});
    const auto tick_of = [law, safety = std::make_shared<Safety>()](const WalkTick& tick) {
      return safety->apply(haptics::coupling_wrenches(*law, tick.X_WH, tick.V_WH, tick.X_WT, tick.V_WT).on_hand_W);
    };
    all.push_back({std::string(info.name), "law, saturation, safety chain", true, tick_of, {}});
  }
  return all;
}

void run_round(CouplingBenchContestant& contestant, const std::vector<WalkTick>& walk, double seconds) {
  const SteadyClock clock;
  const LocalTime end = clock.now() + from_seconds(seconds);
  Wrench sum;
  LocalTime before = clock.now();
  do {
    for (const WalkTick& tick : walk) {
      before = clock.now();
      sum += contestant.work(tick);
      contestant.times.record(clock.now() - before);
    }
  } while (before < end);
  if (!is_finite(sum)) throw std::runtime_error("law " + contestant.name + " gave an infinite force");
}

std::vector<Check> checks_of(const std::vector<CouplingBenchContestant>& all) {
  std::vector<Check> checks;
  for (const CouplingBenchContestant& contestant : all) {
    if (!contestant.is_claimed) continue;
    checks.push_back({contestant.name, "median of a tick", microseconds(contestant.times.quantile(0.5)),
                      Relation::kAtMost, kMedianBound_us, "µs", 3});
  }
  return checks;
}

boost::json::object report_of(const std::vector<CouplingBenchContestant>& all, const std::vector<Check>& checks) {
  boost::json::array rows;
  for (const CouplingBenchContestant& contestant : all) {
    rows.push_back(
        boost::json::object{{"name", contestant.name},
                            {"what", contestant.what},
                            {"ticks", contestant.times.count()},
                            {"tick_us", boost::json::object{{"p50", microseconds(contestant.times.quantile(0.5))},
                                                            {"p99", microseconds(contestant.times.quantile(0.99))},
                                                            {"max", microseconds(contestant.times.max())}}}});
  }
  return {{"seed", kSeed},
          {"states", kTicks},
          {"median_bound_us", kMedianBound_us},
          {"rows", rows},
          {"checks", to_json(checks)}};
}

void print(const std::vector<CouplingBenchContestant>& all, const std::vector<Check>& checks) {
  std::ostringstream text;
  text << "time of a tick, clock reading included [µs]\n\n"
       << std::left << std::setw(24) << "" << std::setw(32) << "what" << std::right << std::setw(8) << "median"
       << std::setw(8) << "p99" << '\n'
       << std::fixed << std::setprecision(3);
  for (const CouplingBenchContestant& contestant : all) {
    text << std::left << std::setw(24) << contestant.name << std::setw(32) << contestant.what << std::right
         << std::setw(8) << microseconds(contestant.times.quantile(0.5)) << std::setw(8)
         << microseconds(contestant.times.quantile(0.99)) << '\n';
  }
  std::cout << text.str() << '\n';
  print_checks(std::cout, checks);
}

int run_coupling_bench(const CouplingBenchOptions& options) {
  const std::vector<WalkTick> walk = random_walk();
  std::vector<CouplingBenchContestant> all = contestants();
  for (int round = 0; round < kCouplingRounds; ++round) {
    for (CouplingBenchContestant& contestant : all) run_round(contestant, walk, options.seconds / kCouplingRounds);
  }
  const std::vector<Check> checks = checks_of(all);
  if (options.prints_json) {
    std::cout << pretty_json(report_of(all, checks));
  } else {
    print(all, checks);
  }
  return !options.has_check || all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_coupling_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<CouplingBenchOptions>();
  CLI::App* command = bench.add_subcommand("coupling", "Coupling law, saturation and safety chain, tick by tick");
  command->add_option("--seconds", options->seconds, "time spent on each law [s]")
      ->check(CLI::Range(0.01, 10.0))
      ->capture_default_str();
  command->add_flag("--check", options->has_check, "exit code 1 when a median is above its bound");
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->footer("Exit code: 0 done, 1 a bound does not hold and --check is given, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_coupling_bench(*options); });
}

}  // namespace tandem::lab
