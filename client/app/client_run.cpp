// See client_run.hpp.
#include "client/app/client_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/app/run_recording.hpp"
#include "client/app/run_report.hpp"
#include "client/app/run_settings.hpp"
#include "client/app/second_hand.hpp"
#include "client/app/start_run.hpp"
#include "client/app/stop_signals.hpp"
#include "client/app/summary.hpp"
#include "client/app/trace.hpp"
#include "client/commands/command_run.hpp"
#include "client/haptics/haptic_loop.hpp"
#include "client/net/client_io.hpp"
#include "client/session/scene_from_wire.hpp"
#include "client/view/screen/screen.hpp"
#include "client/view/window.hpp"
#include "common/realtime/output.hpp"
#include "devices/sim/hand_path.hpp"
#include "proto/coupling_fields.hpp"

namespace tandem::client {
namespace {

constexpr Duration kMainPeriod{std::chrono::milliseconds(10)};
constexpr Duration kStatusPeriod{std::chrono::seconds(1)};
// Maximum time to join a room. It exceeds the sum of the session's time-outs for the steps of a join.
constexpr Duration kMaxJoin{std::chrono::seconds(20)};

/// Haptic loops that the exit handler must stop. Set only in a run with a window; null while no force may be displayed.
std::atomic<HapticLoop*> loop_to_stop{nullptr};
std::atomic<SecondHand*> second_to_stop{nullptr};

/// Exit handler that ramps the force down. It is needed because the window library calls exit() in the middle of a
/// frame if the connection to the display is lost.
void release_at_exit() {
  HapticLoop* const loop = loop_to_stop.exchange(nullptr);
  if (loop == nullptr) return;
  SecondHand* const second = second_to_stop.exchange(nullptr);
  loop->request_stop();
  if (second != nullptr) second->request_stop();
  loop->stop();
  if (second != nullptr) second->stop();
  // A device with a thread of its own receives the zero force only after some time (devices/threaded_device.hpp); 60 ms
  // suffice.
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  std::cerr << "tandem-client: the display was lost\n";
  std::_Exit(1);
}

/// Last texts about the session, stored so that a text is logged only when it changes.
struct SessionTexts {
  std::string why;
  std::string stage_note;
  std::string news;  ///< last text about a change in the room
};

/// Findings of the newest coupling check, as data and as text for the user.
struct ExplainedCoupling {
  std::uint64_t check = 0;  ///< number of the check to which the findings belong (CouplingCheck::number)
  std::vector<haptics::StabilityFinding> findings;
  std::string lines;
};

/// Body of the current scene whose displacement the run reports.
struct WatchedBody {
  std::shared_ptr<const wire::Joined> joined;
  BodyId id;  ///< id of the body; invalid if there is none
  std::string name;
};

/// State of the wait until the hands of all users in the room start together.
struct StartWait {
  LocalTime since{};
  bool has_begun = false;  ///< true once this user's hand follows its path
  std::string problem;     ///< error message if the room did not begin in time; otherwise empty
};

/// State of the screenshot requested by --screenshot.
struct Screenshot {
  LocalTime due{};
  bool is_taken = false;
};

/// Parts of a run that only a run with a window has.
struct WindowPart {
  Screen* screen = nullptr;                ///< window of the operating system; null: a headless run
  std::vector<std::string> invitations{};  ///< invitations that this user can pass on to other users
  Screenshot screenshot{};
  RunEnd::Next next = RunEnd::Next::kQuit;
};

class ClientRun {
 public:
  ClientRun(const ClientOptions& options, realtime::Output& output, WindowPart part);
  ~ClientRun() {
    loop_to_stop = nullptr;
    second_to_stop = nullptr;
  }
  ClientRun(const ClientRun&) = delete;
  ClientRun& operator=(const ClientRun&) = delete;

  /// Out     has_begun  see run_client()
  RunEnd run(bool& has_begun);

