#include "lab/therapy/person_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <set>
#include <stdexcept>
#include <thread>

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

class PersonStoreTest : public testing::Test {
 protected:
  void TearDown() override { fs::remove_all(folder_); }
  template <class Call>
  static std::string error_of(const Call& call) {
    try {
      call();
    } catch (const std::exception& error) {
      return error.what();
    }
    return "no error";
  }
  void write(const fs::path& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  /// Returns whether a name below the folder, or the content of a file, contains `text`.
  bool has(const std::string& text) const {
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.path().filename().string().find(text) != std::string::npos) return true;
      if (!entry.is_regular_file()) continue;
      std::ifstream in(entry.path(), std::ios::binary);
      const std::string content{std::istreambuf_iterator<char>(in), {}};
      if (content.find(text) != std::string::npos) return true;
    }
    return false;
  }

  fs::path folder_ = fs::temp_directory_path() / ("tandem_persons_" + std::to_string(::getpid()));
  PersonStore store_{folder_};
};

SessionMeasures session_of(std::uint64_t recording, const std::string& level = "level") {
  SessionMeasures session{
      .recording = recording, .begun_utc = "2026-12-01T10:00:00Z", .scene = "ring", .parts = {}, .movements = {}};
  session.calibration = MotionRange{{-0.1, -0.2, -0.3}, {0.1, 0.2, 0.3}, {0, 0, 0.1}};
  session.parts.push_back({.kind = PartKind::kSession, .name = "session", .time_s = 12.5, .smoothness = -1.5});
  session.parts.push_back({.kind = PartKind::kLevel, .outcome = PartOutcome::kReached, .name = level, .time_s = 3});
  session.parts.back().range = session.calibration;
  session.movements = {{1, 0.5, 0.2, 0.75, -1.42}, {3, 70, 2, 0.5, PartMeasures::kUnknown}};
  return session;
}

TEST_F(PersonStoreTest, KeepsSessionsAsTheyWere) {
  const std::string person = store_.create("");
  EXPECT_EQ(store_.add(person, session_of(1)), 1);
  EXPECT_EQ(store_.add(person, session_of(2, "another")), 2);
  const auto sessions = PersonStore(folder_).sessions(person);
  ASSERT_EQ(sessions.size(), 2U);
  const SessionMeasures& session = sessions[1].measures;
  EXPECT_EQ(sessions[1].number, 2);
  EXPECT_EQ(session.recording, 2U);
  EXPECT_EQ(session.parts[1].name, "another");
  EXPECT_EQ(session.parts[1].outcome, PartOutcome::kReached);
  EXPECT_EQ(session.whole().smoothness, -1.5);
  EXPECT_TRUE(std::isnan(session.whole().force_peak_n));
  EXPECT_EQ(session.calibration->high_m, Vec3(0.1, 0.2, 0.3));
  ASSERT_EQ(session.movements.size(), 2U);
  EXPECT_EQ(session.movements[0].smoothness, -1.42);
  EXPECT_TRUE(std::isnan(session.movements[1].smoothness));
}

TEST_F(PersonStoreTest, MakesRandomPseudonyms) {
  std::set<std::string> names;
  for (int i = 0; i < 50; ++i) names.insert(store_.create(""));
  EXPECT_EQ(names.size(), 50U);
  for (const std::string& name : names) EXPECT_THAT(name, testing::MatchesRegex("P-[0-9A-Z-]+"));
  EXPECT_EQ(store_.persons().size(), 50U);
  EXPECT_EQ(store_.create("STUDY-0042"), "STUDY-0042");
  EXPECT_THAT(error_of([&] { store_.create("STUDY-0042"); }),
              AllOf(HasSubstr("STUDY-0042 already"), HasSubstr("give another")));
}

TEST_F(PersonStoreTest, FilesAreOfTheirOwnerOnly) {
  const mode_t before = ::umask(0);
  const std::string person = store_.create("");
  store_.add(person, session_of(1));
  ::umask(before);
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    const auto expected = entry.is_directory() ? fs::perms::owner_all : fs::perms::owner_read | fs::perms::owner_write;
    EXPECT_EQ(entry.status().permissions(), expected) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 3) << "person, session and lock";
  EXPECT_EQ(fs::status(folder_).permissions(), fs::perms::owner_all);
}

