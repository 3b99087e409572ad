// The program tandem-signal. It sends named numbers (signals) to the game of a room. The numbers are read from standard
// input, or generated.
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <csignal>
#include <iostream>
#include <limits>
#include <numbers>
#include <optional>
#include <thread>

#include "client/signals/app/signal_options.hpp"
#include "client/signals/signal_line.hpp"
#include "common/base/units.hpp"

namespace {

using namespace tandem;

constexpr int kFailed = 1, kSetupError = 2;
/// Maximum time between two checks, during a wait, whether the program must end.
constexpr std::chrono::milliseconds kSlice{200};

struct Options {
  client::SignalOptions target;
  std::string generate;
  double low = -1;
  double high = 1;
  double confidence = 1;
  double rate_hz = 5;
  std::string period = "20s";
  std::string duration;
  bool is_quiet = false;
};

void declare(CLI::App& app, Options& options) {
  client::add_signal_options(app, options.target);
  app.add_option("--generate", options.generate,
                 "send a sine of this name instead of reading lines, until --duration ends or the program is stopped")
      ->type_name("NAME");
  app.add_option("--low", options.low, "smallest generated value")->capture_default_str();
  app.add_option("--high", options.high, "largest generated value")->capture_default_str();
  app.add_option("--period", options.period, "period of the sine, with unit; it begins at the middle and rises")
      ->capture_default_str()
      ->type_name("TIME");
  app.add_option("--confidence", options.confidence, "confidence of generated values, 0 to 1")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "generated values, 0.1 to 40 [per second]")->capture_default_str();
  app.add_option("--duration", options.duration, "until a generated signal ends, with unit [until stopped]")
      ->type_name("TIME");
  app.add_flag("--quiet", options.is_quiet, "do not print the signals of the room at the start");
  app.set_version_flag("--version", "tandem-signal " TANDEM_VERSION);
  app.footer(
      "A line is: name value [confidence [age]], with a confidence of 0 to 1 [1] and an age in seconds [0]. The game "
      "of "
      "the room names its signals in its scene (game.signals); a name that it lacks is refused.\n"
      "Exit code: 0 done, 1 a line was refused or the connection was lost, 2 bad input or set-up.");
}

std::atomic<bool> is_stopped{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void stop_on_signals() {
  for (const int signal : {SIGINT, SIGTERM}) {
    struct sigaction action {};
    action.sa_handler = [](int) { is_stopped = true; };
    sigaction(signal, &action, nullptr);
  }
}

/// Returns a text for the user if the game of the room has no signal of this name; otherwise empty.
std::string unknown_name(const client::SignalConnection& connection, const std::string& name) {
  const std::vector<std::string> names = connection.status().names;
  if (std::ranges::find(names, name) != names.end()) return {};
  std::string listed;
  for (const std::string& known : names) listed += (listed.empty() ? "" : ", ") + known;
  return "the game of the room has no signal '" + name + "'; it has " + listed;
}

/// Returns true until the program is stopped or its session has ended.
bool continues(const client::SignalConnection& connection) {
  return !is_stopped && connection.status().session.state != client::SessionState::kEnded;
}

/// Reads lines of bounded length from a file descriptor, while continues() is true.
class LineReader {
 public:
  LineReader(int descriptor, const client::SignalConnection& connection)
      : descriptor_(descriptor), connection_(connection) {}

  /// Returns the next line; nothing at the end of the input. A line that is too long is cut to kMaxSignalLineBytes + 1
  /// bytes, so that the parser refuses it.
  std::optional<std::string> next() {
    for (;;) {
      const auto end = std::ranges::find(pending_, '\n');
      if (end != pending_.end() || (has_ended_ && !pending_.empty())) {
        std::string line(pending_.begin(), end);
        pending_.erase(pending_.begin(), end == pending_.end() ? end : end + 1);
        line.resize(std::min(line.size(), client::kMaxSignalLineBytes + 1));
        return line;
      }
      if (has_ended_ || !fill()) return std::nullopt;
    }
  }

 private:
  /// Waits for input and appends it to `pending_`. The rest of a line that is too long is discarded. Returns false if
  /// the program must end.
  bool fill() {
    pollfd wait{descriptor_, POLLIN, 0};
    while (continues(connection_) && ::poll(&wait, 1, static_cast<int>(kSlice.count())) <= 0) {
    }
    if (!continues(connection_)) return false;
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(descriptor_, bytes.data(), bytes.size());
    has_ended_ = count <= 0;
    if (count > 0) pending_.append(bytes.data(), static_cast<std::size_t>(count));
    const bool is_line = pending_.find('\n') != std::string::npos;
    if (!is_line && pending_.size() > bytes.size()) pending_.resize(bytes.size());
    return true;
  }

  int descriptor_;
  const client::SignalConnection& connection_;
  std::string pending_;
  bool has_ended_ = false;
};

/// Sends the signals that are read from standard input, one a line. Returns true if all lines were valid.
bool send_lines(client::SignalConnection& connection) {
  LineReader reader(STDIN_FILENO, connection);
  bool are_valid = true;
  std::uint64_t number = 0;
  while (const auto line = reader.next()) {
    ++number;
    if (line->find_first_not_of(" \t\r") == std::string::npos || line->front() == '#') continue;
    try {
      if (line->size() > client::kMaxSignalLineBytes) throw std::invalid_argument("it is longer than 256 bytes");
      const client::SignalLine signal = client::parse_signal_line(*line);
      if (const std::string problem = unknown_name(connection, signal.signal.name); !problem.empty()) {
        throw std::invalid_argument(problem);
      }
      connection.send(signal.signal, signal.age);
    } catch (const std::invalid_argument& error) {
      are_valid = false;
      std::cerr << "tandem-signal: line " << number << ": " << error.what() << std::endl;
    }
  }
  return are_valid;
}

/// Waits for a time, in slices. Returns false as soon as the program is stopped or the session has ended.
bool wait_until(std::chrono::steady_clock::time_point time, const client::SignalConnection& connection) {
  while (continues(connection)) {
    const auto left = time - std::chrono::steady_clock::now();
    if (left <= std::chrono::nanoseconds(0)) return true;
    std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(left, kSlice));
  }
  return false;
}

