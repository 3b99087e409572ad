#include "devices/eeg/sources/cortex_source.hpp"

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <functional>
#include <stdexcept>
#include <thread>

#include "common/base/json_fields.hpp"
#include "common/net/host_port.hpp"
#include "devices/eeg/sources/cortex_messages.hpp"

namespace tandem::eeg {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace json = boost::json;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kMaxMessage = std::size_t{1} << 20U;
constexpr std::uint16_t kUsualPort = 6868;
constexpr double kUsualRateHz = 128;

struct Url {
  bool is_tls = true;
  net::HostPort place;
};

Url url_of(const std::string& text) {
  Url url;
  const std::string remedy = "; write wss://localhost:6868, the service must be on this machine";
  const std::size_t scheme = text.find("://");
  if (scheme == std::string::npos || (text.substr(0, scheme) != "wss" && text.substr(0, scheme) != "ws"))
    throw std::invalid_argument("--cortex: '" + text + "' does not begin with wss:// or ws://" + remedy);
  url.is_tls = text.starts_with("wss");
  try {
    url.place = net::host_port_of(text.substr(scheme + 3));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("--cortex: '" + text + "': " + error.what() + remedy);
  }
  const auto address = net::numeric(url.place.host);
  if (url.place.host != "localhost" && !(address && address->is_loopback()))
    throw std::invalid_argument("--cortex: '" + text + "' is another machine" + remedy);
  return url;
}

/// A WebSocket with or without TLS. Its operations are asynchronous, so that the caller can limit the time of each.
class WebSocket {
 public:
  virtual ~WebSocket() = default;
  using Done = std::function<void(error_code)>;
  virtual void open(const tcp::resolver::results_type& places, const std::string& host, Done done) = 0;
  virtual void write(const std::string& text, Done done) = 0;
  virtual void read(beast::flat_buffer& buffer, Done done) = 0;
};

template <class Stream>
class WebSocketOn final : public WebSocket {
 public:
  template <class... Arguments>
  explicit WebSocketOn(Arguments&&... arguments) : stream_(std::forward<Arguments>(arguments)...) {
    stream_.read_message_max(kMaxMessage);
  }

  void open(const tcp::resolver::results_type& places, const std::string& host, Done done) override {
    beast::get_lowest_layer(stream_).async_connect(places, [this, host, done = std::move(done)](error_code error,
                                                                                                const tcp::endpoint&) {
      if (error) return done(error);
      if constexpr (std::is_same_v<Stream, beast::tcp_stream>)
        stream_.async_handshake(host, "/", done);
      else
        stream_.next_layer().async_handshake(asio::ssl::stream_base::client, [this, host, done](error_code refused) {
          if (refused) return done(refused);
          stream_.async_handshake(host, "/", done);
        });
    });
  }
  void write(const std::string& text, Done done) override {
    stream_.async_write(asio::buffer(text), [done = std::move(done)](error_code error, std::size_t) { done(error); });
  }
  void read(beast::flat_buffer& buffer, Done done) override {
    stream_.async_read(buffer, [done = std::move(done)](error_code error, std::size_t) { done(error); });
  }

 private:
  beast::websocket::stream<Stream> stream_;
};

/// A connection to the service: sends requests and receives their answers and samples.
class CortexLink {
 public:
  CortexLink(const Url& url, const std::string& shown_url, Duration answer_within);

  /// Sends a request and waits for its answer.
  /// Fails   std::runtime_error: no answer in time, or an error; the message names the method and the remedy
  json::value call(const std::string& method, json::object parameters);
  /// Returns the next message that arrives within `wait`.
  /// Fails   std::runtime_error: the connection ended
  std::optional<CortexMessage> next(Duration wait);

 private:
  /// Waits at most `wait` for the operation that was started last. Returns its error code. Returns nothing if it has
  /// not ended by then; it remains active in this case.
  std::optional<error_code> run(Duration wait);
  void begin_read();