TEST_F(PersonStoreTest, NoByteOfAPseudonymIsFoundAfterDeletion) {
  const std::string gone = store_.create(""), other = store_.create("");
  for (std::uint64_t i = 1; i <= 3; ++i) {
    store_.add(gone, session_of(i, gone));  // one level has the pseudonym as its name
    store_.add(other, session_of(i));
  }
  write(fs::path(gone) / "session-0004.json.aB3dEf", gone);  // file that an interrupted run has left
  ASSERT_TRUE(has(gone));
  const auto removal = store_.remove(gone);
  EXPECT_TRUE(removal.found.empty() && removal.unreadable.empty());
  EXPECT_FALSE(has(gone));
  EXPECT_THAT(store_.persons(), ElementsAre(other));
  EXPECT_EQ(store_.sessions(other).size(), 3U);
  EXPECT_THAT(error_of([&] { store_.remove(gone); }), AllOf(HasSubstr("no person " + gone), HasSubstr("therapy list")));
}

TEST_F(PersonStoreTest, AnInterruptedDeletionIsCompletedByTheNextRun) {
  const std::string gone = store_.create(""), other = store_.create("");
  store_.add(gone, session_of(1));
  fs::rename(folder_ / gone, folder_ / ".removed-0123456789ABCDEF");  // folder name that an interrupted removal leaves
  EXPECT_FALSE(has(gone));
  EXPECT_THAT(store_.persons(), ElementsAre(other));
  EXPECT_FALSE(fs::exists(folder_ / ".removed-0123456789ABCDEF")) << "persons() only reads";
  fs::create_directory(folder_ / ".removed-1");
  store_.sessions(other);
  EXPECT_FALSE(fs::exists(folder_ / ".removed-1"));
  fs::create_directory(folder_ / ".removed-2");
  EXPECT_TRUE(store_.remove(gone).found.empty()) << "the repeated deletion completes the first";
  EXPECT_THAT(error_of([&] { store_.remove(gone); }), HasSubstr("no person " + gone));
}

TEST_F(PersonStoreTest, PathsThatCannotBeSearchedAreNamed) {
  // The superuser can read every path. Therefore the test runs as another user if it was started as root.
  const bool is_root = ::geteuid() == 0;
  if (is_root) {
    ASSERT_EQ(::seteuid(65534), 0);
  }
  const std::string person = store_.create("");
  write("secret.txt", person);
  fs::permissions(folder_ / "secret.txt", fs::perms::none);
  fs::create_directory(folder_ / "closed");
  fs::permissions(folder_ / "closed", fs::perms::none);
  PersonStore::Removal removal;
  const std::string error = error_of([&] { removal = store_.remove(person); });
  fs::permissions(folder_ / "closed", fs::perms::owner_all);
  fs::remove_all(folder_);
  if (is_root) {
    ASSERT_EQ(::seteuid(0), 0);
  }
  EXPECT_EQ(error, "no error");
  EXPECT_TRUE(removal.found.empty());
  EXPECT_THAT(removal.unreadable, testing::UnorderedElementsAre(folder_ / "secret.txt", folder_ / "closed"));
}

TEST_F(PersonStoreTest, AFolderThatOthersCanReachIsRefused) {
  const std::string person = store_.create("");
  fs::permissions(folder_, fs::perms::group_exec, fs::perm_options::add);
  const auto refused = AllOf(HasSubstr("--data " + folder_.string() + " has the mode 0710"),
                             HasSubstr("run: chmod 700 " + folder_.string()));
  EXPECT_THAT(error_of([&] { store_.create(""); }), refused);
  EXPECT_THAT(error_of([&] { store_.persons(); }), refused);
  EXPECT_THAT(error_of([&] { store_.sessions(person); }), refused);
  EXPECT_THAT(error_of([&] { store_.add(person, session_of(1)); }), refused);
  EXPECT_THAT(error_of([&] { store_.remove(person); }), refused);
  fs::permissions(folder_, fs::perms::owner_all);
  EXPECT_TRUE(store_.sessions(person).empty());
}

