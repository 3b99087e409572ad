// Stops a server while each of its services is busy: poses, recordings, checkpoints, metrics, assets and joins. The
// server ends by stop(), by a simulated crash, or by an exception on the io thread. The test detects hangs, lost
// answers, and files that are damaged or do not match each other. TANDEM_STOPS=200 sets the number of repetitions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cstdlib>
#include <fstream>
#include <map>
#include <thread>

#include "common/recording/mcap_reader.hpp"
#include "server/assets/docking_scene.hpp"
#include "server/docking/pose_keeper.hpp"
#include "server/metrics/monitor.hpp"
#include "server/net/live_server.hpp"
#include "server/recording/server_checkpoint.hpp"
#include "server/recording/server_recorder.hpp"
#include "tests/support/hub_bench.hpp"
#include "tests/support/molecules.hpp"
#include "tests/support/needs.hpp"
#include "tests/support/running_server.hpp"

namespace tandem::server {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

/// A control connection without encryption, with blocking calls. Calls return nothing once the connection has ended.
class Connection {
 public:
  explicit Connection(std::uint16_t port) { socket_.connect({asio::ip::make_address("127.0.0.1"), port}, error_); }

  void send(const wire::ClientControl& message) {
    proto::Bytes frame;
    proto::append_frame(message, frame);
    if (!error_) asio::write(socket_, asio::buffer(frame), error_);
  }
  std::optional<wire::ServerControl> receive() {
    while (!error_) {
      if (const auto payload = reader_.next()) {
        wire::ServerControl message;
        if (!proto::parse_control(*payload, message)) return std::nullopt;
        return message;
      }
      std::array<std::byte, 65536> bytes;
      const std::size_t size = socket_.read_some(asio::buffer(bytes), error_);
      if (!error_) reader_.feed(std::span(bytes).first(size));
    }
    return std::nullopt;
  }
  /// Receives messages up to the first that satisfies `is_it`, and returns it; nothing if the connection ends before.
  template <class IsIt>
  std::optional<wire::ServerControl> receive_until(const IsIt& is_it) {
    while (auto message = receive()) {
      if (is_it(*message)) return message;
    }
    return std::nullopt;
  }
  std::optional<wire::Joined> join(const std::string& room, const std::string& name, wire::Role role) {
    wire::ClientControl hello;
    hello.mutable_hello()->set_protocol_version(proto::kProtocolVersion);
    hello.mutable_hello()->add_capabilities("state-udp");
    send(hello);
    send(test::HubBench::join_message(name, role, room));
    const auto answer =
        receive_until([](const auto& message) { return message.has_joined() || message.has_goodbye(); });
    if (!answer || !answer->has_joined()) return std::nullopt;
    return answer->joined();
  }
  void close() { socket_.close(error_); }

 private:
  asio::io_context io_;
  tcp::socket socket_{io_};
  boost::system::error_code error_;
  proto::FrameReader reader_;
};

/// A user who sends pose requests and stores the answers.
struct Asker {
  Asker(std::uint16_t port, const std::string& room, const std::string& name) : connection(port) {
    EXPECT_TRUE(connection.join(room, name, wire::ROLE_MANIPULATOR)) << name;
  }
  std::uint32_t send_request(wire::AskPose::Kind kind, std::uint32_t number = 0) {
    wire::ClientControl message;
    message.set_request(++last_request);
    message.mutable_ask_pose()->set_kind(kind);
    message.mutable_ask_pose()->set_number(number);
    connection.send(message);
    return last_request;
  }
  wire::ServerControl answer_to(std::uint32_t request) {
    const auto answer =
        connection.receive_until([request](const auto& message) { return message.request() == request; });
    return answer.value_or(wire::ServerControl{});
  }
  /// Waits for a progress message of a minimisation. Returns false if the connection ends before.
  bool sees_progress() {
    return read_until([](const auto& message) { return message.has_pose_progress(); });
  }
  /// Sends a ping and waits for its answer. The server has then read all requests that were sent before the ping.
  bool is_answered() {
    wire::ClientControl message;
    message.mutable_ping()->set_token(kToken);
    connection.send(message);
    return read_until([](const auto& answer) { return answer.has_pong() && answer.pong().token() == kToken; });
  }
  /// Receives messages up to the goodbye.
  void read_rest() {
    read_until([](const auto& message) { return message.has_goodbye(); });
  }
  template <class IsIt>
  bool read_until(const IsIt& is_it) {
    return connection
        .receive_until([&](const auto& message) {
          if (message.request() != 0) answers[message.request()] = message;
          return is_it(message);
        })
        .has_value();
  }

