// `tandem-lab check`: checks whether a coupling is stable and passive on a device. If it is not, the command proposes
// values that are.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/haptics/coupling/adaptive.hpp"
#include "common/haptics/coupling/laws.hpp"
#include "common/haptics/coupling/stability.hpp"
#include "devices/device_check.hpp"
#include "lab/cli/commands.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr std::string_view kAdaptiveLaw = "adaptive";
// Limits of the options, chosen far beyond any tool and device. Values outside them are typing errors.
constexpr double kMinMass = 1e-6;
constexpr double kMinInertia = 1e-12;
constexpr double kMaxMass = 1e4;
constexpr double kMaxDamping = 1e4;
constexpr double kMaxStiffness_n_per_m = 1e6;

struct CheckOptions {
  std::string law{haptics::kDefaultCouplingLaw};
  haptics::CouplingParameters coupling;
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
  std::string out;
  bool prints_json = false;
  /// options that the user may not set together with the adaptive law, because its table determines their values
  std::vector<const CLI::Option*> chosen_by_fit;
  /// options that the adaptive law determines only if its fit includes rotation
  std::vector<const CLI::Option*> turning_chosen_by_fit;
};

struct CheckRun {
  haptics::CouplingParameters coupling;       ///< the checked coupling
  std::optional<devices::LoopCoupling> loop;  ///< empty if the law has no feedback loop whose stability can be checked
  haptics::LoopDevice device;
  std::string fit_source;  ///< origin of the adaptive law's table; empty for other laws
  std::vector<haptics::CheckedLoop> loops;
  std::vector<haptics::StabilityFinding> findings;
  bool is_refused = false;
};

haptics::LoopDevice device_of(const CheckOptions& options, devices::DeviceProfile profile) {
  profile.rate_hz = options.rate_hz.value_or(profile.rate_hz);
  haptics::LoopDevice device = devices::loop_device(profile);
  device.mass_kg = options.device_mass_kg.value_or(device.mass_kg);
  device.damping_n_s_per_m = options.device_damping_n_s_per_m.value_or(device.damping_n_s_per_m);
  device.inertia_kg_m2 = options.device_inertia_kg_m2.value_or(device.inertia_kg_m2);
  device.damping_n_m_s_per_rad = options.device_damping_n_m_s_per_rad.value_or(device.damping_n_m_s_per_rad);
  device.is_verified |= options.device_mass_kg && options.device_damping_n_s_per_m;
  device.is_rotation_verified |= options.device_inertia_kg_m2 && options.device_damping_n_m_s_per_rad;
  device.velocity_window = options.velocity_window.value_or(device.velocity_window);
  device.rotational_velocity_window = options.velocity_window.value_or(device.rotational_velocity_window);
  device.delay_periods = options.delay_periods;
  return device;
}

/// Throws std::invalid_argument if the user set one of `options`, because the adaptive law would override its value.
void refuse_given(const std::vector<const CLI::Option*>& options) {
  for (const CLI::Option* const option : options) {
    if (option->count() == 0) continue;
    throw std::invalid_argument(option->get_name() +
                                ": the law \"adaptive\" takes it from the device's table, by the " +
                                "tool; leave it out, or use another --law");
  }
}

/// Sets the parameters of the adaptive law from a table, according to the mass of the tool.
void adapt(CheckRun& check, const CheckOptions& options, const devices::DeviceProfile& profile) {
  const haptics::AdaptiveFit fit = profile.adaptive.value_or(haptics::thesis_adaptive_fit());
  refuse_given(options.chosen_by_fit);
  if (fit.inertia_high_kg_m2 > 0) refuse_given(options.turning_chosen_by_fit);
  check.coupling = haptics::adapted(fit, options.tool_mass_kg, options.tool_inertia_kg_m2, options.coupling);
  check.fit_source = profile.adaptive ? profile.adaptive_source : "Hou, PhD thesis, NTU, 2014: the profile has no fit";
}

