#include "common/recording/recording_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace tandem::recording {
namespace {

/// Time without a failed write after which the disk counts as usable again. The delay is needed because a nearly full
/// disk sometimes accepts a small chunk between failures.
constexpr std::uint64_t kTrustAfterNs = 5'000'000'000;

}  // namespace

RecordingFile::RecordingFile(std::filesystem::path file, McapWriter writer, RotationSettings rotation,
                             Describe describe)
    : first_(std::move(file)), writer_(std::move(writer)), rotation_(rotation), describe_(std::move(describe)) {
  open(0);
  if (!is_failing_) return;
  throw std::invalid_argument("recording " + path_.string() + ": " + pop_news() +
                              "; name a file that is not there, in a folder that can be written");
}

RecordingFile::~RecordingFile() {
  finish();
}

/// Creates the next file and sets descriptor_ and path_. Skips the numbers of existing files.
bool RecordingFile::open_new_file() {
  constexpr int kTries = 1000;
  for (int i = 0; i < kTries; ++i) {
    char number[16];
    std::snprintf(number, sizeof number, "-%03u", ++file_number_);
    const std::string name = first_.stem().string() + number + first_.extension().string();
    path_ = file_number_ == 1 ? first_ : first_.parent_path() / name;
    descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (descriptor_ >= 0 || errno != EEXIST || file_number_ == 1) break;
  }
  if (descriptor_ < 0) --file_number_;
  return descriptor_ >= 0;
}

/// Begins the next part of the recording. If its file cannot be created, flush() tries again; messages are lost until
/// it succeeds.
void RecordingFile::open(std::uint64_t now_ns) {
  begun_ns_ = now_ns;
  size_ = 0;
  is_described_ = false;
  open_new_file();
  if (append(writer_.begin())) {
    ++part_;
    return;
  }
  failed_ns_ = now_ns;
  if (descriptor_ < 0) return;
  close();
  ::unlink(path_.c_str());
  --file_number_;
}

void RecordingFile::close() {
  ::close(std::exchange(descriptor_, -1));
}

/// Appends all bytes or none, and returns whether it appended them. After a partial write the file is truncated to its
/// previous size, so that it remains valid.
bool RecordingFile::append(std::span<const std::uint8_t> bytes) {
  std::size_t done = 0;
  while (descriptor_ >= 0 && done < bytes.size()) {
    const ssize_t written = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) break;
    done += static_cast<std::size_t>(written);
  }
  if (done == bytes.size() && descriptor_ >= 0) {
    size_ += done;
    bytes_written_ += done;
    return true;
  }
  const char* const reason = std::strerror(errno);
  if (!std::exchange(is_failing_, true)) {
    news_ = path_.string() + " cannot be written: " + reason +
            "; messages that are not recorded are counted, and the session continues";
  }
  if (done > 0 && ::ftruncate(descriptor_, static_cast<off_t>(size_)) == 0) {
    ::lseek(descriptor_, static_cast<off_t>(size_), SEEK_SET);
  }
  return false;
}

bool RecordingFile::is_due(std::uint64_t now_ns) const {
  const auto max_age_ns = static_cast<std::uint64_t>(rotation_.max_age / std::chrono::nanoseconds(1));
  return (rotation_.max_bytes > 0 && size_ >= rotation_.max_bytes) ||
         (max_age_ns > 0 && now_ns > begun_ns_ + max_age_ns);
}

void RecordingFile::add(std::uint16_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> data) {
  if (begun_ns_ == 0) begun_ns_ = time_ns;
  if (!is_described_ && !is_described_in_chunk_) {
    writer_.add(0, time_ns, describe_(part_));
    is_described_in_chunk_ = true;
  }
  writer_.add(channel, time_ns, data);
}

void RecordingFile::flush(std::uint64_t now_ns) {
  if (is_finished_) return;
  if (descriptor_ < 0) open(now_ns);
  const std::uint64_t messages = writer_.waiting_messages();
  if (messages == 0) return;
  const bool has_description = std::exchange(is_described_in_chunk_, false);
  if (!append(writer_.pop_chunk())) {
    writer_.drop_chunk();
    messages_lost_ += messages;
    failed_ns_ = now_ns;
    return;
  }
  if (is_failing_ && now_ns >= failed_ns_ + kTrustAfterNs) {
    is_failing_ = false;
    news_ = path_.string() + " is written again";
  }
  messages_written_ += messages;
  is_described_ = is_described_ || has_description;
  if (!is_due(now_ns)) return;
  append(writer_.finish());
  close();
  open(now_ns);
}

void RecordingFile::finish() {
  if (is_finished_) return;
  flush(begun_ns_);
  is_finished_ = true;
  if (descriptor_ < 0) return;
  append(writer_.finish());
  close();
}

std::string RecordingFile::pop_news() {
  return std::exchange(news_, {});
}

}  // namespace tandem::recording