  static constexpr std::uint64_t kToken = 59;
  Connection connection;
  std::uint32_t last_request = 0;
  std::map<std::uint32_t, wire::ServerControl> answers;  ///< answers by request number
};

enum class Ending { kStop, kCrash, kException };

const std::shared_ptr<const LoadedScene>& helices() {
  static const std::shared_ptr<const LoadedScene> kScene = load_scene_text(
      scene_text(docking_scene(molecule_source(std::string(test::k3al1File) + ":A", ""),
                               molecule_source(std::string(test::k3al1File) + ":B", ""), wire::MolecularField())),
      "helices", ".");
  return kScene;
}

/// A server with all services of tandem-server, and clients that keep every service busy.
class BusyServer {
 public:
  explicit BusyServer(const std::filesystem::path& folder)
      : monitor_("0", std::uint16_t{9}, [](const std::string&) {}) {
    std::vector<std::unique_ptr<Room>> opened;
    for (const char* name : {"docking", "docking too"})
      opened.push_back(std::make_unique<Room>(RoomId{1}, name, helices(), RoomOptions{.steps_soft_aside = true}));
    opened.push_back(std::make_unique<Room>(RoomId{3}, "bench", test::scene_of(test::two_hands_scene())));
    ServerRooms rooms(std::move(opened));
    checkpoint_ =
        rooms.add(std::make_unique<ServerCheckpoint>(folder, rooms.rooms(), "", unix_ms, [](const std::string&) {}));
    PoseKeeper* const poses = rooms.add(std::make_unique<PoseKeeper>(folder / "poses", rooms.rooms(), unix_ms));
    LiveServerSettings settings{.port = 0};
    settings.hub.poses = poses;
    // On a loaded machine, the test's users may be silent for longer than the usual time-out.
    settings.hub.silence_timeout = std::chrono::seconds(30);
    server_ = std::make_unique<LiveServer>(settings, std::move(rooms));
    recorder_ = server_->add(std::make_unique<ServerRecorder>(
        folder / "recording", server_->rooms(), std::vector<RoomRecording>(3), [](const std::string&) {}));
    monitor_.watch(*server_, recorder_, checkpoint_);
    server_port_ = server_->port();
    server_->on_log = [this](std::string_view, const std::string&) {
      if (throws_) throw std::runtime_error("the log cannot be written");
    };
    poses->start();
    checkpoint_->start();
    running_ = std::thread([this] {
      try {
        server_->run();
      } catch (const std::exception& error) {
        fault_ = error.what();
      }
    });
    threads_.emplace_back([this] { keep_fetching(); });
    for (int i = 0; i < 2; ++i) threads_.emplace_back([this] { keep_joining(); });
    threads_.emplace_back([this] { keep_scraping(); });
  }
  ~BusyServer() {
    if (server_ != nullptr) {
      begin_to_end(Ending::kCrash);
      end();
    }
    leave();
  }

  std::uint16_t port() const { return server_port_; }

  /// Returns true once every service has made progress since the first call of this function.
  bool is_busy() {
    std::uint64_t recorded = 0;
    for (const auto& room : recorder_->rooms()) recorded += room->file().bytes_written();
    const std::array<std::uint64_t, 5> now{checkpoint_->writes(), recorded, chunks_, joins_, scrapes_};
    if (first_ == std::array<std::uint64_t, 5>{}) first_ = now;
    bool is_all = true;
    for (std::size_t i = 0; i < now.size(); ++i) is_all = is_all && now[i] > first_[i];
    return is_all;
  }
  std::string figures() const {
    std::string text;
    for (const std::uint64_t number : first_) text += std::to_string(number) + " ";
    return text + "-> checkpoints " + std::to_string(checkpoint_->writes()) + ", chunks " + std::to_string(chunks_) +
           ", joins " + std::to_string(joins_) + ", scrapes " + std::to_string(scrapes_);
  }
  /// Returns whether the answer to an asset request is pending.
  bool is_fetching() const { return chunks_requested_ > chunks_; }