void generate(client::SignalConnection& connection, const Options& options) {
  const double period_s = to_seconds(parse_duration(options.period, "s"));
  const double duration_s = options.duration.empty() ? std::numeric_limits<double>::infinity()
                                                     : to_seconds(parse_duration(options.duration, "s"));
  const double middle = (options.low + options.high) / 2, amplitude = (options.high - options.low) / 2;
  const auto start = std::chrono::steady_clock::now();
  for (std::uint64_t i = 0;; ++i) {
    const double time_s = static_cast<double>(i) / options.rate_hz;
    if (time_s >= duration_s || !wait_until(start + from_seconds(time_s), connection)) return;
    const double value = middle + amplitude * std::sin(2 * std::numbers::pi * time_s / period_s);
    connection.send({options.generate, value, options.confidence});
  }
}

void require_valid(const Options& options) {
  if (!(options.rate_hz >= 0.1 && options.rate_hz <= 40)) {
    throw std::invalid_argument("--rate must be 0.1 to 40 values per second");
  }
  if (!(options.low <= options.high)) throw std::invalid_argument("--low must not be more than --high");
  if (to_seconds(parse_duration(options.period, "s")) < 0.1)
    throw std::invalid_argument("--period must be 0.1s or more");
}

int run(const Options& options) {
  require_valid(options);
  client::SignalConnectionSettings settings = client::connection_of(options.target);
  settings.on_log = [](const std::string& line) { std::cerr << "tandem-signal: " << line << std::endl; };
  client::SignalConnection connection(settings);
  try {
    connection.wait_until_joined();
  } catch (const std::runtime_error& refused) {
    throw std::invalid_argument(refused.what());
  }
  if (!options.generate.empty()) {
    const std::string problem = unknown_name(connection, options.generate);
    if (!problem.empty()) throw std::invalid_argument("--generate: " + problem);
  }
  if (!options.is_quiet) {
    std::cerr << "tandem-signal: joined; the signals of the room:";
    for (const std::string& name : connection.status().names) std::cerr << ' ' << name;
    std::cerr << std::endl;
  }
  bool are_valid = true;
  if (options.generate.empty()) {
    are_valid = send_lines(connection);
  } else {
    generate(connection, options);
  }
  const bool is_confirmed = connection.flush(std::chrono::seconds(2));
  const client::SignalConnectionStatus status = connection.status();
  if (!is_confirmed && status.session.state != client::SessionState::kEnded) {
    std::cerr << "tandem-signal: the server has not confirmed "
              << counted(status.waiting + status.unconfirmed, "value", "values")
              << "; check the connection and send again" << std::endl;
  }
  connection.stop();
  return are_valid && is_confirmed && status.refused == 0 ? 0 : kFailed;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Sends numbers by name, such as a heart rate, to the game of a room.", "tandem-signal");
  declare(app, options);
  try {
    app.parse(argc, argv);
    stop_on_signals();
    return run(options);
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const std::exception& error) {
    std::cerr << "tandem-signal: " << error.what() << "; see --help" << std::endl;
    return kSetupError;
  }
}
