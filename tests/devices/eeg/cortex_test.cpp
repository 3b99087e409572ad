// Tests the Cortex source with a fake service on a real WebSocket: with and without TLS, and with errors of the
// service.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <thread>

#include "common/base/json.hpp"
#include "common/secure/certificate.hpp"
#include "devices/eeg/sources/cortex_messages.hpp"
#include "devices/eeg/sources/cortex_source.hpp"

namespace tandem::eeg {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace json = boost::json;
using asio::ip::tcp;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kColumns = R"(["COUNTER","INTERPOLATED","AF3","T7","Pz","RAW_CQ","MARKER_HARDWARE","MARKERS"])";

/// Fake Cortex service. It answers each method with a fixed result or error, and sends samples after `subscribe`.
///
/// Thread  the service runs on its own thread; tests set the answers before the client connects
class FakeCortex {
 public:
  explicit FakeCortex(std::string certificate_folder = "")
      : acceptor_(io_, {asio::ip::address_v4::loopback(), 0}), certificates_(std::move(certificate_folder)) {}
  ~FakeCortex() {
    boost::system::error_code ignored;
    if (!thread_.joinable()) return;
    // Connects once, so that accept() returns if no client has connected.
    tcp::socket waker(io_);
    waker.connect(acceptor_.local_endpoint(), ignored);
    thread_.join();
  }
  FakeCortex(const FakeCortex&) = delete;
  FakeCortex& operator=(const FakeCortex&) = delete;

  void start() {
    thread_ = std::thread([this] {
      try {
        serve();
      } catch (const std::exception&) {
        // The client has closed the connection.
      }
    });
  }
  std::string url() const {
    return (certificates_.empty() ? "ws://127.0.0.1:" : "wss://127.0.0.1:") +
           std::to_string(acceptor_.local_endpoint().port());
  }
  std::vector<std::string> methods() {
    const std::lock_guard lock(mutex_);
    return methods_;
  }

  std::map<std::string, std::string> answers{
      {"requestAccess", R"("result":{"accessGranted":true})"},
      {"authorize", R"("result":{"cortexToken":"token-7"})"},
      {"queryHeadsets", R"("result":[{"id":"EPOCX-1","status":"connected","settings":{"eegRate":256}}])"},
      {"controlDevice", R"("result":{})"},
      {"createSession", R"("result":{"id":"session-3","status":"activated"})"},
      {"subscribe",
       std::string(R"("result":{"failure":[],"success":[{"streamName":"eeg","sid":"s","cols":)") + kColumns + "}]}"}};
  std::vector<std::string> after_subscribe;  ///< messages that the service sends after the answer to `subscribe`
  bool hangs_up = false;                     ///< true: the service then closes the connection

 private:
  void serve() {
    tcp::socket socket(io_);
    acceptor_.accept(socket);
    if (certificates_.empty()) return converse(beast::websocket::stream<tcp::socket>(std::move(socket)));
    asio::ssl::context tls(asio::ssl::context::tls_server);
    tls.use_certificate_chain_file(certificates_ + "/server.pem");
    tls.use_private_key_file(certificates_ + "/server-key.pem", asio::ssl::context::pem);
    beast::websocket::stream<beast::ssl_stream<tcp::socket>> stream(std::move(socket), tls);
    stream.next_layer().handshake(asio::ssl::stream_base::server);
    converse(std::move(stream));
  }
  template <class Stream>
  void converse(Stream stream) {
    stream.accept();
    for (;;) {
      beast::flat_buffer buffer;
      stream.read(buffer);
      const json::object request = json::parse(beast::buffers_to_string(buffer.data())).as_object();
      const std::string method(request.at("method").as_string());
      {
        const std::lock_guard lock(mutex_);
        methods_.push_back(method);
      }
      const std::string answer =
          answers.contains(method) ? answers.at(method) : R"("error":{"code":-32601,"message":"?"})";
      if (answer.empty()) continue;
      stream.write(asio::buffer(R"({"jsonrpc":"2.0","id":)" + json::serialize(request.at("id")) + "," + answer + "}"));
      if (method != "subscribe") continue;
      for (const std::string& text : after_subscribe) stream.write(asio::buffer(text));
      if (hangs_up) return;
    }
  }

