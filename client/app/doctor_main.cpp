// tandem-doctor: checks whether this machine is suitable for a haptic session.
#include <time.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <string>

#include "client/app/doctor.hpp"
#include "client/app/options.hpp"
#include "client/app/security_options.hpp"
#include "common/base/json.hpp"
#include "common/base/units.hpp"

namespace tandem::client {
namespace {

constexpr int kSetupError = 2;

struct DoctorOptions {
  std::string server;
  SecurityOptions security;
  std::string room;
  std::string duration = "10s";
  int priority = 70;
  bool prints_json = false;

  bool watches_link() const { return !server.empty() || !security.invitation.empty(); }
};

void declare(CLI::App& app, DoctorOptions& options) {
  app.add_option("--server", options.server, "also measure the link to this server")->type_name("ADDRESS:PORT");
  add_security_options(app, options.security);
  app.add_option("--room", options.room, "room to watch there; default: the server's only room");
  app.add_option("--duration", options.duration, "how long the loop and the link are watched each")
      ->capture_default_str()
      ->type_name("TIME");
  app.add_option("--rt-priority", options.priority, "SCHED_FIFO priority to request; 0: normal scheduler")
      ->capture_default_str()
      ->check(CLI::Range(0, 99).description(""));
  app.add_flag("--json", options.prints_json, "print one JSON object");
  app.set_version_flag("--version", "tandem-doctor " TANDEM_VERSION);
  app.footer("Exit code: 0 nothing is bad, 1 something is, 2 bad set-up.");
}

Duration timer_resolution() {
  timespec resolution{};
  clock_getres(CLOCK_MONOTONIC, &resolution);
  return std::chrono::seconds(resolution.tv_sec) + std::chrono::nanoseconds(resolution.tv_nsec);
}

std::vector<Finding> examine(const DoctorOptions& options, const ClientIoSettings& io, Duration duration) {
  std::vector<Finding> findings = find_devices(devices::device_kinds());
  const auto add = [&findings](std::vector<Finding> more) {
    for (Finding& one : more) findings.push_back(std::move(one));
  };
  add(judge_clocks("/sys/devices/system/clocksource/clocksource0/current_clocksource", timer_resolution()));
  add(run_loop(options.priority, duration));
  if (options.watches_link()) findings.push_back(watch_link(io, duration));
  return findings;
}

int run(const DoctorOptions& options) {
  const Duration duration = parse_duration(options.duration, "s");
  if (duration <= Duration{0}) throw std::invalid_argument("--duration: '" + options.duration + "' must be above 0");
  ClientIoSettings io;
  if (!options.server.empty()) apply_server(options.server, io);
  // The doctor always joins as an observer, even if the token permits more, because an observer needs no device.
  io.client.session.role = wire::ROLE_OBSERVER;
  if (options.watches_link()) apply_security(options.security, true, io);
  io.client.session.room = options.room;
  const std::vector<Finding> findings = examine(options, io, duration);
  std::cout << (options.prints_json ? boost::json::serialize(doctor_json(findings)) + "\n" : doctor_text(findings));
  return doctor_exit_code(findings);
}

}  // namespace
}  // namespace tandem::client

int main(int argc, char** argv) {
  tandem::client::DoctorOptions options;
  CLI::App app("Reports the devices, rights, clocks and links of this machine for a haptic session.", "tandem-doctor");
  tandem::client::declare(app, options);
  try {
    app.parse(argc, argv);
    return tandem::client::run(options);
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const std::exception& error) {
    std::cerr << "tandem-doctor: " << error.what() << "; see --help" << std::endl;
    return tandem::client::kSetupError;
  }
}
