// See inverse3_driver.hpp.
#include "devices/inverse3/inverse3_driver.hpp"

#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <charconv>
#include <chrono>
#include <stdexcept>
#include <utility>

namespace tandem::devices {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr Duration kWait = std::chrono::milliseconds(10);
constexpr Duration kServiceSilence = std::chrono::seconds(2);
constexpr std::size_t kMaxMessage = std::size_t{1} << 20U;

constexpr std::string_view kNoService =
    "its service does not listen; start it (systemctl start haply-inverse-service), or name another by --service";
constexpr std::string_view kNoWebSocket = "what listens there is not the Inverse3's service; check --service";
constexpr std::string_view kClosed = "its service has ended the connection; start it again";
constexpr std::string_view kServiceSilent =
    "its service says nothing; look whether it runs, and plug the device in again";
constexpr std::string_view kNoDevice =
    "its service knows of no Inverse3, or says what cannot be read; plug the device in";
constexpr std::string_view kWatchdogMissing =
    "no watchdog could be started for it (too many processes or open files); end other programs, then start again";

/// A whole message from a client: final, text, of 126 to 65535 bytes, masked by zero, which leaves it as it is.
std::vector<std::uint8_t> websocket_message(std::string text) {
  constexpr std::size_t kLeast = 126;
  if (text.size() < kLeast) text.resize(kLeast, ' ');
  std::vector<std::uint8_t> bytes{0x81, 0x80 | 126};
  for (const std::size_t part : {text.size() >> 8U, text.size() & 255U})
    bytes.push_back(static_cast<std::uint8_t>(part));
  bytes.insert(bytes.end(), 4, 0);
  bytes.insert(bytes.end(), text.begin(), text.end());
  return bytes;
}

}  // namespace

/// One connection. Handlers hold it, so that what was abandoned ends by itself.
struct Inverse3Driver::Link {
  explicit Link(asio::io_context& io) : stream(io) {}

  websocket::stream<beast::tcp_stream> stream;
  beast::flat_buffer buffer;
  std::string command;
  bool is_open = false;
  bool is_sending = false;
};

asio::ip::tcp::endpoint inverse3_endpoint(const std::string& service) {
  const std::size_t colon = service.rfind(':');
  const std::string host = service.substr(0, colon == std::string::npos ? 0 : colon);
  const char* const end = service.data() + service.size();
  std::uint16_t port = 0;
  const auto [next, problem] = std::from_chars(end - (service.size() - host.size() - 1), end, port);
  error_code error;
  const asio::ip::address address = asio::ip::make_address(host, error);
  if (host.empty() || error || problem != std::errc() || next != end || port == 0 || !address.is_loopback()) {
    throw std::invalid_argument("--service: '" + service +
                                "' must be an address of this machine and a port, for example 127.0.0.1:10001");
  }
  return {address, port};
}

Inverse3Driver::Inverse3Driver(DeviceSpec spec, asio::ip::tcp::endpoint service, std::shared_ptr<Watchdog> watchdog)
    : spec_(std::move(spec)), service_(std::move(service)), watchdog_(std::move(watchdog)) {
  spec_.actuated_rotations = 0;
}

Inverse3Driver::~Inverse3Driver() {
  if (watchdog_) watchdog_->release();
  if (link_) beast::get_lowest_layer(link_->stream).close();
  link_.reset();
}

DeviceSample Inverse3Driver::step(LocalTime now, const Wrench& wrench_on_hand_D) {
  now_ = now;
  if (!link_) connect(now);
  if (link_ && state_ && !is_watched_over()) fail(kWatchdogMissing);
  // One command a state; but zero waits for none.
  const bool must_let_go = state_ && !shown_n_.isZero(0) && wrench_on_hand_D.f.isZero(0);
  if (link_ && (is_new_ || must_let_go) && !link_->is_sending) send(wrench_on_hand_D);
  work();
  if (is_taken_) heard_ = now;
  if (link_ && now - heard_ > kServiceSilence) fail(state_ ? kServiceSilent : kNoDevice);
  return sample(now);
}

