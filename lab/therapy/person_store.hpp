// Data folder with the sessions of persons. A person is identified by a pseudonym only.
//
//   FOLDER/ mode 0700 lock locked by a run that reads or changes the folder, so that runs do not overlap PSEUDONYM/
//     folder of one person; its name is the only place where the pseudonym is stored session-0001.json measures of one
//     session; mode 0600; written once .removed-… renamed folder of a person whose deletion was interrupted; the next
//     run that opens the data folder completes the deletion
//
// A deletion first renames the folder of the person, which is a single atomic operation. Afterwards the pseudonym is
// stored nowhere, even if the rest of the deletion is interrupted.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "lab/therapy/session_measures.hpp"

namespace tandem::lab {

/// Returns $XDG_DATA_HOME/tandem/therapy or, if that variable is not set to an absolute path,
/// $HOME/.local/share/tandem/therapy.
/// Out     empty if neither variable is set
std::filesystem::path default_person_folder();

struct StoredSession {
  int number = 0;  ///< number of the session, counted from 1
  SessionMeasures measures;
};

/// Sessions of persons in a data folder. Each function refuses a folder that users other than its owner can access.
///
/// Fails   every function: std::invalid_argument or std::runtime_error, which names file, reason and remedy
class PersonStore {
 public:
  /// Result of a deletion. The data of the person have been deleted in any case. The members list other paths that may
  /// still refer to the person.
  struct Removal {
    /// Paths below the data folder whose name or content still contains the pseudonym. They were not created by this
    /// program.
    std::vector<std::filesystem::path> found;
    std::vector<std::filesystem::path> unreadable;  ///< paths that could not be searched
  };

  /// Opens a data folder. A missing folder is created by create().
  explicit PersonStore(std::filesystem::path folder);

  /// Creates a person. Returns the pseudonym.
  /// In      pseudonym  pseudonym of 6 to 32 characters: A–Z, 0–9 and hyphens. It begins with a letter and contains at
  ///         least one digit. If empty, a random pseudonym with 60 bits of entropy is created
  /// Fails   the pseudonym is in use or malformed
  std::string create(const std::string& pseudonym);
  /// Returns the pseudonyms in alphabetical order.
  std::vector<std::string> persons() const;
  /// Stores a session and returns its number.
  /// Fails   there is no such person, or a session of this recording is stored already
  int add(const std::string& pseudonym, const SessionMeasures& session);
  /// Returns the sessions of a person, sorted by number.
  std::vector<StoredSession> sessions(const std::string& pseudonym) const;
  /// Deletes a person. The call also completes interrupted deletions. Their folders do not have the person's name, so
  /// they may belong to this person. Therefore, if the call has completed any, a missing person counts as deleted.
  /// Fails   there is no such person, or a file cannot be removed
  Removal remove(const std::string& pseudonym);

  const std::filesystem::path& folder() const { return folder_; }

 private:
  struct Lock {
    std::shared_ptr<void> held;
    std::size_t completed = 0;  ///< number of interrupted deletions that were completed
  };

  Lock lock() const;
  void require_own_folder() const;
  std::vector<StoredSession> read_sessions(const std::string& pseudonym) const;
  std::filesystem::path person_folder(const std::string& pseudonym) const;

  std::filesystem::path folder_;
};

}  // namespace tandem::lab
