// `tandem-lab calibrate`: computes the table of the adaptive coupling law for one device.

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "common/base/progress.hpp"
#include "lab/cli/commands.hpp"
#include "lab/results/output_files.hpp"
#include "lab/studies/rendering/calibration.hpp"
#include "lab/studies/rendering/calibration_report.hpp"

namespace tandem::lab {
namespace {

struct CalibrateOptions {
  std::string device;
  std::string out;
  std::vector<double> masses_kg;
  std::uint64_t seed = 1;
  bool prints_json = false;
};

int run_calibrate(const CalibrateOptions& options) {
  const devices::DeviceProfile profile = devices::find_device_profile(options.device);
  check_folder_can_be_made(options.out);
  CalibrationSettings settings;
  settings.masses_kg = options.masses_kg;
  settings.seed = options.seed;
  const auto progress = progress_on_stderr();
  const Calibration calibration =
      calibrate(profile, settings, [&](double done) { progress("calibrating " + profile.name, done); });

  const std::string results = pretty_json(to_json(calibration));
  write_all_files(options.out,
                  with_report({{profile.name + ".json", devices::device_profiles_text({calibration.profile})},
                               {"calibration.json", results}},
                              to_report(calibration)));
  std::cout << (options.prints_json ? results : to_text(calibration));
  return all_hold(checks_of(calibration)) ? 0 : 1;
}

}  // namespace

void add_calibrate_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CalibrateOptions>();
  CLI::App* command = app.add_subcommand(
      "calibrate", "Finds stiffness by mass and damping by stiffness for a device, on simulated hands");
  command->add_option("--profile,--device", options->device, "profile of devices/PROFILES.md, or FILE.json")
      ->required()
      ->type_name("NAME|FILE.json");
  command->add_option("--out", options->out, "folder for NAME.json (a profile), calibration.json and report.html")
      ->required();
  command->add_option("--masses", options->masses_kg, "of the tools, increasing [kg]; default: eight that it can hold")
      ->delimiter(',')
      ->type_name("KG,KG,...");
  command->add_option("--seed", options->seed, "of the hands' tremor")->capture_default_str();
  command->add_flag("--json", options->prints_json, "print calibration.json instead of a table");
  command->footer(
      "Takes up to 15 s on one core; Ctrl-C leaves nothing.\n"
      "Exit code: 0 done, 1 the fitted pairs break the rules or are far from the best ones, 2 bad input or set-up.");
  command->callback([options, &exit_code] { exit_code = run_calibrate(*options); });
}

}  // namespace tandem::lab
