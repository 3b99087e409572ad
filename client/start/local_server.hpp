// A tandem-server behind the window, with the partner and the invitations of a choice of the start screen.
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

/// A new folder for temporary files. It is removed with its files when this is destroyed.
class TemporaryFolder {
 public:
  /// Fails   std::runtime_error: it cannot be made
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Starts the server, and follows its output until it listens. Destroying it ends server and partner.
///
/// Thread  main
class LocalServer {
 public:
  enum class State { kPreparing, kReady, kFailed };

  /// In      choice  a choice without a problem_of(), not of the kind kJoin
  ///         beside  folder of tandem-server and tandem-client
  /// Fails   std::system_error, std::runtime_error: a program is missing or cannot be started; no folder or file can be
  ///         written
  LocalServer(StartChoice choice, const std::filesystem::path& beside);
  /// Ends the partner and then the server, within a second each at most.
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  /// Reads the lines that the server has printed. Starts the partner when the server listens.
  /// Fails   as the constructor, for the partner
  State poll();
  State state() const { return state_; }
  /// Last line of the server: its progress while it prepares, the reason if it failed.
  const std::string& news() const { return news_; }
  /// Address and, for a hosted server, the invitation of the program that hosts. Valid when ready.
  const JoinTarget& target() const { return target_; }
  /// Invitations to give to others, one for each person.
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
  std::optional<TemporaryFolder> folder_;  ///< folder of the scene file of a mesh; none for other choices
  State state_ = State::kPreparing;
  std::string news_;
  JoinTarget target_;
  std::vector<std::string> invitations_;
  bool has_partner_joined_ = false;
  std::optional<LocalTime> ended_at_;  ///< time when the end of the server was noticed
  std::unique_ptr<ChildProgram> server_;
  std::unique_ptr<ChildProgram> partner_;  ///< null: the scene has none
};

/// Port of the server's line "... listening on ADDRESS:PORT, ..."; nothing if the line is another.
std::optional<std::string> listening_port(const std::string& line);
/// Invitation in the server's line "invitation (...): tandem-client --join INVITATION"; "" if the line is another.
std::string invitation_in(const std::string& line);

}  // namespace tandem::client