 private:
  void open_second();
  void open_window();
  void pause();
  void follow_request(WindowRequest request);
  void end_by_itself(const ClientIoSnapshot& io);
  bool join();
  void watch_body(const std::shared_ptr<const wire::Joined>& joined);
  void start_loop();
  void keep_going();
  void drain_records();
  void on_record(const TickRecord& record);
  void give_up_waiting(const ClientIoSnapshot& io, LocalTime now);
  void run_commands(const ClientIoSnapshot& io, LocalTime now);
  void set_what_is_due();
  void follow_session(const ClientIoSnapshot& io);
  void take_events();
  void explain_coupling(const CouplingCheck& check);
  RunSummary summary(ClientIoSnapshot io) const;
  void print_json(const ClientIoSnapshot& io);
  std::vector<std::string> problems_at_end(const ClientIoSnapshot& io);
  int finish();

  void log(const std::string& line) { output_.err("tandem-client: " + line + "\n"); }

  ClientOptions options_;
  realtime::Output& output_;
  haptics::SafetySettings safety_;
  WindowPart part_;
  std::optional<Window> window_;  ///< none in a headless run
  std::unique_ptr<devices::Device> device_;
  devices::HandPath hand_path_;  ///< the phases of this path are also the phases of the run's report
  ClientIo io_;
  std::optional<TraceWriter> trace_;
  RunRecordings recordings_;
  RunReport report_;
  WatchedBody watched_;
  std::vector<std::string> realtime_not_granted_;
  SessionTexts texts_;
  std::size_t sets_done_ = 0;
  ExplainedCoupling coupling_;
  StartWait start_;
  LocalTime next_status_{};
  TickRecord newest_;
  bool is_over_ = false;
  std::optional<HapticLoop> loop_;      ///< destroyed before the objects above, which it uses
  std::unique_ptr<SecondHand> second_;  ///< null if there is only one device
  std::optional<CommandRun> commands_;  ///< empty unless --commands is used
  StopSignals stop_signals_;            ///< last member, because its thread calls the loop
};

ClientRun::ClientRun(const ClientOptions& options, realtime::Output& output, WindowPart part)
    : options_(with_pointer(options)),
      output_(output),
      part_(std::move(part)),
      device_(devices::open_device(options_.device)),
      hand_path_(devices::hand_path_of(options.device)),
      io_(io_settings(options, safety_), *device_),
      recordings_(options_, [&output](const std::string& news) { output.err("tandem-client: " + news + "\n"); }),
      report_(hand_path_.phases(), safety_.silence_zero) {
  if (!options_.record.empty()) recordings_.begin(options_.record);
  if (!options.trace.empty()) trace_.emplace(options.trace, options.trace_every);
}

RunEnd ClientRun::run(bool& has_begun) {
  if (part_.screen != nullptr) open_window();
  open_second();
  io_.start();
  if (!join()) return {.code = 1, .next = part_.next};
  has_begun = true;
  start_loop();
  while (!is_over_) keep_going();
  return {.code = finish(), .next = part_.next};
}

/// Opens the second device before joining, so that its errors are reported at once.
void ClientRun::open_second() {
  if (!options_.second_device) return;
  const ClientOptions options = SecondHand::options_of(options_);
  second_ = std::make_unique<SecondHand>(options, io_settings(options, safety_),
                                         [this](const std::string& line) { log(line); });
}

void ClientRun::open_window() {
  WindowSettings settings;
  const SessionSettings& session = options_.io.client.session;
  settings.title = "tandem: " + session.user_name;
  settings.screen = part_.screen;
  settings.begins_guide = options_.window.begins_guide;
  settings.is_scene_only = options_.window.is_scene_only;
  settings.invitations = part_.invitations;
  settings.molecules = options_.window.molecules;
  settings.molecule_colors = options_.window.molecule_colors;
  settings.pointer = options_.device.pointer;
  settings.facts = {{"you", session.user_name + ", " + role_name(session.role)},
                    {"device", options_.device.name + ", as " + options_.device.profile.name}};
  if (options_.io.links) settings.link = options_.io.links->up;
  settings.workspace = session.workspace;
  settings.client = &io_;
  settings.recording_folder = next_recording_file(options_, std::chrono::system_clock::now()).parent_path().string();
  if (options_.window.screenshot.empty()) settings.cap = cap_for_camera(options_.device.name);
  // A screenshot must be reproducible, so it does not use settings that earlier runs have stored.
  settings.remembers = options_.window.screenshot.empty();
  window_.emplace(std::move(settings));
  [[maybe_unused]] static const int registered = std::atexit(release_at_exit);
}

/// Waits until the main thread's next poll. With a window, draws a frame instead.
void ClientRun::pause() {
  if (window_) {
    window_->show_recording(recordings_.is_recording(), recordings_.state());
    window_->draw(io_.haptics().newest_view(), io_.snapshot(), coupling_.lines);
    if (window_->pop_record_press()) log(recordings_.toggle());
    follow_request(window_->pop_request());
  } else {
    std::this_thread::sleep_for(kMainPeriod);
  }
}

/// Ends the run if the user has requested a new session in the window (a scene, a server or the guide).
void ClientRun::follow_request(WindowRequest request) {
  if (request == WindowRequest::kNone) return;
  part_.next = RunEnd::Next::kOpen;
  if (request == WindowRequest::kHost) part_.next = RunEnd::Next::kHost;
  if (request == WindowRequest::kGuide) part_.next = RunEnd::Next::kGuide;
  is_over_ = true;
}

/// Ends the run if the session has ended. A run with a window or with --commands continues, and reports the reason to
/// the user.
void ClientRun::end_by_itself(const ClientIoSnapshot& io) {
  if (!window_) {
    is_over_ = is_over_ || (io.status.state == SessionState::kEnded && !commands_);
    return;
  }
  is_over_ = is_over_ || window_->is_closed();
  if (options_.window.screenshot.empty() || is_over_ || SteadyClock().now() < part_.screenshot.due) return;
  if (window_->is_making()) return;
  window_->save_next_frame(options_.window.screenshot);
  pause();
  part_.screenshot.is_taken = true;
  is_over_ = true;
}

/// Waits until the room is joined. Returns false if a stop signal arrives first.
bool ClientRun::join() {
  const SteadyClock clock;
  const LocalTime give_up = clock.now() + kMaxJoin;
  while (true) {
    const ClientIoSnapshot io = io_.snapshot();
    take_events();
    if (io.status.state == SessionState::kActive && io.joined) {
      log(joined_line(*io.joined));
      for (const std::string& note : shown_notes(*io.joined)) log("scene: " + note);
      const std::string missing = missing_of(device_->spec());
      if (has_tool(io.joined->role()) && !missing.empty()) log(missing);
      watch_body(io.joined);
      return true;
    }
    if (io.status.state == SessionState::kEnded) throw std::runtime_error(io.status.why);
    if (clock.now() > give_up) throw std::runtime_error("not joined within 20 s: " + io.status.why);
    pause();
    if (stop_signals_.is_requested() || (window_ && window_->is_closed()) || is_over_) {
      log("stopped before the room was joined");
      return false;
    }
  }
}

/// Selects the watched body after the scene has changed.
void ClientRun::watch_body(const std::shared_ptr<const wire::Joined>& joined) {
  watched_.joined = joined;
  watched_.id = watched_body(*joined);
  io_.haptics().watch(watched_.id);
  if (!watched_.id.is_valid()) return;
  watched_.name = joined->scene().bodies(static_cast<int>(watched_.id.value) - 1).name();
}

void ClientRun::start_loop() {
  HapticLoopSettings settings;
  settings.realtime_priority = options_.realtime_priority;
  settings.cpu = options_.cpu;
  settings.keeps_awake = options_.keeps_awake;
  settings.duration = options_.duration;
  loop_.emplace(settings, io_.haptics(), [this] { io_.notify(); });
  if (window_) loop_to_stop = &*loop_;
  realtime_not_granted_ = loop_->start();
  if (options_.insists_on_realtime && !realtime_not_granted_.empty()) {
    throw std::runtime_error("--insist-realtime: " + joined_lines(realtime_not_granted_));
  }
  for (const std::string& line : realtime_not_granted_) log(line);
  if (loop_->keeps_awake()) log("keeping a processor awake for the haptic thread; --keep-awake off turns this off");
  if (second_) second_->start(io_.snapshot());
  second_to_stop = second_.get();
  // With a window, the mouse moves the hand, so commands must not move it.
  if (options_.reads_commands) {
    commands_.emplace(io_, window_ ? nullptr : options_.device.pointer, STDIN_FILENO, STDOUT_FILENO);
  }
  stop_signals_.when_requested([this] {
    loop_->request_stop();
    if (second_) second_->request_stop();
  });
  start_.since = SteadyClock().now();
  next_status_ = start_.since + kStatusPeriod;
  part_.screenshot.due = start_.since + options_.window.after;
}

void ClientRun::keep_going() {
  pause();
  if (loop_->is_over()) is_over_ = true;
  drain_records();
  set_what_is_due();
  take_events();
  const ClientIoSnapshot io = io_.snapshot();
  if (second_) second_->poll(io);
  follow_session(io);
  const LocalTime now = SteadyClock().now();
  give_up_waiting(io, now);
  recordings_.add_link(io, now);
  run_commands(io, now);
  if (!options_.prints_json && !commands_ && now >= next_status_) {
    next_status_ += kStatusPeriod;
    output_.out(status_line(io, report_.length(), newest_));
  }
}

void ClientRun::run_commands(const ClientIoSnapshot& io, LocalTime now) {
  if (!commands_) return;
  commands_->poll(io, io_.haptics().newest_view(), now);
  is_over_ = is_over_ || commands_->is_over();
}

/// Ends a run of limited duration if the room does not begin within the start time-out.
void ClientRun::give_up_waiting(const ClientIoSnapshot& io, LocalTime now) {
  if (io.hand_start.kind != HandStart::Kind::kAwaited || start_.has_begun) start_.since = now;
  if (!options_.duration || now - start_.since < options_.start_timeout) return;
  is_over_ = true;
  char line[96];
  std::snprintf(line, sizeof line, "the room did not begin within %g s: ", to_seconds(options_.start_timeout));
  start_.problem = line + texts_.news;
}

void ClientRun::set_what_is_due() {
  for (; sets_done_ < options_.sets.size() && options_.sets[sets_done_].first <= report_.length(); ++sets_done_) {
    const wire::SetParameter& next = options_.sets[sets_done_].second;
    if (next.name() == proto::kLawParameter) {
      io_.send(command::SetLaw{next.text()});
    } else {
      io_.send(command::SetParameter{next.name(), next.value()});
    }
  }
}

void ClientRun::drain_records() {
  TickRecord record;
  while (loop_->pop(record)) on_record(record);
}

void ClientRun::on_record(const TickRecord& record) {
  const int phase = hand_path_.phase_at(record.sample.path_time);
  start_.has_begun = start_.has_begun || record.has_begun;
  report_.add(record, phase);
  if (window_) window_->add(record);
  if (trace_) trace_->write(record, phase);
  recordings_.add(record, phase);
  const std::string news = report_.pop_device_news();
  constexpr std::string_view kEnded = "lost: ";
  const bool is_end_of_replay = options_.device.name == "replay" && news.starts_with(kEnded);
  if (is_end_of_replay) log("the replayed hand has ended: " + news.substr(kEnded.size()));
  if (!news.empty() && !is_end_of_replay) log("device " + options_.device.name + " is " + news);
  newest_ = record;
}

/// Reports the events since the last call.
void ClientRun::take_events() {
  // Collects the texts of all news of this call. The events of one step of a game arrive together, and the window can
  // show only one text at a time.
  std::string together;
  while (const std::optional<Event> event = io_.next()) {
    if (const auto* const news = std::get_if<event::News>(&*event)) {
      texts_.news = news->text;
      log(texts_.news);
      together += (together.empty() ? "" : "; ") + texts_.news;
    } else if (const std::string line = log_line(*event); options_.is_verbose && !line.empty()) {
      log(line);
    }
    if (commands_) commands_->receive(*event);
  }
  if (window_ && !together.empty()) window_->show_news(together);
}

void ClientRun::follow_session(const ClientIoSnapshot& io) {
  const SessionStatus& status = io.status;
  if (io.joined != nullptr && io.joined != watched_.joined) watch_body(io.joined);
  if (report_.is_silent()) {
    report_.explain_silence(status.why.empty() ? "no state was received, although the connection is open" : status.why);
  }
  const RenderingStatus& rendering = io.rendering;
  if (status.why != texts_.why && !status.why.empty()) log(status.why);
  texts_.why = status.why;
  if (stage_line(rendering.stage) != stage_line(options_.stage)) log(stage_line(rendering.stage));
  options_.stage = rendering.stage;
  if (rendering.stage_note != texts_.stage_note && !rendering.stage_note.empty()) log(rendering.stage_note);
  texts_.stage_note = rendering.stage_note;
  explain_coupling(io.coupling_check);
  end_by_itself(io);
}

// Explains a coupling check that the io thread has completed. The search for a remedy takes tens of milliseconds, so it
// runs on the main thread.
void ClientRun::explain_coupling(const CouplingCheck& check) {
  if (check.number == coupling_.check) return;
  coupling_.check = check.number;
  coupling_.findings = explained(check, options_.device.profile);
  std::string lines = coupling_lines(coupling_.findings);
  if (lines != coupling_.lines) output_.err(lines);
  coupling_.lines = std::move(lines);
}

RunSummary ClientRun::summary(ClientIoSnapshot io) const {
  return {.options = options_,
          .device = device_->spec(),
          .realtime_not_granted = realtime_not_granted_,
          .loop = loop_->report(),
          .trace_overflows = loop_->trace_overflows(),
          .counters = io_.haptics().counters(),
          .io = std::move(io),
          .coupling_findings = coupling_.findings,
          .watched = watched_.id,
          .watched_name = watched_.name,
          .run = report_};
}

void ClientRun::print_json(const ClientIoSnapshot& io) {
  boost::json::object report = to_json(summary(io));
  if (second_) report["second"] = second_->summary();
  recordings_.add_to(report);
  output_.out(boost::json::serialize(report) + "\n");
}

int ClientRun::finish() {
  loop_to_stop = nullptr;
  second_to_stop = nullptr;
  loop_->request_stop();
  if (second_) second_->request_stop();
  loop_->stop();
  if (second_) second_->stop();
  if (commands_) commands_->finish();
  drain_records();
  const ClientIoSnapshot io = io_.snapshot();
  io_.stop();
  take_events();
  explain_coupling(io.coupling_check);
  recordings_.end();
  if (options_.prints_json) print_json(io);
  const std::vector<std::string> problems = problems_at_end(io);
  for (const std::string& problem : problems) log(problem);
  return problems.empty() ? 0 : 1;
}

/// Returns one text for each task of the run that has failed. If there is any, the exit code is 1.
std::vector<std::string> ClientRun::problems_at_end(const ClientIoSnapshot& io) {
  const auto if_true = [](bool is_so, const std::string& problem) { return is_so ? problem : std::string(); };
  const std::size_t unset = options_.sets.size() - sets_done_;
  const std::uint64_t refused = options_.sets.empty() ? 0 : io.counters.refused_settings;
  std::vector<std::string> problems{
      second_ ? second_->problem() : "",
      if_true(trace_ && !trace_->flush(),
              "the trace is incomplete: " + options_.trace.string() + " could not be written"),
      start_.problem,
      commands_ ? commands_->problem() : "",
      if_true(recordings_.lost() > 0,
              "a recording is incomplete: " + std::to_string(recordings_.lost()) + " messages are not in it"),
      if_true(!options_.window.screenshot.empty() && !part_.screenshot.is_taken,
              "--screenshot: the run ended before the picture was taken; see --after and --duration"),
      if_true(unset > 0,
              "--set: the run ended before " + std::to_string(unset) + " of the parameters were set; see --duration"),
      if_true(refused > 0, "--set: the server refused " + std::to_string(refused) + " of the settings"),
      problem_at_end(io, options_.io.client.session)};
  std::erase(problems, "");
  return problems;
}

}  // namespace

int run_client(const ClientOptions& options, realtime::Output& output) {
  bool has_begun = false;
  if (!options.window.is_open) return ClientRun(options, output, {}).run(has_begun).code;
  check_screenshot(options.window.screenshot);
  Screen screen({.width = options.window.width,
                 .height = options.window.height,
                 .is_for_picture = !options.window.screenshot.empty()});
  const RunEnd end = run_client(options, output, screen, {}, has_begun);
  if (end.next == RunEnd::Next::kQuit) return end.code;
  return run_from_start(has_begun ? options_of_next(options) : options, output, screen, end.next);
}

RunEnd run_client(const ClientOptions& options, realtime::Output& output, Screen& screen,
                  const std::vector<std::string>& invitations, bool& has_begun) {
  return ClientRun(options, output, {.screen = &screen, .invitations = invitations}).run(has_begun);
}

}  // namespace tandem::client