  void begin_to_end(Ending ending) {
    if (ending == Ending::kStop) server_->stop();
    if (ending == Ending::kCrash) server_->abandon();
    if (ending == Ending::kException) throws_ = true;
  }
  /// Waits until the server's run() has returned, and destroys the server. Between these two events no room may step,
  /// because its state is being written.
  void end() {
    running_.join();
    std::vector<std::uint64_t> steps;
    for (const auto& room : server_->rooms()) steps.push_back(room->steps_done().value);
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (std::size_t i = 0; i < steps.size(); ++i)
      EXPECT_EQ(server_->rooms()[i]->steps_done().value, steps[i]) << "a room steps while its state is written";
    server_.reset();
  }
  void leave() {
    is_over_ = true;
    for (std::thread& thread : threads_) thread.join();
    threads_.clear();
  }
  const std::string& fault() const { return fault_; }

 private:
  static std::uint64_t unix_ms() {
    return static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
            .count());
  }
  static void rest() { std::this_thread::sleep_for(std::chrono::milliseconds(2)); }

  /// Requests chunks of an asset and keeps four requests pending, so that the end of the server always interrupts some.
  void keep_fetching() {
    Connection connection(server_port_);
    const auto joined = connection.join("docking", "fetcher", wire::ROLE_OBSERVER);
    if (!joined || joined->assets().empty()) return;
    wire::ClientControl request;
    request.mutable_get_asset()->set_sha256(joined->assets(0).sha256());
    const auto is_chunk = [](const auto& message) { return message.has_asset_chunk(); };
    for (int i = 0; i < 4; ++i, ++chunks_requested_) connection.send(request);
    while (!is_over_ && connection.receive_until(is_chunk)) {
      ++chunks_;
      connection.send(request);
      ++chunks_requested_;
      rest();
    }
  }
  void keep_joining() {
    while (!is_over_) {
      Connection connection(server_port_);
      if (connection.join("bench", "visitor", wire::ROLE_OBSERVER)) ++joins_;
      rest();
    }
  }
  void keep_scraping() {
    while (!is_over_) {
      asio::io_context io;
      tcp::socket socket(io);
      boost::system::error_code error;
      const std::string address = monitor_.address();
      const auto port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
      socket.connect({asio::ip::make_address("127.0.0.1"), port}, error);
      if (!error) asio::write(socket, asio::buffer(std::string("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n")), error);
      std::string answer;
      if (!error) asio::read(socket, asio::dynamic_buffer(answer), error);
      if (answer.find("tandem_checkpoint") != std::string::npos) ++scrapes_;
      rest();
    }
  }

  Monitor monitor_;
  ServerCheckpoint* checkpoint_ = nullptr;
  ServerRecorder* recorder_ = nullptr;
  std::unique_ptr<LiveServer> server_;
  std::uint16_t server_port_ = 0;
  std::atomic<bool> throws_{false}, is_over_{false};
  std::atomic<std::uint64_t> chunks_{0}, chunks_requested_{0}, joins_{0}, scrapes_{0};
  std::array<std::uint64_t, 5> first_{};
  std::string fault_;
  std::thread running_;
  std::vector<std::thread> threads_;
};

/// Checks that every list of poses is readable, and that the structure files beside it match its poses.
void expect_sound_poses(const std::filesystem::path& folder) {
  for (const auto& room : std::filesystem::directory_iterator(folder)) {
    const auto list = read_kept_poses(room.path());
    ASSERT_TRUE(list) << room.path();
    for (const wire::KeptPose& pose : list->poses) {
      const std::filesystem::path file = room.path() / (std::to_string(pose.number()) + ".cif");
      EXPECT_TRUE(std::filesystem::exists(file)) << file;
      EXPECT_TRUE(std::isfinite(pose.lj_kj_per_mol()));
    }
  }
}

