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
#include "proto/datagram_seal.hpp"
#include "proto/placement.hpp"
#include "proto/state_codec.hpp"

namespace tandem::lab {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;

constexpr double kSpacing_m = 0.15;
constexpr double kCube_m = 0.04;
/// Maximum lateness of an input. Inputs that would be sent later than this are skipped.
constexpr Duration kMaxLate = std::chrono::milliseconds(10);
/// Maximum plausible age of a state. Larger ages are not recorded.
constexpr Duration kMaxAge = std::chrono::seconds(1);

/// Returns the horizontal position (x, y) of the user's cube on the table.
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

std::string crowded_scene(const std::string& name, std::size_t users, std::size_t bodies_per_user, double rate_hz) {
  std::ostringstream out;
  out << R"({"name": ")" << name << R"(", "step_rate_hz": )" << rate_hz
      << R"(, "bodies": [{"name": "table", "shapes": [{"box": {"size_m": [2, 2, 0.1]}}],)"
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

/// One simulated user: a control connection that is used only for joining, and a socket for states and inputs.
struct ServerLoad::User {
  User(asio::io_context& io, std::uint16_t port, const std::string& name, const std::string& room,
       const secure::TlsContext* context, const secure::Bytes& token)
      : control(io), tls(context), state(io, udp::endpoint(asio::ip::address_v4::loopback(), 0)) {
    control.connect({asio::ip::address_v4::loopback(), port});
    shake_hands();
    join(name, room, token);
    state.connect({asio::ip::address_v4::loopback(), port});
    state.non_blocking(true);
  }

  void send_control(const wire::ClientControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    proto::Bytes out;
    tls.send(frame, out);
    asio::write(control, asio::buffer(out));
  }
  void shake_hands() {
    proto::Bytes out;
    tls.start(out);
    asio::write(control, asio::buffer(out));
    while (!tls.is_established()) read_more();
  }
  void read_more() {
    std::array<std::byte, 4096> bytes;
    proto::Bytes out;
    const std::size_t size = control.read_some(asio::buffer(bytes));
    if (!tls.receive(std::span(bytes).first(size), unparsed, out)) throw std::runtime_error(tls.problem());
    asio::write(control, asio::buffer(out));
  }
  /// Reads the next `size` bytes of the stream and removes them.
  proto::Bytes read_bytes(std::size_t size) {
    while (unparsed.size() < size) read_more();
    const auto end = unparsed.begin() + static_cast<std::ptrdiff_t>(size);
    proto::Bytes taken(unparsed.begin(), end);
    unparsed.erase(unparsed.begin(), end);
    return taken;
  }
  wire::ServerControl read_message() {
    std::size_t size = 0;
    for (const std::byte byte : read_bytes(proto::kFrameLengthBytes))
      size = size << 8U | std::to_integer<std::size_t>(byte);
    const proto::Bytes payload = read_bytes(size);
    wire::ServerControl message;
    if (!proto::parse_control(payload, message)) throw std::runtime_error("the server sent an unreadable message");
    return message;
  }
  void join(const std::string& name, const std::string& room, const secure::Bytes& token) {
    wire::ClientControl hello;
    hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
    hello.mutable_hello()->add_capabilities(proto::kCapabilityStateUdp);
    send_control(hello);
    const wire::ServerControl welcome = read_message();
    connection = ConnectionId{welcome.welcome().connection_id()};
    epoch = static_cast<std::uint8_t>(welcome.welcome().epoch());
    wire::ClientControl join;
    join.mutable_join()->set_room(room);
    join.mutable_join()->set_user_name(name);
    join.mutable_join()->set_role(wire::ROLE_MANIPULATOR);
    join.mutable_join()->set_token(token.data(), token.size());
    const auto secret = tls.exported(secure::kDatagramExport, proto::seal_context(connection));
    using Use = proto::DatagramSeal::Use;
    seal = proto::DatagramSeal(secret, Use::kSeal, true, epoch);
    opener = proto::DatagramSeal(secret, Use::kOpen, false, epoch);
    send_control(join);
    const wire::ServerControl joined = read_message();
    if (!joined.has_joined()) throw std::runtime_error(name + " cannot join " + room + ": " + joined.error().text());
    const wire::Tool& tool = joined.joined().scene().tools(static_cast<int>(joined.joined().tool()));
    X_WT = proto::pose_from_placement(tool.placement());
  }

  /// Sends an input. The hand presses 5 mm into the cube and lifts off again, once a second. `place` delays this
  /// periodic motion [s], so that not all users press at the same time.
  void send(LocalTime now, Tick tick, double place, LoadResult& result) {
    const double phase = 2 * std::numbers::pi * (to_seconds(now.time_since_epoch()) - place);
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
    if (deliver()) ++result.inputs_sent;
    sent_at[tick.value % sent_at.size()] = now;
  }

  bool deliver() {
    seal.seal(sequence, datagram);
    boost::system::error_code error;
    state.send(asio::buffer(datagram), 0, error);
    return !error;
  }
  /// Answers the server's path challenge, which verifies the address of the user.
  void answer_challenge(std::span<const std::byte> number) {
    datagram.clear();
    proto::append_header({proto::DatagramType::kPathResponse, epoch, connection, ++sequence}, datagram);
    datagram.insert(datagram.end(), number.begin(), number.end());
    deliver();
  }

  /// Receives all waiting states and records their latencies.
  /// In      deadline_of  returns the deadline of a step of this user's room
  void receive(LocalTime now, Tick newest, const std::function<LocalTime(Step)>& deadline_of, LoadResult& result) {
    std::array<std::byte, 2048> buffer;
    boost::system::error_code error;
    for (std::size_t size = state.receive(asio::buffer(buffer), 0, error); !error;
         size = state.receive(asio::buffer(buffer), 0, error)) {
      proto::ServerUpdate update;
      proto::DatagramHeader header;
      std::span<const std::byte> payload;
      const std::span<const std::byte> bytes = std::span(buffer).first(size);
      if (proto::parse_header(bytes, header) != proto::DropReason::kNone ||
          opener.open(header, bytes, payload) != proto::DropReason::kNone)
        continue;
      if (header.type == proto::DatagramType::kPathChallenge) answer_challenge(payload);
      if (proto::parse_server_update(payload, update) != proto::DropReason::kNone) continue;
      ++result.states_received;
      const LocalTime deadline = deadline_of(update.step);
      if (update.sent > server_time_of_own_clock(deadline + kMaxAge))
        continue;  // the deadline of this step is unknown, so its latency cannot be measured
      result.added_latency.record(update.sent - server_time_of_own_clock(deadline));
      if (received_at != LocalTime{}) silence = std::max(silence, now - received_at);
      received_at = now;
      const bool is_known = update.answered_input.value + sent_at.size() > newest.value;
      if (update.answered_input <= answered || !is_known) continue;
      answered = update.answered_input;
      result.input_age.record(deadline - sent_at[answered.value % sent_at.size()]);
      result.answer.record(now - sent_at[answered.value % sent_at.size()]);
    }
  }

  tcp::socket control;
  secure::TlsStream tls;
  proto::Bytes unparsed;  ///< bytes of the stream that are not parsed yet
  udp::socket state;
  proto::DatagramSeal seal{{}, proto::DatagramSeal::Use::kSeal, true, 0};
  proto::DatagramSeal opener{{}, proto::DatagramSeal::Use::kOpen, false, 0};
  ConnectionId connection;
  std::uint8_t epoch = 0;
  std::uint64_t sequence = 0;
  Pose X_WT;
  proto::Bytes datagram;
  std::array<LocalTime, 1024> sent_at{};  ///< sending time of each input, indexed by tick modulo the size of the array
  Tick answered;
  LocalTime received_at{};
  Duration silence{0};
};

struct ServerLoad::Impl {
  asio::io_context io;
  std::optional<secure::TlsContext> tls;
  std::vector<std::unique_ptr<User>> users;
  std::vector<std::function<LocalTime(Step)>> deadlines;  ///< deadline of a step of each user's room
  Tick tick;
};

ServerLoad::ServerLoad(std::uint16_t port, std::size_t users, std::size_t rooms,
                       const std::optional<LoadSecurity>& security,
                       const std::function<LocalTime(std::size_t, Step)>& deadline)
    : impl_(std::make_unique<Impl>()) {
  if (security) impl_->tls = secure::TlsContext::client(security->trust);
  for (std::size_t i = 0; i < users; ++i) {
    impl_->users.push_back(std::make_unique<User>(
        impl_->io, port, "user " + std::to_string(i + 1), "room " + std::to_string(i % rooms + 1),
        impl_->tls ? &*impl_->tls : nullptr, security ? security->token() : secure::Bytes{}));
    impl_->deadlines.emplace_back([deadline, room = i % rooms](Step step) { return deadline(room, step); });
  }
}

Duration ServerLoad::seal_cost() {
  constexpr int kTurns = 20, kDatagrams = 1000;
  constexpr std::size_t kUsualPayload = 200;
  using Use = proto::DatagramSeal::Use;
  const secure::Exported secret;
  proto::DatagramSeal seal(secret, Use::kSeal, true, 0), opener(secret, Use::kOpen, true, 0);
  proto::Bytes datagram;
  std::span<const std::byte> payload;
  Duration least = Duration::max();
  for (int turn = 0; turn < kTurns; ++turn) {
    const LocalTime begin = SteadyClock().now();
    for (std::uint64_t sequence = 1; sequence <= kDatagrams; ++sequence) {
      const proto::DatagramHeader header{proto::DatagramType::kClientUpdate, 0, ConnectionId{1}, sequence};
      datagram.clear();
      proto::append_header(header, datagram);
      datagram.resize(proto::kDatagramHeaderBytes + kUsualPayload);
      seal.seal(sequence, datagram);
      opener.open(header, datagram, payload);
    }
    least = std::min(least, (SteadyClock().now() - begin) / (2 * kDatagrams));
  }
  return least;
}

ServerLoad::~ServerLoad() = default;

LoadResult ServerLoad::run(Duration duration, double rate_hz) {
  LoadResult result;
  const SteadyClock clock;
  const LocalTime begin = clock.now();
  const Duration period = from_seconds(1 / rate_hz);
  realtime::PeriodicTimer timer(period, begin);
  LocalTime sent = begin;
  for (const auto& user : impl_->users) {
    user->silence = Duration{0};
    user->received_at = LocalTime{};
  }
  while (sent < begin + duration) {
    const LocalTime due = timer.wait();
    // If this thread got no processor time for a while, several inputs are due at once. They are all sent, because
    // users on separate machines would have sent them too.
    for (sent = std::max(sent + period, due - kMaxLate); sent <= due; sent += period) {
      ++impl_->tick.value;
      for (std::size_t i = 0; i < impl_->users.size(); ++i) {
        const double place = static_cast<double>(i) / static_cast<double>(impl_->users.size());
        User& user = *impl_->users[i];
        user.receive(clock.now(), impl_->tick, impl_->deadlines[i], result);
        user.send(clock.now(), impl_->tick, place, result);
      }
    }
    sent -= period;
  }
  for (const auto& user : impl_->users) result.longest_silence.record(user->silence);
  return result;
}

}  // namespace tandem::lab
