#include "client/recording/client_recorder.hpp"

#include <algorithm>

#include "client/recording/tick_codec.hpp"
#include "proto/recording/schema.hpp"

namespace tandem::client {
namespace {

constexpr Duration kPeriod = std::chrono::milliseconds(20);
/// Period of writing the file to disk. If the process is killed, at most the records of this period and of one drain
/// period of the ring are lost.
constexpr std::uint64_t kFlushEvery_ns = 250'000'000;
/// Capacity of the ring, enough for 4 s of ticks at 1 kHz.
constexpr std::size_t kCapacity = 4096;
enum : std::uint16_t { kSessionTopic, kTickTopic, kLinkTopic };

std::vector<recording::Channel> channels() {
  return {proto::channel_of("/session", wire::RecordedSession()), proto::channel_of("/tick", wire::RecordedTick()),
          proto::channel_of("/link", wire::RecordedLink())};
}

wire::RecordedLink recorded(const LinkFigures& figures) {
  const auto whole = [](Duration duration) {
    return static_cast<std::uint64_t>(std::max(duration, Duration(0)).count());
  };
  wire::RecordedLink out;
  out.set_state(std::string(figures.state));
  out.set_has_clock(figures.has_clock);
  out.set_clock_offset_ns(figures.clock_offset.count());
  out.set_round_trip_ns(whole(figures.round_trip));
  out.set_minimum_round_trip_ns(whole(figures.minimum_round_trip));
  out.set_datagrams_sent(figures.sent);
  out.set_datagrams_received(figures.received);
  out.set_datagrams_dropped(figures.dropped);
  out.set_reconnects(figures.reconnects);
  return out;
}

}  // namespace

ClientRecorder::ClientRecorder(ClientRecording settings, std::function<void(const std::string&)> on_news)
    : settings_(std::move(settings)),
      on_news_(std::move(on_news)),
      ring_(kCapacity),
      file_(settings_.file, recording::McapWriter(channels(), settings_.about.program()), settings_.rotation,
            [this](std::uint32_t part) {
              wire::RecordedSession about = settings_.about;
              about.set_part(part);
              about.set_every(static_cast<std::uint32_t>(settings_.every));
              return proto::bytes_of(about);
            }) {
  thread_.emplace(kPeriod, [this] { drain(); });
}

ClientRecorder::~ClientRecorder() {
  finish();
}

void ClientRecorder::push(const Record& record) noexcept {
  if (!ring_.push(record)) overflows_.fetch_add(1, std::memory_order_relaxed);
}

void ClientRecorder::add(const TickRecord& tick, int phase) noexcept {
  if (seen_++ % settings_.every == 0) push(std::pair(tick, phase));
}

void ClientRecorder::add(const LinkFigures& figures) noexcept {
  push(figures);
}

std::uint64_t ClientRecorder::unix_ns(LocalTime time) const {
  return static_cast<std::uint64_t>(std::max(Duration(0), time.time_since_epoch() + settings_.unix_offset).count());
}

void ClientRecorder::write(const Record& record) {
  if (const auto* tick = std::get_if<std::pair<TickRecord, int>>(&record)) {
    newest_ns_ = unix_ns(tick->first.at);
    file_.add(kTickTopic, newest_ns_, proto::bytes_of(client::recorded(tick->first, tick->second)));
  } else if (const auto* figures = std::get_if<LinkFigures>(&record)) {
    file_.add(kLinkTopic, unix_ns(figures->at), proto::bytes_of(recorded(*figures)));
  }
}

void ClientRecorder::report(const std::string& news) {
  on_news_(news);
  const std::scoped_lock lock(news_mutex_);
  newest_news_ = news;
}

std::string ClientRecorder::newest_news() const {
  const std::scoped_lock lock(news_mutex_);
  return newest_news_;
}

void ClientRecorder::drain() {
  const std::uint64_t before_ns = newest_ns_;
  while (ring_.pop(record_)) write(record_);
  if (newest_ns_ == before_ns || newest_ns_ >= flushed_ns_ + kFlushEvery_ns) {
    flushed_ns_ = newest_ns_;
    file_.flush(newest_ns_);
  }
  if (const std::string news = file_.pop_news(); !news.empty()) report(news);
  if (has_reported_overflow_ || overflows_.load(std::memory_order_relaxed) == 0) return;
  has_reported_overflow_ = true;
  report("recording " + settings_.file.string() + " does not keep up: ticks are left out, and counted");
}

void ClientRecorder::finish() {
  if (!thread_) return;
  thread_->stop();
  thread_.reset();
  file_.finish();
}

std::uint64_t ClientRecorder::lost() const {
  return overflows_.load(std::memory_order_relaxed) + file_.messages_lost();
}

}  // namespace tandem::client