  asio::io_context io_;
  asio::ssl::context tls_{asio::ssl::context::tls_client};
  std::unique_ptr<WebSocket> socket_;
  beast::flat_buffer buffer_;
  std::string request_;
  bool is_reading_ = false;
  std::optional<error_code> read_result_, other_result_;
  std::int64_t last_id_ = 0;
  Duration answer_within_;
};

CortexLink::CortexLink(const Url& url, const std::string& shown_url, Duration answer_within)
    : answer_within_(answer_within) {
  const std::string port = std::to_string(url.place.port.value_or(kUsualPort));
  error_code error;
  const auto places = tcp::resolver(io_).resolve(url.place.host, port, error);
  if (!error) {
    if (url.is_tls) {
      tls_.set_verify_mode(asio::ssl::verify_none);
      socket_ = std::make_unique<WebSocketOn<beast::ssl_stream<beast::tcp_stream>>>(io_, tls_);
    } else {
      socket_ = std::make_unique<WebSocketOn<beast::tcp_stream>>(io_);
    }
    socket_->open(places, url.place.host + ":" + port, [this](error_code done) { other_result_ = done; });
    error = run(answer_within).value_or(asio::error::timed_out);
  }
  if (error)
    throw std::runtime_error("the Cortex service does not answer at " + shown_url + " (" + error.message() +
                             "); start the EMOTIV Launcher, or name its address by --cortex");
}

std::optional<error_code> CortexLink::run(Duration wait) {
  const SteadyClock clock;
  const LocalTime end = clock.now() + wait;
  io_.restart();
  while (!other_result_ && clock.now() < end) io_.run_one_for(end - clock.now());
  return std::exchange(other_result_, std::nullopt);
}

void CortexLink::begin_read() {
  if (is_reading_) return;
  is_reading_ = true;
  socket_->read(buffer_, [this](error_code error) {
    is_reading_ = false;
    read_result_ = error;
  });
}

std::optional<CortexMessage> CortexLink::next(Duration wait) {
  const SteadyClock clock;
  const LocalTime end = clock.now() + wait;
  do {
    // If a message arrived during a write, it is evaluated before a new read begins, because a read appends to the same
    // buffer.
    if (!read_result_) begin_read();
    io_.restart();
    if (!read_result_) io_.run_one_for(std::max(end - clock.now(), Duration{0}));
    if (!read_result_) continue;
    const error_code error = *std::exchange(read_result_, std::nullopt);
    if (error)
      throw std::runtime_error("the Cortex service has ended the connection (" + error.message() +
                               "); start the EMOTIV Launcher again");
    const auto bytes = buffer_.data();
    auto message = read_cortex_message({static_cast<const char*>(bytes.data()), bytes.size()});
    buffer_.consume(bytes.size());
    if (message) return message;
  } while (clock.now() < end);
  return std::nullopt;
}

json::value CortexLink::call(const std::string& method, json::object parameters) {
  const std::int64_t id = ++last_id_;
  request_ = cortex_request(id, method, std::move(parameters));
  socket_->write(request_, [this](error_code done) { other_result_ = done; });
  if (run(answer_within_).value_or(asio::error::timed_out))
    throw std::runtime_error("Cortex " + method + ": the request could not be sent; start the EMOTIV Launcher again");
  const SteadyClock clock;
  const LocalTime end = clock.now() + answer_within_;
  while (clock.now() < end) {
    const auto message = next(end - clock.now());
    if (!message || message->id != id) continue;
    if (message->error) throw std::runtime_error("Cortex " + method + ": " + cortex_advice(*message->error));
    return message->result;
  }
  throw std::runtime_error("Cortex " + method + ": no answer within " + std::to_string(to_seconds(answer_within_)) +
                           " s; start the EMOTIV Launcher again");
}

std::string text_at(const json::value& value, std::string_view name) {
  const json::object* const object = value.if_object();
  const json::value* const found = object != nullptr ? object->if_contains(name) : nullptr;
  return found != nullptr && found->is_string() ? std::string(found->get_string()) : "";
}

bool is_true_at(const json::value& value, std::string_view name) {
  const json::object* const object = value.if_object();
  const json::value* const found = object != nullptr ? object->if_contains(name) : nullptr;
  return found != nullptr && found->is_bool() && found->get_bool();
}

/// A session of the Cortex service. The constructor opens it; read() returns its samples.
class CortexSource final : public EegSource {
 public:
  explicit CortexSource(const CortexSettings& settings);

  const StreamFormat& format() const override { return format_; }
  bool is_live() const override { return true; }
  bool read(std::vector<double>& frames_uv, Duration wait) override;

 private:
  json::object identity() const {
    return {{"clientId", settings_.credentials.client_id}, {"clientSecret", settings_.credentials.client_secret}};
  }
  void request_access();
  void authorise();
  json::value find_headset();
  void connect_headset();
  void subscribe();

