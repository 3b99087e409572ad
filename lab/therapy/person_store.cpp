#include "lab/therapy/person_store.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <fstream>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "common/base/folders.hpp"
#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "common/secure/secret.hpp"
#include "lab/report/format.hpp"
#include "lab/therapy/measures_json.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kRemoved = ".removed-";
constexpr std::string_view kSession = "session-", kSessionEnd = ".json";
constexpr int kMaxSessions = 9999;
constexpr std::size_t kMinPseudonym = 6, kMaxPseudonym = 32;
constexpr mode_t kOwnFolder = 0700, kOwnFile = 0600;

std::string reason_of(int error) {
  return std::generic_category().message(error);
}

/// Characters of a pseudonym: letters and digits that readers do not confuse with each other (Crockford's Base32).
constexpr std::string_view kAlphabet = "0123456789ABCDEFGHJKMNPQRSTVWXYZ";

std::string random_text(std::size_t length) {
  std::array<std::byte, 32> bytes{};
  secure::fill_random(bytes);
  std::string text;
  for (std::size_t i = 0; i < length; ++i) text += kAlphabet[std::to_integer<std::size_t>(bytes[i]) % kAlphabet.size()];
  return text;
}

/// Returns a pseudonym of 12 random characters, such as P-7K3Q-X9ZD-04MN.
std::string random_pseudonym() {
  for (;;) {
    const std::string text = random_text(12);
    if (text.find_first_of("0123456789") == std::string::npos) continue;
    return "P-" + text.substr(0, 4) + "-" + text.substr(4, 4) + "-" + text.substr(8);
  }
}

bool is_pseudonym(std::string_view text) {
  const auto is_letter = [](char c) { return c >= 'A' && c <= 'Z'; };
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  return text.size() >= kMinPseudonym && text.size() <= kMaxPseudonym && is_letter(text.front()) &&
         std::ranges::any_of(text, is_digit) &&
         std::ranges::all_of(text, [&](char c) { return is_letter(c) || is_digit(c) || c == '-'; });
}

void require_pseudonym(const std::string& text) {
  if (is_pseudonym(text)) return;
  throw std::invalid_argument("pseudonym '" + shortened(printable(text), 40) + "': it must have " +
                              std::to_string(kMinPseudonym) + " to " + std::to_string(kMaxPseudonym) +
                              " characters of A-Z, 0-9 and -, a letter first and a digit; without one, "
                              "\"tandem-lab therapy new\" makes a random one");
}

void make_own_folder(const fs::path& folder) {
  std::error_code error;
  if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), error);
  if (::mkdir(folder.c_str(), kOwnFolder) == 0 || (errno == EEXIST && fs::is_directory(folder))) return;
  throw std::invalid_argument("--data " + folder.string() + ": the folder cannot be made (" + reason_of(errno) +
                              "); check the path and its rights");
}

/// Returns the session number in the file name of a session; 0 if the file is not a session.
int session_number(const fs::path& file) {
  const std::string name = file.filename().string();
  if (!name.starts_with(kSession) || !name.ends_with(kSessionEnd)) return 0;
  const std::string digits = name.substr(kSession.size(), name.size() - kSession.size() - kSessionEnd.size());
  if (digits.size() != 4 || digits.find_first_not_of("0123456789") != std::string::npos) return 0;
  return std::stoi(digits);
}

fs::path session_file(const fs::path& person, int number) {
  std::string digits = std::to_string(number);
  digits.insert(0, 4 - std::min<std::size_t>(digits.size(), 4), '0');
  return person / (std::string(kSession) + digits + std::string(kSessionEnd));
}

void remove_tree(const fs::path& folder) {
  std::error_code error;
  fs::remove_all(folder, error);
  if (!error) return;
  throw std::runtime_error(folder.string() + ": cannot be removed (" + error.message() +
                           "); check its rights and delete again");
}

