#include "lab/studies/docking/field_scaling.hpp"

#include "lab/report/format.hpp"

namespace tandem::lab {
namespace {

double number(const boost::json::object& row, const char* name) {
  const boost::json::value& value = row.at(name);
  return value.is_null() ? 0 : value.to_number<double>();
}

double microseconds(const boost::json::object& row, const char* quantile) {
  return row.at("eval_us").as_object().at(quantile).to_number<double>();
}

}  // namespace

HtmlReport field_scaling_report(const std::string& subtitle, const boost::json::array& rows) {
  HtmlReport page("Cost of the molecular field against the interface", subtitle);
  page.question("How long does an evaluation of the field take as the molecules come nearer?");
  Plot plot;
  plot.description = "Time of one evaluation against the atoms in the interface";
  plot.x = {.quantity = "atoms of both molecules within the reach of the other", .is_log = true};
  plot.y = {.quantity = "time of an evaluation", .unit = "µs", .low = 0};
  Series median{"p50", {}, {}, 0}, tail{"p99", {}, {}, 1};
  Table table{"Interfaces",
              {{"Interface", "atoms"},
               {"Pairs within", ""},
               {"Pairs computed", ""},
               {"Shortest distance", "Å"},
               {"p50", "µs"},
               {"p99", "µs"},
               {"Share of the limit", "%"}},
              {}};
  for (const boost::json::value& value : rows) {
    const boost::json::object& row = value.as_object();
    for (Series* const series : {&median, &tail}) {
      series->x.push_back(number(row, "interface_atoms"));
      series->y.push_back(microseconds(row, series->label.c_str()));
    }
    table.rows.push_back({format_fixed(number(row, "interface_atoms"), 0), format_fixed(number(row, "pairs_within"), 0),
                          format_fixed(number(row, "pairs"), 0), format_fixed(number(row, "min_distance_angstrom"), 2),
                          format_fixed(microseconds(row, "p50"), 1), format_fixed(microseconds(row, "p99"), 1),
                          format_fixed(100 * number(row, "share_of_limit"), 0)});
  }
  plot.series = {median, tail};
  plot.caption =
      "The ligand comes nearer along one line; each pose is measured with the ligand swinging by 0.5 Å about it.";
  page.answer("p99 of the largest interface: " + table.rows.back()[5] + " µs, " + table.rows.back()[6] +
              " % of the limit.");
  page.figure(plot);
  page.appendix();
  page.table(table);
  page.footer("One core; pairs computed are those of whole registers.");
  return page;
}

}  // namespace tandem::lab
