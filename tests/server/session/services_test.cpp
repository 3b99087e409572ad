// Tests each service of joined users with a fake host in place of the session hub: handled messages, permitted roles,
// rate limits, refusals, and messages to other users.
#include "server/session/services/services.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <utility>

#include "proto/control_framing.hpp"
#include "proto/coupling_fields.hpp"
#include "proto/soft_shape.hpp"
#include "tests/support/hub_bench.hpp"

namespace tandem::server {
namespace {

using test::described;
using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;
using Case = SessionService::Case;

/// A host with one room, under a virtual clock. It stores everything that a service sends.
class FakeHost final : public ServiceHost {
 public:
  explicit FakeHost(const std::string& scene) : FakeHost(test::scene_of(scene)) {}
  explicit FakeHost(std::shared_ptr<const LoadedScene> scene) : loaded_(std::move(scene)) {
    rooms_.push_back(std::make_unique<Room>(RoomId{1}, "bench", loaded_));
    seats_.push_back(std::make_unique<RoomSeats>(room()));
  }

  Room& room() { return *rooms_.front(); }
  RoomSeats& seats() { return *seats_.front(); }

  SessionUser& join(const std::string& name, UserRole role = UserRole::kManipulator) {
    const auto seat = seats().allocate(role, false, haptics::kNoCouplingBounds, name);
    EXPECT_TRUE(seat) << name;
    users_.push_back(std::make_unique<SessionUser>(SessionUser{name, &seats(), *seat}));
    step();
    return *users_.back();
  }
  /// Removes a user from users_of(). The hub does the same before it calls SessionService::on_left(). The reference to
  /// the user stays valid.
  void leave(SessionUser& user) {
    seats().leave(user.seat);
    const auto found = std::ranges::find_if(users_, [&user](const auto& each) { return each.get() == &user; });
    gone_.push_back(std::move(*found));
    users_.erase(found);
    step();
  }
  void step(int ms = 1) {
    for (int i = 0; i < ms; ++i) {
      now_ += std::chrono::milliseconds(1);
      room().step(server_time_of_own_clock(now_));
    }
  }
  /// Returns the messages that a user has received since the last call.
  std::vector<wire::ServerControl> drain(const SessionUser& user) { return std::exchange(sent_[&user], {}); }
  std::string received(const SessionUser& user) { return described(drain(user)); }

  LocalTime now() const override { return now_; }
  const std::vector<std::unique_ptr<RoomSeats>>& rooms() const override { return seats_; }
  std::vector<SessionUser*> users_of(const Room& of) const override {
    std::vector<SessionUser*> users;
    for (const auto& user : users_) {
      if (&user->room() == &of) users.push_back(user.get());
    }
    return users;
  }
  void send(SessionUser& user, const wire::ServerControl& message) override { sent_[&user].push_back(message); }
  std::size_t queued_bytes(const SessionUser& /*user*/) const override { return queued; }
  void announce(SessionUser& user, std::size_t key, std::function<wire::ServerControl()> make) override {
    news_[&user][key] = std::move(make);
  }
  void send_news(SessionUser& user) override {
    for (const auto& [key, make] : std::exchange(news_[&user], {})) send(user, make());
  }
  void end(SessionUser& user, wire::DisconnectReason reason, const std::string& text) override {
    ended.emplace_back(&user, reason);
    EXPECT_FALSE(text.empty());
  }
  void log(std::string_view kind, const std::string& line) const override {
    logged.push_back(std::string(kind) + ": " + line);
  }

  std::size_t queued = 0;
  std::vector<std::pair<SessionUser*, wire::DisconnectReason>> ended;
  mutable std::vector<std::string> logged;

