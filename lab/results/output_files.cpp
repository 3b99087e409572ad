#include "lab/results/output_files.hpp"

#include <csignal>
#include <stdexcept>
#include <system_error>
#include <vector>

#include <pthread.h>

#include "lab/results/output_folder.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

/// Blocks SIGINT and SIGTERM during its lifetime. Signals received meanwhile take effect afterwards.
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

/// Creates the missing folders of a path, innermost first in the list. The destructor removes them unless keep() was
/// called.
class MadeFolders {
 public:
  explicit MadeFolders(const std::string& out) {
    std::error_code error;
    for (fs::path at = fs::absolute(out).lexically_normal(); !at.empty() && !fs::exists(at, error);
         at = at.parent_path()) {
      if (at.has_filename()) folders_.push_back(at);
    }
    made_folder(out);
  }
  ~MadeFolders() {
    std::error_code ignored;  // a folder that another program has filled is not removed
    for (const fs::path& folder : folders_) fs::remove(folder, ignored);
  }
  MadeFolders(const MadeFolders&) = delete;
  MadeFolders& operator=(const MadeFolders&) = delete;
  void keep() { folders_.clear(); }

 private:
  std::vector<fs::path> folders_;
};

/// Files that exist under a temporary name. The destructor removes those that were not renamed.
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

}  // namespace

void check_folder_can_be_made(const std::string& out) {
  const SignalsWait wait;
  const MadeFolders made(out);
}

void write_all_files(const std::string& out, const std::map<std::string, std::string>& files) {
  const SignalsWait wait;
  MadeFolders folders(out);
  UnfinishedFiles unfinished;
  for (const auto& [name, text] : files) unfinished.write(fs::path(out) / name, text);
  unfinished.finish();
  folders.keep();
}

}  // namespace tandem::lab