TEST_F(PersonStoreTest, FilesOfOthersWithThePseudonymAreNamed) {
  const std::string person = store_.create("");
  write("notes.txt", std::string(70'000, '.') + "about " + person);
  write(person + ".txt", "nothing");
  const auto left = store_.remove(person).found;
  std::set<std::string> names;
  for (const fs::path& file : left) names.insert(file.filename().string());
  EXPECT_EQ(names, (std::set<std::string>{"notes.txt", person + ".txt"}));
}

TEST_F(PersonStoreTest, AnUnfinishedFileIsNoSession) {
  const std::string person = store_.create("");
  store_.add(person, session_of(1));
  write(fs::path(person) / "session-0002.json.aB3dEf", "{\"format\": 1");
  EXPECT_EQ(store_.sessions(person).size(), 1U);
  EXPECT_EQ(store_.add(person, session_of(2)), 2);
  EXPECT_FALSE(fs::exists(folder_ / person / "session-0002.json.aB3dEf"));
}

TEST_F(PersonStoreTest, ARecordingIsStoredOnce) {
  const std::string person = store_.create("");
  store_.add(person, session_of(7));
  EXPECT_THAT(error_of([&] { store_.add(person, session_of(7)); }),
              AllOf(HasSubstr("session 1 of " + person), HasSubstr("name the recording of another session")));
  EXPECT_EQ(store_.sessions(person).size(), 1U);
}

TEST_F(PersonStoreTest, RunsAtTheSameTimeLoseNoSession) {
  const std::string person = store_.create("");
  std::vector<std::thread> runs;
  for (std::uint64_t run = 0; run < 4; ++run) {
    runs.emplace_back([&, run] {
      PersonStore store(folder_);
      for (std::uint64_t i = 0; i < 10; ++i) store.add(person, session_of(1 + run * 10 + i));
    });
  }
  for (std::thread& run : runs) run.join();
  EXPECT_EQ(store_.sessions(person).size(), 40U);
}

TEST_F(PersonStoreTest, WrongPseudonymsAreRefusedWithTheirForm) {
  store_.create("");
  for (const std::string& name :
       {std::string("../../etc"), std::string("anna"), std::string("ABCDEF"), std::string("1BCDEF"),
        std::string("AB/CD1"), std::string("A1"), std::string(33, 'A'), std::string("A1B2C3\n")}) {
    for (const auto& error : {error_of([&] { store_.create(name); }), error_of([&] { store_.remove(name); }),
                              error_of([&] { store_.add(name, session_of(1)); })}) {
      EXPECT_THAT(error, AllOf(HasSubstr("pseudonym '"), HasSubstr("6 to 32"), HasSubstr("a letter first"))) << name;
    }
  }
  fs::create_directory_symlink("/", folder_ / "L1NKED");
  EXPECT_THAT(error_of([&] { store_.remove("L1NKED"); }), HasSubstr("no person L1NKED"));
  EXPECT_TRUE(fs::exists("/usr"));
}

TEST_F(PersonStoreTest, WrongFilesAreNamedWithFieldAndRemedy) {
  const std::string person = store_.create("");
  const auto error = [&](const std::string& text) {
    write(fs::path(person) / "session-0001.json", text);
    return error_of([&] { store_.sessions(person); });
  };
  EXPECT_THAT(error(R"({"format": 2})"), AllOf(HasSubstr("session-0001.json: format is 2"), HasSubstr("must be 1")));
  EXPECT_THAT(error(R"({"format": 1, "recording": "7", "begun_utc": "2026", "parts": [{"time_s": "long"}]})"),
              AllOf(HasSubstr("session-0001.json: parts[0].time_s is \"long\""), HasSubstr("must be a number")));
  EXPECT_THAT(error(R"({"format": 1, "recording": "-7"})"),
              AllOf(HasSubstr("recording is \"-7\""), HasSubstr("whole number in quotes")));
  EXPECT_THAT(error(R"({"format": 1, "recording": "7", "begun_utc": "2026", "parts": []})"),
              AllOf(HasSubstr("parts is []"), HasSubstr("1 to ")));
  EXPECT_THAT(error("{"), AllOf(HasSubstr("session-0001.json: line 1"), HasSubstr("valid JSON")));
  EXPECT_THAT(error(std::string(100'000, '[')), HasSubstr("session-0001.json: line 1"));
}

TEST_F(PersonStoreTest, AFolderThatIsMissingOrWrongIsNamed) {
  EXPECT_TRUE(store_.persons().empty());
  EXPECT_THAT(error_of([&] { store_.remove("ABCDE1"); }),
              AllOf(HasSubstr("--data " + folder_.string()), HasSubstr("therapy new")));
  EXPECT_THAT(error_of([] { PersonStore(fs::path()); }), AllOf(HasSubstr("--data"), HasSubstr("name a folder")));
  EXPECT_THAT(error_of([] { PersonStore("/dev/null/x").create(""); }),
              AllOf(HasSubstr("--data /dev/null/x"), HasSubstr("check the path")));
}

TEST(PersonFolder, FollowsTheDirectorySpecification) {
  const auto set = [](const char* name, const char* value) {
    value == nullptr ? ::unsetenv(name) : ::setenv(name, value, 1);
  };
  const std::string home = std::getenv("HOME") == nullptr ? "" : std::getenv("HOME");
  set("HOME", "/home/x");
  set("XDG_DATA_HOME", "/data");
  EXPECT_EQ(default_person_folder(), "/data/tandem/therapy");
  set("XDG_DATA_HOME", "relative");
  EXPECT_EQ(default_person_folder(), "/home/x/.local/share/tandem/therapy");
  set("XDG_DATA_HOME", nullptr);
  set("HOME", nullptr);
  EXPECT_TRUE(default_person_folder().empty());
  set("HOME", home.c_str());
}

}  // namespace
}  // namespace tandem::lab
