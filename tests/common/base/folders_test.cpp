// Tests that a file is written completely or not at all: detects partial, overwritten and left-over files.
#include "common/base/folders.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

namespace tandem {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(std::string_view text) {
  return std::as_bytes(std::span(text));
}

std::string text_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

unsigned mode_of(const fs::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? status.st_mode & 07777U : 0;
}

class WholeFile : public ::testing::Test {
 protected:
  WholeFile() : folder(fs::temp_directory_path() / ("tandem_folders_test_" + std::to_string(::getpid()))) {}
  ~WholeFile() override { fs::remove_all(folder); }

  [[nodiscard]] std::ptrdiff_t files() const { return std::distance(fs::directory_iterator(folder), {}); }

  const fs::path folder;
};

TEST_F(WholeFile, IsItsPartsInAFolderThatIsMade) {
  const fs::path file = folder / "deep" / "file";
  EXPECT_FALSE(replace_file(file, {bytes_of("one "), bytes_of(""), bytes_of("two")}));
  EXPECT_EQ(text_of(file), "one two");
  EXPECT_EQ(mode_of(file), 0644U);
}

TEST_F(WholeFile, ReplacesAnExistingFile) {
  const fs::path file = folder / "file";
  EXPECT_FALSE(replace_file(file, {bytes_of("a long text")}));
  EXPECT_FALSE(replace_file(file, {bytes_of("short")}, 0600));
  EXPECT_EQ(text_of(file), "short");
  EXPECT_EQ(mode_of(file), 0600U);
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFile, ACacheFileReplacesAnExistingOne) {
  const fs::path file = folder / "deep" / "file";
  EXPECT_FALSE(replace_cache_file(file, {bytes_of("a long text")}));
  EXPECT_FALSE(replace_cache_file(file, {bytes_of("short")}));
  EXPECT_EQ(text_of(file), "short");
  EXPECT_EQ(mode_of(file), 0644U);
  EXPECT_TRUE(replace_cache_file(folder / "deep", {bytes_of("text")})) << "a folder has this name";
}

TEST_F(WholeFile, CreatingANewFileKeepsAnExistingOne) {
  const fs::path file = folder / "file";
  EXPECT_FALSE(write_new_file(file, {bytes_of("first")}, 0600));
  EXPECT_EQ(mode_of(file), 0600U);
  EXPECT_EQ(write_new_file(file, {bytes_of("second")}), std::errc::file_exists);
  EXPECT_EQ(text_of(file), "first");
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFile, LeavesNoFileAfterAFailure) {
  fs::create_directories(folder / "file" / "is a folder");
  EXPECT_TRUE(replace_file(folder / "file", {bytes_of("text")}));
  EXPECT_EQ(files(), 1);
  EXPECT_EQ(replace_file("/proc/no folder/file", {bytes_of("text")}), std::errc::no_such_file_or_directory);
}

TEST_F(WholeFile, IsUnchangedIfTheDiskIsFull) {
  const fs::path file = folder / "file";
  EXPECT_FALSE(replace_file(file, {bytes_of("old")}));
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const rlimit narrow{4, before.rlim_max};
  ::signal(SIGXFSZ, SIG_IGN);
  ::setrlimit(RLIMIT_FSIZE, &narrow);
  const std::error_code error = replace_file(file, {bytes_of("longer than four bytes")});
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(error, std::errc::file_too_large);
  EXPECT_EQ(text_of(file), "old");
  EXPECT_EQ(files(), 1);
}

TEST_F(WholeFile, OfAKilledWriterIsRemovedByTheNextAlone) {
  const fs::path file = folder / "file";
  EXPECT_FALSE(replace_file(file, {bytes_of("old")}));
  const pid_t writer = ::fork();
  if (writer == 0) {
    const rlimit narrow{4, 4};
    ::signal(SIGXFSZ, SIG_DFL);
    const rlimit no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    ::setrlimit(RLIMIT_FSIZE, &narrow);
    replace_file(file, {bytes_of("longer than four bytes")});
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(writer, &status, 0), writer);
  ASSERT_TRUE(WIFSIGNALED(status));
  ASSERT_EQ(files(), 2) << "the unfinished file of the killed writer";

  for (const char* const other : {"file.abcde", "file.abcdefg", "file.abc-ef", "filex.abcdef", "file-abcdef"}) {
    EXPECT_FALSE(replace_file(folder / other, {bytes_of("text")}));
  }
  fs::create_directories(folder / "file.folder");
  fs::create_symlink(file, folder / "file.alinkk");
  EXPECT_EQ(remove_unfinished(file), 1U);
  EXPECT_EQ(files(), 8);
  EXPECT_EQ(text_of(file), "old");
  EXPECT_EQ(remove_unfinished(folder / "no folder" / "file"), 0U);
}

TEST(UserFolder, ARelativePathInAnXdgVariableIsIgnored) {
  const std::string home = std::getenv("HOME") == nullptr ? "" : std::getenv("HOME");
  ::setenv("HOME", "/home/x", 1);
  ::setenv("TANDEM_TEST_XDG", "relative", 1);
  EXPECT_EQ(user_folder("TANDEM_TEST_XDG", ".cache"), "/home/x/.cache");
  ::setenv("TANDEM_TEST_XDG", "/absolute", 1);
  EXPECT_EQ(user_folder("TANDEM_TEST_XDG", ".cache"), "/absolute");
  ::unsetenv("TANDEM_TEST_XDG");
  ::unsetenv("HOME");
  EXPECT_TRUE(user_folder("TANDEM_TEST_XDG", ".cache").empty());
  ::setenv("HOME", home.c_str(), 1);
}

}  // namespace
}  // namespace tandem