void expect_sound_recordings(const std::filesystem::path& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream in(entry.path(), std::ios::binary);
    recording::McapReader reader(in);
    std::size_t messages = 0;
    while (reader.next()) ++messages;
    EXPECT_EQ(reader.end(), recording::McapReader::End::kWhole) << entry.path() << ": " << reader.why();
    EXPECT_GT(messages, 0U) << entry.path();
  }
}

void expect_sound_checkpoint(const std::filesystem::path& file) {
  wire::ServerCheckpoint checkpoint;
  std::ifstream in(file, std::ios::binary);
  EXPECT_TRUE(checkpoint.ParseFromIstream(&in));
  EXPECT_EQ(checkpoint.rooms_size(), 3);
}

/// Starts a server in the folder that the previous server has left, loads it with requests, and ends it.
void live_and_end(const std::filesystem::path& folder, Ending ending, const std::string& user) {
  BusyServer server(folder);
  Asker ada(server.port(), "docking", user), ben(server.port(), "docking too", user);
  const bool is_busy = test::eventually([&server] { return server.is_busy(); });
  ASSERT_TRUE(is_busy) << server.figures();
  const wire::ServerControl kept = ada.answer_to(ada.send_request(wire::AskPose::KEEP));
  ASSERT_TRUE(kept.has_kept_pose()) << kept.ShortDebugString();
  std::vector<std::uint32_t> of_ada{ada.send_request(wire::AskPose::MINIMISE)},
      of_ben{ben.send_request(wire::AskPose::MINIMISE)};
  ASSERT_TRUE(ada.sees_progress() && ben.sees_progress()) << "both are being minimised";
  of_ada.push_back(ada.send_request(wire::AskPose::KEEP));
  of_ada.push_back(ada.send_request(wire::AskPose::DELETE, kept.kept_pose().number()));
  of_ben.push_back(ben.send_request(wire::AskPose::KEEP));
  ASSERT_TRUE(ada.is_answered() && ben.is_answered());
  EXPECT_TRUE(server.is_fetching());
  server.begin_to_end(ending);
  if (ending == Ending::kStop) {
    ada.read_rest();
    ben.read_rest();
    for (const std::uint32_t request : of_ada) EXPECT_TRUE(ada.answers.contains(request)) << "ada's " << request;
    for (const std::uint32_t request : of_ben) EXPECT_TRUE(ben.answers.contains(request)) << "ben's " << request;
    const std::string words = ada.answers[of_ada[0]].error().text() + ben.answers[of_ben[0]].error().text();
    // Two texts are possible for the interrupted minimisation. The second one occurs on a loaded machine, if the stop
    // is complete before the pose thread has noticed it.
    EXPECT_THAT(words,
                testing::AnyOf(testing::HasSubstr("the server is stopping"), testing::HasSubstr("the server stops")))
        << "a minimisation was open";
    ada.connection.close();
    ben.connection.close();
  }
  server.end();
  EXPECT_EQ(server.fault(), ending == Ending::kException ? "the log cannot be written" : "");
  server.leave();
  expect_sound_poses(folder / "poses");
  expect_sound_recordings(folder / "recording");
  expect_sound_checkpoint(folder / "checkpoint.pb");
}

TEST(Stop, WithEachServiceAtWorkLeavesNothingOpenAndEveryFileWhole) {
  TANDEM_NEEDS_FILES(test::k3al1File, test::kOplsDirectory);
  const char* const wanted = std::getenv("TANDEM_STOPS");
  const int times = wanted != nullptr ? std::atoi(wanted) : 6;
  const auto folder = std::filesystem::path(testing::TempDir()) / ("tandem_stop_" + std::to_string(::getpid()));
  for (int i = 0; i < times && !HasFailure(); ++i) {
    SCOPED_TRACE("stop " + std::to_string(i));
    // The folder is cleared from time to time: a room stores at most 200 poses, and recordings accumulate.
    if (i % 12 == 0) std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    const std::array endings{Ending::kStop, Ending::kCrash, Ending::kStop, Ending::kException};
    live_and_end(folder, endings[static_cast<std::size_t>(i) % endings.size()], "user " + std::to_string(i));
  }
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace tandem::server
