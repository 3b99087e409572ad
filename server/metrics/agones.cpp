#include "server/metrics/agones.hpp"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/json/parse.hpp>
#include <cstdlib>
#include <stdexcept>
#include <utility>

#include "common/net/socket_rules.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;

constexpr Duration kAgonesPeriod = std::chrono::milliseconds(100);
/// Time limit of a call, from connecting to the end of the answer.
constexpr Duration kCallWithin = std::chrono::seconds(1);
constexpr std::size_t kMaxHeadBytes = 8192, kMaxBodyBytes = std::size_t{256} << 10U;

const char* path_of(AgonesPlan::Call call) {
  using Call = AgonesPlan::Call;
  switch (call) {
    case Call::kReady:
      return "/ready";
    case Call::kHealth:
      return "/health";
    case Call::kGameServer:
      return "/gameserver";
    case Call::kAllocate:
      return "/allocate";
    case Call::kShutdown:
      return "/shutdown";
    case Call::kNone:
      break;
  }
  return "";
}

/// Returns whether the JSON text of a GameServer has the state Allocated.
bool is_allocated(const std::string& body) {
  error_code error;
  const boost::json::value json = boost::json::parse(body, error);
  const boost::json::value* const state = error ? nullptr : json.find_pointer("/status/state", error);
  return state != nullptr && state->is_string() && state->as_string() == "Allocated";
}

}  // namespace

std::uint16_t agones_port(const std::string& text) {
  constexpr const char* kVariable = "AGONES_SDK_HTTP_PORT";
  const char* const of_environment = std::getenv(kVariable);
  const bool is_given = text != "auto";
  const std::string digits = is_given ? text : of_environment != nullptr ? of_environment : "9358";
  if (const auto port = net::port_of(digits); port.value_or(0) > 0) return *port;
  throw std::invalid_argument((is_given ? std::string("--agones") : kVariable) + (" \"" + digits) +
                              "\": not a port; use 1 to 65535");
}

struct Agones::Reply {
  bool is_good = false;
  std::string problem;
  std::string body;
};

AgonesPlan::Call AgonesPlan::due(const Seen& seen, LocalTime now) {
  if (seen.has_ended) return has_sent_shutdown_ ? Call::kNone : Call::kShutdown;
  if (seen.users > 0) {
    left_.reset();
  } else if (!left_) {
    left_ = now;
  }
  if (now < not_before_) return Call::kNone;
  if (seen.is_healthy && now >= next_health_) return Call::kHealth;
  if (!has_sent_ready_) return seen.is_ready ? Call::kReady : Call::kNone;
  if (seen.users > 0 && !is_allocated_) return has_game_server_ ? Call::kAllocate : Call::kGameServer;
  // After the cluster has allocated the server, its first user may not have connected yet. is_allocated_ becomes true
  // only when a user is present, so the server is not offered to others before a user has come and left.
  if (is_allocated_ && left_ && now - *left_ >= kReturnAfter) return Call::kReady;
  return Call::kNone;
}

void AgonesPlan::note_answer(Call call, bool is_good, LocalTime now, bool is_allocated) {
  if (!is_good) {
    again_ = std::clamp(2 * again_, kMinAgain, kMaxAgain);
    not_before_ = now + again_;
    return;
  }
  again_ = Duration{0};
  if (call == Call::kHealth) next_health_ = now + kHealthEvery;
  if (call == Call::kReady) {
    has_sent_ready_ = true;
    has_game_server_ = is_allocated_ = false;
  }
  if (call == Call::kGameServer) {
    has_game_server_ = true;
    is_allocated_ = is_allocated;
  }
  if (call == Call::kAllocate) is_allocated_ = true;
  if (call == Call::kShutdown) has_sent_shutdown_ = true;
}

Agones::Agones(std::uint16_t port, std::function<AgonesPlan::Seen()> read_status,
               std::function<void(const std::string&)> on_news)
    : port_(port),
      read_status_(std::move(read_status)),
      on_news_(std::move(on_news)),
      thread_(std::make_unique<recording::RecorderThread>(kAgonesPeriod, [this] { work(); })) {}

Agones::~Agones() {
  finish();
}

void Agones::finish() {
  thread_.reset();
}

void Agones::work() {
  const SteadyClock clock;
  const AgonesPlan::Call due = plan_.due(read_status_(), clock.now());
  if (due == AgonesPlan::Call::kNone) return;
  const Reply reply = call(path_of(due), due != AgonesPlan::Call::kGameServer);
  plan_.note_answer(due, reply.is_good, clock.now(), is_allocated(reply.body));
  report(reply);
}

void Agones::report(const Reply& reply) {
  if (is_reachable_ == reply.is_good) return;
  is_reachable_ = reply.is_good;
  const std::string sidecar = "the Agones sidecar at 127.0.0.1:" + std::to_string(port_);
  on_news_(reply.is_good ? sidecar + " answers"
                         : sidecar + " does not answer: " + reply.problem + "; the server continues, and tries again");
}

Agones::Reply Agones::call(const std::string& path, bool is_post) const {
  Reply reply;
  asio::io_context io;
  beast::tcp_stream stream(io);
  beast::flat_buffer buffer(kMaxHeadBytes + kMaxBodyBytes);
  http::request<http::string_body> request(is_post ? http::verb::post : http::verb::get, path, 11);
  request.set(http::field::host, "127.0.0.1:" + std::to_string(port_));
  request.set(http::field::content_type, "application/json");
  request.keep_alive(false);
  if (is_post) request.body() = "{}";
  request.prepare_payload();
  http::response_parser<http::string_body> parser;
  parser.header_limit(kMaxHeadBytes);
  parser.body_limit(kMaxBodyBytes);
  const auto went_well = [&reply](const error_code& error) {
    if (error) reply.problem = net::lower_first(error.message());
    return !error;
  };
  stream.expires_after(kCallWithin);
  stream.async_connect({asio::ip::make_address("127.0.0.1"), port_}, [&](const error_code& connected) {
    if (!went_well(connected)) return;
    http::async_write(stream, request, [&](const error_code& written, std::size_t) {
      if (!went_well(written)) return;
      http::async_read(stream, buffer, parser, [&](const error_code& read, std::size_t) {
        if (!went_well(read)) return;
        reply.is_good = parser.get().result() == http::status::ok;
        if (!reply.is_good) reply.problem = "status " + std::to_string(parser.get().result_int()) + " for " + path;
        reply.body = std::move(parser.get().body());
      });
    });
  });
  io.run();
  return reply;
}

}  // namespace tandem::server
