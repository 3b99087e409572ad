#include "lab/studies/contact/contact_bench.hpp"

#include <algorithm>
#include <sstream>
#include <string>

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

std::string times_line(const std::string& name, const TimeQuantiles& times) {
  return "  " + name + format_significant(times.p50_us, 3) + " / " + format_significant(times.p99_us, 3) + " / " +
         format_significant(times.p999_us, 3) + " / " + format_significant(times.max_us, 3) + " µs\n";
}

std::string figures_text(const TouchFigures& figures) {
  return "  steps                 " + std::to_string(figures.steps) + "\n  contacts at most      " +
         std::to_string(figures.contacts_max) + "\n" + times_line("query                 ", figures.query_us) +
         times_line("step                  ", figures.step_us) +
         times_line("step, first run alone ", figures.step_once_us) + "  penetration           " +
         format_significant(1e3 * figures.max_penetration_m, 3) + " mm\n  pop-throughs          " +
         std::to_string(figures.pop_throughs) + "\n";
}

}  // namespace

ContactBench describe(const TouchObject& a, const TouchObject& b) {
  const bool is_one = &a == &b;
  ContactBench bench;
  bench.a = a.name;
  bench.b = b.name;
  bench.triangles_a = a.mesh.mesh.triangles.size();
  bench.triangles_b = b.mesh.mesh.triangles.size();
  bench.points = a.points() + b.points();
  bench.spacing_m = std::max(a.spacing_m(), b.spacing_m());
  bench.cell_m = std::max(a.cell_m(), b.cell_m());
  bench.build_s = a.build_s + (is_one ? 0 : b.build_s);
  bench.cache_load_s = a.cache_load_s + (is_one ? 0 : b.cache_load_s);
  bench.memory_bytes = a.shape->memory_bytes() + (is_one ? 0 : b.shape->memory_bytes());
  return bench;
}

boost::json::object to_json(const TouchFigures& figures) {
  return {{"steps", figures.steps},
          {"contacts_max", figures.contacts_max},
          {"query_us", to_json(figures.query_us)},
          {"step_us", to_json(figures.step_us)},
          {"max_penetration_m", figures.max_penetration_m},
          {"pop_throughs", figures.pop_throughs}};
}

boost::json::object to_json(const ContactBench& bench) {
  boost::json::object result{{"a", bench.a},
                             {"b", bench.b},
                             {"triangles_a", bench.triangles_a},
                             {"triangles_b", bench.triangles_b},
                             {"points", bench.points},
                             {"spacing_m", bench.spacing_m},
                             {"cell_m", bench.cell_m}};
  for (const auto& [key, value] : to_json(bench.ours)) result[key] = value;
  result["looks"] = boost::json::object{{"p50", bench.ours.queries_p50}, {"p99", bench.ours.queries_p99}};
  result["hand_force_step_max_n"] = bench.ours.hand_force_step_max_n;
  result["hand_torque_step_max_n_m"] = bench.ours.hand_torque_step_max_n_m;
  result["contact_created_j"] = bench.ours.contact_created_j;
  result["not_converged"] = bench.ours.not_converged;
  result["build_s"] = bench.build_s;
  result["cache_load_s"] = bench.cache_load_s;
  result["memory_bytes"] = bench.memory_bytes;
  if (bench.gimpact) result["gimpact"] = to_json(*bench.gimpact);
  result["machine"] = boost::json::object{{"field_sample_ns", bench.field_sample_ns},
                                          {"copy_256_kib_us", to_json(bench.memory_copy_us)}};
  return result;
}

std::string to_text(const ContactBench& bench) {
  std::ostringstream text;
  text << bench.a << " (" << bench.triangles_a << " triangles) on " << bench.b << " (" << bench.triangles_b
       << " triangles)\n"
       << "  points                " << bench.points << ", at most " << format_significant(1e3 * bench.spacing_m, 3)
       << " mm apart; cells of " << format_significant(1e3 * bench.cell_m, 3) << " mm\n"
       << "  built in              " << format_significant(bench.build_s, 3) << " s, from the cache in "
       << format_significant(bench.cache_load_s, 3) << " s; "
       << format_significant(static_cast<double>(bench.memory_bytes) / (1U << 20U), 3) << " MiB\n\n"
       << "ours                    p50 / p99 / p99.9 / max\n"
       << figures_text(bench.ours) << "  hand's force          moves by "
       << format_significant(bench.ours.hand_force_step_max_n, 3) << " N and "
       << format_significant(1e3 * bench.ours.hand_torque_step_max_n_m, 3)
       << " mN m a step at most\n  distance queries      " << bench.ours.queries_p50 << " a step, p99 "
       << bench.ours.queries_p99 << '\n';
  if (bench.gimpact) text << "\nBullet's GImpact        p50 / p99 / p99.9 / max\n" << figures_text(*bench.gimpact);
  text << "\nthis machine            p50 / p99 / p99.9 / max\n"
       << times_line("copy of 256 KiB       ", bench.memory_copy_us) << "  one field sample      "
       << format_significant(bench.field_sample_ns, 3) << " ns\n";
  return text.str();
}

TouchPlan bench_plan(const TouchSettings& settings) {
  TouchPlan plan;
  // The target lies beyond the depth at which the coupling reaches its force limit. The tool is thus pressed with that
  // limit.
  plan.press_m = 1.2 * settings.coupling.force_limit_n / settings.coupling.stiffness_n_per_m;
  return plan;
}

}  // namespace tandem::lab
