#include "lab/cli/bench/bench_commands.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "lab/studies/contact/contact_bench.hpp"
#include "lab/studies/contact/contact_scaling.hpp"
#include "lab/studies/contact/landing.hpp"
#include "lab/studies/contact/mesh_source.hpp"
#include "lab/studies/contact/pose_check.hpp"
#include "lab/studies/contact/reproduce_touch.hpp"

namespace tandem::lab {
namespace {

constexpr std::uint64_t kPoseSeed = 1;

struct ContactBenchOptions {
  std::string a;
  std::string b;
  std::string cache;
  std::string out;
  std::optional<double> scale;
  double size_mm = 100;
  double mass_kg = 0.1;
  std::array<double, 3> direction{0, 0, -1};
  std::size_t steps = 0;
  std::size_t peer_steps = 3000;
  std::size_t check = 0;
  bool is_landing = false;
  bool has_peer = true;
  bool prints_json = false;
};

void check_numbers(const ContactBenchOptions& options) {
  const auto is_positive = [](double value) { return std::isfinite(value) && value > 0; };
  if (options.scale && !is_positive(*options.scale)) {
    throw std::invalid_argument("--scale is " + std::to_string(*options.scale) +
                                "; it must be more than 0 metres per unit of the file");
  }
  if (!is_positive(options.size_mm) || options.size_mm > 10'000) {
    throw std::invalid_argument("--size-mm is " + std::to_string(options.size_mm) +
                                "; it must be more than 0 and at most 10000 mm");
  }
  if (!is_positive(options.mass_kg) || options.mass_kg > 100) {
    throw std::invalid_argument("--mass-kg is " + std::to_string(options.mass_kg) +
                                "; it must be more than 0 and at most 100 kg");
  }
}

Vec3 direction_of(const ContactBenchOptions& options) {
  const Vec3 direction(options.direction[0], options.direction[1], options.direction[2]);
  if (!is_finite(direction) || direction.norm() < 1e-6) {
    throw std::invalid_argument("--direction has no direction; give three numbers that are not all 0");
  }
  return direction;
}

TouchObject object_of(const ContactBenchOptions& options, const std::string& name, const std::string& option,
                      const Clock& clock) {
  return make_touch_object(name, mesh_from(name, option, options.size_mm / 1e3, options.scale), clock, options.cache);
}

struct Measured {
  ContactBench bench;
  std::vector<Plot> figures;
};

Measured measure_contact_bench(const ContactBenchOptions& options, const TouchObject& a, const TouchObject& b,
                               const Clock& clock) {
  TouchSettings settings;
  settings.mass_kg = options.mass_kg;
  TouchPlan plan = bench_plan(settings);
  plan.direction_W = direction_of(options);
  const devices::HandPath path = touch_path(*a.exact, *b.exact, plan);
  const std::size_t steps = options.steps > 0 ? options.steps : kWholePath;
  ContactBench bench = describe(a, b);
  const auto runs = in_rounds([&] { return run_touch(*a.shape, *b.shape, path, settings, clock, Duration{0}, steps); });
  bench.ours = figures_of(runs, *a.exact, *b.exact);
  if (options.has_peer) {
    const Duration press = begin_of_phase(path, "press");
    const std::size_t peer_steps = std::min(options.peer_steps, steps);
    const auto peer = [&] { return run_gimpact(a.mesh.mesh, b.mesh.mesh, path, settings, clock, press, peer_steps); };
    bench.gimpact = figures_of(in_rounds(peer), *a.exact, *b.exact);
  }
  bench.field_sample_ns = field_sample_ns(*b.shape, clock);
  bench.memory_copy_us = memory_copy_us(clock);
  return {std::move(bench), touch_figures({{"", fastest_of(runs)}}, path.phases())};
}

std::vector<Check> checks_of(const PoseCheck& check) {
  const std::string scope = std::to_string(check.poses) + " poses";
  return {{scope, "poses with a missed contact deeper than 0.2 mm", static_cast<double>(check.missed_poses),
           Relation::kAtMost, 0, "", 0},
          {scope, "largest error of the deepest penetration", 1e3 * check.deepest_error_max_m, Relation::kAtMost,
           1e3 * kDeepestErrorBound_m, "mm", 3}};
}

boost::json::object to_json(const PoseCheck& check) {
  return {{"poses", check.poses},
          {"exact_points", check.exact_points},
          {"missed_deeper_than_0p2mm", check.missed_poses},
          {"deepest_error_max_m", check.deepest_error_max_m},
          {"worst_pose", check.worst_pose},
          {"deepest_max_m", check.deepest_max_m},
          {"checks", to_json(checks_of(check))}};
}

std::string words_of(const TouchFigures& figures) {
  return "a step takes " + format_significant(figures.step_us.p50_us, 3) + " µs (median; p99 " +
         format_significant(figures.step_us.p99_us, 3) + " µs) with up to " + std::to_string(figures.contacts_max) +
         " contacts; the greatest penetration is " + format_significant(1e3 * figures.max_penetration_m, 3) +
         " mm; pop-throughs: " + std::to_string(figures.pop_throughs) + ". ";
}

HtmlReport report_of(const Measured& measured, const std::vector<Check>& checks) {
  const ContactBench& bench = measured.bench;
  HtmlReport page("Contact of two meshes", bench.a + " on " + bench.b);
  page.question("How long does a step of this contact take, and how deep do the meshes go into each other?");
  page.answer("Here " + words_of(bench.ours) + (bench.gimpact ? "With GImpact " + words_of(*bench.gimpact) : ""));
  if (!checks.empty()) page.verdict(checks);
  for (std::size_t i = 0; i + 1 < measured.figures.size(); ++i) page.figure(measured.figures[i]);
  page.appendix();
  page.figure(measured.figures.back());
  page.footer("Times are of this machine: the fastest of " + std::to_string(kRounds) + " equal runs.");
  return page;
}

/// Runs the landing and drop tests, with option --landing. Without it the command runs a touch along a path.
int run_landings(const ContactBenchOptions& options, const TouchObject& a, const TouchObject& b, const Clock& clock) {
  std::vector<Landing> all = landings(a, b, direction_of(options), options.mass_kg, clock);
  for (Landing& drop : drops(a, options.mass_kg, clock)) all.push_back(std::move(drop));
  const std::vector<Check> checks = landing_checks(all);
  if (options.prints_json) {
    std::cout << pretty_json(boost::json::object{{"a", a.name}, {"b", b.name}, {"landing", to_json(all)}});
  } else {
    std::cout << a.name << " on " << b.name << "\n\n" << to_text(all) << '\n';
    print_checks(std::cout, checks);
  }
  return all_hold(checks) ? 0 : 1;
}

int run_contact_bench(const ContactBenchOptions& options) {
  check_numbers(options);
  const SteadyClock clock;
  const TouchObject a = object_of(options, options.a, "--a", clock);
  std::optional<TouchObject> other;
  if (options.b != options.a) other = object_of(options, options.b, "--b", clock);
  const TouchObject& b = other ? *other : a;
  if (options.is_landing) return run_landings(options, a, b, clock);
  if (!options.out.empty()) check_folder_can_be_made(options.out);
  const Measured measured = measure_contact_bench(options, a, b, clock);
  boost::json::object json = to_json(measured.bench);
  std::vector<Check> checks;
  if (options.check > 0) {
    const PoseCheck check = check_poses(a, b, options.check, kPoseSeed);
    json["check"] = to_json(check);
    checks = checks_of(check);
  }
  const std::string results = pretty_json(json);
  if (!options.out.empty())
    write_all_files(options.out, with_report({{"contact.json", results}}, report_of(measured, checks)));
  std::cout << (options.prints_json ? results : to_text(measured.bench));
  if (!options.prints_json && !checks.empty()) print_checks(std::cout << '\n', checks);
  return all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_contact_bench(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<ContactBenchOptions>();
  CLI::App* contact = bench.add_subcommand("contact", "One mesh touching another, against Bullet's GImpact");
  contact->add_option("--a", options->a, "the tool: a mesh file, or peg, box_with_hole, sphere, cube")->required();
  contact->add_option("--b", options->b, "the touched object, likewise")->required();
  contact->add_option("--scale", options->scale, "metres per unit of the files, instead of --size-mm");
  contact->add_option("--size-mm", options->size_mm, "longest edge of the bounding box of meshes from files [mm]")
      ->capture_default_str();
  contact->add_option("--mass-kg", options->mass_kg, "of the tool [kg]")->capture_default_str();
  contact->add_option("--direction", options->direction, "in which the tool approaches: x,y,z")
      ->delimiter(',')
      ->capture_default_str();
  contact->add_option("--steps", options->steps, "of 1 ms; 0: the whole path")->capture_default_str();
  contact->add_option("--peer-steps", options->peer_steps, "of GImpact, from where the tool begins to press")
      ->capture_default_str();
  CLI::Option* check = contact->add_option("--check", options->check, "poses to compare with an exhaustive search");
  check->capture_default_str();
  contact
      ->add_flag("--landing", options->is_landing,
                 "in place of the path: the hand lands the tool at three speeds and two stiffnesses, and the tool is "
                 "dropped on each of its six sides")
      ->excludes(check);
  contact->add_option("--cache", options->cache, "folder that keeps shapes built from meshes for the next run");
  contact->add_option("--out", options->out, "folder for contact.json and report.html; not with --landing")
      ->excludes("--landing");
  contact->add_flag("!--no-peer", options->has_peer, "leave GImpact out");
  contact->add_flag("--json", options->prints_json, "print JSON instead of a table");
  contact->footer("Exit code: 0 done, 1 a bound of --check or --landing does not hold, 2 bad input or set-up.");
  contact->callback([options, &exit_code] { exit_code = run_contact_bench(*options); });
}

}  // namespace tandem::lab
