#include "client/app/run_recording.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <system_error>
#include <utility>

#include "common/base/time.hpp"
#include "common/secure/key_pair.hpp"

namespace tandem::client {
namespace {

constexpr Duration kLinkPeriod{std::chrono::seconds(1)};

}  // namespace

ClientRecording recording_settings(const ClientOptions& options, const std::filesystem::path& file) {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  ClientRecording settings{.file = file,
                           .every = options.record_every,
                           .unix_offset = since_1970 - SteadyClock().now().time_since_epoch(),
                           .rotation = options.record_rotation};
  settings.about.set_program("tandem-client " TANDEM_VERSION);
  settings.about.set_recording(secure::random_u64());
  settings.about.set_user_name(options.io.client.session.user_name);
  settings.about.set_device(options.device.name);
  settings.about.set_profile(options.device.profile.name);
  settings.about.set_stage(options.stage.name);
  return settings;
}

std::filesystem::path next_recording_file(const ClientOptions& options,
                                          std::chrono::system_clock::time_point since_1970) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(since_1970);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 48> name{};
  std::strftime(name.data(), name.size(), "tandem-%Y%m%dT%H%M%SZ.mcap", &utc);
  std::error_code error;
  const std::filesystem::path folder = options.record.parent_path();
  const std::filesystem::path whole =
      std::filesystem::absolute(folder.empty() ? "." : folder, error).lexically_normal();
  return (error ? folder : whole) / name.data();
}

LinkFigures link_figures(const ClientIoSnapshot& io, LocalTime now) {
  LinkFigures figures{.at = now,
                      .state = name_of(io.status.state),
                      .has_clock = io.clock.is_known,
                      .clock_offset = io.clock.offset,
                      .round_trip = io.clock.round_trip,
                      .minimum_round_trip = io.clock.minimum_round_trip,
                      .sent = io.counters.datagrams_sent,
                      .received = io.counters.datagrams_received,
                      .reconnects = io.counters.reconnects};
  for (std::size_t i = 1; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
    const auto reason = static_cast<proto::DropReason>(i);
    figures.dropped += io.counters.received_drops.count(reason) + io.counters.sent_drops.count(reason);
  }
  return figures;
}

std::string recording_line(const ClientRecorder& recorder, Duration length) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), ": %.0f s, %.2f MB", to_seconds(length),
                static_cast<double>(recorder.bytes_written()) / 1e6);
  std::string line = recorder.name().string() + text.data();
  if (recorder.lost() > 0) line += ", " + std::to_string(recorder.lost()) + " messages left out";
  const std::string news = recorder.newest_news();
  return news.empty() ? line : line + "; " + news;
}

boost::json::object recording_json(const ClientRecorder& recorder) {
  return {{"file", recorder.file().path().string()},
          {"files", recorder.file().parts()},
          {"bytes", recorder.file().bytes_written()},
          {"messages", recorder.file().messages_written()},
          {"lost", recorder.lost()}};
}

RunRecordings::RunRecordings(const ClientOptions& options, std::function<void(const std::string&)> on_news)
    : options_(options), on_news_(std::move(on_news)) {}

void RunRecordings::begin(const std::filesystem::path& file) {
  auto recorder = std::make_unique<ClientRecorder>(recording_settings(options_, file), on_news_);
  if (recorder_) earlier_.push_back(recording_json(*recorder_));
  recorder_ = std::move(recorder);
  since_ = SteadyClock().now();
  next_link_ = {};
  is_recording_ = true;
}

void RunRecordings::end() {
  if (!std::exchange(is_recording_, false)) return;
  recorder_->finish();
  length_ = SteadyClock().now() - since_;
  lost_ += recorder_->lost();
}

std::string RunRecordings::toggle() {
  problem_.clear();
  if (is_recording_) {
    end();
    return state();
  }
  try {
    begin(next_recording_file(options_, std::chrono::system_clock::now()));
  } catch (const std::exception& error) {
    problem_ = error.what();
  }
  return state();
}

std::string RunRecordings::state() const {
  if (!problem_.empty()) return problem_;
  if (!recorder_) return {};
  if (is_recording_) return "recording " + recording_line(*recorder_, SteadyClock().now() - since_);
  return "recorded " + recording_line(*recorder_, length_);
}

void RunRecordings::add(const TickRecord& record, int phase) {
  if (is_recording_) recorder_->add(record, phase);
}

void RunRecordings::add_link(const ClientIoSnapshot& io, LocalTime now) {
  if (!is_recording_ || now < next_link_) return;
  next_link_ = now + kLinkPeriod;
  recorder_->add(link_figures(io, now));
}

void RunRecordings::add_to(boost::json::object& summary) const {
  if (recorder_) summary["recording"] = recording_json(*recorder_);
  if (!earlier_.empty()) summary["earlier_recordings"] = earlier_;
}

}  // namespace tandem::client
