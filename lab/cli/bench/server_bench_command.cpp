// `tandem-lab bench server`: runs a complete server with sockets and rooms, and users that send and receive at 1 kHz,
// all on this machine. Its latency is compared with that of an echo server that only returns datagrams.

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <fstream>
#include <future>
#include <iostream>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/realtime/realtime.hpp"
#include "common/secure/certificate.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/report/check.hpp"
#include "lab/session/server_load.hpp"
#include "lab/session/udp_echo.hpp"
#include "server/app/security.hpp"
#include "server/net/live_server.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kServerSettling = std::chrono::seconds(1);
/// Number of runs into which the measured time is divided. The median over the runs is reported for each latency.
constexpr int kTurns = 3;
constexpr std::size_t kEchoUsers = 2;
constexpr int kRoomPriority = 60;
constexpr double kMaxLatency_us = 500;
constexpr double kMaxEchoes = 2;
constexpr double kMaxAead_percent = 10;
/// With --overload, each step of the first room is delayed by this time. At 1 kHz, a step then takes about five
/// periods.
constexpr Duration kOverload = std::chrono::milliseconds(4);

struct ServerBenchOptions {
  std::size_t clients = 16;
  std::size_t rooms = 0;  ///< 0: one room for every two users
  std::size_t bodies = 3;
  double rate_hz = 1000;
  double seconds = 5;
  bool is_overloaded = false;
  bool is_insecure = false;
  bool prints_json = false;
};

