// Program tandem-eeg: computes the signal `valence` from EEG, with a classifier that is trained for one person.
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>

#include "devices/eeg/app/options.hpp"

int main(int argc, char** argv) {
  using namespace tandem::eeg;
  constexpr int kSetupError = 2;
  CLI::App app(
      std::string("tandem-eeg: features of EEG, and a valence signal by a classifier trained for one person.\n") +
          kNotMedical,
      "tandem-eeg");
  app.set_version_flag("--version", "tandem-eeg " TANDEM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Each command has --help. Exit code: 0 done, 1 a checked claim failed or the source was lost, 2 bad input or "
      "set-up.");
  int exit_code = 0;
  add_generate_command(app);
  add_features_command(app);
  add_train_command(app);
  add_validate_command(app, exit_code);
  add_stream_command(app, exit_code);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const std::exception& error) {
    std::string text = error.what();
    std::ranges::replace(text, '\n', ' ');
    std::cerr << "tandem-eeg: " << text << "; see --help" << std::endl;
    return kSetupError;
  }
}
