// Tests Happy Eyeballs (RFC 8305) in virtual time: the order and the start times of connection attempts, and the
// winning address.
#include "common/net/address_race.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <random>

#include "tests/support/test_seed.hpp"

namespace tandem::net {
namespace {

using std::chrono::milliseconds;

Address address(const char* text) {
  return boost::asio::ip::make_address(text);
}

LocalTime at(int ms) {
  return LocalTime(std::chrono::hours(1)) + milliseconds(ms);
}

enum class Ending : std::uint8_t { kAccepts, kRefuses, kSilent };

/// How an address responds to a connection attempt: the kind of ending, and its time after the start [ms].
struct Behaviour {
  Ending ending = Ending::kSilent;
  int after_ms = 0;
};

/// Runs a race in steps of 1 ms of virtual time, without sockets and timers, until it is won or lost or until
/// `limit_ms`.
struct Course {
  Course(AddressRace& race, const std::function<Behaviour(const Address&)>& behaviour, int from_ms, int limit_ms) {
    std::map<Address, int> going_on;
    for (now_ms = from_ms; now_ms <= limit_ms; ++now_ms) {
      for (const auto& [to, began] : std::map<Address, int>(going_on)) {
        const Behaviour does = behaviour(to);
        if (does.ending == Ending::kSilent || now_ms < began + does.after_ms) continue;
        going_on.erase(to);
        if (does.ending == Ending::kAccepts) {
          race.accepted(to);
          winner = to;
          return;
        }
        race.failed(to, AttemptFailure::kRefused, "connection refused");
      }
      while (const auto late = race.expired(at(now_ms))) {
        going_on.erase(*late);
        race.failed(*late, AttemptFailure::kTimedOut, "no answer");
        timed_out.push_back(*late);
      }
      while (const auto next = race.next(at(now_ms))) {
        started.emplace_back(*next, now_ms);
        going_on[*next] = now_ms;
      }
      is_lost = race.is_lost();
      if (is_lost) return;
    }
  }

