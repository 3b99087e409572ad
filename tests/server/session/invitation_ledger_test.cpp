// Tests the list of used invitations through failed writes, damaged files, restarts and a full list. A fault would
// admit two users with one invitation, or refuse a valid one.
#include "server/session/invitation_ledger.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "common/base/random.hpp"
#include "tests/support/test_seed.hpp"

namespace tandem::server {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;
using Use = InvitationLedger::Use;

InvitationLedger::Id id_of(std::uint64_t number) {
  InvitationLedger::Id id{};
  for (std::size_t i = 0; i < sizeof number; ++i) id[i] = static_cast<std::byte>(number >> (8 * i) & 0xFFU);
  return id;
}

class InvitationLedgerTest : public testing::Test {
 protected:
  InvitationLedgerTest() {
    char folder[] = "/tmp/tandem-ledger-XXXXXX";
    folder_ = ::mkdtemp(folder);
    file = folder_ / "invitations.pb";
  }
  ~InvitationLedgerTest() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<InvitationLedger> open(std::size_t max_used = kMaxUsedTokens) {
    const auto replace = [this](const std::filesystem::path& to, std::span<const std::byte> bytes) {
      ++attempts;
      if (error != std::errc{}) return std::make_error_code(error);
      std::ofstream(to, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
      return std::error_code();
    };
    return std::make_unique<InvitationLedger>(
        file, [this](const std::string& line) { news.push_back(line); }, replace, max_used);
  }
  std::string problem_of_opening() {
    try {
      open();
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
    return "opened";
  }
  std::string bytes() const {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write_bytes(const std::string& text) const {
    std::ofstream(file, std::ios::binary).write(text.data(), std::ssize(text));
  }

  std::filesystem::path file;
  std::errc error{};  ///< result of every write; std::errc{} means success
  int attempts = 0;
  std::vector<std::string> news;

 private:
  std::filesystem::path folder_;
};

TEST_F(InvitationLedgerTest, AUseCountsWhenItIsOnTheDiskAndStaysOverRestarts) {
  for (const bool keeps_credentials : {false, true, false}) {
    auto ledger = open();
    ledger->begin(keeps_credentials, 1000);
    if (!keeps_credentials && ledger->use_of(id_of(1)) == Use::kNone) {
      ledger->use(id_of(1), 5000);
      EXPECT_EQ(ledger->use_of(id_of(1)), Use::kBeingWritten);
      ledger->work(LocalTime(1s));
      EXPECT_EQ(ledger->use_of(id_of(1)), Use::kBeingWritten) << "io has not heard of it";
      ledger->poll();
    }
    EXPECT_EQ(ledger->use_of(id_of(1)), Use::kWritten);
    EXPECT_EQ(ledger->use_of(id_of(2)), Use::kNone);
  }
}

TEST_F(InvitationLedgerTest, AFailedWriteLeavesTheInvitationUnusedAndKeepsARevocation) {
  {
    auto ledger = open();
    ledger->begin(true, 1000);
    error = std::errc::no_space_on_device;
    ledger->use(id_of(1), 5000);
    ledger->revoke(id_of(7));
    ledger->work(LocalTime(1s));
    ledger->poll();
    EXPECT_EQ(ledger->use_of(id_of(1)), Use::kNone);
    EXPECT_EQ(ledger->problem(), "No space left on device");
    error = {};
    ledger->use(id_of(2), 5000);
    ledger->work(LocalTime(1s) + 1ms);
    ledger->poll();
    EXPECT_EQ(ledger->use_of(id_of(2)), Use::kWritten) << "a join tries at once";
    EXPECT_EQ(ledger->problem(), "");
  }
  const auto again = open();
  EXPECT_EQ(again->use_of(id_of(1)), Use::kNone);
  EXPECT_EQ(again->use_of(id_of(2)), Use::kWritten);
  EXPECT_TRUE(again->is_revoked(id_of(7)));
}

TEST_F(InvitationLedgerTest, AFailedWriteIsRetriedWithBackOffAndSaidOnce) {
  auto ledger = open();
  ledger->begin(true, 1000);
  error = std::errc::read_only_file_system;
  ledger->revoke(id_of(7));
  attempts = 0;
  std::vector<std::int64_t> tried;
  for (Duration at = 0s; at < 40s; at += 5ms) {
    const int before = attempts;
    ledger->work(LocalTime(at));
    if (attempts > before) tried.push_back(at / 1ms);
  }
  EXPECT_THAT(tried, testing::ElementsAre(0, 500, 1500, 3500, 7500, 15'500, 23'500, 31'500, 39'500));
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0], testing::AllOf(HasSubstr(file.string()), HasSubstr("Read-only"), HasSubstr("writable")));
  error = {};
  ledger->work(LocalTime(47'500ms));
  EXPECT_EQ(news.size(), 2U);
  EXPECT_TRUE(open()->is_revoked(id_of(7)));
}

TEST_F(InvitationLedgerTest, AFileThatCannotBeWrittenAtTheStartIsASetUpError) {
  auto ledger = open();
  error = std::errc::permission_denied;
  try {
    ledger->begin(false, 1000);
    FAIL() << "begun";
  } catch (const std::invalid_argument& problem) {
    EXPECT_THAT(problem.what(), testing::AllOf(HasSubstr(file.string()), HasSubstr("Permission denied"),
                                               HasSubstr("make the folder writable")));
  }
}

TEST_F(InvitationLedgerTest, EveryDamagedOrShortenedFileIsRefusedWithTheRemedy) {
  Random random(test::test_seed(1));
  {
    auto ledger = open();
    ledger->begin(true, 1000);
    for (std::uint64_t i = 0; i < 20; ++i) ledger->use(id_of(random.next_u64()), random.next_u64());
    ledger->work(LocalTime{});
  }
  const std::string whole = bytes();
  ASSERT_EQ(problem_of_opening(), "opened");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write_bytes(whole.substr(0, size));
    ASSERT_THAT(problem_of_opening(), HasSubstr("is damaged")) << size << " bytes";
  }
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ static_cast<char>(1U << random.next_u32() % 8U));
    write_bytes(damaged);
    ASSERT_THAT(problem_of_opening(), testing::AllOf(HasSubstr("is damaged"), HasSubstr("remove it"))) << "byte " << at;
  }
  write_bytes(std::string((16U << 20U) + 1, 'x'));
  EXPECT_THAT(problem_of_opening(), HasSubstr("has 16777217 bytes"));
  std::filesystem::remove(file);
  std::filesystem::create_directory(file);
  EXPECT_THAT(problem_of_opening(), testing::AllOf(HasSubstr("cannot be read"), HasSubstr("remove it")));
}

TEST_F(InvitationLedgerTest, WithoutAFileEarlierTokensAreRefusedUnlessTheKeyIsNew) {
  auto ledger = open();
  ledger->begin(true, 1000);
  EXPECT_EQ(ledger->issued_from_ms(), 1000U);
  ledger = open();
  ledger->begin(true, 2000);
  EXPECT_EQ(ledger->issued_from_ms(), 1000U) << "the file exists now";
  ledger = open();
  ledger->begin(true, 900);
  ASSERT_EQ(news.size(), 1U);
  EXPECT_THAT(news[0], testing::AllOf(HasSubstr("clock is behind"), HasSubstr("1970-01-01 00:00:01 UTC")));
  std::filesystem::remove(file);
  InvitationFile::make(file);
  const std::string made = bytes();
  InvitationFile::make(file);
  EXPECT_EQ(bytes(), made) << "one that exists stays";
  ledger = open();
  ledger->begin(true, 3000);
  EXPECT_EQ(ledger->issued_from_ms(), 0U);
}

TEST_F(InvitationLedgerTest, CredentialsEndWithAStartThatDoesNotKeepThem) {
  const auto generation_after = [this](bool keeps_credentials) {
    auto ledger = open();
    ledger->begin(keeps_credentials, 1000);
    return ledger->generation();
  };
  const std::string first = generation_after(true);
  EXPECT_EQ(generation_after(true), first);
  const std::string second = generation_after(false);
  EXPECT_NE(second, first);
  EXPECT_EQ(generation_after(true), second);
  std::filesystem::remove(file);
  EXPECT_NE(generation_after(true), second) << "a checkpoint beside a removed file is of no use";
}

TEST_F(InvitationLedgerTest, AFullListRemovesOnlyExpiredEntriesAndStillRefusesThem) {
  Random random(test::test_seed(2));
  constexpr std::size_t kMost = 50;
  std::map<std::uint64_t, std::uint64_t> used;  // expiry [ms] of each used invitation, by number
  std::uint64_t now_ms = 1000, newest_ms = 0, refused = 0;
  for (int run = 0; run < 20; ++run) {
    auto ledger = open(kMost);
    ledger->begin(random.next_u32() % 2 == 0, now_ms);
    for (int i = 0; i < 60; ++i) {
      // Sometimes the clock steps back. Invitations whose entries were deleted as expired must be refused nevertheless.
      now_ms = random.next_u32() % 10 == 0 ? now_ms - 100 : now_ms + random.next_u32() % 60;
      newest_ms = std::max(newest_ms, now_ms);
      const std::uint64_t expires_ms = now_ms + 1 + random.next_u32() % 1000;
      if (!ledger->has_room(now_ms)) {
        ++refused;
        const auto unexpired = std::ranges::count_if(used, [now_ms](const auto& one) { return one.second > now_ms; });
        ASSERT_GE(unexpired, static_cast<std::ptrdiff_t>(kMost));
      } else if (expires_ms > ledger->forgotten_to_ms()) {
        used[used.size()] = expires_ms;
        ledger->use(id_of(used.size() - 1), expires_ms);
        ledger->work(LocalTime{});
        ledger->poll();
      }
      for (const auto& [number, expires] : used) {
        ASSERT_TRUE(ledger->use_of(id_of(number)) == Use::kWritten || expires <= ledger->forgotten_to_ms());
      }
      ASSERT_LE(ledger->forgotten_to_ms(), newest_ms);
    }
  }
  EXPECT_GT(refused, 10U);
  EXPECT_GT(used.size(), 3 * kMost);
}

TEST_F(InvitationLedgerTest, HoldsTheNewestRevocationsAndALongRowOfChanges) {
  auto ledger = open();
  ledger->begin(true, 1000);
  // Revokes ten more invitations than the ledger stores, all before its first write. The oldest ten may be lost, but
  // none of the newest.
  for (std::uint64_t i = 0; i < kMaxRevoked + 10; ++i) ledger->revoke(id_of(i));
  for (int i = 0; i < 30; ++i) {
    ledger->work(LocalTime{});
    ledger->poll();
  }
  ledger = open();
  EXPECT_FALSE(ledger->is_revoked(id_of(9)));
  EXPECT_TRUE(ledger->is_revoked(id_of(10)));
  EXPECT_TRUE(ledger->is_revoked(id_of(kMaxRevoked + 9)));
}

TEST_F(InvitationLedgerTest, TheThreadWritesAndTheEndWritesTheRest) {
  {
    InvitationLedger ledger(file);
    ledger.begin(true, 1000);
    ledger.start();
    ledger.use(id_of(1), 5000);
    while (ledger.use_of(id_of(1)) != Use::kWritten) {
      std::this_thread::sleep_for(1ms);
      ledger.poll();
    }
    for (std::uint64_t i = 2; i < 500; ++i) ledger.use(id_of(i), 5000);
    for (std::uint64_t i = 2; i < 100; ++i) ledger.release(id_of(i));
    ledger.finish();
  }
  InvitationLedger again(file);
  for (std::uint64_t i = 1; i < 500; ++i) {
    EXPECT_EQ(again.use_of(id_of(i)), i >= 2 && i < 100 ? Use::kNone : Use::kWritten) << i;
  }
}

}  // namespace
}  // namespace tandem::server
