// A tandem-server that the window starts for a choice on the start screen. The simulated partner and the invitations
// belong to the server.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/start/child_program.hpp"
#include "client/start/start_choice.hpp"
#include "common/base/time.hpp"

namespace tandem::client {

/// A new folder for temporary files. The destructor removes it with its files.
class TemporaryFolder {
 public:
  /// Fails   std::runtime_error: the folder cannot be made
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Starts the server, and reads its output until it listens. The destructor ends server and partner.
///
/// Thread  main
class LocalServer {
 public:
  enum class State { kPreparing, kReady, kFailed };

  /// In      choice  problem_of(choice) must be empty; the kind must not be kJoin
  ///         beside  folder of tandem-server and tandem-client
  /// Fails   std::system_error or std::runtime_error if a program is missing or cannot be started, or if a folder or
  ///         file cannot be written
  LocalServer(StartChoice choice, const std::filesystem::path& beside);
  /// Ends the partner and then the server, each within a second at most.
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  /// Reads the lines that the server has printed. Starts the partner when the server listens.
  /// Fails   like the constructor, if the partner cannot be started
  State poll();
  State state() const { return state_; }
  /// Returns the last line that the server has printed: its progress while it prepares, or the reason if it failed.
  const std::string& news() const { return news_; }
  /// Returns the address and, for a hosted server, the invitation for this program. Valid when ready.
  const JoinTarget& target() const { return target_; }
  /// Returns the invitations for other users, one for each.
  const std::vector<std::string>& invitations() const { return invitations_; }
  const StartChoice& choice() const { return choice_; }

 private:
  void read_lines();
  void read(const std::string& line);
  bool is_complete() const;
  void follow_end();
  void start_partner();

  StartChoice choice_;
  std::filesystem::path beside_;
  std::optional<TemporaryFolder> folder_;  ///< folder for the scene file of a mesh; empty for other choices
  State state_ = State::kPreparing;
  std::string news_;
  JoinTarget target_;
  std::vector<std::string> invitations_;
  bool has_partner_joined_ = false;
  std::optional<LocalTime> ended_at_;  ///< time when poll() found that the server has ended
  std::unique_ptr<ChildProgram> server_;
  std::unique_ptr<ChildProgram> partner_;  ///< simulated partner; null if the scene has none
};

/// Returns the port in the server's line "... listening on ADDRESS:PORT, ..."; nothing for any other line.
std::optional<std::string> listening_port(const std::string& line);
/// Returns the invitation in the server's line "invitation (...): tandem-client --join INVITATION"; empty for any other
/// line.
std::string invitation_in(const std::string& line);

}  // namespace tandem::client