 private:
  std::shared_ptr<const LoadedScene> loaded_;
  LocalTime now_{std::chrono::seconds(100)};
  std::vector<std::unique_ptr<Room>> rooms_;
  std::vector<std::unique_ptr<RoomSeats>> seats_;
  std::vector<std::unique_ptr<SessionUser>> users_, gone_;
  std::map<const SessionUser*, std::vector<wire::ServerControl>> sent_;
  std::map<const SessionUser*, std::map<std::size_t, std::function<wire::ServerControl()>>> news_;
};

/// Returns a scene with one box, tools for `users` users, and seats for up to four observers.
std::string scene_for(int users) {
  std::string tools;
  for (int i = 0; i < users; ++i) {
    tools += std::string(i > 0 ? "," : "") + R"({"name": "t)" + std::to_string(i) +
             R"(", "placement": {"position_m": [)" + std::to_string(0.05 * (i + 1)) + ", 0.2, 0]}}";
  }
  return R"({"name": "bench", "bodies": [{"name": "box", "shapes": [{"box": {"size_m": [0.02, 0.02, 0.02]}}],
             "mass_kg": 0.1, "gravity": false}], "tools": [)" +
         tools + R"(], "limits": {"observers": )" + std::to_string(std::min(users, 4)) + "}}";
}

std::vector<std::unique_ptr<SessionService>> all_services(ServiceHost& host) {
  std::vector<std::unique_ptr<SessionService>> services;
  services.push_back(make_grasping(host));
  services.push_back(make_coupling(host));
  services.push_back(make_moderation(host, nullptr));
  services.push_back(make_poses(host, nullptr));
  services.push_back(make_pointing(host));
  services.push_back(make_signals(host));
  services.push_back(make_assets(host));
  services.push_back(make_soft_shapes(host));
  return services;
}

TEST(Services, EachMessageHasOneHandler) {
  FakeHost host(test::two_hands_scene());
  const std::vector<std::unique_ptr<SessionService>> services = all_services(host);
  std::multiset<int> handled;
  for (const auto& service : services) {
    for (const Case each : service->cases()) handled.insert(static_cast<int>(each));
  }
  // Kinds of messages that no service handles, but the hub itself: those for connections without a joined user, or in
  // any state.
  for (const Case each : {Case::kHello, Case::kJoin, Case::kLeave, Case::kStateDatagram, Case::kPing}) {
    handled.insert(static_cast<int>(each));
  }
  const auto* const kinds = wire::ClientControl::descriptor()->oneof_decl(0);
  ASSERT_EQ(handled.size(), static_cast<std::size_t>(kinds->field_count()));
  for (int i = 0; i < kinds->field_count(); ++i) {
    EXPECT_EQ(handled.count(kinds->field(i)->number()), 1U) << kinds->field(i)->name();
  }
}

wire::ClientControl point_message(std::uint32_t body, double x_m) {
  return message_of([&](auto& message) {
    message.mutable_point()->set_body(body);
    for (const double number : {x_m, 0.0, 0.0}) {
      message.mutable_point()->add_place(number);
      message.mutable_point()->add_place_w(number);
    }
  });
}
wire::ClientControl parameter_message(const std::string& name, double value, const std::string& text = "") {
  return message_of([&](auto& message) {
    message.mutable_set_parameter()->set_name(name);
    message.mutable_set_parameter()->set_value(value);
    message.mutable_set_parameter()->set_text(text);
  });
}
wire::ClientControl law_message(const std::string& law) {
  return parameter_message(std::string(proto::kLawParameter), 0, law);
}

/// A request that only some roles may send.
struct Restricted {
  std::string name;
  wire::ClientControl message;
  std::set<UserRole> allowed;
};

std::vector<Restricted> restricted_requests() {
  const std::set<UserRole> hands = {UserRole::kManipulator, UserRole::kOperator};
  const std::set<UserRole> chief = {UserRole::kOperator};
  return {
      {"grab", message_of([](auto& message) { message.mutable_grab()->set_body(1); }), hands},
      {"release", message_of([](auto& message) { message.mutable_release(); }), hands},
      {"point", point_message(0, 0.1), hands},
      {"set a coefficient", parameter_message("coupling.stiffness_n_per_m", 250), chief},
      {"set the law", law_message("qsa-dynamic"), chief},
      {"kick", message_of([](auto& message) { message.mutable_kick()->set_user(1); }), chief},
      {"reset", message_of([](auto& message) { message.mutable_reset_room(); }), chief},
  };
}

/// Passes a message to the service that handles its kind.
void handle(const std::vector<std::unique_ptr<SessionService>>& services, SessionUser& user,
            const wire::ClientControl& message) {
  for (const auto& service : services) {
    const std::vector<Case> cases = service->cases();
    if (std::ranges::find(cases, message.message_case()) != cases.end()) return service->handle(user, message);
  }
  FAIL() << "no service handles this message";
}

