#include "proto/recording/recorded_files.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::proto {
namespace {

/// Topics that this version of the program writes, for rooms and clients.
constexpr std::array<std::string_view, 6> kTopics{"/room", "/step", "/states", "/session", "/tick", "/link"};
constexpr std::uint32_t kMaxParts = 100'000;

/// Position of a file within a recording, from the first message of the file. `recording` is the random number of the
/// recording; 0: the file was not written by a program of this project.
struct PartOf {
  std::uint64_t recording = 0;
  std::uint32_t part = 0;
};

PartOf part_of(const std::string& topic, const recording::Message& message) {
  wire::RecordedRoom room;
  wire::RecordedSession session;
  if (topic == "/room" && parse_recorded(message, room)) return {room.recording(), room.part()};
  if (topic == "/session" && parse_recorded(message, session)) return {session.recording(), session.part()};
  return {};
}

/// Returns the existing files "attic-002.mcap", … in ascending order of their numbers, which may have gaps.
std::vector<std::filesystem::path> followers(const std::filesystem::path& first) {
  std::vector<std::pair<std::uint32_t, std::filesystem::path>> found;
  const std::string stem = first.stem().string() + "-";
  const std::filesystem::path folder = first.parent_path().empty() ? "." : first.parent_path();
  std::error_code error;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().stem().string();
    if (entry->path().extension() != first.extension() || !name.starts_with(stem)) continue;
    const std::string_view digits = std::string_view(name).substr(stem.size());
    const bool is_number =
        digits.size() >= 3 && digits.size() <= 6 && digits.find_first_not_of("0123456789") == std::string_view::npos;
    if (is_number) found.emplace_back(std::stoul(std::string(digits)), first.parent_path() / entry->path().filename());
  }
  std::ranges::sort(found);
  std::vector<std::filesystem::path> paths;
  for (auto& [number, path] : found) {
    if (number >= 2 && number <= kMaxParts) paths.push_back(std::move(path));
  }
  return paths;
}

class Reading {
 public:
  explicit Reading(const OnMessage& on_message) : on_message_(on_message) {}

  /// Reads one file. Returns false if `on_message` has stopped the reading.
  bool read(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) {
      note(path, "cannot be opened");
      return true;
    }
    recording::McapReader reader(in);
    bool goes_on = true, is_first = true;
    std::uint64_t last_ns = 0, unknown = 0;
    while (const auto message = goes_on ? reader.next() : std::nullopt) {
      const std::string topic = reader.channel(message->channel)->topic;
      if (std::exchange(is_first, false) && !accept_first(path, part_of(topic, *message))) return true;
      if (begun_ns_ == 0) begun_ns_ = message->log_ns;
      last_ns = message->log_ns;
      unknown += std::ranges::find(kTopics, topic) == kTopics.end() ? 1 : 0;
      goes_on = on_message_(topic, *message);
    }
    if (goes_on) note_end(path, reader, last_ns, unknown);
    return goes_on;
  }

  RecordingEnd end;

 private:
  /// Accepts a file by its first message. Returns false if the file belongs to a different recording.
  bool accept_first(const std::filesystem::path& path, const PartOf& own) {
    if (!end.files.empty() && own.recording != recording_) return false;
    if (!end.files.empty() && own.part > part_ + 1) {
      note(path, std::to_string(own.part - part_ - 1) + " part" + (own.part > part_ + 2 ? "s" : "") +
                     " of the recording before it are missing; put them beside it");
    }
    recording_ = own.recording;
    part_ = own.part;
    end.files.push_back(path);
    return true;
  }

  void note_end(const std::filesystem::path& path, const recording::McapReader& reader, std::uint64_t last_ns,
                std::uint64_t unknown) {
    if (reader.end() == recording::McapReader::End::kWhole) return;
    const bool is_stopped = reader.ends_behind_a_record() && unknown == 0;
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    std::string text = reader.why() + ", at byte " + std::to_string(reader.offset()) +
                       (error ? "" : " of " + std::to_string(size)) +
                       "; read until there: " + std::to_string(reader.messages()) + " messages";
    if (last_ns != 0)
      text += ", the last " + seconds_text(last_ns - std::min(begun_ns_, last_ns)) + " s after the first";
    if (unknown > 0) text += "; " + std::to_string(unknown) + " of them have a topic that is none of a recording";
    if (!is_stopped) {
      text +=
          "; copy the file again from where it was recorded, or use the readable part: later chunks may be recovered "
          "by \"mcap recover\" (mcap.dev)";
    }
    end.is_whole = false;
    end.is_damaged = end.is_damaged || !is_stopped;
    add(path.string() + ": " + text);
  }

  void note(const std::filesystem::path& path, const std::string& text) {
    end.is_damaged = true;
    add(path.string() + ": " + text);
  }
  void add(const std::string& line) { end.why += (end.why.empty() ? "" : "; ") + line; }

  static std::string seconds_text(std::uint64_t ns) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3f", static_cast<double>(ns) * 1e-9);
    return text.data();
  }

  const OnMessage& on_message_;
  std::uint64_t recording_ = 0, begun_ns_ = 0;
  std::uint32_t part_ = 0;
};

}  // namespace

RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message) {
  if (!std::ifstream(first, std::ios::binary)) {
    throw std::invalid_argument(first.string() + " cannot be opened; name a recording");
  }
  Reading reading(on_message);
  bool goes_on = reading.read(first);
  if (reading.end.files.empty()) {
    const std::string& why = reading.end.why;
    throw std::invalid_argument(why.empty() ? first.string() + ": no message can be read; it is empty"
                                            : first.string() + ": no message can be read; " + why);
  }
  for (const std::filesystem::path& path : followers(first)) {
    if (!goes_on) break;
    goes_on = reading.read(path);
  }
  return reading.end;
}

}  // namespace tandem::proto
