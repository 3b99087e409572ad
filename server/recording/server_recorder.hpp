// Recordings of all rooms of a server, and the thread that writes them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/recording/recorder_thread.hpp"
#include "server/recording/room_recorder.hpp"
#include "server/room/server_rooms.hpp"

namespace tandem::server {

/// Writes one recording per room into a folder. The first file of a recording is named ROOM-20261122T071500Z.mcap. When
/// a file is full, the next one begins (rotation); its name ends with -002, -003 and so on.
class ServerRecorder final : public RoomService {
 public:
  /// Starts to record the rooms, which must outlive the recorder and must not have stepped yet.
  /// In      settings  settings of each room, in the order of `rooms`
  ///         on_news  receives messages for the operator; called on the recorder thread
  /// Fails   std::invalid_argument if the folder or a file cannot be created
  ServerRecorder(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                 const std::vector<RoomRecording>& settings, std::function<void(const std::string&)> on_news);
  ~ServerRecorder() override;
  ServerRecorder(const ServerRecorder&) = delete;
  ServerRecorder& operator=(const ServerRecorder&) = delete;

  /// Writes the pending steps, closes the files and ends the thread.
  void finish() override;
  /// Recorders in the order of the rooms. Before finish() only their counters may be used.
  const std::vector<std::unique_ptr<RoomRecorder>>& rooms() const { return recorders_; }

 private:
  void drain();

  std::vector<std::unique_ptr<RoomRecorder>> recorders_;
  std::function<void(const std::string&)> on_news_;
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
