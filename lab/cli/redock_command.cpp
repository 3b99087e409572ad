// `tandem-lab redock`: two simulated hands separate a molecular complex and reassemble it over a network.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "common/docking/molecular_field.hpp"
#include "lab/cli/commands.hpp"
#include "lab/cli/docking_pair.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "lab/studies/docking/exit_path.hpp"
#include "lab/studies/docking/redock.hpp"
#include "server/assets/docking_scene.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

struct RedockOptions {
  DockingOptions pair;
  std::size_t seeds = 20;
  std::uint64_t seed = 1;
  double rtt_ms = 100;
  std::size_t threads = 0;
  std::string kernel;
  std::string out;
  bool is_guided = false;
  bool prints_json = false;
};

wire::Scene scene_of(const RedockOptions& options) {
  wire::MolecularField field;
  field.set_force_field_directory(options.pair.force_field_directory);
  field.set_dielectric(options.pair.dielectric);
  if (const auto cutoff = cutoff_of(options.pair.cutoff)) field.set_cutoff_angstrom(*cutoff);
  return server::docking_scene(server::molecule_source(options.pair.receptor, options.pair.hydrogens),
                               server::molecule_source(options.pair.ligand, options.pair.hydrogens), field);
}

std::string field_text(const json::object& row, std::string_view name, int decimals) {
  const json::value* const value = row.if_contains(name);
  const double number = value != nullptr && value->is_number() ? value->to_number<double>() : std::nan("");
  return format_fixed(number, decimals);
}

void print(const json::object& redocked) {
  const auto about = [&](std::string_view name, int decimals) { return field_text(redocked, name, decimals); };
  std::cout << about("atoms_receptor", 0) << " x " << about("atoms_ligand", 0) << " atoms, dielectric "
            << redocked.at("dielectric").get_string().c_str() << ", cut-off " << about("cutoff_angstrom", 0)
            << (redocked.at("far_grid").as_bool() ? " Å and a grid of the part beyond" : " Å") << ", zero area "
            << about("zero_area_kt", 1) << " kT, " << about("newtons_per_kcal_per_mol_angstrom", 4)
            << " N per kcal/mol/Å, round trip " << about("round_trip_ms", 0) << " ms\nminimum "
            << about("minimum_kcal_per_mol", 2) << " kcal/mol; from native "
            << about("minimum_rmsd_to_native_angstrom", 2) << " Å, interface "
            << about("minimum_interface_rmsd_angstrom", 2) << " Å, f_nat " << about("minimum_native_contact_share", 2)
            << " of " << about("native_contacts", 0) << " contacts\n";
  for (const json::value& note : redocked.at("notes").get_array())
    std::cout << "  note: " << note.get_string().c_str() << '\n';
  struct Column {
    std::string_view name, field;
    int decimals;
  };
  constexpr Column kColumns[]{{"seed", "seed", 0},
                              {"out Å", "out_angstrom", 2},
                              {"barrier kcal/mol", "barrier_kcal_per_mol", 1},
                              {"aim Å", "intended_rmsd_angstrom", 2},
                              {"let go Å", "released_rmsd_angstrom", 2},
                              {"settled Å", "settled_rmsd_angstrom", 2},
                              {"at 0 ms Å", "settled_rmsd_at_zero_delay_angstrom", 2},
                              {"native Å", "settled_rmsd_to_native_angstrom", 2},
                              {"interface Å", "settled_interface_rmsd_angstrom", 2},
                              {"f_nat", "settled_native_contact_share", 2},
                              {"E-Emin kcal/mol", "settled_above_minimum_kcal_per_mol", 2},
                              {"step N/ms", "force_step_n_per_ms", 3},
                              {"at 0 ms N/ms", "force_step_at_zero_delay_n_per_ms", 3},
                              {"beyond N/ms", "force_step_beyond_n_per_ms", 3},
                              {"peak N", "peak_force_n", 2}};
  const auto right = [](const std::string& text, std::string_view header) {
    const std::size_t width = std::max<std::size_t>(6, text_width(header));
    return std::string(width - std::min(width, text_width(text)), ' ') + text + "  ";
  };
  for (const Column& column : kColumns) std::cout << right(std::string(column.name), column.name);
  std::cout << "end\n";
  for (const json::value& row : redocked.at("seeds").get_array()) {
    for (const Column& column : kColumns)
      std::cout << right(field_text(row.get_object(), column.field, column.decimals), column.name);
    const json::value* const end = row.get_object().if_contains("end");
    std::cout << (end == nullptr ? "–" : end->get_string().c_str()) << '\n';
  }
  std::cout << '\n';
}

std::size_t rows_that_end(const json::object& redocked, std::string_view name) {
  return static_cast<std::size_t>(
      std::ranges::count_if(redocked.at("seeds").get_array(), [name](const json::value& row) {
        const json::value* const end = row.get_object().if_contains("end");
        return end != nullptr && end->get_string() == name;
      }));
}