/// Returns the processor time of this process or of the calling thread [s]. The calling thread generates the load.
/// Therefore the difference of both times is the processor time of the server.
double cpu_seconds(int who) {
  rusage usage{};
  getrusage(who, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}
double server_cpu_seconds() {
  return cpu_seconds(RUSAGE_SELF) - cpu_seconds(RUSAGE_THREAD);
}

/// Returns the processor time of all cores since the machine started, in clock ticks of the kernel. The first value is
/// the total; the second is the steal time, in which the host of a virtual machine ran other guests.
std::array<double, 2> machine_time() {
  std::ifstream stat("/proc/stat");
  std::string cpu;
  stat >> cpu;
  constexpr int kTaken = 7;
  double all = 0, ticks = 0;
  for (int i = 0; i <= kTaken && stat >> ticks; ++i) all += ticks;
  return {all, ticks};
}

struct ServerBenchResult {
  Histogram echo;  ///< latency of the echo server during the load
  std::array<LoadResult, kTurns> turns;
  double took_s = 0;         ///< total duration of all runs [s]
  std::vector<double> kept;  ///< step rate of each room during the load, as a fraction of the nominal rate
  std::vector<server::RoomTiming> timings;
  double server_cpu_s_per_s = 0;
  double aead_percent = 0;  ///< processor time of encryption (AEAD), in per cent of the server's processor time
  double wake_us = 0;       ///< processor time of one sleep and wake-up [µs]
  double taken = 0;         ///< steal time (see machine_time()) during the load, as a fraction of the machine's time
};

/// Deadlines of the latest 4096 steps of a room. The room's thread writes them, and the thread that generates the load
/// reads them.
using Deadlines = std::array<std::atomic<LocalTime>, 4096>;

/// A server on its own thread that counts the steps of its rooms.
class ServerUnderLoad {
 public:
  explicit ServerUnderLoad(const ServerBenchOptions& options) : steps_(options.rooms), deadlines_(options.rooms) {
    std::vector<std::unique_ptr<server::Room>> rooms;
    const std::size_t users = (options.clients + options.rooms - 1) / options.rooms;
    if (users > proto::kMaxUsers || users * options.bodies >= proto::kMaxBodies) {
      throw std::invalid_argument("a room takes at most 16 users and 63 cubes; use more --rooms or fewer --bodies");
    }
    for (std::size_t i = 0; i < options.rooms; ++i) {
      const std::string name = "room " + std::to_string(i + 1);
      const auto scene =
          server::load_scene_text(crowded_scene(name, users, options.bodies, options.rate_hz), name, ".");
      rooms.push_back(std::make_unique<server::Room>(RoomId{static_cast<std::uint32_t>(i + 1)}, name, scene));
    }
    server::LiveServerSettings settings;
    settings.port = 0;
    settings.realtime_priority = kRoomPriority;
    settings.hub.max_connections = options.clients + 1;
    if (!options.is_insecure) {
      settings.tls = server::tls_of(keys_);
      settings.hub.admission = server::admission_of(keys_, {});
    }
    server_ = std::make_unique<server::LiveServer>(settings, std::move(rooms));
    server_->on_log = [](std::string_view kind, const std::string& line) {
      if (kind == "rate") std::cerr << line << '\n';
    };
    server_->on_step = [this, is_overloaded = options.is_overloaded](const server::Room& room, LocalTime deadline) {
      const std::size_t index = room.id().value - 1;
      ++steps_[index];
      deadlines_[index][room.steps_done().value % deadlines_[index].size()] = deadline;
      const SteadyClock clock;
      const LocalTime until = clock.now() + kOverload;
      while (is_overloaded && index == 0 && clock.now() < until) {
      }
    };
    thread_ = std::thread([this] { server_->run(); });
  }
  ~ServerUnderLoad() { stop(); }
  ServerUnderLoad(const ServerUnderLoad&) = delete;
  ServerUnderLoad& operator=(const ServerUnderLoad&) = delete;

  void stop() {
    if (!thread_.joinable()) return;
    server_->stop();
    thread_.join();
  }
  std::vector<std::uint64_t> steps() const { return {steps_.begin(), steps_.end()}; }
  LocalTime deadline(std::size_t room, Step step) const {
    return deadlines_[room][step.value % deadlines_[room].size()];
  }
  server::LiveServer& server() { return *server_; }
  LoadSecurity security() const {
    return {{.pin = keys_.identity.id()}, [this] { return server::token_for({}, keys_.identity.id(), keys_.issuer); }};
  }

 private:
  static server::ServerKeys make_keys() {
    using Kind = secure::KeyPair::Kind;
    const auto identity = secure::KeyPair::make(Kind::kP256);
    return {identity, secure::KeyPair::make(Kind::kEd25519), secure::self_signed_certificate(identity)};
  }

  const server::ServerKeys keys_ = make_keys();
  std::vector<std::atomic<std::uint64_t>> steps_;
  std::vector<Deadlines> deadlines_;
  std::unique_ptr<server::LiveServer> server_;
  std::thread thread_;
};

/// Returns the processor time that one sleep until a deadline and the wake-up take on this machine while it is idle
/// [µs].
double wake_cost_us() {
  constexpr int kWakes = 1000;
  double cost_us = 0;
  std::thread([&cost_us] {
    realtime::request_realtime(kRoomPriority);
    realtime::PeriodicTimer timer(std::chrono::microseconds(500), SteadyClock().now());
    const double before_s = cpu_seconds(RUSAGE_THREAD);
    for (int i = 0; i < kWakes; ++i) timer.wait();
    cost_us = 1e6 * (cpu_seconds(RUSAGE_THREAD) - before_s) / kWakes;
  }).join();
  return cost_us;
}

/// Returns the median over all runs of the 99th percentile [µs].
double median_p99_us(const ServerBenchResult& result, Histogram LoadResult::*what) {
  std::array<double, kTurns> p99_us{};
  std::ranges::transform(result.turns, p99_us.begin(),
                         [what](const LoadResult& turn) { return microseconds((turn.*what).quantile(0.99)); });
  std::ranges::sort(p99_us);
  return p99_us[kTurns / 2];
}

Histogram of_all_turns(const ServerBenchResult& result, Histogram LoadResult::*what) {
  Histogram all;
  for (const LoadResult& turn : result.turns) all.merge(turn.*what);
  return all;
}

double per_second(const ServerBenchResult& result, std::uint64_t LoadResult::*what) {
  std::uint64_t sum = 0;
  for (const LoadResult& turn : result.turns) sum += turn.*what;
  return static_cast<double>(sum) / result.took_s;
}

ServerBenchResult measure_server_bench(const ServerBenchOptions& options) {
  ServerBenchResult result;
  result.wake_us = wake_cost_us();
  ServerUnderLoad subject(options);
  const auto security = options.is_insecure ? std::nullopt : std::optional(subject.security());
  ServerLoad load(subject.server().port(), options.clients, options.rooms, security,
                  [&subject](std::size_t room, Step step) { return subject.deadline(room, step); });
  load.run(kServerSettling, options.rate_hz);
  result.kept.resize(options.rooms);
  double cpu_s = 0;
  const auto [all_before, taken_before] = machine_time();
  for (LoadResult& turn : result.turns) {
    const std::vector<std::uint64_t> before = subject.steps();
    const LocalTime begin = SteadyClock().now();
    const double cpu_before_s = server_cpu_seconds();
    const Duration duration = from_seconds(options.seconds / kTurns);
    // Measures the latency of an echo server during the load. It has the priority of the server's io thread, and its
    // datagrams have the size of a user's input. The result is the latency of the machine itself under this load.
    auto echo =
        std::async(std::launch::async, udp_echo_latency, kEchoUsers, options.rate_hz, duration, kRoomPriority + 1);
    turn = load.run(duration, options.rate_hz);
    const auto [echo_latency, echo_cpu] = echo.get();
    result.echo.merge(echo_latency);
    result.took_s += to_seconds(SteadyClock().now() - begin);
    cpu_s += server_cpu_seconds() - cpu_before_s - to_seconds(echo_cpu);
    const std::vector<std::uint64_t> after = subject.steps();
    for (std::size_t i = 0; i < options.rooms; ++i) result.kept[i] += static_cast<double>(after[i] - before[i]);
  }
  const auto [all_after, taken_after] = machine_time();
  result.taken = (taken_after - taken_before) / std::max(1.0, all_after - all_before);
  for (double& kept : result.kept) kept /= options.rate_hz * result.took_s;
  result.server_cpu_s_per_s = cpu_s / result.took_s;
  const double datagrams_per_s =
      per_second(result, &LoadResult::inputs_sent) + per_second(result, &LoadResult::states_received);
  if (!options.is_insecure) {
    result.aead_percent = 100 * datagrams_per_s * to_seconds(ServerLoad::seal_cost()) / result.server_cpu_s_per_s;
  }
  subject.stop();
  result.timings = subject.server().room_timings();
  return result;
}

double least_kept(const ServerBenchOptions& options, const ServerBenchResult& result) {
  return *std::min_element(result.kept.begin() + (options.is_overloaded ? 1 : 0), result.kept.end());
}

std::vector<Check> checks_of(const ServerBenchOptions& options, const ServerBenchResult& result) {
  if (options.is_overloaded && options.rooms == 1) return {};
  const std::string rooms_text =
      options.is_overloaded ? "steps kept by the rooms that are not overloaded" : "steps kept";
  std::vector<Check> checks{
      {"server", rooms_text + ", least", 100 * least_kept(options, result), Relation::kAtLeast, 99, "%", 1}};
  if (options.is_overloaded) return checks;
  const double latency_us = median_p99_us(result, &LoadResult::added_latency);
  const double echoes = latency_us / microseconds(result.echo.quantile(0.99));
  checks.push_back({"server", "added latency, p99", latency_us, Relation::kAtMost, kMaxLatency_us, "µs", 0});
  checks.push_back(
      {"server", "added latency, p99, as a multiple of a bare echo", echoes, Relation::kAtMost, kMaxEchoes, "", 2});
  if (options.is_insecure) return checks;
  checks.push_back({"server", "sealing and opening, share of the server's processor time", result.aead_percent,
                    Relation::kAtMost, kMaxAead_percent, "%", 1});
  return checks;
}

boost::json::object to_json(const ServerBenchOptions& options, const ServerBenchResult& result,
                            const std::vector<Check>& checks) {
  boost::json::array rooms;
  for (std::size_t i = 0; i < result.timings.size(); ++i) {
    const server::RoomTiming& timing = result.timings[i];
    rooms.push_back(boost::json::object{{"kept_percent", 100 * result.kept[i]},
                                        {"step_us", quantiles_us(timing.step_time)},
                                        {"lateness_us", quantiles_us(timing.lateness)},
                                        {"overruns", timing.overruns},
                                        {"slow_steps", timing.slow}});
  }
  const double steps_per_s = std::accumulate(result.kept.begin(), result.kept.end(), 0.0) * options.rate_hz;
  Histogram step_time;
  std::uint64_t overruns = 0;
  for (const server::RoomTiming& timing : result.timings) {
    step_time.merge(timing.step_time);
    overruns += timing.overruns;
  }
  return {{"clients", options.clients},
          {"rooms", options.rooms},
          {"rate_hz", options.rate_hz},
          {"is_overloaded", options.is_overloaded},
          {"is_encrypted", !options.is_insecure},
          {"cpu_seconds_per_second", result.server_cpu_s_per_s},
          {"aead_percent_of_cpu", result.aead_percent},
          {"wake_us", result.wake_us},
          {"taken_by_host_percent", 100 * result.taken},
          {"steps_per_s", steps_per_s},
          {"datagrams_in_per_s", per_second(result, &LoadResult::inputs_sent)},
          {"datagrams_out_per_s", per_second(result, &LoadResult::states_received)},
          {"added_latency_us", quantiles_us(of_all_turns(result, &LoadResult::added_latency))},
          {"echo_latency_us", quantiles_us(result.echo)},
          {"input_age_us", quantiles_us(of_all_turns(result, &LoadResult::input_age))},
          {"answer_us", quantiles_us(of_all_turns(result, &LoadResult::answer))},
          {"longest_silence_us", microseconds(of_all_turns(result, &LoadResult::longest_silence).max())},
          {"step_us", quantiles_us(step_time)},
          {"overruns", overruns},
          {"each_room", rooms},
          {"checks", to_json(checks)}};
}

void print(const ServerBenchOptions& options, const ServerBenchResult& result, const std::vector<Check>& checks) {
  std::cout << options.clients << " clients in " << options.rooms << (options.rooms == 1 ? " room" : " rooms")
            << (options.is_overloaded ? ", the first overloaded" : "")
            << "\n  room  kept %  step p50, p99 [µs]  overruns\n";
  for (std::size_t i = 0; i < result.timings.size(); ++i) {
    const server::RoomTiming& timing = result.timings[i];
    std::cout << "  " << i + 1 << "  " << 100 * result.kept[i] << "  " << microseconds(timing.step_time.quantile(0.5))
              << ", " << microseconds(timing.step_time.quantile(0.99)) << "  " << timing.overruns << '\n';
  }
  const auto line = [](const char* what, const Histogram& h) {
    std::cout << what << " p50 " << microseconds(h.quantile(0.5)) << ", p99 " << microseconds(h.quantile(0.99))
              << " µs\n";
  };
  std::cout << "datagrams/s in " << per_second(result, &LoadResult::inputs_sent) << ", out "
            << per_second(result, &LoadResult::states_received) << '\n';
  line("from a step's deadline to the send of its state     ", of_all_turns(result, &LoadResult::added_latency));
  line("from a datagram's send to its answer's by an echo   ", result.echo);
  line("from an input's send to the deadline of its step    ", of_all_turns(result, &LoadResult::input_age));
  line("from an input's send to the arrival of its state    ", of_all_turns(result, &LoadResult::answer));
  std::cout << "processor time of the server " << result.server_cpu_s_per_s << " s/s, of it the AEAD "
            << result.aead_percent << " %\n";
  std::cout << "one sleep and wake-up of an idle machine takes " << result.wake_us << " µs of processor time\n";
  std::cout << "a host took " << 100 * result.taken << " % of this machine's time meanwhile\n";
  std::cout << "longest silence at a user "
            << microseconds(of_all_turns(result, &LoadResult::longest_silence).max()) / 1e3 << " ms\n";
  print_checks(std::cout, checks);
}

int run_server_bench(const ServerBenchOptions& options) {
  const ServerBenchResult result = measure_server_bench(options);
  const std::vector<Check> checks = checks_of(options, result);
  if (options.prints_json) {
    std::cout << pretty_json(to_json(options, result, checks));
  } else {
    print(options, result, checks);
  }
  return all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_server_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<ServerBenchOptions>();
  CLI::App* command =
      bench.add_subcommand("server", "A whole server over loopback, with users at 1 kHz on the same machine");
  command->add_option("--clients", options->clients, "users in all, dealt to the rooms in turn")
      ->check(CLI::Range(1, 64))
      ->capture_default_str();
  command->add_option("--rooms", options->rooms, "rooms, each with a scene of its own; at most 16 users in each")
      ->check(CLI::Range(1, 32))
      ->default_str("one for every two users");
  command->add_option("--bodies", options->bodies, "cubes of each user; at most 63 in a room")
      ->check(CLI::Range(1, 4))
      ->capture_default_str();
  command->add_option("--rate-hz", options->rate_hz, "inputs of each user and steps of each room, a second [Hz]")
      ->check(CLI::Range(60, 4000))
      ->capture_default_str();
  command->add_option("--seconds", options->seconds, "how long [s], after one second to settle; in three turns")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  command->add_flag("--overload", options->is_overloaded, "each step of the first room takes 4 ms more");
  command->add_flag("--insecure", options->is_insecure, "nothing is encrypted, to compare");
  command->add_flag("--json", options->prints_json, "print JSON instead of a table");
  command->callback([options, &exit_code] {
    if (options->rooms == 0) options->rooms = (options->clients + 1) / 2;
    exit_code = run_server_bench(*options);
  });
}

}  // namespace tandem::lab
