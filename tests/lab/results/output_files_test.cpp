// Tests that a long-running command writes either all of its output or nothing.
#include "lab/results/output_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

fs::path empty_folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / name;
  fs::remove_all(folder);
  return folder;
}

std::string content_of(const fs::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::ptrdiff_t entries_of(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

TEST(ShellWord, IsReadBackByAShell) {
  for (const std::string word :
       {"plain", "", "it's", "a\nb", "`date`", "#x", "~", "a!b", "$HOME", "x=1,2", "*", "'", "\\"}) {
    const std::string command = "printf %s. " + shell_word(word);
    std::FILE* const shell = ::popen(command.c_str(), "r");
    ASSERT_NE(shell, nullptr);
    std::string read_back;
    for (int c = std::fgetc(shell); c != EOF; c = std::fgetc(shell)) read_back += static_cast<char>(c);
    EXPECT_EQ(::pclose(shell), 0) << command;
    EXPECT_EQ(read_back, word + ".") << command;
  }
  EXPECT_EQ(shell_word("link.rtt_ms=0,50"), "link.rtt_ms=0,50");
}

TEST(OutputFiles, AreExactlyTheDocumentedFiles) {
  const fs::path folder = empty_folder("all_files") / "deeper";
  const std::map<std::string, std::string> files{{"a.json", "{}"}, {"b.html", "<p>"}};
  write_all_files(folder, files);
  write_all_files(folder, files);
  EXPECT_EQ(content_of(folder / "a.json"), "{}");
  EXPECT_EQ(content_of(folder / "b.html"), "<p>");
  EXPECT_EQ(entries_of(folder), 2);
}

TEST(OutputFiles, LeaveTheOldOnesWhenOneCannotBeWritten) {
  const fs::path folder = empty_folder("one_in_the_way");
  fs::create_directories(folder / "b.html");
  std::ofstream(folder / "a.json") << "before";
  const std::map<std::string, std::string> files{{"a.json", "after"}, {"b.html", "<p>"}};
  EXPECT_THROW(write_all_files(folder, files), std::runtime_error);
  EXPECT_EQ(content_of(folder / "a.json"), "before");
  EXPECT_EQ(entries_of(folder), 2);
}

TEST(OutputFiles, LeaveNoFolderBehindWhenOneCannotBeWritten) {
  const fs::path folder = empty_folder("no_such_place");
  const std::string too_long(300, 'b');  // file systems allow names of 255 bytes
  const std::map<std::string, std::string> files{{"a.json", "{}"}, {"figures/" + too_long, "<p>"}};
  EXPECT_THROW(write_all_files(folder / "deeper", files), std::runtime_error);
  EXPECT_FALSE(fs::exists(folder));
}

TEST(OutputFiles, HaveAReportThatNamesTheHashOfTheResults) {
  const fs::path folder = empty_folder("with_report");
  HtmlReport report("title", "subtitle");
  Plot figure;
  figure.y.quantity = "force";
  report.figure(figure);
  write_all_files(folder, with_report({{"a.json", "abc"}}, report));
  EXPECT_EQ(content_of(folder / "a.json"), "abc");
  EXPECT_TRUE(fs::is_regular_file(folder / "figures" / "1-force.svg"));
  EXPECT_TRUE(fs::is_regular_file(folder / "figures" / "1-force.csv"));
  // Hash of "abc". Source: FIPS 180-4, example.
  EXPECT_NE(content_of(folder / "report.html")
                .find("a.json: <code>ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"),
            std::string::npos);
}

TEST(OutputFiles, AskingForAFolderMakesNone) {
  const fs::path folder = empty_folder("only_asked");
  check_folder_can_be_made(folder / "deeper" / "");
  EXPECT_FALSE(fs::exists(folder));
  fs::create_directories(folder);
  check_folder_can_be_made(folder);
  EXPECT_TRUE(fs::exists(folder)) << "an existing folder must be kept";
  std::ofstream(folder / "file") << "a file";
  EXPECT_THROW(check_folder_can_be_made(folder / "file" / "deeper"), std::invalid_argument);
}

}  // namespace
}  // namespace tandem::lab
