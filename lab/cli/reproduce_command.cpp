// `tandem-lab reproduce [NAME]`: repeats a published benchmark and prints the published figures beside our own.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/cli/commands.hpp"
#include "lab/results/output_files.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/studies/contact/reproduce_touch.hpp"
#include "lab/studies/docking/reproduce_docking.hpp"
#include "lab/studies/prediction/reproduce_prediction.hpp"
#include "lab/studies/rendering/reproduce_laws.hpp"

namespace tandem::lab {
namespace {

std::filesystem::path no_file() {
  return {};
}

struct Benchmark {
  std::string_view name;
  std::string_view description;
  /// returns the path of a required file that is not part of the project; null: no such file is required
  std::filesystem::path (*needs)();
  Reproduction (*run)(const Clock& clock);
};
constexpr std::array kBenchmarks{
    Benchmark{"displacement", "sag of a tool by its weight, for each law and mass", no_file, reproduce_displacement},
    Benchmark{"saturation", "the coupling at its force limit", no_file, reproduce_saturation},
    Benchmark{"growth", "force against displacement, in and out", no_file, reproduce_growth},
    Benchmark{"buzz", "vibration of a light tool under a trembling hand", no_file, reproduce_buzz},
    Benchmark{"zwidth", "largest stable stiffness, predicted and simulated", no_file, reproduce_zwidth},
    Benchmark{"prediction", "a force of 200 Hz shown at 1000 Hz: AR, spline, hold, linear", no_file,
              reproduce_prediction},
    Benchmark{"peg", "peg in hole in five steps, five masses", no_file, reproduce_peg},
    Benchmark{"bunny", "Stanford bunny against Stanford bunny (needs glmark2-data)", bunny_file, reproduce_bunny},
    Benchmark{"docking", "two helices, stable method or none (needs pymol-data, gromacs-data)", docking_file,
              reproduce_docking},
};

/// Runs a benchmark and writes its results to `folder`. Returns whether all claims hold.
bool run_reproduce(const Benchmark& benchmark, const std::filesystem::path& folder) {
  Reproduction reproduction = benchmark.run(SteadyClock{});
  reproduction.question = "Subject: " + std::string(benchmark.description) + ".";
  const std::string results = pretty_json(to_json(reproduction));
  write_all_files(folder.string(),
                  with_report({{std::string(benchmark.name) + ".json", results}}, to_report(reproduction)));
  std::cout << to_text(reproduction);
  return all_hold(reproduction.claims);
}

/// Runs each benchmark and writes its results to a folder of its own. A benchmark whose required file is missing is
/// skipped with a message. The last line states how many benchmarks ran.
bool run_all(const std::string& out) {
  bool do_all_hold = true;
  std::size_t done = 0;
  std::string left_out;
  for (const Benchmark& benchmark : kBenchmarks) {
    const std::filesystem::path needed = benchmark.needs();
    if (!needed.empty() && !std::filesystem::exists(needed)) {
      left_out += ", " + std::string(benchmark.name) + " left out: " + needed.string() + " is not there";
      continue;
    }
    do_all_hold &= run_reproduce(benchmark, made_folder((std::filesystem::path(out) / benchmark.name).string()));
    ++done;
    std::cout << std::endl;
  }
  std::cout << done << " of " << kBenchmarks.size() << " run, "
            << (do_all_hold ? "all their claims hold" : "not all their claims hold") << left_out << '\n';
  return do_all_hold;
}

std::string listed_benchmarks() {
  std::string text = "Benchmarks:\n";
  for (const Benchmark& benchmark : kBenchmarks) {
    text += "  " + std::string(benchmark.name) + std::string(14 - benchmark.name.size(), ' ');
    text += std::string(benchmark.description) + "\n";
  }
  return text;
}

}  // namespace

void add_reproduce_command(CLI::App& app, int& exit_code) {
  CLI::App* reproduce = app.add_subcommand("reproduce", "Runs published benchmarks and checks their claims");
  reproduce->footer(listed_benchmarks() + "Exit code: 0 all claims hold, 1 one does not, 2 bad input or set-up.");
  const auto name = std::make_shared<std::string>();
  const auto out = std::make_shared<std::string>();
  std::vector<std::string> names;
  for (const Benchmark& benchmark : kBenchmarks) names.emplace_back(benchmark.name);
  reproduce->add_option("name", *name, "which; without it all, each into a folder of its own in the folder")
      ->check(CLI::IsMember(names));
  reproduce->add_option("--out", *out, "folder for NAME.json and report.html")->required();
  reproduce->callback([name, out, &exit_code] {
    if (name->empty()) {
      exit_code = run_all(*out) ? 0 : 1;
      return;
    }
    exit_code = run_reproduce(*std::ranges::find(kBenchmarks, *name, &Benchmark::name), made_folder(*out)) ? 0 : 1;
  });
}

}  // namespace tandem::lab
