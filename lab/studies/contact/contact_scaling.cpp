#include "lab/studies/contact/contact_scaling.hpp"

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

constexpr double kMaxGrowth = 2;

}  // namespace

std::vector<Check> scaling_checks(std::span<const ScalingRow> rows, std::size_t reference) {
  const double growth = rows.back().figures.step_us.p99_us / rows[reference].figures.step_us.p99_us;
  return {{"same path",
           "step p99 at " + std::to_string(rows.back().triangles) + " triangles over that at " +
               std::to_string(rows[reference].triangles),
           growth, Relation::kAtMost, kMaxGrowth, "", 2}};
}

HtmlReport scaling_report(const std::string& mesh_name, std::span<const ScalingRow> rows, std::size_t reference) {
  HtmlReport page("Cost of touch against mesh size", mesh_name + " against itself, the same path of the hand");
  page.question("Does the cost of a step grow with the resolution of the mesh?");
  page.verdict(scaling_checks(rows, reference));
  Plot plot;
  plot.description = "Time of a step against the number of triangles";
  plot.x = {.quantity = "triangles of each mesh", .is_log = true};
  plot.y = {.quantity = "time of a step", .unit = "µs", .low = 0};
  Series median{"p50", {}, {}, 0}, tail{"p99", {}, {}, 1};
  Table table{"Resolutions",
              {{"Triangles", ""},
               {"Points", ""},
               {"Spacing", "mm"},
               {"Cell", "mm"},
               {"Built in", "s"},
               {"Contacts", "at most"},
               {"Step p50", "µs"},
               {"Step p99", "µs"}},
              {}};
  for (const ScalingRow& row : rows) {
    median.x.push_back(static_cast<double>(row.triangles));
    median.y.push_back(row.figures.step_us.p50_us);
    tail.x.push_back(static_cast<double>(row.triangles));
    tail.y.push_back(row.figures.step_us.p99_us);
    table.rows.push_back({std::to_string(row.triangles), std::to_string(row.points),
                          format_fixed(1e3 * row.spacing_m, 3), format_fixed(1e3 * row.cell_m, 3),
                          format_fixed(row.build_s, 2), std::to_string(row.figures.contacts_max),
                          format_fixed(row.figures.step_us.p50_us, 1), format_fixed(row.figures.step_us.p99_us, 1)});
  }
  plot.series = {median, tail};
  plot.caption = "A step is the search for contacts and their solution. The path was made for the mesh as given.";
  page.figure(plot);
  page.appendix();
  page.table(table);
  page.footer("Finer meshes are subdivisions with waves of a few micrometres.");
  return page;
}

}  // namespace tandem::lab