TEST(Services, RefuseRequestsOfRolesThatMayNotMakeThemAndTellNobodyElse) {
  for (const Restricted& request : restricted_requests()) {
    for (const UserRole role : {UserRole::kManipulator, UserRole::kObserver, UserRole::kOperator}) {
      if (request.allowed.contains(role)) continue;
      SCOPED_TRACE(request.name + ", role " + std::to_string(static_cast<int>(role)));
      FakeHost host(scene_for(3));
      const std::vector<std::unique_ptr<SessionService>> services = all_services(host);
      SessionUser& witness = host.join("witness");
      SessionUser& user = host.join("user", role);
      const haptics::CouplingParameters before = host.seats().coupling().parameters;
      handle(services, user, request.message);
      const std::vector<wire::ServerControl> answers = host.drain(user);
      ASSERT_EQ(described(answers), "error ERROR_NOT_ALLOWED");
      EXPECT_EQ(answers[0].request(), 42U);
      EXPECT_FALSE(answers[0].error().text().empty());
      EXPECT_EQ(host.received(witness), "");
      EXPECT_TRUE(host.ended.empty());
      EXPECT_EQ(host.seats().coupling().parameters, before);
      EXPECT_TRUE(host.logged.empty());
    }
  }
}

TEST(Grasping, AnswersTheRequesterWithTheRoomsResult) {
  FakeHost host(test::two_hands_scene());
  const auto service = make_grasping(host);
  SessionUser& ada = host.join("ada");
  SessionUser& ben = host.join("ben");
  const auto grab = [&](SessionUser& user, std::uint32_t body) {
    service->handle(user, message_of([body](auto& message) { message.mutable_grab()->set_body(body); }));
    // A user's next request is accepted only after an update has reported the result of the present one. Three steps
    // suffice for this.
    for (int i = 0; i < 3; ++i) {
      host.step();
      while (host.room().output().poll()) {
        for (const auto* each : {&ada, &ben}) host.seats().on_update(each->seat, host.room().output().front());
      }
      service->on_poll();
    }
    return host.drain(user);
  };
  EXPECT_EQ(described(grab(ada, 9)), "error ERROR_UNKNOWN_BODY");
  const auto granted = grab(ada, 1);
  ASSERT_EQ(described(granted), "grabbed");
  EXPECT_EQ(granted[0].request(), 42U);
  EXPECT_EQ(granted[0].grabbed().body(), 1U);
  EXPECT_EQ(described(grab(ada, 1)), "error ERROR_ALREADY_HOLDING");
  EXPECT_EQ(host.received(ben), "") << "others see the state of the body";
  // The answer to a user who has left must be dropped, not sent to others.
  service->handle(ben, message_of([](auto& message) { message.mutable_grab()->set_body(9); }));
  host.step();
  host.leave(ben);
  service->on_left(ben);
  service->on_poll();
  EXPECT_EQ(host.received(ben), "");
  EXPECT_EQ(host.received(ada), "");
}

TEST(Grasping, RefusesASecondRequestBeforeTheFirstIsServed) {
  FakeHost host(test::two_hands_scene());
  const auto service = make_grasping(host);
  SessionUser& ada = host.join("ada");
  const auto release = message_of([](auto& message) { message.mutable_release(); });
  service->handle(ada, release);
  EXPECT_EQ(host.received(ada), "");
  service->handle(ada, release);
  const auto refused = host.drain(ada);
  ASSERT_EQ(described(refused), "error ERROR_NOT_ALLOWED");
  EXPECT_EQ(refused[0].error().text(), kRoomBusy);
}

