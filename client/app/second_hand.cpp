// See second_hand.hpp.
#include "client/app/second_hand.hpp"

#include <stdexcept>
#include <utility>

#include "client/app/summary.hpp"
#include "client/session/credentials.hpp"

namespace tandem::client {
namespace {

HapticLoopSettings loop_settings(const ClientOptions& options) {
  HapticLoopSettings settings;
  settings.realtime_priority = options.realtime_priority;
  settings.keeps_awake = options.keeps_awake;
  settings.duration = options.duration;
  return settings;
}

}  // namespace

ClientOptions SecondHand::options_of(const ClientOptions& first) {
  ClientOptions options = first;
  options.device = *first.second_device;
  options.second_device.reset();
  options.window = {};
  options.window.is_open = false;
  options.trace.clear();
  options.record.clear();
  options.io.client.session.token.clear();
  options.seed = first.seed + 1;
  options.device.seed = options.seed;
  SessionSettings& session = options.io.client.session;
  session.user_name += " 2";
  // A room has only one operator, and the first hand may be this operator.
  if (session.role == wire::ROLE_OPERATOR) session.role = wire::ROLE_MANIPULATOR;
  return options;
}

SecondHand::SecondHand(ClientOptions options, ClientIoSettings io, std::function<void(const std::string&)> log)
    : options_(std::move(options)),
      log_(std::move(log)),
      device_(devices::open_device(options_.device)),
      io_(std::move(io), *device_),
      report_({}, haptics::SafetySettings{}.silence_zero),
      loop_(loop_settings(options_), io_.haptics(), [this] { io_.notify(); }) {}

void SecondHand::start(const ClientIoSnapshot& first) {
  if (first.beside) io_.set_credentials(*first.beside);
  io_.start();
}

void SecondHand::poll(const ClientIoSnapshot& first) {
  last_ = io_.snapshot();
  if (last_.has_nudges != first.has_nudges) io_.send(command::SetNudges{first.has_nudges});
  const auto is_in_room = [](const ClientIoSnapshot& of) { return of.status.state == SessionState::kActive; };
  if (is_in_room(first) && is_in_room(last_)) follow(first.room);
  if (!has_started_ && last_.status.state == SessionState::kActive && last_.joined) start_loop();
  if (!has_started_ && last_.status.state == SessionState::kEnded) {
    throw std::runtime_error("second device: " + last_.status.why);
  }
  if (has_started_) pop_news();
  take_events();
  if (last_.status.why != last_why_ && !last_.status.why.empty()) log_("second device: " + last_.status.why);
  last_why_ = last_.status.why;
}

/// Moves to the room of the first hand. Each room is tried only once, because it may be full.
void SecondHand::follow(const std::string& room) {
  const bool is_tried = room == std::exchange(followed_to_, room);
  if (room != last_.room && !is_tried) io_.send(command::ChangeRoom{room});
}

void SecondHand::start_loop() {
  has_started_ = true;
  realtime_not_granted_ = loop_.start();
  log_("second device: " + joined_line(*last_.joined));
  const std::string missing = missing_of(device_->spec());
  if (!missing.empty()) log_(missing);
}

void SecondHand::pop_news() {
  TickRecord record;
  while (loop_.pop(record)) {
    report_.add(record, -1);
    const std::string news = report_.pop_device_news();
    if (!news.empty()) log_("second device " + options_.device.name + " is " + news);
  }
}

/// Reports the events of this hand, except changes in the room (News), which the first hand reports.
void SecondHand::take_events() {
  while (const std::optional<Event> event = io_.next()) {
    const std::string line = std::holds_alternative<event::News>(*event) ? "" : log_line(*event);
    if (options_.is_verbose && !line.empty()) log_("second device: " + line);
  }
}

void SecondHand::request_stop() noexcept {
  loop_.request_stop();
}

void SecondHand::stop() {
  loop_.stop();
  if (has_started_) pop_news();
  take_events();
  last_ = io_.snapshot();
  io_.stop();
}

std::string SecondHand::problem() const {
  if (!has_started_) return "the second device had not joined when the run ended";
  const std::string problem = problem_at_end(last_, options_.io.client.session);
  return problem.empty() ? problem : "the second device: " + problem;
}

boost::json::object SecondHand::summary() const {
  return to_json(RunSummary{.options = options_,
                            .device = device_->spec(),
                            .realtime_not_granted = realtime_not_granted_,
                            .loop = loop_.report(),
                            .trace_overflows = loop_.trace_overflows(),
                            .counters = io_.haptics().counters(),
                            .io = last_,
                            .coupling_findings = {},
                            .watched = {},
                            .watched_name = {},
                            .run = report_});
}

}  // namespace tandem::client