CheckRun check_of(const CheckOptions& options) {
  const haptics::CouplingLawInfo* law = haptics::find_coupling_law(options.law);
  if (law == nullptr) {
    throw std::invalid_argument("--law: \"" + options.law +
                                "\" is not known; use one of: " + haptics::listed_coupling_law_names());
  }
  const devices::DeviceProfile profile = devices::find_device_profile(options.device);
  CheckRun check;
  check.coupling = options.coupling;
  if (law->name == kAdaptiveLaw) adapt(check, options, profile);
  const devices::LoopCoupling loop =
      devices::loop_coupling(*law, check.coupling, options.tool_mass_kg, options.tool_inertia_kg_m2);
  const haptics::LoopDevice device = device_of(options, profile);
  if (loop.slope_factor > 0) {
    check.loop = loop;
    check.device = device;
    check.loops =
        haptics::checked_loops(loop.parameters, loop.tool_mass_kg, loop.tool_inertia_kg_m2, device, loop.slope_factor);
    check.findings =
        haptics::check_coupling(loop.parameters, loop.tool_mass_kg, loop.tool_inertia_kg_m2, device, loop.slope_factor);
  }
  if (const auto active = devices::find_active_law(*law)) check.findings.push_back(*active);
  for (const haptics::StabilityFinding& finding : check.findings) {
    check.is_refused = check.is_refused || finding.verdict == haptics::StabilityVerdict::kUnstable;
  }
  return check;
}

json::value finite_or_null(double value) {
  return std::isfinite(value) ? json::value(value) : json::value();
}

json::object to_json(const CheckOptions& options, const CheckRun& check) {
  json::array loops, findings;
  for (const haptics::CheckedLoop& loop : check.loops) {
    loops.emplace_back(json::object{{"motion", loop.is_rotation ? "rotation" : "translation"},
                                    {"hand", loop.hand},
                                    {"is_touching", loop.is_touching},
                                    {"spectral_radius", finite_or_null(loop.spectral_radius)}});
  }
  for (const haptics::StabilityFinding& finding : check.findings) {
    findings.emplace_back(json::object{{"is_unstable", finding.verdict == haptics::StabilityVerdict::kUnstable},
                                       {"parameter", finding.parameter},
                                       {"value", finite_or_null(finding.value)},
                                       {"remedy", finite_or_null(finding.remedy)},
                                       {"remedy_damping", finite_or_null(finding.remedy_damping)},
                                       {"spectral_radius", finite_or_null(finding.spectral_radius)},
                                       {"text", finding.text}});
  }
  const haptics::CouplingParameters& c = check.coupling;
  return {{"law", options.law},
          {"device", options.device},
          {"coupling",
           {{"stiffness_n_per_m", c.stiffness_n_per_m},
            {"damping_n_s_per_m", c.damping_n_s_per_m},
            {"stiffness_n_m_per_rad", c.stiffness_n_m_per_rad},
            {"damping_n_m_s_per_rad", c.damping_n_m_s_per_rad},
            {"fit", check.fit_source.empty() ? json::value() : json::value(check.fit_source)}}},
          {"is_refused", check.is_refused},
          {"loops", std::move(loops)},
          {"findings", std::move(findings)}};
}

/// Returns the result of the check in one sentence.
std::string verdict_of(const CheckRun& check) {
  if (check.is_refused) return "refused: the coupling is unstable in some hand";
  if (check.loops.empty()) return "not checked: this law has no loop whose stability can be computed";
  const double largest = std::ranges::max(check.loops, {}, &haptics::CheckedLoop::spectral_radius).spectral_radius;
  const std::string stable =
      "stable in all hands, largest spectral radius " + format_fixed(largest, 6) + " (stable: below 1)";
  return check.findings.empty() ? "passed: passive, and " + stable : "passed with warnings: not passive, but " + stable;
}

void print_adapted(const CheckRun& check, const CheckOptions& options) {
  const haptics::CouplingParameters& c = check.coupling;
  std::printf("%g kg: %.6g N/m, %.6g N·s/m; %g kg·m²: %.6g N·m/rad, %.6g N·m·s/rad (%s)\n", options.tool_mass_kg,
              c.stiffness_n_per_m, c.damping_n_s_per_m, options.tool_inertia_kg_m2, c.stiffness_n_m_per_rad,
              c.damping_n_m_s_per_rad, check.fit_source.c_str());
}

