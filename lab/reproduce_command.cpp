// `tandem-lab reproduce NAME`: a published benchmark run again, its figures beside ours.

#include <CLI/CLI.hpp>
#include <array>
#include <iostream>
#include <memory>
#include <string>

#include "common/json/pretty.hpp"
#include "lab/commands.hpp"
#include "lab/contact/reproduce_touch.hpp"
#include "lab/output_folder.hpp"

namespace tandem::lab {
namespace {

struct Benchmark {
  const char* name;
  const char* description;
  Reproduction (*run)(const Clock& clock);
};
constexpr std::array kBenchmarks{
    Benchmark{"bunny", "Stanford bunny against Stanford bunny (needs glmark2-data)", reproduce_bunny},
    Benchmark{"peg", "peg in hole in five steps, five masses", reproduce_peg},
};

int run(const Benchmark& benchmark, const std::string& out) {
  const auto folder = made_folder(out);
  const Reproduction reproduction = benchmark.run(SteadyClock{});
  write_text_file(folder / (std::string(benchmark.name) + ".json"), pretty_json(to_json(reproduction)));
  write_text_file(folder / "report.html", to_html(reproduction));
  std::cout << to_text(reproduction);
  return report::all_hold(reproduction.claims) ? 0 : 1;
}

}  // namespace

void add_reproduce_command(CLI::App& app, int& exit_code) {
  CLI::App* reproduce = app.add_subcommand("reproduce", "Runs a published benchmark and checks what is claimed of it");
  reproduce->require_subcommand(1);
  reproduce->footer("Exit code: 0 all claims hold, 1 one does not, 2 bad input or set-up.");
  for (const Benchmark& benchmark : kBenchmarks) {
    const auto out = std::make_shared<std::string>();
    CLI::App* command = reproduce->add_subcommand(benchmark.name, benchmark.description);
    command->add_option("--out", *out, "folder for " + std::string(benchmark.name) + ".json and report.html")
        ->required();
    command->callback([&benchmark, out, &exit_code] { exit_code = run(benchmark, *out); });
  }
}

}  // namespace tandem::lab