  int now_ms = 0;
  std::vector<std::pair<Address, int>> started;
  std::vector<Address> timed_out;
  std::optional<Address> winner;
  bool is_lost = false;
};

const Address kSix = address("2001:db8::1"), kSix2 = address("2001:db8::2");
const Address kFour = address("192.0.2.1"), kFour2 = address("192.0.2.2");

TEST(AddressRace, TriesIpv6FirstThenTheFamiliesInTurnA250MillisecondsApart) {
  AddressRace race({}, 2);
  race.add(std::vector{kSix, kSix2}, true, "", at(0));
  race.add(std::vector{kFour, kFour2}, false, "", at(0));
  const Course course(
      race, [](const Address&) { return Behaviour{}; }, 0, 1000);
  const std::vector<std::pair<Address, int>> expected{{kSix, 0}, {kFour, 250}, {kSix2, 500}, {kFour2, 750}};
  EXPECT_EQ(course.started, expected);
}

TEST(AddressRace, StartsTheNextAtOnceWhenTheLastOneFails) {
  AddressRace race(std::vector{kSix, kFour});
  const Course course(
      race,
      [](const Address& to) {
        return Behaviour{to == kSix ? Ending::kRefuses : Ending::kAccepts, 3};
      },
      0, 1000);
  EXPECT_EQ(course.winner, kFour);
  EXPECT_EQ(course.now_ms, 6);
  EXPECT_EQ(race.report().substr(0, 31), "2001:db8::1: connection refused");
}

TEST(AddressRace, WaitsFor50MillisecondsForTheIpv6AnswerAndNoLonger) {
  for (const int v6_answers_ms : {20, 49, 80, 3000}) {
    AddressRace race({}, 2);
    race.add(std::vector{kFour}, false, "", at(0));
    EXPECT_EQ(race.next(at(0)), std::nullopt);
    EXPECT_EQ(race.due(), at(50));
    if (v6_answers_ms < 50) {
      race.add(std::vector{kSix}, true, "", at(v6_answers_ms));
      EXPECT_EQ(race.next(at(v6_answers_ms)), kSix);
    } else {
      EXPECT_EQ(race.next(at(49)), std::nullopt);
      EXPECT_EQ(race.next(at(50)), kFour);
    }
  }
  AddressRace race({}, 2);
  race.add(std::vector{kFour}, false, "", at(0));
  race.add({}, true, "host not found", at(7));
  EXPECT_EQ(race.next(at(7)), kFour) << "no IPv6 address will come";
  AddressRace six({}, 2);
  six.add(std::vector{kSix}, true, "", at(0));
  EXPECT_EQ(six.next(at(0)), kSix) << "IPv6 must not wait for IPv4";
}

TEST(AddressRace, AnAnswerDuringARaceIsTriedInItsTurn) {
  AddressRace race({}, 2);
  race.add(std::vector{kFour, kFour2}, false, "", at(0));
  EXPECT_EQ(race.next(at(50)), kFour);
  race.add(std::vector{kSix}, true, "", at(100));
  EXPECT_EQ(race.next(at(299)), std::nullopt);
  EXPECT_EQ(race.next(at(300)), kSix) << "before the second address of IPv4";
}

TEST(AddressRace, AnAddressThatWonBeforeNeedsNoLookUp) {
  AddressRace race(std::vector{kFour, kSix}, 2);
  EXPECT_EQ(race.next(at(0)), kFour) << "it won the race before";
  EXPECT_EQ(race.next(at(250)), kSix);
  race.failed(kFour, AttemptFailure::kRefused, "connection refused");
  EXPECT_FALSE(race.is_lost());
  race.failed(kSix, AttemptFailure::kRefused, "connection refused");
  EXPECT_TRUE(race.is_lost()) << "although the name server has not answered";
}

TEST(AddressRace, AWinnerThatIsNotTheServerIsReplacedByAnotherAddress) {
  AddressRace race(std::vector{kSix, kFour});
  EXPECT_EQ(race.next(at(0)), kSix);
  EXPECT_EQ(race.next(at(250)), kFour);
  race.accepted(kSix);
  EXPECT_EQ(race.next(at(900)), std::nullopt) << "no other address may be tried during the set-up";
  race.failed(kSix, AttemptFailure::kUntrusted, "its key is another");
  EXPECT_EQ(race.next(at(901)), kFour);
  race.failed(kFour, AttemptFailure::kRefused, "connection refused");
  EXPECT_TRUE(race.is_lost());
  EXPECT_EQ(race.report(), "2001:db8::1: its key is another; 192.0.2.1: connection refused");
}

TEST(AddressRace, ASilentWinnerIsAbandonedOnlyIfAnotherAddressIsLeft) {
  AddressRace race(std::vector{kSix, kFour});
  EXPECT_EQ(race.next(at(0)), kSix);
  race.accepted(kSix);
  EXPECT_EQ(race.due(), at(3000));
  EXPECT_EQ(race.expired(at(2999)), std::nullopt);
  EXPECT_EQ(race.expired(at(3000)), kSix);
  race.failed(kSix, AttemptFailure::kTimedOut, "no answer");
  EXPECT_EQ(race.next(at(3000)), kFour);
  race.accepted(kFour);
  EXPECT_EQ(race.expired(at(60000)), std::nullopt) << "the caller's own limit ends it";
}

TEST(AddressRace, IgnoresAddressesAboveItsLimitAndThoseItHas) {
  AddressRace race({}, 2);
  std::vector<Address> many(20, kSix);
  for (int i = 0; i < 20; ++i) many.push_back(address(("2001:db8::" + std::to_string(10 + i)).c_str()));
  race.add(many, true, "", at(0));
  race.add({}, false, "", at(0));
  const Course course(
      race,
      [](const Address&) {
        return Behaviour{Ending::kRefuses, 0};
      },
      0, 1000);
  EXPECT_TRUE(course.is_lost);
  EXPECT_EQ(course.started.size(), AddressRace::kMaxPerFamily);
}

/// Reference: order and start times according to the text of RFC 8305, computed without the tested code. The address
/// families alternate. Each attempt starts a fixed delay after the previous one, or when the previous one fails.
struct Expected {
  Expected(std::vector<Address> six, std::vector<Address> four, const std::map<Address, Behaviour>& behaviours) {
    std::vector<Address> order;
    for (std::size_t i = 0; i < std::max(six.size(), four.size()); ++i) {
      if (i < six.size()) order.push_back(six[i]);
      if (i < four.size()) order.push_back(four[i]);
    }
    constexpr int kDelay = 250, kTimeOut = 3000;
    int start = 0;
    for (const Address& to : order) {
      if (winner && start >= ends_ms) break;
      starts.emplace_back(to, start);
      const Behaviour& does = behaviours.at(to);
      const bool is_in_time = does.ending != Ending::kSilent && does.after_ms < kTimeOut;
      const int end = start + (is_in_time ? does.after_ms : kTimeOut);
      if (is_in_time && does.ending == Ending::kAccepts && (!winner || end < ends_ms)) {
        winner = to;
        ends_ms = end;
      }
      const bool fails_early = is_in_time && does.ending == Ending::kRefuses && does.after_ms < kDelay;
      start = fails_early ? end : start + kDelay;
    }
  }