void print_lock(const json::object& lock) {
  std::cout << "locked: rigid parts come at most " << field_text(lock, "out_angstrom", 2)
            << " Å out before repulsion costs more than " << format_fixed(kExitBound_kcal_per_mol, 0)
            << " kcal/mol. The largest repulsion there: " << lock.at("against").get_string().c_str() << ". ";
  if (lock.at("out_without_hydrogens_angstrom").to_number<double>() >= kExitDistance_angstrom) {
    std::cout << "Without hydrogens there is a way out: give --hydrogens united, or hydrogens that fit.\n";
  } else {
    std::cout
        << "Without hydrogens they come " << field_text(lock, "out_without_hydrogens_angstrom", 2)
        << " Å out: the parts are interwound, threaded or closed around each other, and no rigid motion takes them "
           "apart.\n";
  }
}

/// Prints the reason for each group of seeds that did not end docked.
void print_ends(const json::object& redocked) {
  struct End {
    std::string_view name, text;
  };
  constexpr End kEnds[]{
      {"deeper minimum",
       "settle in another, deeper minimum: these files' field prefers it to the native pose. Look at the notes for "
       "groups that were left out or lost their charge"},
      {"zero area", "rest within the zero area and its edge, where little force is shown: the well is as wide as that"},
      {"elsewhere", "rest elsewhere: the hands let go before the well, or a wall held the ligand"},
      {"disconnected", "lost the connection"}};
  for (const End& end : kEnds) {
    const std::size_t count = rows_that_end(redocked, end.name);
    if (count == 0) continue;
    std::cout << end.name << ": " << count << " of " << redocked.at("seeds").get_array().size() << " seeds " << end.text
              << '\n';
  }
}

void print_offset(const json::object& redocked) {
  double least = std::nan(""), greatest = std::nan("");
  for (const json::value& row : redocked.at("seeds").get_array()) {
    const json::value* const offset = row.get_object().if_contains("settled_rmsd_angstrom");
    if (offset == nullptr) continue;
    least = std::fmin(least, offset->to_number<double>());
    greatest = std::fmax(greatest, offset->to_number<double>());
  }
  std::cout << "a hand that goes on guiding holds the ligand " << format_fixed(least, 2) << " to "
            << format_fixed(greatest, 2) << " Å off the minimum\n";
}

void print_far_minimum(const json::object& redocked) {
  std::cout << "no minimum within " << format_fixed(kNative_angstrom, 0)
            << " Å of the native pose. At that pose the energy is " << field_text(redocked, "native_kcal_per_mol", 1)
            << " kcal/mol; " << redocked.at("native_nearest_atoms").get_string().c_str()
            << ", nearest of all. Parts solved apart overlap when they are superposed; otherwise the notes name groups "
               "that were left out or lost their charge.\n";
}

/// Prints an explanation of the result in words.
void print_remark(const json::object& redocked) {
  if (redocked.at("minimum_rmsd_to_native_angstrom").to_number<double>() > kNative_angstrom)
    print_far_minimum(redocked);
  if (const json::value* const lock = redocked.if_contains("lock")) return print_lock(lock->get_object());
  redocked.at("guided").get_bool() ? print_offset(redocked) : print_ends(redocked);
}

/// Returns one value of each seed as a series of markers.
Series over_seeds(const json::object& redocked, const char* label, const char* field, int style) {
  Series series{label, {}, {}, style, Draw::kMarkers};
  for (const json::value& value : redocked.at("seeds").get_array()) {
    const json::object& row = value.get_object();
    const json::value* const number = row.if_contains(field);
    series.x.push_back(row.at("seed").to_number<double>());
    series.y.push_back(number != nullptr && number->is_number() ? number->to_number<double>() : std::nan(""));
  }
  return series;
}

Plot figure_of(PlotAxis y, std::vector<Series> series, AxisMark limit, const char* caption) {
  Plot figure;
  figure.description = figure.caption = caption;
  figure.x = {"seed"};
  figure.y = std::move(y);
  figure.y.low = 0;
  figure.series = std::move(series);
  figure.limits = {std::move(limit)};
  figure.width_px = kHalfWidth_px;
  return figure;
}

HtmlReport report_of(const RedockOptions& options, const json::object& redocked, const std::vector<Check>& checks) {
  HtmlReport page("Redocking by two hands", options.pair.receptor + " and " + options.pair.ligand);
  const std::string rtt = format_significant(options.rtt_ms, 4) + " ms";
  page.question("Do two simulated hands put this complex together again over a round trip of " + rtt + "?");
  page.verdict(checks);
  const auto of = [&](const char* label, const char* field, int style) {
    return over_seeds(redocked, label, field, style);
  };
  const std::string now = "at " + rtt;
  const std::array figures{
      figure_of({"RMSD to the minimum", "Å"},
                {of(now.c_str(), "settled_rmsd_angstrom", 0), of("at 0 ms", "settled_rmsd_at_zero_delay_angstrom", 1)},
                {kDocked_angstrom, "docked below"},
                "Ligand RMSD to the minimum at the end, for each way out and back."),
      figure_of({"change of force", "N/ms"},
                {of(now.c_str(), "force_step_n_per_ms", 0), of("at 0 ms", "force_step_at_zero_delay_n_per_ms", 1),
                 of("excess over 0 ms at the same time", "force_step_beyond_n_per_ms", 2)},
                {kStepBeyond_n_per_ms, "bound of the excess"}, "Largest change of the force in 1 ms.")};
  page.side_by_side(figures);
  page.appendix();
  Table table{"Ways out and back", {{"seed"}, {"end", "", true}}, {}};
  for (const auto& [name, value] : redocked.at("seeds").get_array().front().get_object()) {
    if (value.is_number() && name != "seed") table.columns.push_back({name, ""});
  }
  for (const json::value& value : redocked.at("seeds").get_array()) {
    const json::object& row = value.get_object();
    const json::value* const end = row.if_contains("end");
    std::vector<std::string> cells{field_text(row, "seed", 0), end == nullptr ? "–" : end->get_string().c_str()};
    for (std::size_t i = 2; i < table.columns.size(); ++i) cells.push_back(field_text(row, table.columns[i].header, 3));
    table.rows.push_back(std::move(cells));
  }
  page.table(table);
  return page;
}

