#include "lab/studies/contact/reproduce_touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/folders.hpp"
#include "lab/report/format.hpp"
#include "lab/studies/contact/contact_bench.hpp"
#include "lab/studies/contact/mesh_source.hpp"
#include "lab/studies/conventions.hpp"

namespace tandem::lab {
namespace {

constexpr const char* kBunny = "/usr/share/glmark2/models/bunny.obj";
constexpr Duration kPeerStretch = std::chrono::seconds(3);

std::vector<Band> bands_of(const TouchTrace& trace, const std::vector<std::string>& phases) {
  std::vector<Band> bands;
  int phase = -1;
  for (const TouchStep& step : trace) {
    const double now_s = to_seconds(step.at);
    if (!bands.empty()) bands.back().end = now_s;
    if (step.phase != phase) bands.push_back({now_s, now_s, phases[static_cast<std::size_t>(step.phase)]});
    phase = step.phase;
  }
  return bands;
}

Plot figure_of(const std::vector<NamedTrace>& runs, const std::vector<std::string>& phases, const PlotAxis& axis,
               const std::string& caption, const std::function<double(const TouchStep&)>& of) {
  Plot figure;
  figure.caption = caption;
  figure.description = caption;
  figure.x = {.quantity = "time", .unit = "s"};
  figure.y = axis;
  figure.y.low = 0;
  figure.bands = bands_of(runs.front().trace, phases);
  int color = 0;
  for (const NamedTrace& run : runs) {
    Series series{runs.size() > 1 ? run.name : "", {}, {}, color++};
    for (const TouchStep& step : run.trace) {
      series.x.push_back(to_seconds(step.at));
      series.y.push_back(of(step));
    }
    figure.series.push_back(std::move(series));
  }
  return figure;
}

double greatest_force_n(const TouchTrace& trace) {
  double force = 0;
  for (const TouchStep& step : trace) force = std::max(force, step.on_hand_W.f.norm());
  return force;
}

/// Returns the amplitude of sustained vibration of the force. It is computed in three steps:
/// 1. The deviation of the force from its mean over the surrounding 20 ms gives an RMS for each interval of 100 ms.
/// 2. Of three consecutive RMS values, the smallest is taken, because an impact ends within one of the intervals.
/// 3. The result is the largest of these minima over the whole trace.
///
/// Voluntary motion changes the force at frequencies below 10 Hz. The deviation contains frequencies above about 25 Hz,
/// at which users perceive buzz.
double buzz_n(const TouchTrace& trace) {
  constexpr std::size_t kMean = 10, kWindow = 100;
  std::vector<double> sums{0};  // cumulative squared deviations up to each step
  for (std::size_t i = kMean; i + kMean < trace.size(); ++i) {
    Vec3 mean = Vec3::Zero();
    for (std::size_t k = i - kMean; k <= i + kMean; ++k) mean += trace[k].on_hand_W.f;
    sums.push_back(sums.back() + (trace[i].on_hand_W.f - mean / (2 * kMean + 1)).squaredNorm());
  }
  double largest = 0;
  for (std::size_t i = 0; i + 3 * kWindow < sums.size(); ++i) {
    const auto of_window = [&](std::size_t n) { return sums[i + (n + 1) * kWindow] - sums[i + n * kWindow]; };
    largest = std::max(largest, std::min({of_window(0), of_window(1), of_window(2)}));
  }
  return std::sqrt(largest / kWindow);
}

std::string microseconds(const TimeQuantiles& times) {
  return format_significant(times.p50_us, 3) + " µs, p99 " + format_significant(times.p99_us, 3) + " µs";
}

std::vector<Check> bunny_claims(const ContactBench& bench) {
  const std::string scope = "bunny on bunny";
  const TouchFigures& ours = bench.ours;
  return {{scope, "step p50", ours.step_us.p50_us, Relation::kAtMost, 60, "µs", 1},
          {scope, "step p99", ours.step_us.p99_us, Relation::kAtMost, 250, "µs", 1},
          {scope, "penetration at 5 N", 1e3 * ours.max_penetration_m, Relation::kAtMost, 0.5, "mm", 3},
          {scope, "pop-throughs", static_cast<double>(ours.pop_throughs), Relation::kAtMost, 0, "", 0},
          {scope, "force jump of the reduced contacts", ours.force_jump_max_n, Relation::kAtMost, 0.05, "N", 4},
          {scope, "steps that did not converge", static_cast<double>(ours.not_converged), Relation::kAtMost, 0, "", 0},
          {scope, "building the asset", bench.build_s, Relation::kAtMost, 10, "s", 2},
          {scope, "from the cache", bench.cache_load_s, Relation::kAtMost, 0.3, "s", 3}};
}

struct PegRun {
  double mass_kg = 0;
  double force_n = 0;
  double buzz_n = 0;
  double deepest_z_m = 0;  ///< lowest height that the tip reached
  TouchFigures figures;
};

PegRun peg_run(const TouchObject& peg, const TouchObject& box, const std::vector<TouchTrace>& runs, double mass_kg) {
  const TouchTrace& trace = runs.front();
  PegRun run;
  run.mass_kg = mass_kg;
  run.force_n = greatest_force_n(trace);
  run.buzz_n = buzz_n(trace);
  run.figures = figures_of(runs, *peg.exact, *box.exact);
  const Vec3 tip(0, 0, peg.shape->low_S.z());
  for (const TouchStep& step : trace) run.deepest_z_m = std::min(run.deepest_z_m, (step.X_WT * tip).z());
  return run;
}

std::vector<Check> peg_claims(const PegRun& run, double force_limit_n, double top_z_m) {
  const std::string scope = format_significant(run.mass_kg, 3) + " kg";
  return {
      {scope, "largest force", run.force_n, Relation::kAtMost, force_limit_n * (1 + 1e-9), "N", 2},
      {scope, "largest force, laid down and pressed", run.force_n, Relation::kAtLeast, 0.99 * force_limit_n, "N", 2},
      {scope, "buzz above 25 Hz", run.buzz_n, Relation::kAtMost, 0.05, "N", 4},
      {scope, "tip below the top of the hole", 1e3 * (top_z_m - run.deepest_z_m), Relation::kAtLeast, 30, "mm", 1},
      {scope, "penetration", 1e3 * run.figures.max_penetration_m, Relation::kAtMost, 0.5, "mm", 3},
      {scope, "pop-throughs", static_cast<double>(run.figures.pop_throughs), Relation::kAtMost, 0, "", 0},
      {scope, "step p99, of the 1 ms of a haptic loop", run.figures.step_us.p99_us, Relation::kAtMost, 1000, "µs", 0}};
}

ReproductionRow peg_row(const PegRun& run) {
  const bool is_chapter_4 = run.mass_kg < 0.03;
  return {
      format_significant(run.mass_kg, 3) + " kg",
      is_chapter_4 ? "saturates at 4 N, no buzz with the stable law, buzz with QSA" : "stable, no obvious vibration",
      "at most " + format_significant(run.force_n, 3) + " N, buzz " + format_significant(run.buzz_n, 2) + " N, " +
          microseconds(run.figures.step_us) + ", " + std::to_string(run.figures.contacts_max) + " contacts"};
}

}  // namespace

std::vector<Plot> touch_figures(const std::vector<NamedTrace>& runs, const std::vector<std::string>& phases) {
  return {figure_of(runs, phases, {"force on the hand", "N"}, "Magnitude of the coupling's force on the hand.",
                    [](const TouchStep& step) { return step.on_hand_W.f.norm(); }),
          figure_of(runs, phases, {"time of a step", "µs"}, "Search for contacts and their solution, on one core.",
                    [](const TouchStep& step) { return 1e6 * to_seconds(step.step); }),
          figure_of(runs, phases, {"contacts"}, "Points that press. There is no limit on their number.",
                    [](const TouchStep& step) { return static_cast<double>(step.contacts); }),
          figure_of(runs, phases, {"torque on the hand", "mN·m"}, "Magnitude of the coupling's torque on the hand.",
                    [](const TouchStep& step) { return 1e3 * step.on_hand_W.t.norm(); })};
}

std::filesystem::path bunny_file() {
  return kBunny;
}

Reproduction reproduce_bunny(const Clock& clock) {
  const TouchObject bunny = make_touch_object("bunny", mesh_from(kBunny, "the bunny"), clock);
  const TouchSettings settings;
  const devices::HandPath path = touch_path(*bunny.exact, *bunny.exact, bench_plan(settings));
  ContactBench bench = describe(bunny, bunny);
  const auto ours = in_rounds([&] { return run_touch(*bunny.shape, *bunny.shape, path, settings, clock); });
  const std::vector<NamedTrace> runs{{"ours", fastest_of(ours)}};
  bench.ours = figures_of(ours, *bunny.exact, *bunny.exact);
  const Duration press = begin_of_phase(path, "press");
  const auto peer_steps = static_cast<std::size_t>(to_seconds(kPeerStretch) / settings.step_s);
  const geometry::TriangleMesh& mesh = bunny.mesh.mesh;
  const auto peer = in_rounds([&] { return run_gimpact(mesh, mesh, path, settings, clock, press, peer_steps); });
  bench.gimpact = figures_of(peer, *bunny.exact, *bunny.exact);
  bench.field_sample_ns = field_sample_ns(*bunny.shape, clock);
  bench.memory_copy_us = memory_copy_us(clock);

  Reproduction result;
  result.title = "Stanford bunny against Stanford bunny";
  result.summary =
      "A hand brings one bunny of 10 cm and 0.1 kg to another, presses with 5 N, slides, twists and leaves. Both have "
      "all " +
      std::to_string(bench.triangles_a) +
      " triangles of the file; the thesis used 20,898 each, and a person's hand. Its times are those of its machine of "
      "2014.";
  result.rows = {
      {"triangles of each bunny", "20898", std::to_string(bench.triangles_a)},
      {"time of a frame", "2 to 10 ms (chapter 4), more than 30 ms (chapter 5)", microseconds(bench.ours.step_us)},
      {"contacts", "stopped at 150", "up to " + std::to_string(bench.ours.contacts_max) + ", no limit"},
      {"GImpact on the same path", "",
       microseconds(bench.gimpact->step_us) + ", " + std::to_string(bench.gimpact->contacts_max) + " contacts, " +
           format_significant(1e3 * bench.gimpact->max_penetration_m, 3) + " mm deep, " +
           std::to_string(bench.gimpact->pop_throughs) + " pop-throughs"},
      {"penetration", "", format_significant(1e3 * bench.ours.max_penetration_m, 3) + " mm"}};
  result.claims = bunny_claims(bench);
  result.figures = touch_figures(runs, path.phases());
  result.details = to_json(bench);
  return result;
}

Reproduction reproduce_peg(const Clock& clock) {
  constexpr double kForceLimit_n = 4;
  const TouchObject peg = make_touch_object("peg", make_peg(), clock);
  const TouchObject box = make_touch_object("box with hole", make_box_with_hole(), clock);
  const devices::HandPath path = devices::load_hand_path(data_folder() / "paths" / "peg_five_steps.json");
  Reproduction result;
  result.title = "Peg in hole in five steps";
  result.summary =
      "A peg of 180 triangles and a box with hole of 176, as in the thesis, with 0.5 mm of clearance; sizes are ours, "
      "the thesis gives none. The same hand path for every mass: slide the tip on top, lay down and slide, push the "
      "front side, insert, leave. Spring and damper with a limit of 4 N; the peg has weight.";
  std::vector<NamedTrace> runs;
  boost::json::array details;
  for (const double mass_kg : {0.02, 0.05, 0.1, 0.15, 0.2}) {
    TouchSettings settings;
    settings.mass_kg = mass_kg;
    settings.gravity_m_per_s2 = Vec3(0, 0, -kGravity_m_per_s2);
    settings.coupling.force_limit_n = kForceLimit_n;
    const auto rounds = in_rounds([&] { return run_touch(*peg.shape, *box.shape, path, settings, clock); });
    runs.push_back({format_significant(mass_kg, 3) + " kg", fastest_of(rounds)});
    const PegRun run = peg_run(peg, box, rounds, mass_kg);
    result.rows.push_back(peg_row(run));
    for (Check& claim : peg_claims(run, kForceLimit_n, box.shape->high_S.z()))
      result.claims.push_back(std::move(claim));
    boost::json::object detail = to_json(run.figures);
    detail["mass_kg"] = mass_kg;
    detail["force_max_n"] = run.force_n;
    detail["buzz_n"] = run.buzz_n;
    details.push_back(std::move(detail));
  }
  result.figures = touch_figures(runs, path.phases());
  result.details = std::move(details);
  return result;
}

}  // namespace tandem::lab
