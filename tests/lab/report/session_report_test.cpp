// Tests the verdict on a session of the demo. Every check must be able to fail independently, and an error about an
// invalid file must name the file.
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "client/app/summary.hpp"
#include "client/app/trace.hpp"
#include "lab/cli/commands.hpp"
#include "lab/report/session_checks.hpp"
#include "lab/report/session_data.hpp"
#include "lab/report/session_report.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

json::object good_summary(const std::string& user) {
  json::object hold{
      {"name", "hold"}, {"duration_s", 4.0}, {"settled_hand_speed_max_m_per_s", 0.004}, {"settled_force_mean_n", 2.5}};
  return {{"user", user},
          {"scene", "peg_in_hole"},
          {"stage", "late-pose"},
          {"ticks_run", 9995},
          {"ticks_expected", 10000},
          {"tick_rate_hz", 999.5},
          {"lateness_us", {{"p50", 60}, {"p99", 140.5}, {"p999", 800}, {"max", 2200}}},
          {"missed", 5},
          {"round_trip_ms", {{"newest", 51.25}, {"minimum", 50.5}}},
          {"clock_offset_ms", 2000.0},
          {"drops", {{"received", {{"late", 31}}}, {"sent", json::object()}}},
          {"force_n", {{"rms", 1.25}, {"max", 3.5}}},
          {"torque_n_m", {{"rms", 0.02}, {"max", 0.08}}},
          {"force_limit_n", 8},
          {"torque_limit_n_m", 0.3},
          {"clamped_fraction", 0.0},
          {"all_forces_finite", true},
          {"phases", json::array{{{"name", "approach"},
                                  {"duration_s", 0.5},
                                  {"settled_hand_speed_max_m_per_s", nullptr},
                                  {"settled_force_mean_n", nullptr}},
                                 hold}},
          {"watched_body", {{"name", "peg"}, {"displacement_m", 0.02}}}};
}

/// Returns a trace with one row per second, one for each value of the force along x. The phase is "approach" in the
/// first second and "hold" in all later seconds.
std::string trace_csv(const std::vector<std::string>& forces_n, double start_s = 0) {
  std::ostringstream out;
  out << "local_ns,phase,handle_p_x_m,handle_p_y_m,handle_p_z_m,tool_p_x_m,tool_p_y_m,tool_p_z_m,body_p_x_m,body_p_y_m,"
         "body_p_z_m,displayed_force_x_n,displayed_force_y_n,displayed_force_z_n,displayed_torque_x_n_m,"
         "displayed_torque_y_n_m,displayed_torque_z_n_m,state_age_s,field_energy_kj_per_mol\n";
  for (std::size_t i = 0; i < forces_n.size(); ++i) {
    out << static_cast<std::int64_t>((start_s + static_cast<double>(i)) * 1e9) << (i == 0 ? ",0" : ",1")
        << ",0,0,0.1,0,0,0.1,,,," << forces_n[i] << ",0,0,0,0,0,0.001,-1\n";
  }
  return out.str();
}

ClientRun user_run(const json::object& summary, const std::string& csv) {
  ClientRun run = parse_client_summary(summary, "anna.json");
  run.trace = make_trace(parse_csv(csv, "anna.csv"), run);
  return run;
}

ClientRun good_user(const std::string& name) {
  return user_run(good_summary(name), trace_csv({"0", "2", "3.5"}));
}

std::vector<std::string> failing_claims(const ClientRun& user) {
  const std::vector<Session> sessions = {{"peg", {good_user("anna"), user}}};
  std::vector<std::string> claims;
  for (const Check& check : check_sessions(sessions)) {
    if (check.holds()) continue;
    EXPECT_EQ(check.scope, "peg · ben") << check.claim;
    claims.push_back(check.claim);
  }
  return claims;
}

TEST(SessionChecks, AllHoldForAGoodSession) {
  EXPECT_EQ(failing_claims(good_user("ben")), std::vector<std::string>());
}

struct Fault {
  const char* claim;
  std::function<void(ClientRun&)> make;
};