TEST(Coupling, RefusesWhatIsUnknownOutOfRangeOrChosenByTheLaw) {
  FakeHost host(test::two_hands_scene());
  const auto service = make_coupling(host);
  SessionUser& chief = host.join("chief", UserRole::kOperator);
  service->on_joined(chief, {});
  const auto answer = [&](const wire::ClientControl& message) {
    service->handle(chief, message);
    return host.drain(chief);
  };
  const auto unknown = answer(parameter_message("gravity", 1));
  ASSERT_EQ(described(unknown), "error ERROR_UNKNOWN_PARAMETER");
  EXPECT_THAT(unknown[0].error().text(), HasSubstr("coupling.law, coupling.stiffness_n_per_m"));
  for (const proto::CouplingField& field : proto::kCouplingFields) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {field.low - 1, 2 * field.high + 1, nan, infinity}) {
      EXPECT_EQ(described(answer(parameter_message(std::string(field.name), bad))), "error ERROR_BAD_VALUE")
          << field.name << " " << bad;
    }
    EXPECT_EQ(described(answer(parameter_message(std::string(field.name), field.low))), "parameter_set") << field.name;
  }
  EXPECT_EQ(described(answer(law_message(""))), "error ERROR_BAD_VALUE");
  EXPECT_EQ(described(answer(law_message("no such law"))), "error ERROR_BAD_VALUE");
  for (const char* const law : {"direct", "qsa-static", "qsa-dynamic", "adaptive"}) {
    EXPECT_EQ(described(answer(law_message(law))), "error ERROR_NOT_ALLOWED") << law;
  }
  EXPECT_TRUE(host.logged.empty());
  EXPECT_EQ(described(answer(law_message("stable-dynamic"))), "parameter_set");
  EXPECT_EQ(host.logged.size(), 1U);
}

TEST(Coupling, AnswersTheOperatorAndNotifiesTheOthers) {
  FakeHost host(test::two_hands_scene());
  const auto service = make_coupling(host);
  SessionUser& chief = host.join("chief", UserRole::kOperator);
  SessionUser& ben = host.join("ben");
  for (SessionUser* const user : {&chief, &ben}) service->on_joined(*user, {});
  service->handle(chief, parameter_message("coupling.stiffness_n_per_m", 300));
  const auto own = host.drain(chief), others = host.drain(ben);
  ASSERT_EQ(described(own), "parameter_set");
  ASSERT_EQ(described(others), "parameter_set");
  EXPECT_EQ(own[0].request(), 42U);
  EXPECT_EQ(others[0].request(), 0U);
  EXPECT_EQ(others[0].parameter_set().value(), 300);
  service->handle(chief, law_message("stable-dynamic"));
  const auto law = host.drain(ben);
  ASSERT_FALSE(law.empty());
  EXPECT_EQ(law[0].parameter_set().text(), "stable-dynamic") << "the law precedes the coefficients";
  host.drain(chief);
  // When the operator leaves, the scene's coupling is restored, and users must be notified.
  host.leave(chief);
  service->on_left(chief);
  std::map<std::string, wire::ParameterSet> restored;
  for (const auto& message : host.drain(ben)) restored[message.parameter_set().name()] = message.parameter_set();
  EXPECT_EQ(restored["coupling.law"].text(), "spring-damper");
  EXPECT_EQ(restored["coupling.stiffness_n_per_m"].value(), 200);
  service->on_update(host.room());
  host.send_news(ben);
  EXPECT_EQ(host.received(ben), "") << "each change is sent once";
}

TEST(Moderation, KicksAnotherUserOfTheRoomAndNobodyElse) {
  FakeHost host(scene_for(3));
  const auto service = make_moderation(host, nullptr);
  SessionUser& chief = host.join("chief", UserRole::kOperator);
  SessionUser& ben = host.join("ben");
  const auto kick = [&](std::uint32_t user) {
    service->handle(chief, message_of([user](auto& message) { message.mutable_kick()->set_user(user); }));
    return host.drain(chief);
  };
  for (const std::uint32_t nobody : {0U, 99U, chief.seat.user.value}) {
    EXPECT_EQ(described(kick(nobody)), "error ERROR_BAD_VALUE") << nobody;
  }
  EXPECT_TRUE(host.ended.empty());
  const auto answer = kick(ben.seat.user.value);
  ASSERT_EQ(described(answer), "user_left");
  EXPECT_EQ(answer[0].request(), 42U);
  EXPECT_EQ(answer[0].user_left().user(), ben.seat.user.value);
  EXPECT_THAT(host.ended, ElementsAre(std::pair(&ben, wire::DISCONNECT_KICKED)));
}

