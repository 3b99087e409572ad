#include "lab/session/server_load.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "common/realtime/realtime.hpp"
#include "proto/control_framing.hpp"
#include "proto/placement.hpp"
#include "proto/state_codec.hpp"

namespace tandem::lab {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;

constexpr double kSpacing_m = 0.15;
constexpr double kCube_m = 0.04;

/// Of the user's cube on the table, seen from above.
std::array<double, 2> place_of(std::size_t user) {
  const std::size_t column = user % 4, row = user / 4;
  return {kSpacing_m * static_cast<double>(column), kSpacing_m * static_cast<double>(row)};
}

void add_cube(std::ostream& out, std::size_t user, std::size_t number) {
  constexpr std::array<std::array<double, 2>, 4> kAround{{{0, 0}, {0.05, 0}, {0, 0.05}, {0.05, 0.05}}};
  const auto [x, y] = place_of(user);
  out << R"(, {"name": "cube)" << user << '-' << number << R"(", "shapes": [{"box": {"size_m": [0.04, 0.04, 0.04]}}],)"
      << R"("mass_kg": 0.2, "graspable": true, "placement": {"position_m": [)" << x + kAround[number][0] << ", "
      << y + kAround[number][1] << ", " << kCube_m / 2 << "]}}";
}

}  // namespace

std::string crowded_scene(const std::string& name, std::size_t users, std::size_t bodies_per_user) {
  std::ostringstream out;
  out << R"({"name": ")" << name << R"(", "bodies": [{"name": "table", "shapes": [{"box": {"size_m": [2, 2, 0.1]}}],)"
      << R"("placement": {"position_m": [0, 0, -0.05]}})";
  for (std::size_t user = 0; user < users; ++user) {
    for (std::size_t number = 0; number < bodies_per_user; ++number) add_cube(out, user, number);
  }
  out << R"(], "tools": [)";
  for (std::size_t user = 0; user < users; ++user) {
    const auto [x, y] = place_of(user);
    out << (user > 0 ? ", " : "") << R"({"name": "tool)" << user << R"(", "placement": {"position_m": [)" << x << ", "
        << y << ", " << kCube_m + 0.01 << "]}}";
  }
  out << R"(], "coupling": {"law": "spring-damper", "stiffness_n_per_m": 300, "damping_n_s_per_m": 3}})";
  return out.str();
}

/// One user: his control connection, which only joins, and his socket for state.
struct ServerLoad::User {
  User(asio::io_context& io, std::uint16_t port, const std::string& name, const std::string& room)
      : control(io), state(io, udp::endpoint(asio::ip::address_v4::loopback(), 0)) {
    control.connect({asio::ip::address_v4::loopback(), port});
    join(name, room);
    state.connect({asio::ip::address_v4::loopback(), port});
    state.non_blocking(true);
  }

  void say(const wire::ClientControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    asio::write(control, asio::buffer(frame));
  }
  wire::ServerControl hear() {
    std::array<unsigned char, proto::kFrameLengthBytes> length{};
    asio::read(control, asio::buffer(length));
    proto::Bytes payload((length[0] << 24U) | (length[1] << 16U) | (length[2] << 8U) | length[3]);
    asio::read(control, asio::buffer(payload));
    wire::ServerControl message;
    if (!proto::parse_control(payload, message)) throw std::runtime_error("the server said what nobody can read");
    return message;
  }
  void join(const std::string& name, const std::string& room) {
    wire::ClientControl hello;
    hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
    hello.mutable_hello()->add_capabilities(proto::kCapabilityStateUdp);
    say(hello);
    const wire::ServerControl welcome = hear();
    connection = ConnectionId{welcome.welcome().connection_id()};
    epoch = static_cast<std::uint8_t>(welcome.welcome().epoch());
    wire::ClientControl join;
    join.mutable_join()->set_room(room);
    join.mutable_join()->set_user_name(name);
    join.mutable_join()->set_role(wire::ROLE_MANIPULATOR);
    say(join);
    const wire::ServerControl joined = hear();
    if (!joined.has_joined()) throw std::runtime_error(name + " cannot join " + room + ": " + joined.error().text());
    const wire::Tool& tool = joined.joined().scene().tools(static_cast<int>(joined.joined().tool()));
    X_WT = proto::pose_from_placement(tool.placement());
  }