void print(const CheckRun& check, const CheckOptions& options) {
  if (!check.fit_source.empty()) print_adapted(check, options);
  std::printf("%-12s %-12s %-12s %15s\n", "motion", "hand", "tool", "spectral radius");
  for (const haptics::CheckedLoop& loop : check.loops) {
    std::printf("%-12s %-12s %-12s %15.6f%s\n", loop.is_rotation ? "rotation" : "translation",
                std::string(loop.hand).c_str(), loop.is_touching ? "in contact" : "in the air", loop.spectral_radius,
                loop.spectral_radius < 1 ? "" : "  unstable");
  }
  for (const haptics::StabilityFinding& finding : check.findings) {
    std::printf("%s: %s\n", finding.verdict == haptics::StabilityVerdict::kUnstable ? "refused" : "warning",
                finding.text.c_str());
  }
  std::printf("%s\n", verdict_of(check).c_str());
}

/// Returns the largest stiffness at which the control loop of translation is stable in every checked hand with this
/// damping [N/m]. It is at most kMaxStiffness_n_per_m. It is NaN if the loop is unstable even at 1 N/m.
double largest_stable_n_per_m(const CheckRun& check, double damping_n_s_per_m) {
  haptics::CouplingParameters parameters = check.loop->parameters;
  parameters.damping_n_s_per_m = damping_n_s_per_m;
  const auto is_stable = [&](double stiffness_n_per_m) {
    parameters.stiffness_n_per_m = stiffness_n_per_m;
    const auto loops = haptics::checked_loops(parameters, check.loop->tool_mass_kg, check.loop->tool_inertia_kg_m2,
                                              check.device, check.loop->slope_factor);
    return std::ranges::all_of(
        loops, [](const haptics::CheckedLoop& loop) { return loop.is_rotation || loop.spectral_radius < 1; });
  };
  double low = 1, high = kMaxStiffness_n_per_m;
  if (!is_stable(low)) return std::numeric_limits<double>::quiet_NaN();
  if (is_stable(high)) return high;
  for (int i = 0; i < 24; ++i) {
    const double middle = std::sqrt(low * high);
    (is_stable(middle) ? low : high) = middle;
  }
  return low;
}

Plot stability_figure(const CheckRun& check) {
  constexpr int kPoints = 24;
  const haptics::CouplingParameters& coupling = check.loop->parameters;
  Plot figure;
  figure.caption =
      "Largest stiffness at which translation is stable in all hands. Below the line the coupling is stable. At most "
      "1e6 N/m is tried; a gap: no stiffness from 1 N/m is stable.";
  figure.description = figure.caption;
  figure.x = {"damping", "N·s/m"};
  figure.y = {.quantity = "stiffness", .unit = "N/m", .is_log = true};
  Series limit{"largest stable stiffness", {}, {}, 0, Draw::kLine};
  for (int i = 0; i <= kPoints; ++i) {
    limit.x.push_back(std::max(3 * coupling.damping_n_s_per_m, 10.0) * i / kPoints);
    limit.y.push_back(largest_stable_n_per_m(check, limit.x.back()));
  }
  figure.series = {std::move(limit),
                   {"this coupling", {coupling.damping_n_s_per_m}, {coupling.stiffness_n_per_m}, 1, Draw::kMarkers}};
  return figure;
}

Table loops_table(const CheckRun& check) {
  Table table{"Checked loops",
              {{.header = "Motion", .is_text = true},
               {.header = "Hand", .is_text = true},
               {.header = "Tool", .is_text = true},
               {"Spectral radius", "1"}},
              {}};
  for (const haptics::CheckedLoop& loop : check.loops) {
    table.rows.push_back({loop.is_rotation ? "rotation" : "translation", std::string(loop.hand),
                          loop.is_touching ? "in contact" : "in the air", format_fixed(loop.spectral_radius, 6)});
  }
  return table;
}

HtmlReport report_of(const CheckOptions& options, const CheckRun& check) {
  HtmlReport page("Check of a coupling", options.law + " on " + options.device);
  page.question("Is this coupling stable and passive on this device, in every assumed hand?");
  page.answer(verdict_of(check));
  for (const haptics::StabilityFinding& finding : check.findings) page.paragraph(finding.text);
  if (check.loop) page.figure(stability_figure(check));
  page.appendix();
  page.table(loops_table(check));
  return page;
}

