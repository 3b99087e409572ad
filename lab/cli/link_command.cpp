// `tandem-lab link`: the simulated link as a program between real clients and a real server.

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <csignal>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/base/units.hpp"
#include "common/realtime/realtime.hpp"
#include "lab/cli/commands.hpp"
#include "lab/session/link_proxy.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kStep = std::chrono::microseconds(500);

struct Options {
  LinkProxySettings proxy;
  std::string delay = "0ms";
  std::string jitter = "0ms";
  std::string loss = "0%";
  std::string duration;
};

void obey(const std::string& word, LinkProxy& proxy) {
  if (word == "cut" || word == "restore") {
    proxy.cut(word == "cut");
  } else if (word == "move") {
    proxy.move();
  } else {
    throw std::invalid_argument("'" + word + "' is not understood; say cut, restore or move");
  }
  std::cout << word << std::endl;
}

/// What has been typed so far, a line each.
void listen_to_stdin(std::string& begun, bool& has_ended, LinkProxy& proxy) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (has_ended || ::poll(&input, 1, 0) <= 0) return;
  std::array<char, 256> bytes{};
  const ssize_t size = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  has_ended = size <= 0;
  if (!has_ended) begun.append(bytes.data(), static_cast<std::size_t>(size));
  for (std::size_t end = begun.find('\n'); end != std::string::npos; end = begun.find('\n')) {
    obey(begun.substr(0, end), proxy);
    begun.erase(0, end + 1);
  }
}

int run(Options options) {
  std::signal(SIGPIPE, SIG_IGN);
  options.proxy.link.delay = parse_duration(options.delay, "ms");
  options.proxy.link.jitter = parse_duration(options.jitter, "ms");
  options.proxy.link.loss = parse_fraction(options.loss, net::kMaxLoss);
  if (const std::string problem = options.proxy.link.problem(); !problem.empty()) throw std::invalid_argument(problem);
  LinkProxy proxy(options.proxy);
  const SteadyClock clock;
  const LocalTime end =
      options.duration.empty() ? LocalTime::max() : clock.now() + parse_duration(options.duration, "s");
  std::cout << "tandem-lab link: from " << options.proxy.listen << " to " << options.proxy.server << ", port "
            << options.proxy.port << std::endl;
  realtime::PeriodicTimer timer(kStep, clock.now());
  std::string begun;
  bool has_ended = false;
  while (timer.wait() < end) {
    proxy.step(clock.now());
    listen_to_stdin(begun, has_ended, proxy);
  }
  return 0;
}

}  // namespace

void add_link_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "link",
      "A simulated link between real programs; cut, restore and move on stdin break it, mend it, and change where "
      "datagrams come from");
  command->add_option("--listen", options->proxy.listen, "address that clients connect to")->capture_default_str();
  command->add_option("--server", options->proxy.server, "address of the server")->capture_default_str();
  command->add_option("--port", options->proxy.port, "TCP and UDP, of both")->capture_default_str();
  command->add_option("--delay", options->delay, "each way, e.g. 25ms")->capture_default_str();
  command->add_option("--jitter", options->jitter, "its standard deviation")->capture_default_str();
  command->add_option("--loss", options->loss, "share of datagrams lost")->capture_default_str();
  command->add_option("--seed", options->proxy.seed, "of jitter and loss")->capture_default_str();
  command->add_option("--capture", options->proxy.capture, "write all bytes that go through to this file");
  command->add_option("--duration", options->duration, "end after this long, with unit [default: never]");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tandem::lab