TEST(Moderation, ResetsAtTheRateOfTheRoomAndTellsAll) {
  FakeHost host(scene_for(3));
  const auto service = make_moderation(host, nullptr);
  SessionUser& chief = host.join("chief", UserRole::kOperator);
  SessionUser& ben = host.join("ben");
  int granted = 0, refused = 0;
  constexpr int kTries = 1000;
  for (int i = 0; i < kTries; ++i) {  // one request every 10 ms for 10 s
    service->handle(chief, message_of([](auto& message) { message.mutable_reset_room(); }));
    const auto own = host.drain(chief), others = host.drain(ben);
    ASSERT_EQ(own.size(), 1U);
    EXPECT_EQ(own[0].request(), 42U);
    EXPECT_EQ(described(others), own[0].has_room_reset() ? "room_reset" : "");
    ++(own[0].has_room_reset() ? granted : refused);
    host.step(10);
  }
  EXPECT_NEAR(granted, kResetRate.at_once + 10 * kResetRate.per_second, 1);
  EXPECT_EQ(granted + refused, kTries);
  EXPECT_EQ(host.logged.size(), static_cast<std::size_t>(granted));
}

TEST(Pointing, ShowsThePlaceToAllAndRefusesWhatIsNone) {
  FakeHost host(scene_for(3));
  const auto service = make_pointing(host);
  SessionUser& ada = host.join("ada");
  SessionUser& eve = host.join("eve", UserRole::kObserver);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {nan, 1001.0, -std::numeric_limits<double>::infinity()}) {
    service->handle(ada, point_message(0, bad));
    EXPECT_EQ(host.received(ada), "error ERROR_BAD_VALUE") << bad;
  }
  wire::ClientControl two = point_message(0, 0.1);
  two.mutable_point()->mutable_place()->RemoveLast();
  service->handle(ada, two);
  EXPECT_EQ(host.received(ada), "error ERROR_BAD_VALUE");
  service->handle(ada, point_message(2, 0.1));
  EXPECT_EQ(host.received(ada), "error ERROR_UNKNOWN_BODY") << "the scene has one body";
  service->handle(ada, point_message(1, 0.1));
  const auto own = host.drain(ada), others = host.drain(eve);
  ASSERT_EQ(described(own), "pointed");
  ASSERT_EQ(described(others), "pointed") << "observers see it, too";
  EXPECT_EQ(own[0].request(), 42U);
  EXPECT_EQ(others[0].request(), 0U);
  EXPECT_EQ(others[0].pointed().user(), ada.seat.user.value);
  EXPECT_EQ(others[0].pointed().point().place(0), 0.1);
}

/// Returns the number of granted requests if each of `users` users sends a pointing request every `period_ms` for 20 s.
int granted_points(int users, int period_ms) {
  FakeHost host(scene_for(users));
  const auto service = make_pointing(host);
  std::vector<SessionUser*> all;
  for (int i = 0; i < users; ++i) all.push_back(&host.join("user " + std::to_string(i)));
  int granted = 0;
  for (int ms = 0; ms < 20'000; ms += period_ms) {
    for (SessionUser* const user : all) {
      service->handle(*user, point_message(0, 0.1));
      for (SessionUser* const each : all) {
        for (const auto& message : host.drain(*each)) granted += message.request() == 42 && message.has_pointed();
      }
    }
    host.step(period_ms);
  }
  return granted;
}

TEST(Pointing, GrantsItsRateToThoseWhoAskMoreOften) {
  EXPECT_NEAR(granted_points(1, 2000), 10, 0) << "less than the limit";
  EXPECT_NEAR(granted_points(1, 10), kUserPointRate.at_once + 20 * kUserPointRate.per_second, 1);
  EXPECT_NEAR(granted_points(12, 1000), kPointRate.at_once + 20 * kPointRate.per_second, 4) << "the limit of the room";
}

TEST(Poses, AreRefusedInARoomWithoutTwoMolecules) {
  FakeHost host(scene_for(2));
  const auto service = make_poses(host, nullptr);
  SessionUser& ada = host.join("ada");
  service->on_joined(ada, {});
  for (int kind = 0; kind <= wire::AskPose::CANCEL; ++kind) {
    service->handle(ada, message_of([kind](auto& message) {
                      message.mutable_ask_pose()->set_kind(static_cast<wire::AskPose::Kind>(kind));
                    }));
    EXPECT_EQ(host.received(ada), "error ERROR_NOT_ALLOWED") << kind;
  }
  service->begin_stop();
  service->on_poll();
  EXPECT_FALSE(service->owes_answers());
  service->refuse_unanswered();
  service->on_left(ada);
  EXPECT_EQ(host.received(ada), "");
}