TEST(SessionChecks, EachFailsAloneForItsOwnFault) {
  constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Fault> faults = {
      {"shared body felt", [](ClientRun& u) { u.phases[1].settled_force_mean_n = 0.29; }},
      {"shared body felt", [](ClientRun& u) { u.phases[1].settled_force_mean_n = kNotANumber; }},
      {"shared body moved", [](ClientRun& u) { u.body_displacement_m = 0.0019; }},
      {"shared body moved", [](ClientRun& u) { u.body_displacement_m = kNotANumber; }},
      {"hand at rest", [](ClientRun& u) { u.phases[1].settled_hand_speed_max_m_per_s = 0.021; }},
      {"hand at rest", [](ClientRun& u) { u.phases[1].settled_hand_speed_max_m_per_s = kNotANumber; }},
      {"forces that are not finite", [](ClientRun& u) { u.all_forces_finite = false; }},
      {"forces that are not finite", [](ClientRun& u) { u.trace.force_n[1] = kNotANumber; }},
      {"forces that are not finite", [](ClientRun& u) { u.trace.torque_n_m[1] = -1 / 0.0; }},
      {"largest force", [](ClientRun& u) { u.force_max_n = 8.01; }},
      {"largest force", [](ClientRun& u) { u.trace.force_n[2] = 8.01; }},
      {"time at the clamp", [](ClientRun& u) { u.clamped_fraction = 0.01; }},
      {"haptic ticks run", [](ClientRun& u) { u.loop.ticks_run = 9899; }},
      {"haptic ticks run", [](ClientRun& u) { u.loop.ticks_run = u.loop.ticks_expected = 0; }},
      {"mean tick rate", [](ClientRun& u) { u.loop.tick_rate_hz = 989; }},
      {"mean tick rate", [](ClientRun& u) { u.loop.tick_rate_hz = 1011; }},
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    ClientRun user = good_user("ben");
    faults[i].make(user);
    const auto claims = failing_claims(user);
    ASSERT_EQ(claims.size(), 1U) << "fault " << i << ", " << faults[i].claim;
    EXPECT_TRUE(claims[0].starts_with(faults[i].claim)) << "fault " << i << ": " << claims[0];
  }
}

TEST(SessionChecks, AForceClampedAtTheLimitIsWithinItInRoundedText) {
  ClientRun user = good_user("ben");
  user.trace.force_n[2] = 8.0000001;
  EXPECT_EQ(failing_claims(user), std::vector<std::string>());
}

TEST(SessionChecks, RefuseAUserWithoutAHoldPhase) {
  ClientRun user = good_user("ben");
  user.phases[1].name = "move";
  try {
    check_sessions(std::vector<Session>{{"peg", {user}}});
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "session peg, user ben: phases has no \"hold\" (it has: approach, move); give the client a hand path with "
        "a phase of that name");
  }
}

std::string complaint_about(const json::value& summary) {
  try {
    parse_client_summary(summary, "ben.json");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ClientRun, MissingKeysAreNamedWithTheirFile) {
  for (const auto& entry : good_summary("ben")) {
    json::object summary = good_summary("ben");
    summary.erase(entry.key());
    const std::string complaint = complaint_about(summary);
    EXPECT_TRUE(complaint.starts_with("ben.json: " + std::string(entry.key()))) << entry.key() << ": " << complaint;
  }
}

TEST(ClientRun, WrongValuesAreNamedWithTheirKey) {
  const std::vector<std::pair<std::string, json::value>> wrong = {
      {"/ticks_run", "many"},
      {"/lateness_us/p99", -1},
      {"/force_n/max", nullptr},
      {"/all_forces_finite", 1},
      {"/phases", 3},
      {"/phases/1/settled_force_mean_n", "x"},
      {"/drops/received/late", 0.5},
      {"/drops/sent", json::array()},
      {"/watched_body/displacement_m", "far"},
      {"/clamped_fraction", 1.5},
      {"/user", 7},
  };
  for (const auto& [pointer, value] : wrong) {
    json::value summary = good_summary("ben");
    summary.at_pointer(pointer) = value;
    const std::string complaint = complaint_about(summary);
    const std::string key = pointer.substr(pointer.rfind('/') + 1);
    EXPECT_TRUE(complaint.starts_with("ben.json: ")) << pointer << ": " << complaint;
    EXPECT_NE(complaint.find(key), std::string::npos) << pointer << ": " << complaint;
  }
  EXPECT_NE(complaint_about(json::array()), "accepted");
}

TEST(ClientRun, UpdatesThatWereSuppressedMayHaveTheirOlderName) {
  for (const char* name : {"suppressed", "held_back"}) {
    json::object summary = good_summary("ben");
    summary["datagrams"] = json::object{{"sent", 9000}, {"received", 9100}, {name, 120}, {"paced", 0}};
    EXPECT_EQ(complaint_about(summary), "accepted") << name;
  }
}

TEST(ClientRun, AnUnknownValueIsNanAndFailsItsCheck) {
  json::value summary = good_summary("ben");
  summary.at_pointer("/watched_body") = nullptr;
  summary.at_pointer("/phases/1/settled_force_mean_n") = nullptr;
  summary.at_pointer("/round_trip_ms/newest") = nullptr;
  summary.at_pointer("/clock_offset_ms") = nullptr;
  const auto claims = failing_claims(user_run(summary.get_object(), trace_csv({"0", "2"})));
  EXPECT_EQ(claims.size(), 2U);
}

TEST(ClientRun, IsTheFormatThatTheClientWrites) {
  client::RunReport run({"approach", "hold"}, from_seconds(0.14));
  client::TickRecord record;
  record.at = LocalTime(from_seconds(5));
  for (int i = 0; i < 2000; ++i) {
    record.at += from_seconds(0.001);
    record.displayed_on_hand_D.f.x() = 2.0;
    run.add(record, i < 500 ? 0 : 1);
  }
  client::RunSummary summary{.options = {},
                             .device = {},
                             .realtime_not_granted = {},
                             .loop = {},
                             .trace_overflows = 0,
                             .counters = {},
                             .io = {},
                             .coupling_findings = {},
                             .watched = {},
                             .watched_name = {},
                             .run = run};
  summary.options.io.client.session.user_name = "ben";
  summary.options.stage.name = "hold";
  summary.io.joined = std::make_shared<wire::Joined>();
  json::object written = client::to_json(summary);
  written["scene"] = "peg";  // to_json() wrote an empty text: this test's Joined message has no scene
  const ClientRun read = parse_client_summary(written, "ben.json");
  EXPECT_EQ(read.name, "ben");
  EXPECT_EQ(read.stage, "hold");
  ASSERT_NE(read.phase("hold"), nullptr);
  EXPECT_DOUBLE_EQ(read.phase("hold")->settled_force_mean_n, 2.0);
  EXPECT_TRUE(std::isnan(read.phase("approach")->settled_force_mean_n)) << "0.5 s do not settle";
  EXPECT_TRUE(std::isnan(read.body_displacement_m));
}

class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "tandem_report_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  std::string text() const { return path_.string(); }
  void write(const std::string& name, const std::string& content) const { std::ofstream(path_ / name) << content; }
  void write_user(const std::string& name, const json::object& summary, const std::string& csv) const {
    write(name + ".json", json::serialize(summary));
    write(name + ".csv", csv);
  }

 private:
  std::filesystem::path path_;
};