/// Completes interrupted deletions. Returns the number of completed deletions.
std::size_t remove_leftovers(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (entry->path().filename().string().starts_with(kRemoved)) found.push_back(entry->path());
  }
  if (error) {
    throw std::invalid_argument("--data " + folder.string() + " cannot be read (" + error.message() +
                                "); check the path and its rights");
  }
  for (const fs::path& leftover : found) remove_tree(leftover);
  return found.size();
}

/// Returns whether a file contains the text; none if the file cannot be read.
std::optional<bool> contains(const fs::path& file, const std::string& text) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  std::array<char, 1U << 16U> buffer;
  std::string window;
  while (in) {
    in.read(buffer.data(), buffer.size());
    window.append(buffer.data(), static_cast<std::size_t>(in.gcount()));
    if (window.find(text) != std::string::npos) return true;
    if (window.size() >= text.size()) window.erase(0, window.size() - text.size() + 1);
  }
  return in.bad() ? std::nullopt : std::optional(false);
}

/// Searches all files and folders below `folder`. Returns those whose name or content has `text`, and those that cannot
/// be read.
PersonStore::Removal search(const fs::path& folder, const std::string& text) {
  PersonStore::Removal out;
  std::vector<fs::path> folders{folder};
  while (!folders.empty()) {
    const fs::path next = std::move(folders.back());
    folders.pop_back();
    std::error_code error;
    for (fs::directory_iterator entry(next, error), end; !error && entry != end; entry.increment(error)) {
      const fs::path& path = entry->path();
      std::error_code unknown;
      const fs::file_type type = entry->symlink_status(unknown).type();
      const bool is_named = path.filename().string().find(text) != std::string::npos;
      const auto has_text =
          type == fs::file_type::regular && !is_named ? contains(path, text) : std::optional(is_named);
      if (has_text.value_or(false)) out.found.push_back(path);
      if (unknown || !has_text) out.unreadable.push_back(path);
      if (type == fs::file_type::directory) folders.push_back(path);
    }
    if (error) out.unreadable.push_back(next);
  }
  return out;
}

}  // namespace

fs::path default_person_folder() {
  const fs::path data = user_folder("XDG_DATA_HOME", ".local/share");
  return data.empty() ? data : data / "tandem" / "therapy";
}

PersonStore::PersonStore(fs::path folder) : folder_(std::move(folder)) {
  if (folder_.empty()) throw std::invalid_argument("--data: neither XDG_DATA_HOME nor HOME is set; name a folder");
}

/// Refuses a data folder that users other than its owner can access.
/// Fails   std::invalid_argument: another user has rights on the folder
void PersonStore::require_own_folder() const {
  struct stat status {};
  if (::stat(folder_.c_str(), &status) != 0 || (status.st_mode & (S_IRWXG | S_IRWXO)) == 0) return;
  std::ostringstream mode;
  mode << std::oct << (status.st_mode & 07777U);
  throw std::invalid_argument("--data " + folder_.string() + " has the mode 0" + mode.str() +
                              ", so that others can reach it; run: chmod 700 " + folder_.string());
}

/// Locks the folder against other runs of the program until the returned object is destroyed, and completes interrupted
/// deletions. If the program is killed, the operating system releases the lock.
PersonStore::Lock PersonStore::lock() const {
  require_own_folder();
  const fs::path file = folder_ / "lock";
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kOwnFile);
  if (descriptor < 0) {
    throw std::invalid_argument("--data " + folder_.string() + ": the file lock cannot be opened (" + reason_of(errno) +
                                "); make a person by \"tandem-lab therapy new\", or check the folder's rights");
  }
  std::shared_ptr<void> held(nullptr, [descriptor](void*) { ::close(descriptor); });
  while (::flock(descriptor, LOCK_EX) != 0) {
    if (errno != EINTR) throw std::runtime_error(file.string() + ": cannot be locked (" + reason_of(errno) + ")");
  }
  return {held, remove_leftovers(folder_)};
}

