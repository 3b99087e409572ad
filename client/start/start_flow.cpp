#include "client/start/start_flow.hpp"

#include <exception>
#include <utility>

#include "client/start/recent.hpp"

namespace tandem::client {

StartFlow::StartFlow(std::filesystem::path beside, std::filesystem::path recent)
    : beside_(std::move(beside)), recent_file_(std::move(recent)), recent_(recent_choices(recent_file_)) {}

const std::string& StartFlow::progress() const {
  static const std::string kNone;
  return server_ == nullptr ? kNone : server_->news();
}

void StartFlow::open(StartChoice choice) {
  if (state_ != State::kChoosing) return;
  problem_ = problem_of(choice);
  if (!problem_.empty()) return;
  opened_ = choice;
  if (choice.kind == StartChoice::Kind::kJoin) {
    target_ = join_target(choice.address);
    state_ = State::kReady;
  } else {
    try {
      server_ = std::make_unique<LocalServer>(std::move(choice), beside_);
      state_ = State::kPreparing;
    } catch (const std::exception& error) {
      problem_ = error.what();
    }
  }
}

void StartFlow::drop(const std::filesystem::path& file) {
  if (state_ != State::kChoosing) return;
  const auto choice = with_file(form_, file);
  if (!choice) {
    problem_ = file.filename().string() + " is neither a mesh, a structure nor a scene file";
    return;
  }
  form_ = *choice;
  problem_.clear();
  if (form_.kind != StartChoice::Kind::kDock || !form_.ligand.empty()) open(form_);
}

void StartFlow::cancel() {
  if (state_ == State::kPreparing) close("");
}

void StartFlow::poll() {
  if (server_ == nullptr) return;
  try {
    const LocalServer::State state = server_->poll();
    if (state_ != State::kPreparing) return;
    if (state == LocalServer::State::kReady) {
      target_ = server_->target();
      state_ = State::kReady;
    }
    if (state == LocalServer::State::kFailed) close(std::string(server_->news()));
  } catch (const std::exception& error) {
    close(error.what());
  }
}

void StartFlow::close(const std::string& problem) {
  if (state_ == State::kReady && problem.empty()) remember_choice(recent_file_, opened_);
  server_.reset();
  recent_ = recent_choices(recent_file_);
  state_ = State::kChoosing;
  problem_ = problem;
  // Clears the field with the invitation, because an invitation can be used only once.
  form_.address.clear();
}

std::vector<std::string> StartFlow::invitations() const {
  return server_ == nullptr ? std::vector<std::string>{} : server_->invitations();
}

}  // namespace tandem::client
