#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "common/base/json_pretty.hpp"
#include "lab/cli/commands.hpp"
#include "lab/report/format.hpp"
#include "lab/results/output_files.hpp"
#include "lab/therapy/measures_json.hpp"
#include "lab/therapy/person_store.hpp"
#include "lab/therapy/session_measures.hpp"
#include "lab/therapy/therapy_report.hpp"

#include <sys/stat.h>

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

struct TherapyOptions {
  std::string data;  ///< empty: the default folder
  std::string pseudonym;
  std::string recording;
  std::string user;
  std::string calibration;   ///< recording of the calibration
  double calibration_s = 0;  ///< duration of the calibration at the beginning of the session recording [s]; 0: none
  int session = 0;           ///< number of the reported session; 0: the last session
  std::string out;
  bool prints_json = false;
};

PersonStore store_of(const TherapyOptions& options) {
  // The measures and reports describe a person. Therefore all files are created such that only their owner can read
  // them.
  ::umask(S_IRWXG | S_IRWXO);
  return PersonStore(options.data.empty() ? default_person_folder() : fs::path(options.data));
}

std::string range_words(const std::optional<MotionRange>& range) {
  if (!range) return "not measured";
  constexpr double kMilli = 1e3;
  const Vec3 mm = range->size_m() * kMilli;
  return format_fixed(mm.x(), 0) + " x " + format_fixed(mm.y(), 0) + " x " + format_fixed(mm.z(), 0) + " mm";
}

int run_new(const TherapyOptions& options) {
  std::cout << store_of(options).create(options.pseudonym) << '\n';
  return 0;
}

int run_list(const TherapyOptions& options) {
  const PersonStore store = store_of(options);
  boost::json::array persons;
  for (const std::string& pseudonym : store.persons()) {
    boost::json::array sessions;
    for (const StoredSession& session : store.sessions(pseudonym)) {
      sessions.push_back(boost::json::object{
          {"number", session.number}, {"begun_utc", session.measures.begun_utc}, {"scene", session.measures.scene}});
    }
    if (!options.prints_json) {
      std::cout << pseudonym << "  " << sessions.size() << (sessions.size() == 1 ? " session" : " sessions") << '\n';
    }
    persons.push_back(boost::json::object{{"pseudonym", pseudonym}, {"sessions", std::move(sessions)}});
  }
  if (options.prints_json) std::cout << pretty_json(persons);
  return 0;
}

int run_add(const TherapyOptions& options) {
  PersonStore store = store_of(options);
  store.sessions(options.pseudonym);  // reports an unknown person before the recording is read
  const auto first_seconds = options.calibration_s > 0 ? std::optional(options.calibration_s) : std::nullopt;
  SessionMeasures session = measure_session(options.recording, options.user, first_seconds);
  if (!options.calibration.empty()) session.calibration = measure_calibration(options.calibration, options.user);
  const int number = store.add(options.pseudonym, session);
  if (session.is_cut) {
    std::cerr << "tandem-lab: " << options.recording
              << " is cut or damaged; the readable part was measured. See \"tandem-replay info\" for the reason\n";
  }
  if (options.prints_json) {
    boost::json::object out{{"session", number}};
    out["measures"] = to_json(session);
    std::cout << pretty_json(out);
    return 0;
  }
  const PartMeasures& whole = session.whole();
  std::cout << "session " << number << ": " << whole.movements << " movements in " << format_fixed(whole.time_s, 1)
            << " s, smoothness " << format_fixed(whole.smoothness, 2) << ", range of motion "
            << range_words(whole.range) << ", calibration "
            << (session.calibration ? range_words(session.calibration) : "none") << '\n';
  return 0;
}

/// Checks that a report is written outside of the data folder. A report inside would contain data of a person, and the
/// deletion of the person would not remove it.
/// Fails   std::invalid_argument: the report would lie within the data folder
void require_outside(const fs::path& out, const fs::path& data) {
  const fs::path folder = fs::weakly_canonical(data), report = fs::weakly_canonical(fs::absolute(out));
  const auto [end, unused] = std::ranges::mismatch(folder, report);
  if (end != folder.end()) return;
  throw std::invalid_argument("--out " + out.string() + ": it is within the data folder " + data.string() +
                              "; name a folder outside");
}

int run_report(const TherapyOptions& options) {
  const PersonStore store = store_of(options);
  require_outside(options.out, store.folder());
  const std::vector<StoredSession> sessions = store.sessions(options.pseudonym);
  if (sessions.empty()) {
    throw std::invalid_argument(options.pseudonym +
                                " has no session; store one by \"tandem-lab therapy add\" with a recording");
  }
  const int number = options.session == 0 ? sessions.back().number : options.session;
  const auto found = std::ranges::find(sessions, number, &StoredSession::number);
  if (found == sessions.end()) {
    throw std::invalid_argument("--session " + std::to_string(number) + ": " + options.pseudonym +
                                " has the sessions " + std::to_string(sessions.front().number) + " to " +
                                std::to_string(sessions.back().number) + "; name one of them");
  }
  const auto index = static_cast<std::size_t>(found - sessions.begin());
  write_all_files(options.out, with_report({{"measures.csv", measures_csv(sessions)},
                                            {"movements.csv", movements_csv(found->measures)}},
                                           therapy_report(options.pseudonym, sessions, index)));
  std::cout << (fs::path(options.out) / "report.html").string() << '\n';
  return 0;
}

