#include "client/start/local_server.hpp"

#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "client/start/shipped_scenes.hpp"
#include "common/base/folders.hpp"

namespace tandem::client {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPartner = "ben";
/// Maximum time between the end of the server and the end of its output. The wait is needed because the last lines of
/// the output contain the reason of the end.
constexpr Duration kLastWords = std::chrono::seconds(1);

/// Returns the message of a log line, without its prefix (time and level, as in "23:45:07.887 info ", or the program's
/// name).
std::string plain(const std::string& line) {
  for (const std::string before : {" info ", "tandem-server: "}) {
    const std::size_t at = line.find(before);
    if (at != std::string::npos) return line.substr(at + before.size());
  }
  return line;
}

/// Writes a file for the server to read.
/// Fails   std::runtime_error if the file cannot be written; the message names the file
void write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(file.string() + " cannot be written; free some space");
}

fs::path checked(const fs::path& program) {
  std::error_code error;
  if (fs::exists(program, error)) return program;
  throw std::runtime_error(program.filename().string() + " is not in " + program.parent_path().string() +
                           "; build or install it there");
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "tandem-mesh-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": no folder can be made there");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

std::optional<std::string> listening_port(const std::string& line) {
  constexpr std::string_view kBefore = "listening on ";
  const std::size_t begin = line.find(kBefore);
  if (begin == std::string::npos) return std::nullopt;
  const std::size_t end = std::min(line.find(',', begin), line.size());
  const std::size_t colon = line.rfind(':', end);
  if (colon == std::string::npos || colon < begin + kBefore.size()) return std::nullopt;
  return line.substr(colon + 1, end - colon - 1);
}

std::string invitation_in(const std::string& line) {
  constexpr std::string_view kBefore = "--join ";
  const std::size_t at = line.starts_with("invitation (") ? line.find(kBefore) : std::string::npos;
  return at == std::string::npos ? "" : line.substr(at + kBefore.size());
}

LocalServer::LocalServer(StartChoice choice, const fs::path& beside) : choice_(std::move(choice)), beside_(beside) {
  const fs::path program = checked(beside_ / "tandem-server");
  fs::path scene;
  if (choice_.kind == StartChoice::Kind::kMesh) {
    scene = folder_.emplace().path() / "mesh.json";
    write_text(scene, mesh_scene(choice_));
  }
  server_ = std::make_unique<ChildProgram>(program, server_arguments(choice_, scene));
}

LocalServer::~LocalServer() {
  if (partner_ != nullptr) partner_->request_stop();
  server_->request_stop();
  partner_.reset();
  server_.reset();
}

LocalServer::State LocalServer::poll() {
  read_lines();
  if (partner_ != nullptr) partner_->take_lines();
  if (state_ == State::kPreparing && is_complete()) {
    start_partner();
    // If there is a simulated partner, the partner must join before this user, so that the partner always gets the
    // scene's first tool.
    const bool is_awaited = partner_ != nullptr && !has_partner_joined_ && partner_->is_running();
    if (!is_awaited) state_ = State::kReady;
  }
  if (state_ == State::kPreparing && !server_->is_running()) follow_end();
  return state_;
}

/// Returns true if the server has printed its address and all invitations that a session needs. The invitations follow
/// the address.
bool LocalServer::is_complete() const {
  const auto needed = static_cast<std::size_t>(choice_.is_hosted ? choice_.invited : 0);
  return !target_.address.empty() && (!choice_.is_hosted || target_.invitation) && invitations_.size() >= needed;
}

/// Handles the end of the server: once the last lines of its output have been read, sets the state kFailed and the
/// reason.
void LocalServer::follow_end() {
  const LocalTime now = SteadyClock().now();
  if (!ended_at_) ended_at_ = now;
  if (!server_->has_read_all() && now - *ended_at_ < kLastWords) return;
  read_lines();
  state_ = State::kFailed;
  if (!news_.empty()) return;
  const int code = server_->exit_code();
  news_ = code == ChildProgram::kNotExecuted
              ? "tandem-server could not be executed; wait until it is built, or install it again"
              : "the server ended with exit code " + std::to_string(code);
}

void LocalServer::read_lines() {
  for (const std::string& line : server_->take_lines()) read(line);
}

void LocalServer::read(const std::string& line) {
  if (const auto port = listening_port(line)) {
    target_.address = "127.0.0.1:" + *port;
  } else if (const std::string invitation = invitation_in(line); !invitation.empty()) {
    const auto read = proto::invitation_of(invitation);
    if (choice_.is_hosted && read && !target_.invitation) {
      target_.invitation = read;
      target_.invitation->server = target_.address;
    } else {
      invitations_.push_back(invitation);
    }
  } else {
    has_partner_joined_ = has_partner_joined_ || (line.find(kPartner) != line.npos && line.find("joined") != line.npos);
    news_ = plain(line);
  }
}

void LocalServer::start_partner() {
  const std::string_view hand = partner_of(choice_);
  if (hand.empty() || partner_ != nullptr) return;
  const fs::path file = data_folder() / hand;
  std::error_code error;
  partner_ = std::make_unique<ChildProgram>(
      checked(beside_ / "tandem-client"),
      std::vector<std::string>{"--insecure", "--server", target_.address, "--headless", "--name", kPartner, "--device",
                               "sim", "--hand", fs::exists(file, error) ? file.string() : std::string(hand)});
}

}  // namespace tandem::client
