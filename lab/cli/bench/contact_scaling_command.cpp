// `tandem-lab bench contact-scaling`: measures the duration of one contact, computed with four resolutions of a mesh.

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "common/base/json_pretty.hpp"
#include "lab/cli/bench/bench_commands.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "lab/studies/contact/contact_bench.hpp"
#include "lab/studies/contact/contact_scaling.hpp"
#include "lab/studies/contact/mesh_generators.hpp"
#include "lab/studies/contact/mesh_source.hpp"

namespace tandem::lab {
namespace {

/// Height of the waves that subdivision adds to the surface. It makes finer meshes non-flat, but is too small to change
/// the contact.
constexpr double kSubdivisionHeight_m = 5e-6;

struct ContactScalingOptions {
  std::string mesh;
  std::string out;
};

ScalingRow row_of(const TouchObject& object) {
  ScalingRow row;
  row.triangles = object.mesh.mesh.triangles.size();
  row.points = object.points();
  row.spacing_m = object.spacing_m();
  row.cell_m = object.cell_m();
  row.build_s = object.build_s;
  return row;
}

/// Returns objects with 1, 4, 9 and 16 times the number of triangles of `mesh`.
std::vector<TouchObject> resolutions_of(const std::string& name, const geometry::TriangleMesh& mesh,
                                        const Clock& clock) {
  std::vector<TouchObject> objects;
  for (const int pieces : {1, 2, 3, 4}) {
    const geometry::TriangleMesh finer = subdivided(mesh, pieces, kSubdivisionHeight_m);
    objects.push_back(make_touch_object(name, finer, clock));
    std::cerr << name << ": " << finer.triangles.size() << " triangles built\n";
  }
  return objects;
}

boost::json::object to_json(const ScalingRow& row) {
  return {{"triangles", row.triangles},
          {"points", row.points},
          {"spacing_m", row.spacing_m},
          {"cell_m", row.cell_m},
          {"build_s", row.build_s},
          {"contacts_max", row.figures.contacts_max},
          {"query_us", to_json(row.figures.query_us)},
          {"step_us", to_json(row.figures.step_us)}};
}

void print_rows(std::span<const ScalingRow> rows) {
  for (const ScalingRow& row : rows) {
    std::cout << row.triangles << " triangles: step p50 " << format_significant(row.figures.step_us.p50_us, 3)
              << " µs, p99 " << format_significant(row.figures.step_us.p99_us, 3) << " µs, up to "
              << row.figures.contacts_max << " contacts\n";
  }
}

int run_contact_scaling(const ContactScalingOptions& options) {
  constexpr std::size_t kReference = 0;
  const SteadyClock clock;
  const geometry::TriangleMesh mesh = mesh_from(options.mesh, "--mesh");
  check_folder_can_be_made(options.out);
  const std::vector<TouchObject> objects = resolutions_of(options.mesh, geometry::repaired(mesh).mesh, clock);
  const TouchSettings settings;
  const ExactSurface& exact = *objects[kReference].exact;
  const devices::HandPath path = touch_path(exact, exact, bench_plan(settings));

  std::vector<std::vector<TouchTrace>> runs(objects.size());
  for (int round = 0; round < kRounds; ++round) {
    // The resolutions alternate, so that a change of the processor's clock rate affects all of them.
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const contact::ContactShape& shape = *objects[i].shape;
      runs[i].push_back(run_touch(shape, shape, path, settings, clock));
    }
  }
  std::vector<ScalingRow> rows;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    rows.push_back(row_of(objects[i]));
    rows.back().figures = quick_figures_of(runs[i]);
  }
  const auto checks = scaling_checks(rows, kReference);
  boost::json::array rows_json;
  for (const ScalingRow& row : rows) rows_json.push_back(to_json(row));
  const boost::json::object json{{"rows", rows_json}, {"checks", to_json(checks)}};
  write_all_files(options.out, with_report({{"contact-scaling.json", pretty_json(json)}},
                                           scaling_report(options.mesh, rows, kReference)));
  print_rows(rows);
  print_checks(std::cout, checks);
  return all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_contact_scaling(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<ContactScalingOptions>();
  CLI::App* scaling = bench.add_subcommand("contact-scaling", "The same touch at four resolutions of a mesh");
  scaling->add_option("--mesh", options->mesh, "mesh file, or peg, box_with_hole, sphere, cube")->required();
  scaling->add_option("--out", options->out, "folder for contact-scaling.json and report.html")->required();
  scaling->footer("Exit code: 0 done, 1 the cost grows more than it may, 2 bad input or set-up.");
  scaling->callback([options, &exit_code] { exit_code = run_contact_scaling(*options); });
}

}  // namespace tandem::lab