int run_redock(RedockOptions options) {
  if (!options.kernel.empty()) docking::MolecularField::use_by_default(options.kernel);
  if (options.threads == 0) options.threads = std::max(1U, std::thread::hardware_concurrency());
  if (!options.out.empty()) check_folder_can_be_made(options.out);
  const auto progress = progress_on_stderr();
  json::object redocked = redock(scene_of(options), options.seed, options.seeds, from_seconds(options.rtt_ms * 1e-3),
                                 options.is_guided, options.threads, [&](double done) { progress("redocking", done); });
  const std::vector<Check> checks = redock_checks(redocked);
  redocked["claims"] = to_json(checks);
  const std::string text = pretty_json(redocked);
  if (!options.out.empty())
    write_all_files(options.out, with_report({{"redock.json", text}}, report_of(options, redocked, checks)));
  if (options.prints_json) {
    std::cout << text;
  } else {
    print(redocked);
    print_remark(redocked);
    print_checks(std::cout, checks);
  }
  return all_hold(checks) ? 0 : 1;
}

}  // namespace

void add_redock_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RedockOptions>();
  options->pair.cutoff = "auto";
  CLI::App* const command = app.add_subcommand("redock", "Two simulated hands put a complex together again");
  add_docking_options(*command, options->pair);
  command->add_option("--seeds", options->seeds, "ways out and back, 1 to 1000; each seed is one")
      ->check(CLI::Range(1, 1000).description(""))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "the first seed")->capture_default_str();
  command->add_option("--rtt-ms", options->rtt_ms, "round trip of both hands, 0 to 1000 [ms]")
      ->check(CLI::Range(0.0, 1000.0).description(""))
      ->capture_default_str();
  command->add_flag("--guided", options->is_guided, "the hands go on guiding at 200 N/m instead of letting go");
  command->add_option("--kernel", options->kernel,
                      "of the molecular field, instead of the widest that this CPU has: \"portable\" gives the same "
                      "bytes on every x86-64");
  command->add_option("--threads", options->threads, "trials at a time, 1 to 256 [default: as many as there are cores]")
      ->check(CLI::Range(1, 256).description(""));
  command->add_option("--out", options->out, "folder for redock.json and report.html");
  command->add_flag("--json", options->prints_json, "print redock.json instead of a table");
  command->footer(
      "Of each seed, a line of the table and an entry of redock.json:\n"
      "  out Å, barrier kcal/mol   how far out the way leads, and its highest Lennard-Jones energy\n"
      "  aim, let go, settled Å    ligand RMSD to the minimum: of the hand's last pose, when the hands relax, at the "
      "end\n"
      "  at 0 ms Å                 the last at zero delay\n"
      "  native Å                  ligand RMSD of the end pose to the native pose, which is the files' pose; heavy "
      "atoms\n"
      "  interface Å               interface RMSD to the native pose, as CAPRI defines it: residues within 10 Å of the "
      "other\n"
      "                            molecule, superposed; atoms N, CA, C, O, of nucleotides P, O5', C5', C4', C3', O3', "
      "of\n"
      "                            residues without a backbone all heavy atoms\n"
      "  f_nat                     share of the native contacts, 0 to 1: pairs of residues with heavy atoms within 5 "
      "Å\n"
      "  E-Emin kcal/mol           energy of the end pose above the minimum's\n"
      "  step, beyond N/ms; peak N largest change of force in 1 ms, its part beyond zero delay's; largest force\n"
      "  end                       docked; deeper minimum: the field prefers another pose; zero area: no force is "
      "shown there;\n"
      "                            elsewhere; disconnected\n"
      "The minimum is the deepest one found within 2 Å of the native pose. The line above the table has native Å, "
      "interface Å and f_nat of the minimum.\n"
      "Claims: the minimum is within 2 Å (ligand RMSD) of the native pose; 80 % of the seeds settle within 1 Å of the "
      "minimum;\n"
      "force steps at most 0.1 N/ms beyond zero delay's; forces at most the device's.\n"
      "Exit code: 0 all claims hold, 1 one does not, or the pair is locked, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_redock(*options); });
}

}  // namespace tandem::lab
