// What a test needs beside this tree. No test leaves out its claim in silence: see tests/README.md.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <initializer_list>
#include <string>

namespace tandem::test {

/// Names the first of these files or folders that is missing, and the Debian package that installs it; empty: none is.
std::string missing_of(std::initializer_list<std::filesystem::path> paths);

/// True in continuous integration (TANDEM_REQUIRE=all): what a machine lacks is a failure there.
bool is_all_required();

/// Prints a claim that is not tested, and appends it to the file $TANDEM_LEFT_OUT, whose lines deploy/test counts.
void note_left_out(const std::string& test, const std::string& why);

}  // namespace tandem::test

/// Fails a test whose data package is missing: deploy/test installs all of them.
#define TANDEM_NEEDS_FILES(...)                                                                           \
  if (const std::string missing_file = ::tandem::test::missing_of({__VA_ARGS__}); missing_file.empty()) { \
  } else                                                                                                  \
    FAIL() << missing_file

/// Skips a test that this machine cannot run (a right, a kind of processor): counted; a failure in continuous integration.
#define TANDEM_NEEDS_OF_MACHINE(condition, what)                                                   \
  do {                                                                                             \
    if (condition) break;                                                                          \
    const std::string lacks = "this machine lacks what the test needs: " + std::string(what);      \
    if (::tandem::test::is_all_required()) FAIL() << lacks << " (TANDEM_REQUIRE=all)";             \
    const auto& test = *::testing::UnitTest::GetInstance()->current_test_info();                   \
    ::tandem::test::note_left_out(std::string(test.test_suite_name()) + "." + test.name(), lacks); \
    GTEST_SKIP() << lacks;                                                                         \
  } while (false)
