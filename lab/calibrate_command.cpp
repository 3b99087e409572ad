// `tandem-lab calibrate`: the adaptive law's table of one device.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <unistd.h>

#include "common/json/pretty.hpp"
#include "common/progress.hpp"
#include "lab/commands.hpp"
#include "lab/output_folder.hpp"
#include "lab/rendering/calibration.hpp"
#include "lab/rendering/calibration_report.hpp"

namespace tandem::lab {
namespace {

struct Options {
  std::string device;
  std::string out;
  std::vector<double> masses_kg;
  std::uint64_t seed = 1;
  bool wants_json = false;
};

// Complete or not there: whoever is interrupted finds the file of before, or none.
void write_at_once(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path unfinished = file.string() + ".unfinished";
  write_text_file(unfinished, text);
  std::filesystem::rename(unfinished, file);
}

int run(const Options& options) {
  const DeviceProfile profile = find_device_profile(options.device);
  const std::filesystem::path folder = made_folder(options.out);
  CalibrationSettings settings;
  settings.masses_kg = options.masses_kg;
  settings.trial.seed = options.seed;
  ProgressLine line(std::cerr, isatty(STDERR_FILENO) != 0);
  const Calibration calibration =
      calibrate(profile, settings, [&](double done) { line.show("calibrating " + profile.name, done); });

  const std::string results = pretty_json(to_json(calibration));
  write_at_once(folder / (profile.name + ".json"), device_profiles_text({calibration.profile}));
  write_at_once(folder / "calibration.json", results);
  write_at_once(folder / "report.html", to_html(calibration));
  std::cout << (options.wants_json ? results : to_text(calibration));
  return report::all_hold(checks_of(calibration)) ? 0 : 1;
}

}  // namespace

void add_calibrate_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "Finds stiffness by mass and damping by stiffness for a device, on simulated hands");
  command->add_option("--device", options->device, "profile of devices/README.md, or FILE.json")
      ->required()
      ->type_name("NAME|FILE.json");
  command->add_option("--out", options->out, "folder for NAME.json (a profile), calibration.json and report.html")
      ->required();
  command->add_option("--masses", options->masses_kg, "of the tools, increasing [kg]; default: eight that it can hold")
      ->delimiter(',')
      ->type_name("KG,KG,...");
  command->add_option("--seed", options->seed, "of the hands' tremor")->capture_default_str();
  command->add_flag("--json", options->wants_json, "print calibration.json instead of a table");
  command->footer(
      "Takes up to two minutes; Ctrl-C leaves no file.\n"
      "Exit code: 0 done, 1 the fitted pairs do not keep the margins, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tandem::lab