/// Adds an option for a number from `low` to `high`. The error message states both limits.
template <class T>
CLI::Option* add_number(CLI::App& command, const std::string& name, T& value, double low, double high,
                        const std::string& help) {
  const auto problem = [low, high](const std::string& text) {
    double number = 0;
    // A NaN fails both comparisons and is therefore refused.
    if (CLI::detail::lexical_cast(text, number) && number >= low && number <= high) return std::string();
    return "'" + text + "' must be a number from " + format_significant(low, 3) + " to " + format_significant(high, 3);
  };
  return command.add_option(name, value, help)->check(problem);
}

/// Adds an option for a coefficient of the coupling. The option permits the same range of values as the corresponding
/// field of a scene file.
CLI::Option* add_coefficient(CLI::App& command, const std::string& name, CheckOptions& options,
                             double haptics::CouplingParameters::*value, const std::string& help) {
  const auto* const field = std::ranges::find(proto::kCouplingFields, value, &proto::CouplingField::value);
  return add_number(command, name, options.coupling.*value, field->low, field->high, help)->capture_default_str();
}

void add_pair_options(CLI::App& command, CheckOptions& options) {
  using C = haptics::CouplingParameters;
  for (CLI::Option* const option :
       {add_coefficient(command, "--stiffness", options, &C::stiffness_n_per_m, "of the coupling, N/m"),
        add_coefficient(command, "--damping", options, &C::damping_n_s_per_m, "of the coupling, N·s/m")}) {
    options.chosen_by_fit.push_back(option);
  }
  for (CLI::Option* const option :
       {add_coefficient(command, "--stiffness-rotation", options, &C::stiffness_n_m_per_rad, "N·m/rad"),
        add_coefficient(command, "--damping-rotation", options, &C::damping_n_m_s_per_rad, "N·m·s/rad")}) {
    options.turning_chosen_by_fit.push_back(option);
  }
}

void add_device_options(CLI::App& command, CheckOptions& options) {
  command.add_option("--profile,--device", options.device, "device profile, by name or a .json file")
      ->capture_default_str();
  add_number(command, "--device-mass", options.device_mass_kg, 0, kMaxMass, "kg; instead of the profile's");
  add_number(command, "--device-damping", options.device_damping_n_s_per_m, 0, kMaxDamping,
             "N·s/m of the mechanism; alike");
  add_number(command, "--device-inertia", options.device_inertia_kg_m2, 0, kMaxMass, "kg·m²; alike");
  add_number(command, "--device-damping-rotation", options.device_damping_n_m_s_per_rad, 0, kMaxDamping,
             "N·m·s/rad; alike");
  add_number(command, "--rate", options.rate_hz, 1, 1e6, "Hz; alike");
}

void add_options(CLI::App& command, CheckOptions& options) {
  command.add_option("--law", options.law, "coupling law: " + haptics::listed_coupling_law_names())
      ->capture_default_str();
  add_pair_options(command, options);
  add_coefficient(command, "--sharpness", options, &haptics::CouplingParameters::curve_sharpness,
                  "c of the stable dynamic curve");
  add_number(command, "--tool-mass", options.tool_mass_kg, kMinMass, kMaxMass, "kg")->capture_default_str();
  add_number(command, "--tool-inertia", options.tool_inertia_kg_m2, kMinInertia, kMaxMass, "kg·m²")
      ->capture_default_str();
  add_device_options(command, options);
  command.add_option("--velocity-window", options.velocity_window, "periods that the handle's velocity is taken over")
      ->check(CLI::Range(1, 64));
  command.add_option("--delay", options.delay_periods, "periods from sample to force")
      ->capture_default_str()
      ->check(CLI::Range(0, 64));
  command.add_option("--out", options.out, "folder for check.json and report.html");
  command.add_flag("--json", options.prints_json, "print one JSON object");
}

}  // namespace

void add_check_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand("check", "Whether a coupling is stable and passive on a device");
  add_options(*command, *options);
  command->footer("Exit code: 0 stable, 1 refused: unstable in some hand, 2 bad input.");
  command->callback([options, &exit_code] {
    const CheckRun check = check_of(*options);
    const std::string results = pretty_json(to_json(*options, check));
    if (!options->out.empty())
      write_all_files(options->out, with_report({{"check.json", results}}, report_of(*options, check)));
    if (options->prints_json) {
      std::cout << results;
    } else {
      print(check, *options);
    }
    exit_code = check.is_refused ? 1 : 0;
  });
}

}  // namespace tandem::lab