TEST(Assets, SendsTheRequestedChunkOfTheRoomsOwnAssets) {
  const auto scene = std::make_shared<LoadedScene>(*test::scene_of(test::two_hands_scene()));
  for (const std::size_t size : {std::size_t{0}, std::size_t{100}, 2 * proto::kAssetChunkBytes + 5}) {
    proto::Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<std::byte>(i * i % 251);
    Asset asset;
    asset.sha256.fill(static_cast<std::byte>(size % 256));
    asset.bytes = std::make_shared<const proto::Bytes>(std::move(bytes));
    scene->assets.push_back(std::move(asset));
  }
  FakeHost host(scene);
  const auto service = make_assets(host);
  SessionUser& eve = host.join("eve", UserRole::kObserver);
  const auto get = [&](const std::string& hash, std::uint64_t offset, std::uint32_t max_bytes) {
    service->handle(eve, message_of([&](auto& message) {
                      message.mutable_get_asset()->set_sha256(hash);
                      message.mutable_get_asset()->set_offset(offset);
                      message.mutable_get_asset()->set_max_bytes(max_bytes);
                    }));
    auto answers = host.drain(eve);
    EXPECT_EQ(answers.size(), 1U);
    EXPECT_EQ(answers.at(0).request(), 42U);
    return std::move(answers.at(0));
  };
  for (const std::string& hash : {std::string(), std::string(32, 'x'), std::string(31, 'x')}) {
    EXPECT_EQ(get(hash, 0, 10).error().code(), wire::ERROR_UNKNOWN_ASSET);
  }
  for (const Asset& asset : host.room().scene().assets) {
    const std::string hash(reinterpret_cast<const char*>(asset.sha256.data()), asset.sha256.size());
    const std::uint64_t size = asset.bytes->size();
    for (const std::uint64_t past : {size + 1, std::numeric_limits<std::uint64_t>::max()}) {
      EXPECT_EQ(get(hash, past, 10).error().code(), wire::ERROR_BAD_VALUE);
    }
    EXPECT_EQ(get(hash, 0, 7).asset_chunk().data().size(), std::min<std::uint64_t>(7, size));
    for (const std::uint32_t any : {0U, std::numeric_limits<std::uint32_t>::max()}) {
      EXPECT_EQ(get(hash, 0, any).asset_chunk().data().size(), std::min<std::uint64_t>(proto::kAssetChunkBytes, size));
    }
    EXPECT_EQ(get(hash, size, 10).asset_chunk().data(), "");
    std::string whole;
    while (whole.size() < size) {
      const wire::ServerControl answer = get(hash, whole.size(), 0);
      EXPECT_EQ(answer.asset_chunk().total_bytes(), size);
      ASSERT_FALSE(answer.asset_chunk().data().empty());
      whole += answer.asset_chunk().data();
    }
    EXPECT_EQ(whole, std::string(reinterpret_cast<const char*>(asset.bytes->data()), size));
  }
}

TEST(SoftShapes, AreSentToThoseWhoAskedIfChangedAndIfNothingWaits) {
  FakeHost host(test::two_hands_scene());
  const auto service = make_soft_shapes(host);
  SessionUser& ada = host.join("ada");
  SessionUser& ben = host.join("ben");
  wire::JoinRoom wants;
  wants.set_wants_soft_shapes(true);
  service->on_joined(ada, wants);
  service->on_joined(ben, {});
  const auto publish = [&](double offset_m) {
    const std::vector<Vec3> offsets(proto::kSoftLatticePoints, Vec3(offset_m, 0, 0));
    host.room().soft_offsets().publish({offsets});
    service->on_poll();
    EXPECT_EQ(host.received(ben), "");
    return host.received(ada);
  };
  EXPECT_EQ(publish(0.001), "soft_shape");
  EXPECT_EQ(publish(0.001), "") << "unchanged";
  host.queued = 1;
  EXPECT_EQ(publish(0.002), "") << "earlier bytes wait";
  host.queued = 0;
  EXPECT_EQ(publish(0.002), "soft_shape");
  service->on_left(ada);
  EXPECT_EQ(publish(0.003), "");
}

}  // namespace
}  // namespace tandem::server
