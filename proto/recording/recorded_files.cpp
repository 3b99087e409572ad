#include "proto/recording/recorded_files.hpp"

#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::proto {
namespace {

std::filesystem::path follower(const std::filesystem::path& first, std::uint32_t number) {
  char text[16];
  std::snprintf(text, sizeof text, "-%03u", number);
  return first.parent_path() / (first.stem().string() + text + first.extension().string());
}

/// Which recording a file belongs to, by its first message; 0: none of ours.
std::uint64_t recording_of(const std::string& topic, const recording::Message& message) {
  wire::RecordedRoom room;
  wire::RecordedSession session;
  if (topic == "/room" && parse_recorded(message, room)) return room.recording();
  if (topic == "/session" && parse_recorded(message, session)) return session.recording();
  return 0;
}

}  // namespace

RecordingEnd read_recording(const std::filesystem::path& first, const OnMessage& on_message) {
  RecordingEnd end;
  std::uint64_t recording = 0;
  std::filesystem::path path = first;
  for (std::uint32_t number = 2;; ++number) {
    std::ifstream in(path, std::ios::binary);
    if (!in) break;
    recording::McapReader reader(in);
    bool goes_on = true, is_first = true;
    while (const auto message = goes_on ? reader.next() : std::nullopt) {
      const std::string topic = reader.channel(message->channel)->topic;
      if (std::exchange(is_first, false)) {
        const std::uint64_t own = recording_of(topic, *message);
        if (!end.files.empty() && own != recording) return end;
        recording = own;
        end.files.push_back(path);
      }
      goes_on = on_message(topic, *message);
    }
    if (!goes_on) return end;
    if (is_first && end.files.empty()) {
      throw std::invalid_argument(first.string() + ": no message can be read; " +
                                  (reader.why().empty() ? "it is empty" : reader.why()));
    }
    if (reader.end() != recording::McapReader::End::kWhole) {
      end.is_whole = false;
      end.why = path.string() + ": " + reader.why();
    }
    path = follower(first, number);
  }
  if (end.files.empty()) throw std::invalid_argument(first.string() + " cannot be opened; name a recording");
  return end;
}

}  // namespace tandem::proto