int run_delete(const TherapyOptions& options) {
  const PersonStore::Removal removal = store_of(options).remove(options.pseudonym);
  for (const fs::path& file : removal.found) {
    std::cerr << "tandem-lab: the pseudonym is still in " << file.string()
              << ", which this program did not write; remove it yourself\n";
  }
  for (const fs::path& file : removal.unreadable) {
    std::cerr
        << "tandem-lab: " << file.string()
        << " could not be searched for the pseudonym, and this program did not write it; check its rights and search "
           "it yourself\n";
  }
  if (!removal.found.empty() || !removal.unreadable.empty()) return 1;
  std::cout << "deleted; reports and recordings elsewhere are not removed\n";
  return 0;
}

using Run = int (*)(const TherapyOptions&);

/// Adds a subcommand with the options that every subcommand of `therapy` has.
CLI::App* add_subcommand(CLI::App& therapy, const std::string& name, const std::string& description,
                         const std::shared_ptr<TherapyOptions>& options, Run run_command, int& exit_code) {
  CLI::App* command = therapy.add_subcommand(name, description);
  command
      ->add_option("--data", options->data,
                   "folder of the persons; default: $XDG_DATA_HOME/tandem/therapy, or ~/.local/share/tandem/therapy")
      ->type_name("DIR");
  command->footer(std::string(kNotMedicalDevice));
  command->callback([options, run_command, &exit_code] { exit_code = run_command(*options); });
  return command;
}

void add_add(CLI::App& therapy, const std::shared_ptr<TherapyOptions>& options, int& exit_code) {
  CLI::App* command = add_subcommand(therapy, "add", "Measures the recording of a session and stores the measures",
                                     options, run_add, exit_code);
  command->add_option("pseudonym", options->pseudonym, "the person")->required();
  command->add_option("recording", options->recording, "first file of a recording by tandem-server --record")
      ->required()
      ->type_name("FILE");
  command->add_option("--user", options->user, "name of the user in the recording; default: its only user with a tool")
      ->type_name("NAME");
  CLI::Option* const file =
      command
          ->add_option("--calibration", options->calibration,
                       "recording in which the hand reaches as far as it can in each direction; its range of motion is "
                       "stored with the session")
          ->type_name("FILE");
  command
      ->add_option("--calibration-s", options->calibration_s,
                   "first seconds of the session [s], 1 to 600, that are the calibration; default: no calibration")
      ->type_name("S")
      ->check(CLI::Range(1.0, 600.0))
      ->excludes(file);
  command->add_flag("--json", options->prints_json, "print the measures as one JSON object");
}

void add_report(CLI::App& therapy, const std::shared_ptr<TherapyOptions>& options, int& exit_code) {
  CLI::App* command = add_subcommand(
      therapy, "report", "Writes an HTML page and CSV files of a session and the progress over all sessions", options,
      run_report, exit_code);
  command->add_option("pseudonym", options->pseudonym, "the person")->required();
  command->add_option("--out", options->out, "folder to write, outside the folder of the persons")
      ->required()
      ->type_name("DIR");
  command->add_option("--session", options->session, "number of the session; default: the last one")
      ->type_name("N")
      ->check(CLI::Range(1, 9999));
}

}  // namespace

void add_therapy_command(CLI::App& app, int& exit_code) {
  // The options are shared with the callbacks, which outlive this function.
  const auto options = std::make_shared<TherapyOptions>();
  CLI::App* therapy = app.add_subcommand(
      "therapy", "Range of motion, session reports and progress of persons under pseudonyms. Not a medical device");
  therapy->require_subcommand(1);
  therapy->footer(std::string(kNotMedicalDevice));
  add_subcommand(*therapy, "new", "Creates a person and prints the pseudonym", options, run_new, exit_code)
      ->add_option("pseudonym", options->pseudonym,
                   "pseudonym that a study has assigned, 6 to 32 of A-Z, 0-9 and -, with a digit; never a name. "
                   "Default: a random one");
  add_subcommand(*therapy, "list", "Prints the pseudonyms and their sessions", options, run_list, exit_code)
      ->add_flag("--json", options->prints_json, "print a JSON array");
  add_add(*therapy, options, exit_code);
  add_report(*therapy, options, exit_code);
  CLI::App* const remove =
      add_subcommand(*therapy, "delete", "Deletes all data of a person", options, run_delete, exit_code);
  remove->add_option("pseudonym", options->pseudonym, "the person")->required();
  remove->footer(std::string(kNotMedicalDevice) +
                 "\nExit code: 0 deleted, 1 deleted, but the pseudonym is in files that others put into the folder, 2 "
                 "bad input.");
}

}  // namespace tandem::lab