  /// Presses 5 mm into the cube and lifts off again, once a second.
  void send(LocalTime now, Tick tick, LoadResult& result) {
    const double phase = 2 * std::numbers::pi * to_seconds(now.time_since_epoch());
    proto::ClientUpdate update;
    update.input_tick = tick;
    update.handle.X = X_WT;
    update.handle.X.p.z() -= 0.0075 * (1 - std::cos(phase));
    update.handle.V.v.z() = -0.0075 * 2 * std::numbers::pi * std::sin(phase);
    update.handle_valid = true;
    update.sent = now;
    datagram.clear();
    proto::append_header({proto::DatagramType::kClientUpdate, epoch, connection, ++sequence}, datagram);
    proto::append_client_update(update, datagram);
    boost::system::error_code error;
    state.send(asio::buffer(datagram), 0, error);
    if (!error) ++result.inputs_sent;
    sent_at[tick.value % sent_at.size()] = now;
  }

  void receive(LocalTime now, Tick newest, LoadResult& result) {
    std::array<std::byte, 2048> buffer;
    boost::system::error_code error;
    for (std::size_t size = state.receive(asio::buffer(buffer), 0, error); !error;
         size = state.receive(asio::buffer(buffer), 0, error)) {
      proto::ServerUpdate update;
      const std::span<const std::byte> bytes = std::span(buffer).first(size);
      if (proto::parse_server_update(proto::payload_of(bytes), update) != proto::DropReason::kNone) continue;
      ++result.states_received;
      result.added_latency.record(update.sent - update.stepped);
      if (heard_at != LocalTime{}) silence = std::max(silence, now - heard_at);
      heard_at = now;
      const bool is_known = update.answered_input.value + sent_at.size() > newest.value;
      if (update.answered_input <= answered || !is_known) continue;
      answered = update.answered_input;
      result.answer.record(now - sent_at[answered.value % sent_at.size()]);
    }
  }

  tcp::socket control;
  udp::socket state;
  ConnectionId connection;
  std::uint8_t epoch = 0;
  std::uint64_t sequence = 0;
  Pose X_WT;
  proto::Bytes datagram;
  std::array<LocalTime, 1024> sent_at{};  ///< by tick
  Tick answered;
  LocalTime heard_at{};
  Duration silence{0};
};

struct ServerLoad::Impl {
  asio::io_context io;
  std::vector<std::unique_ptr<User>> users;
  Tick tick;
};

ServerLoad::ServerLoad(std::uint16_t port, std::size_t users, std::size_t rooms) : impl_(std::make_unique<Impl>()) {
  for (std::size_t i = 0; i < users; ++i) {
    impl_->users.push_back(std::make_unique<User>(impl_->io, port, "user " + std::to_string(i + 1),
                                                  "room " + std::to_string(i % rooms + 1)));
  }
}

ServerLoad::~ServerLoad() = default;

LoadResult ServerLoad::run(Duration duration) {
  LoadResult result;
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  realtime::PeriodicTimer timer(std::chrono::milliseconds(1), begin);
  for (const auto& user : impl_->users) user->silence = Duration{0};
  while (timer.wait() < begin + duration) {
    ++impl_->tick.value;
    for (const auto& user : impl_->users) {
      user->receive(clock.now(), impl_->tick, result);
      user->send(clock.now(), impl_->tick, result);
    }
  }
  for (const auto& user : impl_->users) result.longest_silence.record(user->silence);
  return result;
}

}  // namespace tandem::lab
