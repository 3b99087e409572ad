// Tests the result of a test whose requirement is missing. The program runs itself again with examples of such tests.
#include "tests/support/needs.hpp"

#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

namespace tandem::test {
namespace {

bool is_example() {
  return std::getenv("TANDEM_NEEDS_EXAMPLE") != nullptr;
}

TEST(NeedsExample, File) {
  if (!is_example()) return;
  TANDEM_NEEDS_FILES("/proc/self/exe", "/usr/share/gromacs/of_no_version", "/nowhere");
  std::puts("went on");
}

TEST(NeedsExample, Machine) {
  if (!is_example()) return;
  TANDEM_NEEDS_OF_MACHINE(true, "processors");
  TANDEM_NEEDS_OF_MACHINE(false, "a third arm");
  std::puts("went on");
}

struct Ended {
  int status = 0;
  std::string out;
  std::string left_out;
};

Ended run_example(const std::string& name, const std::string& environment) {
  const std::filesystem::path list =
      std::filesystem::temp_directory_path() / ("left_out_" + std::to_string(::getpid()) + "_" + name);
  const std::string command = "TANDEM_NEEDS_EXAMPLE=1 TANDEM_LEFT_OUT=" + list.string() + " " + environment + " " +
                              std::filesystem::read_symlink("/proc/self/exe").string() +
                              " --gtest_filter=NeedsExample." + name + " 2>&1";
  Ended ended;
  FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return ended;
  std::array<char, 4096> piece{};
  while (std::fgets(piece.data(), piece.size(), pipe) != nullptr) ended.out += piece.data();
  ended.status = ::pclose(pipe);
  std::stringstream text;
  text << std::ifstream(list).rdbuf();
  ended.left_out = text.str();
  std::filesystem::remove(list);
  return ended;
}

TEST(Needs, AMissingFileFailsWithItsPackageAndTheRemedy) {
  for (const char* const required : {"TANDEM_REQUIRE=", "TANDEM_REQUIRE=all"}) {
    const Ended ended = run_example("File", required);
    EXPECT_NE(ended.status, 0);
    EXPECT_NE(ended.out.find("needs the Debian package gromacs-data"), std::string::npos) << ended.out;
    EXPECT_NE(ended.out.find("/usr/share/gromacs/of_no_version"), std::string::npos) << ended.out;
    EXPECT_NE(ended.out.find("deploy/install-deps --all"), std::string::npos) << ended.out;
    EXPECT_EQ(ended.out.find("went on"), std::string::npos) << ended.out;
  }
  EXPECT_EQ(missing_of({"/proc/self/exe"}), "");
}

TEST(Needs, AMissingNeedIsCountedIfNotAllAreRequired) {
  const Ended ended = run_example("Machine", "TANDEM_REQUIRE=");
  EXPECT_EQ(ended.status, 0) << ended.out;
  EXPECT_EQ(ended.left_out, "NeedsExample.Machine: this machine lacks what the test needs: a third arm\n");
  EXPECT_NE(ended.out.find("left out: " + ended.left_out), std::string::npos) << ended.out;
  EXPECT_EQ(ended.out.find("went on"), std::string::npos) << ended.out;
}

TEST(Needs, AMissingNeedFailsIfAllAreRequired) {
  const Ended ended = run_example("Machine", "TANDEM_REQUIRE=all");
  EXPECT_NE(ended.status, 0);
  EXPECT_NE(ended.out.find("a third arm"), std::string::npos) << ended.out;
  EXPECT_EQ(ended.left_out, "");
}

}  // namespace
}  // namespace tandem::test