/// Of this connection and device.
bool Inverse3Driver::is_watched_over() {
  if (!watchdog_ || state_->device_id == watched_id_) return true;
  watched_id_ = state_->device_id;
  return watchdog_->watch_over({.descriptor = beast::get_lowest_layer(link_->stream).socket().native_handle(),
                                .usb_endpoint = std::nullopt,
                                .bytes = websocket_message(inverse3_command(watched_id_, Vec3::Zero()))});
}

void Inverse3Driver::connect(LocalTime now) {
  if (!absence_.is_time_to_look(now)) return;
  heard_ = now;
  const auto link = link_ = std::make_shared<Link>(io_);
  beast::get_lowest_layer(link->stream).async_connect(service_, [this, link](const error_code& error) {
    if (link != link_) return;
    if (error) return fail(kNoService);
    beast::get_lowest_layer(link->stream).socket().set_option(asio::ip::tcp::no_delay(true));
    link->stream.read_message_max(kMaxMessage);
    link->stream.async_handshake(service_.address().to_string() + ":" + std::to_string(service_.port()), "/",
                                 [this, link](const error_code& refused) {
                                   if (link != link_) return;
                                   if (refused) return fail(kNoWebSocket);
                                   link->is_open = true;
                                   read_next(link);
                                 });
  });
}

void Inverse3Driver::read_next(const std::shared_ptr<Link>& link) {
  link->stream.async_read(link->buffer, [this, link](const error_code& error, std::size_t) {
    if (link != link_) return;
    if (error) return fail(kClosed);
    const auto bytes = link->buffer.data();
    take({static_cast<const char*>(bytes.data()), bytes.size()});
    link->buffer.consume(bytes.size());
    read_next(link);
  });
}

void Inverse3Driver::take(std::string_view text) {
  auto state = read_inverse3_state(text);
  if (!state) return;
  is_new_ = true;
  is_taken_ = is_taken_ || state->cursor_m.has_value();
  if (state_ && !state->cursor_m) state->cursor_m = state_->cursor_m;
  // A grip need not be told of each time.
  if (state_ && !state->grip) {
    state->grip = state_->grip;
    state->buttons = state_->buttons;
  }
  state_ = std::move(state);
}

void Inverse3Driver::send(const Wrench& wrench_on_hand_D) {
  const Vec3 force_n = is_finite(wrench_on_hand_D.f) && absence_.was_there() ? wrench_on_hand_D.f : Vec3(Vec3::Zero());
  const auto link = link_;
  shown_n_ = force_n;
  link->command = inverse3_command(state_->device_id, force_n);
  link->is_sending = true;
  is_new_ = false;
  link->stream.async_write(asio::buffer(link->command), [this, link](const error_code& error, std::size_t) {
    link->is_sending = false;
    if (link == link_ && error) fail(kClosed);
  });
}

/// Until a state comes, or for some milliseconds.
void Inverse3Driver::work() {
  const SteadyClock clock;
  const LocalTime end = clock.now() + kWait;
  io_.restart();
  for (Duration left = kWait; link_ && !is_taken_ && left > Duration{0}; left = end - clock.now())
    io_.run_one_for(left);
}

void Inverse3Driver::fail(std::string_view reason) {
  // What was there stays lost for a second, so that it is told of and not only done.
  if (has_last_)
    absence_.begin(now_, reason);
  else
    absence_.say(reason);
  if (watchdog_) watchdog_->release();
  watched_id_.clear();
  beast::get_lowest_layer(link_->stream).close();
  link_.reset();
  state_.reset();
  is_new_ = is_taken_ = has_last_ = false;
  shown_n_.setZero();
}

DeviceSample Inverse3Driver::sample(LocalTime now) {
  if (!link_ || !state_) return absence_.sample(now);
  if (!is_taken_ && has_last_) return last_;
  if (!is_taken_) return absence_.sample(now);
  has_last_ = true;
  is_taken_ = false;
  absence_.end();
  if (!origin_m_) origin_m_ = state_->cursor_m;
  last_.taken = now;
  last_.state = DeviceState::kReady;
  last_.is_valid = true;
  last_.X_DH = {*state_->cursor_m - *origin_m_, state_->grip.value_or(Quat::Identity())};
  last_.V_DH.v = state_->cursor_m_per_s;
  last_.buttons = state_->buttons;
  return last_;
}

}  // namespace tandem::devices