TEST(Trace, HasTheColumnsThatTheClientWrites) {
  const Folder folder;
  client::TickRecord record;
  record.at = LocalTime(from_seconds(7));
  record.sample.is_valid = true;
  record.handle_W.X.p = {0.1, 0.2, 0.3};
  record.displayed_on_hand_D.f = {3, 0, 4};
  client::TraceWriter writer(folder / "ben.csv", 1);
  writer.write(record, 1);
  record.at += from_seconds(0.5);
  writer.write(record, -1);
  ASSERT_TRUE(writer.flush());
  const Trace trace = make_trace(read_csv(folder / "ben.csv"), parse_client_summary(good_summary("ben"), "ben.json"));
  EXPECT_DOUBLE_EQ(trace.time_s[0], 9.0) << "7 s on the client's clock, which is 2 s behind the server's";
  EXPECT_DOUBLE_EQ(trace.force_n[0], 5.0);
  EXPECT_DOUBLE_EQ(trace.hand_m[2][0], 0.3);
  EXPECT_TRUE(std::isnan(trace.body_m[0][0]));
  ASSERT_EQ(trace.phases.size(), 1U);
  EXPECT_EQ(trace.phases[0].label, "hold");
  EXPECT_DOUBLE_EQ(trace.phases[0].end, 9.5);
}

TEST(Trace, RefusesDecreasingTimesAndUnknownPhases) {
  const ClientRun summary = parse_client_summary(good_summary("ben"), "ben.json");
  CsvTable table = parse_csv(trace_csv({"0", "1", "2"}), "ben.csv");
  const std::size_t time_column = 0;
  const std::size_t phase_column = 1;
  CsvTable backwards = table;
  std::swap(backwards.columns[time_column][1], backwards.columns[time_column][2]);
  EXPECT_THROW(make_trace(backwards, summary), std::invalid_argument);
  for (const double phase : {2.0, -2.0, std::nan("")}) {
    table.columns[phase_column][1] = phase;
    EXPECT_THROW(make_trace(table, summary), std::invalid_argument) << phase;
  }
  EXPECT_THROW(make_trace(parse_csv(trace_csv({}), "ben.csv"), summary), std::invalid_argument);
}

TEST(LoadSession, PutsBothUsersOnOneClock) {
  const Folder folder;
  folder.write_user("anna", good_summary("anna"), trace_csv({"0", "1"}, 10));
  json::object ben = good_summary("ben");
  ben["clock_offset_ms"] = -3000.0;
  folder.write_user("ben", ben, trace_csv({"0", "1"}, 15.25));
  const Session session = load_session("peg", folder / "");
  ASSERT_EQ(session.users.size(), 2U);
  EXPECT_EQ(session.users[0].name, "anna");
  EXPECT_DOUBLE_EQ(session.users[0].trace.time_s[0], 0);
  EXPECT_NEAR(session.users[1].trace.time_s[0], 0.25, 1e-9);
  EXPECT_NEAR(session.users[1].trace.phases[1].begin, 1.25, 1e-9);
}

