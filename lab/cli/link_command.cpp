// `tandem-lab link`: runs the simulated link as a separate program between unmodified clients and a server.

#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <csignal>
#include <iostream>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/base/units.hpp"
#include "common/realtime/realtime.hpp"
#include "lab/cli/commands.hpp"
#include "lab/session/link_proxy.hpp"

namespace tandem::lab {
namespace {

constexpr Duration kStep = std::chrono::microseconds(500);

struct LinkOptions {
  LinkProxySettings proxy;
  std::vector<std::string> listen{proxy.listen};
  std::string delay = "0ms";
  std::string jitter = "0ms";
  std::string loss = "0%";
  std::string duplication = "0%";
  std::string duration;
};

/// Maps each listening address to its proxy.
using Proxies = std::map<std::string, std::unique_ptr<LinkProxy>>;

void obey(const std::string& word, LinkProxy& proxy) {
  if (word == "cut" || word == "restore") {
    proxy.cut(word == "cut");
  } else if (word == "move") {
    proxy.move();
  } else if (word == "reset") {
    proxy.reset();
  } else {
    throw std::invalid_argument("'" + word + "' is no command; use cut, restore, move or reset");
  }
}

/// Executes one line of input: a command word, optionally followed by a space and an address of --listen. Without an
/// address, the command applies to all links.
void obey_line(const std::string& line, const Proxies& proxies) {
  const std::size_t space = std::min(line.find(' '), line.size());
  const std::string word = line.substr(0, space);
  if (space == line.size()) {
    for (const auto& [address, proxy] : proxies) obey(word, *proxy);
  } else {
    const auto found = proxies.find(line.substr(space + 1));
    if (found == proxies.end()) throw std::invalid_argument("'" + line + "' names no address of --listen");
    obey(word, *found->second);
  }
  std::cout << line << std::endl;
}

/// Executes the complete lines that were typed on standard input since the last call. `begun` holds an incomplete line.
void listen_to_stdin(std::string& begun, bool& has_ended, const Proxies& proxies) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (has_ended || ::poll(&input, 1, 0) <= 0) return;
  std::array<char, 256> bytes{};
  const ssize_t size = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  has_ended = size <= 0;
  if (!has_ended) begun.append(bytes.data(), static_cast<std::size_t>(size));
  for (std::size_t end = begun.find('\n'); end != std::string::npos; end = begun.find('\n')) {
    obey_line(begun.substr(0, end), proxies);
    begun.erase(0, end + 1);
  }
}

Proxies open_links(const LinkOptions& options) {
  if (options.listen.size() > 1 && !options.proxy.capture.empty()) {
    throw std::invalid_argument("--capture is of one link; give only one --listen");
  }
  Proxies proxies;
  LinkProxySettings settings = options.proxy;
  for (const std::string& address : options.listen) {
    settings.listen = address;
    if (proxies.contains(address)) throw std::invalid_argument("--listen " + address + " is given twice");
    proxies[address] = std::make_unique<LinkProxy>(settings);
    ++settings.seed;
  }
  return proxies;
}

int run_link(LinkOptions options) {
  std::signal(SIGPIPE, SIG_IGN);
  options.proxy.link.delay = parse_duration(options.delay, "ms");
  options.proxy.link.jitter = parse_duration(options.jitter, "ms");
  options.proxy.link.loss = parse_fraction(options.loss, net::kMaxLoss);
  options.proxy.link.duplication = parse_fraction(options.duplication);
  if (const std::string problem = options.proxy.link.problem(); !problem.empty()) throw std::invalid_argument(problem);
  const Proxies proxies = open_links(options);
  const SteadyClock clock;
  const LocalTime end =
      options.duration.empty() ? LocalTime::max() : clock.now() + parse_duration(options.duration, "s");
  for (const std::string& address : options.listen) {
    std::cout << "tandem-lab link: from " << address << " to " << options.proxy.server << ", port "
              << options.proxy.port << std::endl;
  }
  realtime::PeriodicTimer timer(kStep, clock.now());
  std::string begun;
  bool has_ended = false;
  while (timer.wait() < end) {
    for (const auto& [address, proxy] : proxies) proxy->step(clock.now());
    listen_to_stdin(begun, has_ended, proxies);
  }
  return 0;
}

}  // namespace

void add_link_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<LinkOptions>();
  CLI::App* command =
      app.add_subcommand("link",
                         "A simulated link between real programs; commands on stdin: cut blocks the link, restore "
                         "opens it again, move changes the source address of datagrams, reset ends the connections; "
                         "followed by an address of --listen: of that link only");
  command->add_option("--listen", options->listen, "address that clients connect to; given again, another link")
      ->allow_extra_args(false)
      ->type_name("ADDRESS")
      ->capture_default_str();
  command->add_option("--server", options->proxy.server, "address of the server")->capture_default_str();
  command->add_option("--port", options->proxy.port, "TCP and UDP, of both")->capture_default_str();
  command->add_option("--delay", options->delay, "each way, e.g. 25ms")->capture_default_str();
  command->add_option("--jitter", options->jitter, "its standard deviation")->capture_default_str();
  command->add_option("--loss", options->loss, "share of datagrams lost")->capture_default_str();
  command->add_option("--duplication", options->duplication, "share of datagrams delivered twice")
      ->capture_default_str();
  command->add_flag("--reorder", options->proxy.link.allows_reordering, "allow jitter to reorder datagrams");
  command->add_option("--seed", options->proxy.seed, "of jitter, loss and duplication; of the next link one more")
      ->capture_default_str();
  command->add_option("--capture", options->proxy.capture, "write all bytes that go through to this file");
  command->add_option("--duration", options->duration, "end after this long, with unit [default: never]");
  command->callback([options, &exit_code] { exit_code = run_link(*options); });
}

}  // namespace tandem::lab
