// Tests a file download over a line that also carries state updates, in virtual time: the rate of the download and the
// delay of the states.
#include "common/net/fetch_rate.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <utility>
#include <vector>

#include "common/base/histogram.hpp"
#include "common/net/link.hpp"

namespace tandem::net {
namespace {

using std::chrono::milliseconds;

constexpr Duration kFetchSlot = std::chrono::microseconds(250);
constexpr std::size_t kStateBytes = 300;

struct Line {
  Duration one_way{milliseconds(50)};
  double bytes_per_s = 1.25e6;
  Duration jitter{0};
};

/// A simulated server that answers requests at once and sends a state update every millisecond.
class Fetching {
 public:
  explicit Fetching(const Line& line)
      : line_(line),
        up_(SimulatedLink::reliable(parameters(line), 1, 1)),
        down_(SimulatedLink::reliable(parameters(line), 1, 2)),
        state_(parameters(line), 1, 3) {
    down_.share_line(state_);
  }

  void run(Duration duration) {
    for (const LocalTime end = now_ + duration; now_ < end; now_ += kFetchSlot) slot();
  }
  void set_rate(double bytes_per_s) {
    line_.bytes_per_s = bytes_per_s;
    down_.set_parameters(parameters(line_));
    state_.set_parameters(parameters(line_));
  }
  void forget_waits() { waits_ = {}; }

  FetchRate rate;
  std::uint64_t fetched = 0;
  bool is_answered = true;

  Duration wait_p99() const { return waits_.quantile(0.99); }
  Duration wait_max() const { return waits_.max(); }

 private:
  static LinkParameters parameters(const Line& line) {
    LinkParameters parameters;
    parameters.delay = line.one_way;
    parameters.jitter = line.jitter;
    parameters.rate_limit_bytes_per_s = line.bytes_per_s;
    return parameters;
  }

  void slot() {
    while (const auto request = up_.receive(now_)) {
      std::size_t bytes = 0;
      std::memcpy(&bytes, request->data(), sizeof bytes);
      if (is_answered) down_.send(now_, std::vector<std::byte>(bytes));
    }
    if (now_.time_since_epoch() % milliseconds(1) == Duration(0)) {
      waits_.record(state_.line_wait(now_));
      std::vector<std::byte> state(kStateBytes);
      std::memcpy(state.data(), &now_, sizeof now_);
      state_.send(now_, state);
    }
    while (const auto state = state_.receive(now_)) {
      LocalTime sent;
      std::memcpy(&sent, state->data(), sizeof sent);
      rate.state_came(now_, now_ - sent, state->size());
    }
    while (const auto piece = down_.receive(now_)) {
      fetched += piece->size();
      rate.answered(now_);
    }
    while (const std::size_t bytes = rate.bytes_to_request(now_)) {
      std::vector<std::byte> request(50);
      std::memcpy(request.data(), &bytes, sizeof bytes);
      up_.send(now_, request);
      rate.note_request(now_, bytes);
    }
  }

  Line line_;
  LocalTime now_{std::chrono::seconds(1)};
  SimulatedLink up_;
  SimulatedLink down_;
  SimulatedLink state_;
  Histogram waits_;
};

TEST(FetchRate, UsesMostOfTheSpareBandwidthAndHardlyDelaysState) {
  for (const int round_trip_ms : {2, 20, 100, 200}) {
    Fetching fetching({.one_way = milliseconds(round_trip_ms) / 2});
    fetching.run(std::chrono::seconds(4));
    const double free = 4 * (1.25e6 - 1000.0 * kStateBytes);
    EXPECT_GT(static_cast<double>(fetching.fetched), 0.65 * free) << round_trip_ms << " ms";
    EXPECT_LE(fetching.wait_p99(), milliseconds(5)) << round_trip_ms << " ms";
    EXPECT_LE(fetching.wait_max(), milliseconds(12)) << round_trip_ms << " ms";
  }
}

TEST(FetchRate, PrefersStateOnANarrowLink) {
  Fetching fetching({.bytes_per_s = 400e3});
  fetching.run(std::chrono::seconds(5));
  EXPECT_GT(fetching.fetched, 200'000U);
  EXPECT_LE(fetching.wait_p99(), milliseconds(12));
}

TEST(FetchRate, FallsWhenTheLineBecomesNarrower) {
  Fetching fetching({});
  fetching.run(std::chrono::seconds(2));
  fetching.set_rate(600e3);
  fetching.run(std::chrono::seconds(2));
  fetching.forget_waits();
  fetching.run(std::chrono::seconds(3));
  EXPECT_LT(fetching.rate.rate_bytes_per_s(), 300e3);
  EXPECT_LE(fetching.wait_p99(), milliseconds(10));
}

TEST(FetchRate, UnderJitterComesForwardMoreSlowlyAndStillLeavesStateAlone) {
  for (const auto& [jitter_ms, share] : {std::pair{2, 0.3}, {5, 0.08}, {10, 0.05}}) {
    for (const int round_trip_ms : {2, 50, 200}) {
      Fetching fetching({.one_way = milliseconds(round_trip_ms) / 2, .jitter = milliseconds(jitter_ms)});
      fetching.run(std::chrono::seconds(6));
      const double free = 6 * (1.25e6 - 1000.0 * kStateBytes);
      EXPECT_GT(static_cast<double>(fetching.fetched), share * free) << jitter_ms << ", " << round_trip_ms << " ms";
      EXPECT_LE(fetching.wait_p99(), milliseconds(10)) << jitter_ms << ", " << round_trip_ms << " ms";
      EXPECT_LE(fetching.wait_max(), milliseconds(20)) << jitter_ms << ", " << round_trip_ms << " ms";
    }
  }
}

TEST(FetchRate, UsesAFastLine) {
  Fetching fetching({.one_way = std::chrono::microseconds(250), .bytes_per_s = 125e6});
  fetching.run(std::chrono::seconds(1));
  EXPECT_GT(fetching.fetched, 10'000'000U);
}

TEST(FetchRate, StaysWithinItsBoundsForAnyDelays) {
  FetchRate rate;
  const Duration longest(std::int64_t{1} << 61U);
  LocalTime now{std::chrono::seconds(1)};
  for (int i = 0; i < 5000; ++i) {
    now += milliseconds(1);
    rate.state_came(now, i % 3 == 0 ? longest : i % 3 == 1 ? -longest : Duration{0}, kStateBytes);
    while (const std::size_t bytes = rate.bytes_to_request(now)) {
      EXPECT_LE(bytes, FetchRate::kMaxPiece);
      rate.note_request(now, bytes);
    }
    for (int k = 0; k < i % 5; ++k) rate.answered(now);
    EXPECT_GE(rate.rate_bytes_per_s(), FetchRate::kMinRate_bytes_per_s);
    EXPECT_LE(rate.rate_bytes_per_s(), FetchRate::kMaxRate_bytes_per_s);
    EXPECT_LE(rate.in_flight_bytes(), FetchRate::kMaxInFlight);
  }
}

TEST(FetchRate, LimitsTheRequestsToAServerThatDoesNotAnswer) {
  Fetching fetching({.one_way = std::chrono::microseconds(250), .bytes_per_s = 125e6});
  fetching.run(std::chrono::seconds(1));
  fetching.is_answered = false;
  fetching.run(std::chrono::seconds(20));
  const std::size_t in_flight = fetching.rate.in_flight_bytes();
  EXPECT_LE(in_flight, FetchRate::kMaxInFlight);
  fetching.run(std::chrono::seconds(20));
  EXPECT_EQ(fetching.rate.in_flight_bytes(), in_flight);
}

}  // namespace
}  // namespace tandem::net
