#include "devices/inverse3/inverse3_driver.hpp"

#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
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
    "its service does not listen; start it (systemctl start haply-inverse-service), or name another one (setting "
    "service, option --service)";
constexpr std::string_view kNoWebSocket =
    "the program that listens there is not the Inverse3's service; check its address (setting service, option "
    "--service)";
constexpr std::string_view kClosed = "its service has ended the connection; start it again";
constexpr std::string_view kServiceSilent =
    "its service sends nothing; check that it runs, and plug the device in again";
constexpr std::string_view kNoDevice = "its service reports no Inverse3, or sends unreadable data; plug the device in";
constexpr std::string_view kOtherDevice = "its service names another device now; its force begins anew";
constexpr std::string_view kWatchdogEnded =
    "its watchdog was ended or does not run; another one is started with a new connection";
constexpr std::string_view kWatchdogMissing =
    "no watchdog could be started for it (too many processes or open files); end other programs, then start again";

/// Returns a WebSocket text frame from a client: one complete message (FIN set), with a 16-bit payload length (126 to
/// 65535 bytes). The masking key is zero, so that the payload stays readable.
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

/// Socket layer for Boost.Beast. Each write contains one complete frame. Without a watchdog, the frame is written to
/// the socket; with a watchdog, it is passed to the watchdog, which writes it.
class ServiceSocket {
 public:
  using executor_type = asio::ip::tcp::socket::executor_type;

  explicit ServiceSocket(asio::io_context& io) : socket_(io) {}
  executor_type get_executor() { return socket_.get_executor(); }
  asio::ip::tcp::socket& socket() { return socket_; }
  void close() {
    error_code ignored;
    socket_.close(ignored);
  }
  /// From now on, passes all writes to the watchdog. When it is called, no earlier write may be pending.
  void write_through(Watchdog& watchdog) { watchdog_ = &watchdog; }
  bool is_writing() const { return is_writing_; }
  /// Sets whether the next command contains a force.
  void set_force_on(bool is_force_on) { is_force_on_ = is_force_on; }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    socket_.async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    if (watchdog_ != nullptr) {
      const error_code error = pass_to_watchdog(beast::buffers_to_string(buffers));
      const std::size_t size = error ? 0 : beast::buffer_bytes(buffers);
      return asio::post(get_executor(), beast::bind_front_handler(std::forward<Handler>(handler), error, size));
    }
    is_writing_ = true;
    asio::async_write(socket_, buffers,
                      [this, handler = std::forward<Handler>(handler)](error_code error, std::size_t size) mutable {
                        is_writing_ = false;
                        handler(error, size);
                      });
  }

 private:
  error_code pass_to_watchdog(const std::string& frame) {
    constexpr unsigned kOpcode = 0x0f, kFirstControl = 0x08;
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(frame.data()), frame.size());
    const bool is_reply = !bytes.empty() && (bytes[0] & kOpcode) >= kFirstControl;
    const bool is_sent = is_reply ? watchdog_->send_reply(bytes) : watchdog_->send(bytes, is_force_on_);
    return is_sent ? error_code() : asio::error::make_error_code(asio::error::no_buffer_space);
  }

  asio::ip::tcp::socket socket_;
  Watchdog* watchdog_ = nullptr;
  bool is_writing_ = false;
  bool is_force_on_ = false;
};

/// Function that Beast requires for a socket layer. Beast calls it only after a connection has failed, because the
/// driver closes connections without a closing handshake.
void teardown(beast::role_type, ServiceSocket& socket, error_code& error) {
  socket.close();
  error = {};
}
template <class Handler>
void async_teardown(beast::role_type, ServiceSocket& socket, Handler&& handler) {
  socket.close();
  asio::post(socket.get_executor(), beast::bind_front_handler(std::forward<Handler>(handler), error_code()));
}

void beast_close_socket(ServiceSocket& socket) {
  socket.close();
}

/// One connection. The handlers of its pending operations share ownership of it. A connection that the driver has
/// abandoned therefore exists until its handlers have ended.
struct Inverse3Driver::Link {
  explicit Link(asio::io_context& io) : stream(io) {}

  ServiceSocket& socket() { return stream.next_layer(); }

  websocket::stream<ServiceSocket> stream;
  beast::flat_buffer buffer;
  std::string command;
  bool is_open = false;
  bool is_sending = false;
};

