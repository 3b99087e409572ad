#include "server/recording/server_recorder.hpp"

#include <array>
#include <ctime>
#include <stdexcept>
#include <system_error>

namespace tandem::server {
namespace {

/// Period of the recorder thread. The ring of a room holds the records of at least 1 s with two users, so it cannot
/// overflow within this period.
constexpr Duration kWriteEvery = std::chrono::milliseconds(20);

/// Replaces the characters of a room name that are not allowed in a file name.
std::string plain(std::string name) {
  for (char& c : name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    if (!is_plain) c = '_';
  }
  return name;
}

std::string time_name() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y%m%dT%H%M%SZ", &utc);
  return text.data();
}

}  // namespace

ServerRecorder::ServerRecorder(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                               const std::vector<RoomRecording>& settings,
                               std::function<void(const std::string&)> on_news)
    : on_news_(std::move(on_news)) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw std::invalid_argument("--record " + folder.string() + ": " + error.message() + "; name a folder");
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    RoomRecording own = settings.at(i);
    const std::string stem = plain(rooms[i]->name()) + "-" + time_name();
    own.file = folder / (stem + ".mcap");
    for (int n = 2; std::filesystem::exists(own.file); ++n)
      own.file = folder / (stem + "_" + std::to_string(n) + ".mcap");
    recorders_.push_back(std::make_unique<RoomRecorder>(*rooms[i], std::move(own)));
    rooms[i]->watch(*recorders_.back());
  }
  thread_ = std::make_unique<recording::RecorderThread>(kWriteEvery, [this] { drain(); });
}

ServerRecorder::~ServerRecorder() {
  finish();
}

void ServerRecorder::drain() {
  for (const auto& recorder : recorders_) {
    recorder->drain();
    const std::string news = recorder->pop_news();
    if (!news.empty()) on_news_(news);
  }
}

void ServerRecorder::finish() {
  if (thread_ == nullptr) return;
  thread_->stop();
  thread_.reset();
  for (const auto& recorder : recorders_) recorder->finish();
}

}  // namespace tandem::server