TEST(SessionReport, IsTheSameToTheByteAndShowsNoMarkupOfAUser) {
  const std::string hostile = "<script>alert(1)</script>";
  const std::vector<Session> sessions = {{"<b>peg</b>", {good_user("anna"), good_user(hostile)}}};
  const auto checks = check_sessions(sessions);
  const std::string html = session_report(sessions, checks).html();
  EXPECT_EQ(html, session_report(sessions, checks).html());
  EXPECT_EQ(html.find("<script"), std::string::npos);
  EXPECT_EQ(html.find("<b>peg"), std::string::npos);
  EXPECT_NE(html.find("&lt;script&gt;alert(1)"), std::string::npos);
  EXPECT_NE(html.find("late</th>"), std::string::npos) << "drops by reason";
}

TEST(SessionReport, HasTheForcesOfEverySession) {
  std::vector<Session> sessions;
  for (const char* name : {"one", "two", "three", "four", "five"})
    sessions.push_back({name, {good_user("anna"), good_user("ben")}});
  std::size_t force_figures = 0, on_first_page = 0;
  const HtmlReport report = session_report(sessions, check_sessions(sessions));
  const std::string html = report.html();
  for (const auto& [name, text] : report.files()) {
    if (!name.ends_with(".csv") || name.find("force") == std::string::npos) continue;
    ++force_figures;
    if (html.find(name) < html.find("class=\"appendix\"")) ++on_first_page;
  }
  EXPECT_EQ(force_figures, 5U);
  EXPECT_EQ(on_first_page, 3U);
}

struct Outcome {
  int code = -1;
  std::string what;
  std::string out;
};

Outcome run_report(const std::vector<std::string>& arguments) {
  CLI::App app("test");
  Outcome outcome;
  add_report_command(app, outcome.code);
  // CLI11 expects the arguments in reverse order.
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  reversed.push_back("report");
  testing::internal::CaptureStdout();
  try {
    app.parse(reversed);
  } catch (const std::invalid_argument& error) {
    outcome.what = error.what();
  }
  outcome.out = testing::internal::GetCapturedStdout();
  return outcome;
}

TEST(ReportCommand, AnswersZeroOrOneByTheChecksAndWritesThePage) {
  const Folder folder;
  folder.write_user("anna", good_summary("anna"), trace_csv({"0", "1"}));
  folder.write_user("ben", good_summary("ben"), trace_csv({"0", "1"}));
  const std::vector<std::string> arguments = {"--session", "peg=" + folder.text(), "--out",
                                              (folder / "new/report.html").string(), "--json"};
  const Outcome good = run_report(arguments);
  EXPECT_EQ(good.code, 0) << good.what;
  EXPECT_TRUE(std::filesystem::exists(folder / "new/report.html"));
  EXPECT_TRUE(json::parse(good.out).at("holds").as_bool());

  folder.write_user("ben", good_summary("ben"), trace_csv({"0", "nan"}));
  const Outcome bad = run_report(arguments);
  EXPECT_EQ(bad.code, 1) << bad.what;
  const json::value printed = json::parse(bad.out);
  EXPECT_FALSE(printed.at("holds").as_bool());
  EXPECT_EQ(printed.at("checks").as_array().size(), 16U);
}

TEST(ReportCommand, NamesTheFileThatIsBadOrMissing) {
  const Folder folder;
  const std::vector<std::string> arguments = {"--session", "peg=" + folder.text(), "--out",
                                              (folder / "report.html").string()};
  EXPECT_NE(run_report(arguments).what.find("a shared session has 2 to 16 users"), std::string::npos);
  folder.write_user("anna", good_summary("anna"), trace_csv({"0"}));
  folder.write("ben.json", json::serialize(good_summary("ben")));
  EXPECT_NE(run_report(arguments).what.find("ben.csv"), std::string::npos);
  folder.write("ben.json", "{");
  EXPECT_NE(run_report(arguments).what.find("ben.json: line 1"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "report.html"));
  EXPECT_NE(run_report({"--session", "peg", "--out", "x"}).what.find("NAME=DIR"), std::string::npos);
  EXPECT_NE(run_report({"--session", "peg=/nowhere/at/all", "--out", "x"}).what.find("/nowhere/at/all"),
            std::string::npos);
}

}  // namespace
}  // namespace tandem::lab
