// The steps between the start screen and a session: the user's choice is checked, and a server is started behind the
// window if the choice needs one. The result is the address to join.
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

  /// In      beside  folder of the programs
  ///         recent  see recent_file()
  StartFlow(std::filesystem::path beside, std::filesystem::path recent);

  /// The form of the start screen, which the user edits.
  StartChoice& form() { return form_; }
  const std::vector<StartChoice>& recent() const { return recent_; }
  State state() const { return state_; }
  /// Why the last choice could not be opened, or why the last session ended; "" if there is nothing to say.
  const std::string& problem() const { return problem_; }
  /// Progress of the server while it prepares.
  const std::string& progress() const;
  /// Title of the choice that is opened.
  std::string title() const { return title_of(opened_); }

  /// Opens a choice, unless it has a problem. The choice says whether it is hosted.
  void open(StartChoice choice);
  /// Puts a dropped file into the form, and opens it if it is a mesh, a scene or the second of two structures.
  void drop(const std::filesystem::path& file);
  /// Ends the server that is being prepared.
  void cancel();
  /// Follows the server. Call once a frame.
  void poll();
  /// Ends the session's server, and returns to the choice.
  /// In      problem  reason why the session failed; "" if the user ended it
  void close(const std::string& problem);

  /// Address to join; valid when ready.
  const JoinTarget& target() const { return target_; }
  bool has_server() const { return server_ != nullptr; }
  /// Invitations for others; empty unless the session is hosted.
  std::vector<std::string> invitations() const;

 private:
  std::filesystem::path beside_, recent_file_;
  StartChoice form_;
  StartChoice opened_;  ///< the choice that is prepared or in session
  std::vector<StartChoice> recent_;
  State state_ = State::kChoosing;
  std::string problem_;
  JoinTarget target_;
  std::unique_ptr<LocalServer> server_;  ///< null: none is needed, or nothing is open
};

}  // namespace tandem::client
