// Data folder of persons under pseudonyms.
//
//   FOLDER/                     mode 0700
//     lock                      one run changes the folder at a time
//     PSEUDONYM/                the only place where the pseudonym is stored
//       session-0001.json       mode 0600; written once
//     .removed-…                a person whose deletion was interrupted; the next run, also one that only reads,
//                               completes it
//
// The pseudonym is the name of a folder, and no file contains it. A deletion first gives the folder another name, in one
// step. From then on no byte of the pseudonym is left, even if the deletion is interrupted.
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
  int number = 0;  ///< from 1
  SessionMeasures measures;
};

/// Each function refuses a folder that others than its owner can read or change.
///
/// Fails   Every function throws std::invalid_argument or std::runtime_error, which names file, reason and remedy
class PersonStore {
 public:
  /// Result of a deletion. The person is gone in any case.
  struct Removal {
    /// Paths in whose name or content the pseudonym is still found. They are not of this program.
    std::vector<std::filesystem::path> found;
    std::vector<std::filesystem::path> unreadable;  ///< paths that could not be searched
  };

  /// The folder is created by create().
  explicit PersonStore(std::filesystem::path folder);

  /// Creates a person. Returns the pseudonym.
  /// In      pseudonym  6 to 32 of A–Z, 0–9 and -, with a letter first and a digit; empty: a random one of 60 bits
  /// Fails   the pseudonym is in use or has another form
  std::string create(const std::string& pseudonym);
  /// Returns the pseudonyms in alphabetical order.
  std::vector<std::string> persons() const;
  /// Stores a session and returns its number.
  /// Fails   there is no such person, or a session of this recording is stored already
  int add(const std::string& pseudonym, const SessionMeasures& session);
  /// Returns the sessions by their number.
  std::vector<StoredSession> sessions(const std::string& pseudonym) const;
  /// Deletes a person. If this run completes an interrupted deletion, a person who does not exist counts as deleted,
  /// because the folder no longer has the name of that person.
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