  std::vector<std::pair<Address, int>> starts;
  std::optional<Address> winner;
  int ends_ms = 0;
};

TEST(AddressRace, WinnerAndTimesAreThoseOfRfc8305ForGeneratedOutcomes) {
  std::mt19937_64 random(test::test_seed(8305));
  const auto below = [&random](int limit) { return std::uniform_int_distribution<int>(0, limit - 1)(random); };
  int wins = 0, losses = 0;
  for (int round = 0; round < 600; ++round) {
    std::vector<Address> six, four;
    std::map<Address, Behaviour> behaviours;
    const auto add = [&](std::vector<Address>& to, const std::string& text) {
      to.push_back(address(text.c_str()));
      behaviours[to.back()] = {static_cast<Ending>(below(3)), 1 + below(below(2) == 0 ? 400 : 2900)};
    };
    const int v6 = below(5), v4 = (v6 == 0 ? 1 : 0) + below(4);
    for (int i = 0; i < v6; ++i) add(six, "2001:db8::" + std::to_string(i + 1));
    for (int i = 0; i < v4; ++i) add(four, "192.0.2." + std::to_string(i + 1));
    AddressRace race({}, 2);
    race.add(six, true, "", at(0));
    race.add(four, false, "", at(0));
    const Course course(
        race, [&](const Address& to) { return behaviours.at(to); }, 0, 12000);
    const Expected expected(six, four, behaviours);
    ASSERT_EQ(course.winner.has_value(), expected.winner.has_value()) << "round " << round << ": " << race.report();
    if (expected.winner) {
      ++wins;
      EXPECT_EQ(course.now_ms, expected.ends_ms) << "round " << round;
      // If two addresses accept in the same millisecond, either may win.
      const Behaviour& does = behaviours.at(*course.winner);
      const auto began = std::ranges::find(expected.starts, *course.winner, &std::pair<Address, int>::first);
      ASSERT_NE(began, expected.starts.end()) << "round " << round;
      EXPECT_EQ(began->second + does.after_ms, expected.ends_ms) << "round " << round;
    } else if (course.is_lost) {
      ++losses;
      for (const auto& [to, does] : behaviours) {
        EXPECT_NE(race.report().find(to.to_string() + ": "), std::string::npos) << race.report();
      }
    }
    for (std::size_t i = 0; i < course.started.size(); ++i) {
      ASSERT_LT(i, expected.starts.size()) << "round " << round;
      EXPECT_EQ(course.started[i], expected.starts[i]) << "round " << round << ", attempt " << i;
    }
  }
  EXPECT_GT(wins, 200);
  EXPECT_GT(losses, 20);
}

TEST(AddressRace, NeverTriesMoreThanOneStartOrForgetsAnAddressForGeneratedEvents) {
  std::mt19937_64 random(test::test_seed(6555));
  const auto below = [&random](std::size_t limit) {
    return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
  };
  for (int round = 0; round < 500; ++round) {
    const std::vector<Address> pool{kSix, kSix2, kFour, kFour2, address("2001:db8::3"), address("192.0.2.3")};
    const std::size_t known = below(3);
    AddressRace race(std::span<const Address>(pool).first(known), 2);
    std::vector<Address> going_on, failed;
    std::optional<Address> accepted;
    int answers = 0;
    for (int ms = 0; ms < 8000; ms += 1 + static_cast<int>(below(60))) {
      const std::size_t what = below(12);
      if (what == 0 && answers < 2) {
        const bool is_v6 = answers++ == 0;
        std::vector<Address> found;
        for (const Address& each : pool) {
          if (each.is_v6() == is_v6 && below(2) == 0) found.push_back(each);
        }
        race.add(found, is_v6, "host not found", at(ms));
      } else if (what == 1 && !going_on.empty() && !accepted) {
        accepted = going_on[below(going_on.size())];
        race.accepted(*accepted);
        going_on.clear();
      } else if (what < 4 && (accepted || !going_on.empty())) {
        const Address fails = accepted ? *accepted : going_on[below(going_on.size())];
        race.failed(fails, AttemptFailure::kOther, "failed");
        std::erase(going_on, fails);
        failed.push_back(fails);
        accepted.reset();
      }
      while (const auto late = race.expired(at(ms))) {
        race.failed(*late, AttemptFailure::kTimedOut, "no answer");
        std::erase(going_on, *late);
        failed.push_back(*late);
        if (accepted == *late) accepted.reset();
      }
      int starts = 0;
      while (const auto next = race.next(at(ms))) {
        ++starts;
        EXPECT_FALSE(accepted) << "no address may be tried while a connection is accepted";
        EXPECT_EQ(std::ranges::find(failed, *next), failed.end()) << "one that failed is not tried again";
        EXPECT_EQ(std::ranges::find(going_on, *next), going_on.end());
        going_on.push_back(*next);
      }
      EXPECT_LE(starts, 1) << "two never start together";
      const bool is_over = going_on.empty() && !accepted && (answers == 2 || known > 0);
      EXPECT_EQ(race.is_lost(), is_over && !race.due()) << "round " << round;
      if (race.is_lost()) break;
    }
  }
}

}  // namespace
}  // namespace tandem::net