  asio::io_context io_;
  tcp::acceptor acceptor_;
  std::string certificates_;
  std::mutex mutex_;
  std::vector<std::string> methods_;
  std::thread thread_;
};

CortexSettings settings_for(const FakeCortex& service) {
  CortexSettings settings;
  settings.url = service.url();
  settings.credentials = {"id", "secret"};
  settings.headset_within = std::chrono::milliseconds(100);
  settings.approved_within = std::chrono::milliseconds(100);
  settings.silent_for = std::chrono::seconds(60);
  return settings;
}

std::string sample(int counter, int interpolated, double first_uv) {
  return R"({"eeg":[)" + std::to_string(counter) + "," + std::to_string(interpolated) + "," + std::to_string(first_uv) +
         R"(,2.5,-3,0,0,[]],"sid":"s","time":1})";
}

/// Reads until at least `count` values have arrived, for at most 20 s.
std::vector<double> values_of(EegSource& source, std::size_t count) {
  std::vector<double> frames;
  for (int i = 0; frames.size() < count && i < 400; ++i) source.read(frames, std::chrono::milliseconds(50));
  return frames;
}

/// Returns the error message with which opening or reading the source fails.
std::string failure_of(FakeCortex& service, Duration silent_for = std::chrono::seconds(60)) {
  service.start();
  CortexSettings settings = settings_for(service);
  settings.silent_for = silent_for;
  try {
    const auto source = open_cortex(settings);
    std::vector<double> frames;
    for (int i = 0; i < 400; ++i) source->read(frames, std::chrono::milliseconds(50));
    return "";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(Cortex, OpensASessionAndReadsItsSamples) {
  FakeCortex service;
  service.after_subscribe = {sample(5, 0, 4200), "no json", R"({"eeg":[1,2],"sid":"s"})", sample(6, 0, 4201.5)};
  service.start();
  const auto source = open_cortex(settings_for(service));
  EXPECT_THAT(source->format().channels, ElementsAre("AF3", "T7", "Pz"));
  EXPECT_EQ(source->format().rate_hz, 256);
  EXPECT_THAT(values_of(*source, 6), ElementsAre(4200, 2.5, -3, 4201.5, 2.5, -3));
  EXPECT_THAT(service.methods(),
              ElementsAre("requestAccess", "authorize", "queryHeadsets", "createSession", "subscribe"));
}

TEST(Cortex, WorksOverTlsWithACertificateOfItsOwn) {
  const auto folder = std::filesystem::temp_directory_path() / ("cortex_" + std::to_string(::getpid()));
  secure::write_dev_certificates(folder, {"127.0.0.1"});
  {
    FakeCortex service(folder.string());
    service.after_subscribe = {sample(0, 0, 1)};
    service.start();
    const auto source = open_cortex(settings_for(service));
    EXPECT_THAT(values_of(*source, 3), ElementsAre(1, 2.5, -3));
  }
  std::filesystem::remove_all(folder);
}

TEST(Cortex, LostAndInterpolatedSamplesAreMarked) {
  FakeCortex service;
  service.after_subscribe = {sample(5, 0, 1), sample(8, 0, 2), sample(9, 1, 3), sample(0, 0, 4), sample(1, 0, 5)};
  service.start();
  const auto source = open_cortex(settings_for(service));
  const auto frames = values_of(*source, 7 * 3);
  ASSERT_EQ(frames.size(), 21U);
  std::vector<double> first;
  for (std::size_t i = 0; i < frames.size(); i += 3) first.push_back(std::isnan(frames[i]) ? -1 : frames[i]);
  EXPECT_THAT(first, ElementsAre(1, -1, -1, 2, -1, 4, 5));
}

TEST(Cortex, ReportsThatRawEegIsNotEnabled) {
  FakeCortex session, stream;
  session.answers["createSession"] = R"("error":{"code":-32006,"message":"No valid license"})";
  EXPECT_THAT(failure_of(session),
              testing::AllOf(HasSubstr("Cortex createSession: raw EEG is not enabled"), HasSubstr("-32006")));
  stream.answers["subscribe"] =
      R"("result":{"success":[],"failure":[{"streamName":"eeg","code":-32016,"message":"The stream is unavailable"}]})";
  EXPECT_THAT(failure_of(stream), testing::AllOf(HasSubstr("Cortex subscribe: raw EEG is not enabled"),
                                                 HasSubstr("-32016: The stream is unavailable")));
}

TEST(Cortex, ReportsThatTheTokenHasExpired) {
  FakeCortex service;
  service.answers["createSession"] = R"("error":{"code":-32015,"message":"Auth token expired"})";
  EXPECT_THAT(failure_of(service),
              HasSubstr("Cortex createSession: the token has expired or is not valid; start the program again"));
}

TEST(Cortex, ReportsThatTheApplicationIsNotApproved) {
  FakeCortex service;
  service.answers["requestAccess"] = R"("result":{"accessGranted":false,"message":"wait"})";
  EXPECT_THAT(failure_of(service),
              HasSubstr("Cortex requestAccess: the application is not approved; open the EMOTIV Launcher"));
}

TEST(Cortex, ReportsThatTheCredentialsAreWrong) {
  FakeCortex service;
  service.answers["authorize"] = R"("error":{"code":-32021,"message":"Invalid client credentials"})";
  EXPECT_THAT(failure_of(service), HasSubstr("Cortex authorize: client id or client secret is wrong"));
}

TEST(Cortex, ReportsAMissingOrUnreadyHeadset) {
  FakeCortex none, off;
  none.answers["queryHeadsets"] = R"("result":[])";
  EXPECT_THAT(failure_of(none), HasSubstr("Cortex queryHeadsets: no headset is found; switch it on"));
  off.answers["queryHeadsets"] = R"("result":[{"id":"EPOCX-1","status":"discovered"}])";
  EXPECT_THAT(failure_of(off), HasSubstr("headset EPOCX-1 is discovered; switch it on"));
  EXPECT_THAT(off.methods(), testing::Contains("controlDevice"));
}

TEST(Cortex, ReportsThatTheHeadsetWasLost) {
  FakeCortex service;
  service.after_subscribe = {sample(1, 0, 1),
                             R"({"jsonrpc":"2.0","warning":{"code":103,"message":{"headsetId":"EPOCX-1"}}})"};
  EXPECT_THAT(failure_of(service),
              HasSubstr("the headset was lost; charge it, bring it nearer, and start again (Cortex 103"));
}

TEST(Cortex, ReportsThatTheHeadsetIsSilentOrTheServiceEnded) {
  FakeCortex silent, ended;
  silent.after_subscribe = {sample(1, 0, 1)};
  EXPECT_THAT(failure_of(silent, std::chrono::milliseconds(300)), HasSubstr("the headset sends nothing"));
  ended.hangs_up = true;
  EXPECT_THAT(failure_of(ended), HasSubstr("the Cortex service has ended the connection"));
}

TEST(Cortex, ReportsThatNoServiceListens) {
  CortexSettings settings;
  {
    const FakeCortex service;
    settings.url = service.url();
  }
  try {
    open_cortex(settings);
    FAIL() << "opened without a service";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("the Cortex service does not answer at ws://127.0.0.1:"));
  }
}

TEST(Cortex, HostileAnswersAreRefused) {
  constexpr const char* kNoColumns = "the service does not name the columns of its EEG";
  constexpr const char* kNoElectrodes = "the service names 0 electrodes; 1 to ";
  for (const auto& [answer, words] : {std::pair{R"("result":null)", kNoColumns},
                                      {R"("result":7)", kNoColumns},
                                      {R"("result":[[[]]])", kNoColumns},
                                      {R"("result":{"success":[{"cols":[]}]})", kNoElectrodes},
                                      {R"("result":{"success":[{"cols":7}]})", kNoColumns},
                                      {R"("result":{"success":[{"cols":["COUNTER"]}]})", kNoElectrodes}}) {
    FakeCortex service;
    service.answers["subscribe"] = answer;
    EXPECT_THAT(failure_of(service), HasSubstr(words)) << answer;
  }
}

TEST(CortexAddress, MustBeOnThisMachine) {
  for (const char* bad : {"", "localhost:6868", "http://localhost", "wss://192.0.2.1:6868", "wss://example.org",
                          "wss://", "wss://127.0.0.1:x"}) {
    CortexSettings settings;
    settings.url = bad;
    EXPECT_THROW(open_cortex(settings), std::invalid_argument) << bad;
  }
}

TEST(CortexCredentials, AreReadFromAFileWhoseMistakesAreNamed) {
  const auto file = std::filesystem::temp_directory_path() / ("credentials_" + std::to_string(::getpid()) + ".json");
  std::ofstream(file) << R"({"client_id":"a","client_secret":"b"})";
  const CortexCredentials credentials = read_cortex_credentials(file);
  EXPECT_EQ(credentials.client_id, "a");
  EXPECT_EQ(credentials.client_secret, "b");
  std::ofstream(file) << R"({"client_id":"a"})";
  EXPECT_THROW(read_cortex_credentials(file), std::invalid_argument);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace tandem::eeg