asio::ip::tcp::endpoint inverse3_endpoint(const std::string& service, const std::string& setting) {
  const std::size_t colon = service.rfind(':');
  const std::string host = service.substr(0, colon == std::string::npos ? 0 : colon);
  const char* const end = service.data() + service.size();
  std::uint16_t port = 0;
  const char* const digits = colon == std::string::npos ? end : service.data() + colon + 1;
  const auto [next, problem] = std::from_chars(digits, end, port);
  error_code error;
  const asio::ip::address address = asio::ip::make_address(host, error);
  if (host.empty() || error || problem != std::errc() || next != end || port == 0 || !address.is_loopback()) {
    throw std::invalid_argument(setting + ": '" + service +
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
  if (link_) link_->socket().close();
  link_.reset();
}

DeviceSample Inverse3Driver::step(LocalTime now, const Wrench& wrench_on_hand_D) {
  now_ = now;
  if (!link_) connect(now);
  if (link_ && state_ && !link_->socket().is_writing()) watch_over();
  // One command is sent for each received state. Exception: after a command with a force, a zero is sent at once.
  const bool must_release = state_ && !shown_n_.isZero(0) && wrench_on_hand_D.f.isZero(0);
  const bool may_send = link_ && !link_->is_sending && (!watchdog_ || !watched_id_.empty());
  if (may_send && (is_new_ || must_release)) send(wrench_on_hand_D);
  work();
  if (is_taken_) last_received_ = now;
  if (link_ && now - last_received_ > kServiceSilence) fail(state_ ? kServiceSilent : kNoDevice);
  return sample(now);
}

/// Starts the watchdog for this connection and its device. If the device has changed, a new connection is made, because
/// a frame on the current one may be incomplete.
void Inverse3Driver::watch_over() {
  if (!watchdog_) return;
  if (watchdog_->has_ended()) return fail(kWatchdogEnded);
  if (state_->device_id == watched_id_) return;
  if (!watched_id_.empty()) return fail(kOtherDevice);
  const bool is_watched =
      watchdog_->watch_over({.descriptor = link_->socket().socket().native_handle(),
                             .usb_endpoint = std::nullopt,
                             .bytes = websocket_message(inverse3_command(state_->device_id, Vec3::Zero()))});
  if (!is_watched) return fail(kWatchdogMissing);
  watched_id_ = state_->device_id;
  link_->socket().write_through(*watchdog_);
}

void Inverse3Driver::connect(LocalTime now) {
  if (!absence_.is_attempt_due(now)) return;
  last_received_ = now;
  const auto link = link_ = std::make_shared<Link>(io_);
  link->socket().socket().async_connect(service_, [this, link](const error_code& error) {
    if (link != link_) return;
    if (error) return fail(kNoService);
    link->socket().socket().set_option(asio::ip::tcp::no_delay(true));
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
    receive({static_cast<const char*>(bytes.data()), bytes.size()});
    link->buffer.consume(bytes.size());
    read_next(link);
  });
}

void Inverse3Driver::receive(std::string_view text) {
  auto state = read_inverse3_state(text);
  if (!state) return;
  is_new_ = true;
  is_taken_ = is_taken_ || state->cursor_m.has_value();
  if (state_ && !state->cursor_m) state->cursor_m = state_->cursor_m;
  // If the message does not mention the grip, the last known state of the grip remains valid.
  if (state_ && !state->grip) {
    state->grip = state_->grip;
    state->buttons = state_->buttons;
  }
  state_ = std::move(state);
}

void Inverse3Driver::send(const Wrench& wrench_on_hand_D) {
  const Vec3 force_n =
      is_finite(wrench_on_hand_D.f) && absence_.was_connected() ? wrench_on_hand_D.f : Vec3(Vec3::Zero());
  const auto link = link_;
  may_be_on_ = may_be_on() || !force_n.isZero(0);
  shown_n_ = force_n;
  link->socket().set_force_on(!force_n.isZero(0));
  link->command = inverse3_command(state_->device_id, force_n);
  link->is_sending = true;
  is_new_ = false;
  link->stream.async_write(asio::buffer(link->command), [this, link](const error_code& error, std::size_t) {
    link->is_sending = false;
    if (link != link_) return;
    if (error) return fail(error == asio::error::no_buffer_space ? kWatchdogEnded : kClosed);
    if (!watchdog_ && shown_n_.isZero(0)) may_be_on_ = false;
  });
}

/// Returns whether the device may still apply a force. After the last command became zero, the result is false as soon
/// as the watchdog reports that this zero is written.
bool Inverse3Driver::may_be_on() const noexcept {
  const bool is_zero_out = watchdog_ && !watched_id_.empty() && shown_n_.isZero(0) && watchdog_->is_written();
  return may_be_on_ && !is_zero_out;
}

/// Handles events until a state arrives, but at most for kWait.
void Inverse3Driver::work() {
  const SteadyClock clock;
  const LocalTime end = clock.now() + kWait;
  io_.restart();
  for (Duration left = kWait; link_ && !is_taken_ && left > Duration{0}; left = end - clock.now())
    io_.run_one_for(left);
}

void Inverse3Driver::fail(std::string_view reason) {
  // If the device was connected, this failure is a new loss with its own reason. Otherwise only the reason is stored,
  // and the next attempt follows a second later.
  if (has_last_)
    absence_.begin(now_, reason);
  else
    absence_.set_reason(reason);
  may_be_on_ = may_be_on();
  if (watchdog_) watchdog_->release();
  watched_id_.clear();
  link_->socket().close();
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