fs::path PersonStore::person_folder(const std::string& pseudonym) const {
  require_pseudonym(pseudonym);
  const fs::path folder = folder_ / pseudonym;
  if (fs::is_directory(fs::symlink_status(folder))) return folder;
  throw std::invalid_argument("there is no person " + pseudonym + " in " + folder_.string() +
                              "; \"tandem-lab therapy list\" prints the pseudonyms");
}

std::string PersonStore::create(const std::string& pseudonym) {
  const std::string name = pseudonym.empty() ? random_pseudonym() : pseudonym;
  require_pseudonym(name);
  make_own_folder(folder_);
  const auto locked = lock();
  if (::mkdir((folder_ / name).c_str(), kOwnFolder) != 0) {
    if (errno == EEXIST) throw std::invalid_argument("there is a person " + name + " already; give another pseudonym");
    throw std::runtime_error((folder_ / name).string() + ": cannot be made (" + reason_of(errno) +
                             "); check the folder's rights and free space");
  }
  sync_folder(folder_);
  return name;
}

std::vector<std::string> PersonStore::persons() const {
  if (!fs::exists(fs::status(folder_))) return {};
  const auto locked = lock();
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (is_pseudonym(name) && fs::is_directory(entry->symlink_status())) names.push_back(name);
  }
  if (error) {
    throw std::invalid_argument("--data " + folder_.string() + " cannot be read (" + error.message() +
                                "); check the path and its rights");
  }
  std::ranges::sort(names);
  return names;
}

std::vector<StoredSession> PersonStore::sessions(const std::string& pseudonym) const {
  const auto locked = lock();
  return read_sessions(pseudonym);
}

std::vector<StoredSession> PersonStore::read_sessions(const std::string& pseudonym) const {
  std::vector<StoredSession> sessions;
  for (const auto& entry : fs::directory_iterator(person_folder(pseudonym))) {
    const int number = session_number(entry.path());
    if (number == 0) continue;
    const std::string origin = entry.path().string();
    sessions.push_back({number, session_from_json(parse_json(read_text_file(entry.path()), origin), origin)});
  }
  std::ranges::sort(sessions, {}, &StoredSession::number);
  return sessions;
}

int PersonStore::add(const std::string& pseudonym, const SessionMeasures& session) {
  const auto locked = lock();
  const fs::path person = person_folder(pseudonym);
  int number = 0;
  for (const StoredSession& stored : read_sessions(pseudonym)) {
    number = stored.number;
    const bool is_same =
        stored.measures.recording == session.recording && stored.measures.begun_utc == session.begun_utc;
    if (is_same) {
      throw std::invalid_argument("session " + std::to_string(number) + " of " + pseudonym +
                                  " is of this recording already; name the recording of another session");
    }
  }
  if (++number > kMaxSessions) {
    throw std::invalid_argument(person.string() + " has " + std::to_string(kMaxSessions) +
                                " sessions; make a new person");
  }
  const fs::path file = session_file(person, number);
  remove_unfinished(file);
  const std::string text = compact_json(to_json(session)) + "\n";
  const std::error_code error = write_new_file(file, {std::as_bytes(std::span(text))}, kOwnFile);
  if (!error) return number;
  throw std::runtime_error(file.string() + ": cannot be written (" + error.message() +
                           "); check the folder's rights and free space");
}

PersonStore::Removal PersonStore::remove(const std::string& pseudonym) {
  const auto locked = lock();
  require_pseudonym(pseudonym);
  const bool is_person = fs::is_directory(fs::symlink_status(folder_ / pseudonym));
  if (!is_person && locked.completed > 0) return search(folder_, pseudonym);
  const fs::path person = person_folder(pseudonym);
  const fs::path removed = folder_ / (std::string(kRemoved) + random_text(16));
  std::error_code error;
  fs::rename(person, removed, error);
  if (error) {
    throw std::runtime_error(person.string() + ": cannot be removed (" + error.message() +
                             "); check the folder's rights");
  }
  sync_folder(folder_);
  remove_tree(removed);
  sync_folder(folder_);
  return search(folder_, pseudonym);
}

}  // namespace tandem::lab
