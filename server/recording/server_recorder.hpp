// Recordings of a server's rooms, and the thread that writes them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/recording/recorder_thread.hpp"
#include "server/recording/room_recorder.hpp"
#include "server/room/server_rooms.hpp"

namespace tandem::server {

/// Writes one file per room into a folder: ROOM-20261122T071500Z.mcap, and -002, … as it rotates.
class ServerRecorder final : public RoomService {
 public:
  /// Watches the rooms from now on. The rooms outlive the recorder, and do not step yet.
  /// In      settings  for each room
  ///         on_news  called on the recorder's thread
  /// Fails   std::invalid_argument: the folder or a file cannot be made
  ServerRecorder(const std::filesystem::path& folder, const std::vector<std::unique_ptr<Room>>& rooms,
                 const std::vector<RoomRecording>& settings, std::function<void(const std::string&)> on_news);
  ~ServerRecorder() override;
  ServerRecorder(const ServerRecorder&) = delete;
  ServerRecorder& operator=(const ServerRecorder&) = delete;

  /// Writes the pending steps and closes the files.
  void finish() override;
  /// Recorders in the order of the rooms. Use them after finish(); their counters at any time.
  const std::vector<std::unique_ptr<RoomRecorder>>& rooms() const { return recorders_; }

 private:
  void drain();

  std::vector<std::unique_ptr<RoomRecorder>> recorders_;
  std::function<void(const std::string&)> on_news_;
  std::unique_ptr<recording::RecorderThread> thread_;
};

}  // namespace tandem::server
