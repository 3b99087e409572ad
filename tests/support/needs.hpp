// Requirements of a test that are outside this source tree: data files and capabilities of the machine. No test may
// skip its claim silently (see tests/README.md).
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <initializer_list>
#include <string>

namespace tandem::test {

/// Returns the first missing file or folder with the Debian package that installs it; empty if none is missing.
std::string missing_of(std::initializer_list<std::filesystem::path> paths);

/// Returns true in continuous integration (TANDEM_REQUIRE=all). A missing capability of the machine is then a failure.
bool is_all_required();

/// Reports that a claim of a test was not tested: prints the claim and appends it to the file $TANDEM_LEFT_OUT.
/// deploy/test counts the lines of this file.
void note_left_out(const std::string& test, const std::string& why);

}  // namespace tandem::test

/// Fails a test whose data package is missing. A missing package is an error, because deploy/test installs all of them.
#define TANDEM_NEEDS_FILES(...)                                                                           \
  if (const std::string missing_file = ::tandem::test::missing_of({__VA_ARGS__}); missing_file.empty()) { \
  } else                                                                                                  \
    FAIL() << missing_file

/// Skips and counts a test that this machine cannot run, for example for lack of a permission or a processor feature.
/// In continuous integration the test fails instead.
#define TANDEM_NEEDS_OF_MACHINE(condition, what)                                                   \
  do {                                                                                             \
    if (condition) break;                                                                          \
    const std::string lacks = "this machine lacks what the test needs: " + std::string(what);      \
    if (::tandem::test::is_all_required()) FAIL() << lacks << " (TANDEM_REQUIRE=all)";             \
    const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();                   \
    ::tandem::test::note_left_out(std::string(test.test_suite_name()) + "." + test.name(), lacks); \
    GTEST_SKIP() << lacks;                                                                         \
  } while (false)
