// `tandem-lab check`: is a coupling stable and passive on a device, and what would do instead?

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/coupling/laws.hpp"
#include "common/coupling/stability.hpp"
#include "common/json/pretty.hpp"
#include "devices/device_check.hpp"
#include "lab/commands.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

struct Options {
  std::string law{kDefaultCouplingLaw};
  CouplingParameters coupling;
  double tool_mass_kg = 0.1;
  double tool_inertia_kg_m2 = 4e-5;
  std::string device = "sim";
  std::optional<double> device_mass_kg;
  std::optional<double> device_damping_n_s_per_m;
  std::optional<double> device_inertia_kg_m2;
  std::optional<double> device_damping_n_m_s_per_rad;
  std::optional<double> rate_hz;
  std::optional<int> velocity_window;
  int delay_periods = 0;
  bool wants_json = false;
};

struct Check {
  std::vector<CheckedLoop> loops;
  std::vector<StabilityFinding> findings;
  bool is_refused = false;
};

LoopDevice device_of(const Options& options) {
  LoopDevice device = loop_device(find_device_profile(options.device));
  device.mass_kg = options.device_mass_kg.value_or(device.mass_kg);
  device.damping_n_s_per_m = options.device_damping_n_s_per_m.value_or(device.damping_n_s_per_m);
  device.inertia_kg_m2 = options.device_inertia_kg_m2.value_or(device.inertia_kg_m2);
  device.damping_n_m_s_per_rad = options.device_damping_n_m_s_per_rad.value_or(device.damping_n_m_s_per_rad);
  if (options.rate_hz) device.period_s = 1 / *options.rate_hz;
  device.velocity_window = options.velocity_window.value_or(device.velocity_window);
  device.delay_periods = options.delay_periods;
  return device;
}

Check check_of(const Options& options) {
  const CouplingLawInfo* law = find_coupling_law(options.law);
  if (law == nullptr) {
    throw std::invalid_argument("--law: \"" + options.law +
                                "\" is not known; use one of: " + listed_coupling_law_names());
  }
  const double slope_factor = steepest_slope_factor(law->name, options.coupling);
  if (!(slope_factor > 0)) {
    throw std::invalid_argument("--law: \"" + options.law + "\" has no coupling to check; use another one");
  }
  const bool is_massless = law->tool == ToolDynamics::kMassless;
  const double mass_kg = is_massless ? 0 : options.tool_mass_kg;
  const double inertia_kg_m2 = is_massless ? 0 : options.tool_inertia_kg_m2;
  const LoopDevice device = device_of(options);
  Check check;
  check.loops = checked_loops(options.coupling, mass_kg, inertia_kg_m2, device, slope_factor);
  check.findings = check_coupling(options.coupling, mass_kg, inertia_kg_m2, device, slope_factor);
  for (const StabilityFinding& finding : check.findings) {
    check.is_refused = check.is_refused || finding.verdict == StabilityVerdict::kUnstable;
  }
  return check;
}

json::value finite_or_null(double value) {
  return std::isfinite(value) ? json::value(value) : json::value();
}

json::object to_json(const Options& options, const Check& check) {
  json::array loops, findings;
  for (const CheckedLoop& loop : check.loops) {
    loops.emplace_back(json::object{{"motion", loop.is_rotation ? "rotation" : "translation"},
                                    {"hand", loop.hand},
                                    {"is_touching", loop.is_touching},
                                    {"spectral_radius", finite_or_null(loop.spectral_radius)}});
  }
  for (const StabilityFinding& finding : check.findings) {
    findings.emplace_back(json::object{{"is_unstable", finding.verdict == StabilityVerdict::kUnstable},
                                       {"parameter", finding.parameter},
                                       {"value", finite_or_null(finding.value)},
                                       {"remedy", finite_or_null(finding.remedy)},
                                       {"remedy_damping", finite_or_null(finding.remedy_damping)},
                                       {"spectral_radius", finite_or_null(finding.spectral_radius)},
                                       {"text", finding.text}});
  }
  return {{"law", options.law},
          {"device", options.device},
          {"is_refused", check.is_refused},
          {"loops", std::move(loops)},
          {"findings", std::move(findings)}};
}

void print(const Check& check) {
  std::printf("%-12s %-12s %-12s %15s\n", "motion", "hand", "tool", "spectral radius");
  for (const CheckedLoop& loop : check.loops) {
    std::printf("%-12s %-12s %-12s %15.6f%s\n", loop.is_rotation ? "rotation" : "translation",
                std::string(loop.hand).c_str(), loop.is_touching ? "in contact" : "in the air", loop.spectral_radius,
                loop.spectral_radius < 1 ? "" : "  unstable");
  }
  for (const StabilityFinding& finding : check.findings) {
    std::printf("%s: %s\n", finding.verdict == StabilityVerdict::kUnstable ? "refused" : "warning",
                finding.text.c_str());
  }
  if (check.findings.empty()) std::printf("nothing to complain of\n");
}

void add_options(CLI::App& command, Options& options) {
  CouplingParameters& c = options.coupling;
  command.add_option("--law", options.law, "coupling law: " + listed_coupling_law_names())->capture_default_str();
  command.add_option("--stiffness", c.stiffness_n_per_m, "of the coupling, N/m")->capture_default_str();
  command.add_option("--damping", c.damping_n_s_per_m, "of the coupling, N·s/m")->capture_default_str();
  command.add_option("--stiffness-rotation", c.stiffness_n_m_per_rad, "N·m/rad")->capture_default_str();
  command.add_option("--damping-rotation", c.damping_n_m_s_per_rad, "N·m·s/rad")->capture_default_str();
  command.add_option("--sharpness", c.curve_sharpness, "c of the stable dynamic curve")->capture_default_str();
  command.add_option("--tool-mass", options.tool_mass_kg, "kg")->capture_default_str();
  command.add_option("--tool-inertia", options.tool_inertia_kg_m2, "kg·m²")->capture_default_str();
  command.add_option("--device", options.device, "device profile, by name or a .json file")->capture_default_str();
  command.add_option("--device-mass", options.device_mass_kg, "kg; instead of the profile's");
  command.add_option("--device-damping", options.device_damping_n_s_per_m, "N·s/m of the mechanism; alike");
  command.add_option("--device-inertia", options.device_inertia_kg_m2, "kg·m²; alike");
  command.add_option("--device-damping-rotation", options.device_damping_n_m_s_per_rad, "N·m·s/rad; alike");
  command.add_option("--rate", options.rate_hz, "Hz; alike")->check(CLI::Range(1.0, 1e6));
  command.add_option("--velocity-window", options.velocity_window, "periods that the handle's velocity is taken over")
      ->check(CLI::Range(1, 64));
  command.add_option("--delay", options.delay_periods, "periods from sample to force")
      ->capture_default_str()
      ->check(CLI::Range(0, 64));
  command.add_flag("--json", options.wants_json, "print one JSON object");
}

}  // namespace

void add_check_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("check", "Whether a coupling is stable and passive on a device");
  add_options(*command, *options);
  command->footer("Exit code: 0 stable, 1 refused: unstable in some hand, 2 bad input.");
  command->callback([options, &exit_code] {
    const Check check = check_of(*options);
    if (options->wants_json) {
      std::cout << pretty_json(to_json(*options, check));
    } else {
      print(check);
    }
    exit_code = check.is_refused ? 1 : 0;
  });
}

}  // namespace tandem::lab