  CortexSettings settings_;
  SteadyClock clock_;
  CortexLink link_;
  std::string token_, headset_, session_;
  std::optional<CortexColumns> columns_;
  StreamFormat format_;
  LocalTime last_sample_{};
};

CortexSource::CortexSource(const CortexSettings& settings)
    : settings_(settings), link_(url_of(settings.url), settings.url, settings.answer_within) {
  request_access();
  authorise();
  connect_headset();
  session_ = text_at(
      link_.call("createSession", {{"cortexToken", token_}, {"headset", headset_}, {"status", "active"}}), "id");
  if (session_.empty())
    throw std::runtime_error("Cortex createSession: the answer names no session; update the EMOTIV Launcher");
  subscribe();
  last_sample_ = clock_.now();
}

void CortexSource::request_access() {
  constexpr auto kPeriod = std::chrono::seconds(1);
  const LocalTime end = clock_.now() + settings_.approved_within;
  while (!is_true_at(link_.call("requestAccess", identity()), "accessGranted")) {
    if (clock_.now() >= end)
      throw std::runtime_error(
          "Cortex requestAccess: the application is not approved; open the EMOTIV Launcher and approve it");
    link_.next(std::min<Duration>(kPeriod, settings_.approved_within));
  }
}

void CortexSource::authorise() {
  token_ = text_at(link_.call("authorize", identity()), "cortexToken");
  if (token_.empty()) throw std::runtime_error("Cortex authorize: the answer has no token; update the EMOTIV Launcher");
}

/// Returns the entry of the headset in the service's list of headsets; null if it is not listed.
json::value CortexSource::find_headset() {
  const json::value list = link_.call("queryHeadsets", {});
  if (!list.is_array()) return nullptr;
  for (const json::value& one : list.get_array()) {
    const std::string id = text_at(one, "id");
    if (!id.empty() && (settings_.headset.empty() || id == settings_.headset)) return one;
  }
  return nullptr;
}

void CortexSource::connect_headset() {
  const LocalTime end = clock_.now() + settings_.headset_within;
  bool is_requested = false;
  for (;;) {
    const json::value headset = find_headset();
    headset_ = text_at(headset, "id");
    const std::string status = text_at(headset, "status");
    if (status == "connected") {
      const json::value* const settings = headset.get_object().if_contains("settings");
      const json::object* const object = settings != nullptr ? settings->if_object() : nullptr;
      const json::value* const rate = object != nullptr ? object->if_contains("eegRate") : nullptr;
      format_.rate_hz = rate != nullptr && rate->is_number() ? rate->to_number<double>() : kUsualRateHz;
      if (format_.rate_hz >= 1 && format_.rate_hz <= kMaxRateHz) return;
      throw std::runtime_error(
          "Cortex queryHeadsets: the rate of the headset is not 1 to 20000 Hz; update the EMOTIV Launcher");
    }
    if (clock_.now() >= end)
      throw std::runtime_error(
          "Cortex queryHeadsets: " +
          (headset_.empty()
               ? std::string("no headset") + (settings_.headset.empty() ? "" : " " + settings_.headset) + " is found"
               : "headset " + headset_ + " is " + (status.empty() ? "not ready" : status)) +
          "; switch it on, charge it, and connect it in the EMOTIV Launcher");
    if (!headset_.empty() && !is_requested) {
      link_.call("controlDevice", {{"command", "connect"}, {"headset", headset_}});
      is_requested = true;
    }
    link_.next(std::min<Duration>(std::chrono::milliseconds(500), settings_.headset_within));
  }
}

void CortexSource::subscribe() {
  const json::value answer =
      link_.call("subscribe", {{"cortexToken", token_}, {"session", session_}, {"streams", json::array{"eeg"}}});
  error_code error;
  if (const json::value* const failure = answer.find_pointer("/failure/0", error)) {
    const json::value* const code = failure->is_object() ? failure->get_object().if_contains("code") : nullptr;
    throw std::runtime_error(
        "Cortex subscribe: " +
        cortex_advice({code != nullptr && code->is_int64() ? code->get_int64() : 0, text_at(*failure, "message")}));
  }
  const json::value* const columns = answer.find_pointer("/success/0/cols", error);
  columns_.emplace(columns != nullptr ? *columns : json::value(nullptr));
  format_.channels = columns_->electrodes();
}

bool CortexSource::read(std::vector<double>& frames_uv, Duration wait) {
  const LocalTime end = clock_.now() + wait;
  const auto max_lost = static_cast<std::size_t>(format_.rate_hz);
  do {
    const auto message = link_.next(end - clock_.now());
    if (!message) break;
    if (message->warning) {
      if (const auto loss = cortex_loss(*message->warning)) throw std::runtime_error(*loss);
    }
    if (message->error) throw std::runtime_error(cortex_advice(*message->error));
    if (message->eeg && columns_->append(*message->eeg, max_lost, frames_uv)) last_sample_ = clock_.now();
  } while (clock_.now() < end);
  if (clock_.now() - last_sample_ > settings_.silent_for)
    throw std::runtime_error("the headset sends nothing; charge it, bring it nearer, and start again");
  return true;
}

}  // namespace

CortexCredentials read_cortex_credentials(const std::filesystem::path& file) {
  JsonFields fields(parse_json(read_text_file(file), file.string()), file.string());
  CortexCredentials credentials{fields.required_text("client_id"), fields.required_text("client_secret")};
  fields.finish();
  return credentials;
}

std::unique_ptr<EegSource> open_cortex(const CortexSettings& settings) {
  return std::make_unique<CortexSource>(settings);
}

}  // namespace tandem::eeg
