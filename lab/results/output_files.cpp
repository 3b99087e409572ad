#include "lab/results/output_files.hpp"

#include <csignal>
#include <ctime>
#include <fstream>
#include <span>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <pthread.h>

#include "lab/results/output_folder.hpp"
#include "proto/content_hash.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

/// Blocks SIGINT and SIGTERM during its lifetime. A signal that arrives in this time takes effect when the object is
/// destroyed.
class SignalsWait {
 public:
  SignalsWait() {
    sigset_t waiting;
    sigemptyset(&waiting);
    sigaddset(&waiting, SIGINT);
    sigaddset(&waiting, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &waiting, &before_);
  }
  ~SignalsWait() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalsWait(const SignalsWait&) = delete;
  SignalsWait& operator=(const SignalsWait&) = delete;

 private:
  sigset_t before_{};
};

/// Creates the missing folders of a path. The destructor removes the created folders, the innermost one first, unless
/// keep() was called.
class MadeFolders {
 public:
  void make(const std::string& out) {
    std::error_code error;
    std::vector<fs::path> missing;
    for (fs::path at = fs::absolute(out).lexically_normal(); !at.empty() && !fs::exists(at, error);
         at = at.parent_path()) {
      if (at.has_filename()) missing.push_back(at);
    }
    folders_.insert(folders_.begin(), missing.begin(), missing.end());
    made_folder(out);
  }
  MadeFolders() = default;
  ~MadeFolders() {
    std::error_code ignored;  // fails if another program has put files into the folder, which then remains
    for (const fs::path& folder : folders_) fs::remove(folder, ignored);
  }
  MadeFolders(const MadeFolders&) = delete;
  MadeFolders& operator=(const MadeFolders&) = delete;
  void keep() { folders_.clear(); }

 private:
  std::vector<fs::path> folders_;
};

/// Files that exist under temporary names. The destructor removes those that were not renamed.
class UnfinishedFiles {
 public:
  UnfinishedFiles() = default;
  ~UnfinishedFiles() {
    std::error_code ignored;
    for (const auto& [unfinished, file] : files_) fs::remove(unfinished, ignored);
  }
  UnfinishedFiles(const UnfinishedFiles&) = delete;
  UnfinishedFiles& operator=(const UnfinishedFiles&) = delete;

  void write(const fs::path& file, const std::string& text) {
    if (fs::is_directory(file)) {
      throw std::runtime_error(file.string() + ": is a folder, where a file shall be written; name another --out");
    }
    files_.push_back({file.string() + ".unfinished", file});
    write_text_file(files_.back().unfinished, text);
  }
  void finish() {
    for (const auto& [unfinished, file] : files_) fs::rename(unfinished, file);
  }

 private:
  struct Names {
    fs::path unfinished, file;
  };
  std::vector<Names> files_;
};

/// Returns the command line of this process. The program's name is given without its folder.
std::string this_command() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  std::string command;
  for (std::string word; std::getline(in, word, '\0');) {
    if (command.empty()) word = fs::path(word).filename().string();
    command += (command.empty() ? "" : " ") + shell_word(word);
  }
  return command;
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &utc);
  return text;
}

}  // namespace

std::string shell_word(const std::string& word) {
  if (word.find_first_of(" \t\n\"'`\\$*?;&|<>(){}[]#~!") == std::string::npos && !word.empty()) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::map<std::string, std::string> with_report(std::map<std::string, std::string> files, HtmlReport report,
                                               const std::string& name) {
  Origin origin{this_command(), "Tandem " TANDEM_VERSION, today()};
  for (const auto& [file, text] : files) {
    origin.sha256[file] = proto::hex(proto::sha256_of(std::as_bytes(std::span(text))));
  }
  report.origin(origin);
  files.merge(report.files(name));
  return files;
}

void check_folder_can_be_made(const std::string& out) {
  const SignalsWait wait;
  MadeFolders made;
  made.make(out);
}

void write_all_files(const std::string& out, const std::map<std::string, std::string>& files) {
  const SignalsWait wait;
  MadeFolders folders;
  folders.make(out);
  UnfinishedFiles unfinished;
  for (const auto& [name, text] : files) {
    const fs::path file = fs::path(out) / name;
    folders.make(file.parent_path().string());
    unfinished.write(file, text);
  }
  unfinished.finish();
  folders.keep();
}

}  // namespace tandem::lab
