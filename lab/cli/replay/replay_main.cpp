// tandem-replay: shows recordings of tandem-server and tandem-client, exports them as tables, and replays them.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "common/base/units.hpp"
#include "lab/recording/recorded_complex.hpp"
#include "lab/recording/recording_facts.hpp"
#include "lab/recording/recording_tables.hpp"
#include "lab/recording/session_replay.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/results/tables.hpp"
#include "proto/recording/recorded_files.hpp"

namespace tandem::lab {
namespace {

struct Options {
  std::string file;
  std::string out;
  std::string scene;
  std::string at = "best";
  bool writes_json = false;
};

void add_file(CLI::App& command, Options& options) {
  command.add_option("file", options.file, "the first file of the recording; those that follow are found beside it")
      ->required()
      ->type_name("FILE.mcap");
}

void add_json(CLI::App& command, Options& options) {
  command.add_flag("--json", options.writes_json, "print one JSON object");
}

void add_scene(CLI::App& command, Options& options) {
  command.add_option("--scene", options.scene, "the scene of the recording, if it is not at the recorded path")
      ->type_name("FILE|NAME");
}

constexpr int kDamaged = 3;

/// Prints on standard error which parts of the recording are missing. Returns `code`, or kDamaged if `code` is 0 and
/// the recording is damaged.
int with_end(const Options& options, int code) {
  const proto::RecordingEnd end = proto::read_recording(options.file, [](const auto&, const auto&) { return true; });
  if (!end.why.empty()) std::cerr << "tandem-replay: " << end.why << '\n';
  return code == 0 && end.is_damaged ? kDamaged : code;
}

int info(const Options& options) {
  const boost::json::object facts = recording_facts(options.file);
  std::cout << (options.writes_json ? boost::json::serialize(facts) + "\n" : facts_text(facts));
  return with_end(options, 0);
}

int export_tables(const Options& options) {
  const auto tables = recording_tables(options.file);
  const std::filesystem::path folder = made_folder(options.out);
  for (const auto& [name, table] : tables) write_csv(folder / (name + ".csv"), table);
  write_tables_hdf5(folder / "recording.h5", tables,
                    {{"recording", options.file}, {"facts", boost::json::serialize(recording_facts(options.file))}});
  for (const auto& [name, table] : tables) {
    std::cout << (folder / (name + ".csv")).string() << ": " << table.row_count() << " rows\n";
  }
  std::cout << (folder / "recording.h5").string() << ": all of them\n";
  return with_end(options, 0);
}

int save_complex(const Options& options) {
  const std::optional<Duration> at =
      options.at == "best" ? std::nullopt : std::optional(parse_duration(options.at, "s"));
  const boost::json::object saved = save_recorded_complex(options.file, at, options.scene, options.out);
  if (options.writes_json) {
    std::cout << boost::json::serialize(saved) << '\n';
    return with_end(options, 0);
  }
  const auto number = [&saved](const char* key) { return saved.at(key).as_double(); };
  std::printf("at %.2f s: %.2f kJ/mol (Lennard-Jones %.2f, Coulomb %.2f), %.2f angstrom from the files' own pose\n%s\n",
              number("t_s"), number("total_kj_mol"), number("lj_kj_mol"), number("coulomb_kj_mol"),
              number("rmsd_angstrom"), options.out.c_str());
  return with_end(options, 0);
}

std::string verdict(const ReplayResult& result) {
  std::string text = std::to_string(result.steps) + " steps with " + std::to_string(result.inputs) + " inputs and " +
                     std::to_string(result.commands) + " commands: ";
  if (result.differs_at_step) {
    text +=
        "the first difference is " + result.differing_thing + " after step " + std::to_string(*result.differs_at_step);
  } else {
    text += "the same state after each";
  }
  if (result.missing_step) text += "; step " + std::to_string(*result.missing_step) + " is not in the recording";
  if (!result.is_whole) text += "; the recording ends without its end";
  if (!result.note.empty()) text += "; " + result.note;
  if (result.differs_at_step && result.program != "tandem-server " TANDEM_VERSION) {
    text += "; it was recorded by " + result.program + ", and this is version " TANDEM_VERSION;
  }
  return text;
}

boost::json::object to_json(const ReplayResult& result) {
  boost::json::object out{{"steps", result.steps},       {"inputs", result.inputs},
                          {"commands", result.commands}, {"is_equal", !result.differs_at_step},
                          {"divergence", nullptr},       {"missing_step", nullptr},
                          {"is_whole", result.is_whole}, {"program", result.program},
                          {"note", result.note}};
  if (result.differs_at_step) {
    out["divergence"] = boost::json::object{{"step", *result.differs_at_step}, {"thing", result.differing_thing}};
  }
  if (result.missing_step) out["missing_step"] = *result.missing_step;
  return out;
}

int play(const Options& options) {
  const ReplayResult result = replay_session(options.file, options.scene);
  std::cout << (options.writes_json ? boost::json::serialize(to_json(result)) : verdict(result)) << '\n';
  return with_end(options, result.differs_at_step || result.missing_step ? 1 : 0);
}

void declare(CLI::App& app, Options& options, int& exit_code) {
  app.set_version_flag("--version", "tandem-replay " TANDEM_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit code: 0 done, 1 the states differ or steps are missing, 2 bad input or set-up, 3 done with the readable "
      "part: the recording is damaged or cut.");
  CLI::App* const info_command =
      app.add_subcommand("info", "Contents of a recording: users, duration, topics and gaps");
  add_file(*info_command, options);
  add_json(*info_command, options);
  info_command->callback([&] { exit_code = info(options); });
  CLI::App* const write = app.add_subcommand("export", "Its time series as CSV files and one HDF5 file");
  add_file(*write, options);
  write->add_option("--out", options.out, "folder for them")->required()->type_name("DIR");
  write->callback([&] { exit_code = export_tables(options); });
  CLI::App* const complex =
      app.add_subcommand("complex", "What two molecules were brought to, as a structure file, with its energy");
  add_file(*complex, options);
  complex->add_option("--at", options.at, "so long after the beginning, with unit, e.g. 12s; best: the least energy")
      ->type_name("TIME|best")
      ->capture_default_str();
  complex->add_option("--save", options.out, "PDB or mmCIF, by the name's ending")
      ->required()
      ->type_name("FILE.pdb|FILE.cif");
  add_scene(*complex, options);
  add_json(*complex, options);
  complex->callback([&] { exit_code = save_complex(options); });
  CLI::App* const again =
      app.add_subcommand("play", "The steps of a room again, with the same inputs: is the state after each the same?");
  add_file(*again, options);
  add_scene(*again, options);
  add_json(*again, options);
  again->callback([&] { exit_code = play(options); });
}

}  // namespace
}  // namespace tandem::lab

int main(int argument_count, char** arguments) {
  CLI::App app{"tandem-replay: recordings of tandem-server --record and tandem-client --record", "tandem-replay"};
  tandem::lab::Options options;
  int exit_code = 0;
  tandem::lab::declare(app, options, exit_code);
  try {
    app.parse(argument_count, arguments);
    return exit_code;
  } catch (const CLI::Success& help_or_version) {
    return app.exit(help_or_version);
  } catch (const CLI::ParseError& error) {
    std::string text = error.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    std::cerr << "tandem-replay: " << text << "; see --help\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "tandem-replay: " << error.what() << '\n';
    return 2;
  }
}
