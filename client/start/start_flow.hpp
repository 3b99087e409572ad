// The steps from the start screen to a session: the user's choice is checked, and a server is started if the choice
// needs one. The result is the address to join.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "client/start/local_server.hpp"
#include "client/start/start_choice.hpp"

namespace tandem::client {

/// Thread  main
class StartFlow {
 public:
  enum class State { kChoosing, kPreparing, kReady };

  /// In      beside  folder with the programs of Tandem
  ///         recent  file of recent_file()
  StartFlow(std::filesystem::path beside, std::filesystem::path recent);

  /// The form of the start screen, which the user edits.
  StartChoice& form() { return form_; }
  const std::vector<StartChoice>& recent() const { return recent_; }
  State state() const { return state_; }
  /// Returns the reason why the last choice could not be opened, or why the last session ended; empty if there is none.
  const std::string& problem() const { return problem_; }
  /// Returns the progress of the server while it prepares.
  const std::string& progress() const;
  /// Returns the title of the choice that is being opened or is in session.
  std::string title() const { return title_of(opened_); }

  /// Opens a choice, unless problem_of() reports a problem. If StartChoice::is_hosted is true, other users may join.
  void open(StartChoice choice);
  /// Enters a dropped file into the form. Opens it if it is a mesh, a scene, or the second of two structures.
  void drop(const std::filesystem::path& file);
  /// Stops the server that is being prepared.
  void cancel();
  /// Reads the progress of the server. Call it once per frame.
  void poll();
  /// Ends the server of the session, and returns to the start screen.
  /// In      problem  reason why the session failed; empty if the user ended it
  void close(const std::string& problem);

  /// Returns the address to join. Valid in the state kReady.
  const JoinTarget& target() const { return target_; }
  bool has_server() const { return server_ != nullptr; }
  /// Returns the invitations for others; empty unless the session is hosted.
  std::vector<std::string> invitations() const;

 private:
  std::filesystem::path beside_, recent_file_;
  StartChoice form_;
  StartChoice opened_;  ///< choice for which a server is being prepared, or that is in session
  std::vector<StartChoice> recent_;
  State state_ = State::kChoosing;
  std::string problem_;
  JoinTarget target_;
  std::unique_ptr<LocalServer> server_;  ///< server of the open choice; null if none is needed or nothing is open
};

}  // namespace tandem::client
