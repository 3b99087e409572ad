#include "lab/recording/recording_facts.hpp"

#include <array>
#include <map>
#include <optional>

#include "common/base/json_pretty.hpp"
#include "common/base/tick_faults.hpp"
#include "common/haptics/safety.hpp"
#include "lab/report/utc.hpp"
#include "proto/recording/recorded_files.hpp"
#include "proto/recording/schema.hpp"
#include "tandem/recording.pb.h"

namespace tandem::lab {
namespace {

namespace json = boost::json;

constexpr std::size_t kMaxGapsListed = 20;

/// Counts the gaps in a sequence of consecutive numbers.
class Sequence {
 public:
  void add(std::uint64_t number, std::uint64_t stride) {
    if (count_ > 0 && number > last_ + stride) {
      const std::uint64_t missing = (number - last_) / stride - 1;
      missing_ += missing;
      if (gaps_.size() < kMaxGapsListed) gaps_.push_back(json::object{{"after", last_}, {"missing", missing}});
    }
    if (count_ == 0) first_ = number;
    last_ = number;
    ++count_;
  }
  void describe(const char* what, json::object& out) const {
    out[what] = json::object{{"count", count_}, {"first", first_}, {"last", last_}, {"missing", missing_}};
    out["gaps"] = gaps_;
  }

 private:
  std::uint64_t count_ = 0, first_ = 0, last_ = 0, missing_ = 0;
  json::array gaps_;
};

class Facts {
 public:
  bool receive(const std::string& topic, const recording::Message& message) {
    ++messages_[topic];
    if (begun_ns_ == 0) begun_ns_ = message.log_ns;
    newest_ns_ = std::max(newest_ns_, message.log_ns);
    if (topic == "/room") return read_room(message);
    if (topic == "/session") return read_session(message);
    if (topic == "/step") return read_step(message);
    if (topic == "/tick") return read_tick(message);
    return true;
  }

  json::object object(const proto::RecordingEnd& end) {
    json::array files;
    for (const auto& file : end.files) files.emplace_back(file.string());
    json::object messages;
    for (const auto& [topic, count] : messages_) messages[topic] = count;
    out_["files"] = files;
    out_["is_whole"] = end.is_whole;
    out_["is_damaged"] = end.is_damaged;
    out_["why"] = end.why;
    out_["begun_utc"] = utc_text(begun_ns_);
    out_["duration_s"] = since_begin_s(newest_ns_);
    out_["messages"] = messages;
    if (out_.contains("room")) describe_room();
    if (out_.contains("user")) sequence_.describe("ticks", out_);
    out_["faults"] = out_.contains("room") ? describe_faults(faults_) : haptics::describe_safety_faults(faults_);
    return out_;
  }

 private:
  double since_begin_s(std::uint64_t ns) const { return static_cast<double>(ns - begun_ns_) * 1e-9; }

  bool read_room(const recording::Message& message) {
    wire::RecordedRoom room;
    if (out_.contains("room")) return true;  // the start record of a continuation file repeats the first one
    proto::require_recorded(message, room);
    out_["kind"] = "room";
    out_["program"] = room.program();
    out_["room"] = room.room();
    out_["scene"] = room.scene().name();
    out_["scene_file"] = room.scene_file();
    out_["part"] = room.part();
    return true;
  }
  bool read_session(const recording::Message& message) {
    wire::RecordedSession session;
    if (out_.contains("user")) return true;  // the start record of a continuation file repeats the first one
    proto::require_recorded(message, session);
    out_["kind"] = "client";
    out_["program"] = session.program();
    out_["user"] = session.user_name();
    out_["device"] = session.device();
    out_["profile"] = session.profile();
    out_["stage"] = session.stage();
    out_["every"] = session.every();
    every_ = std::max(1U, session.every());
    return true;
  }
  bool read_step(const recording::Message& message) {
    wire::RecordedStep step;
    proto::require_recorded(message, step);
    sequence_.add(step.step(), 1);
    faults_ |= step.tick_faults();
    inputs_ += static_cast<std::uint64_t>(step.inputs_size());
    for (const wire::RecordedCommand& command : step.commands()) read_command(command, message.log_ns);
    return true;
  }
  void read_command(const wire::RecordedCommand& command, std::uint64_t at_ns) {
    ++commands_;
    if (command.kind() == wire::RecordedCommand::JOIN) {
      json::object& user = users_[command.user()];
      user = {{"user", command.user()},
              {"name", command.user_name()},
              {"role", wire::Role_Name(command.role())},
              {"joined_s", since_begin_s(at_ns)},
              {"left_s", nullptr}};
      if (command.role() != wire::ROLE_OBSERVER) user["tool"] = command.tool();
    } else if (command.kind() == wire::RecordedCommand::LEAVE && users_.contains(command.user())) {
      users_[command.user()]["left_s"] = since_begin_s(at_ns);
    }
  }
  bool read_tick(const recording::Message& message) {
    wire::RecordedTick tick;
    proto::require_recorded(message, tick);
    sequence_.add(tick.tick(), every_);
    faults_ |= tick.safety_faults();
    return true;
  }
  void describe_room() {
    sequence_.describe("steps", out_);
    json::array users;
    for (const auto& [id, user] : users_) users.push_back(user);
    out_["users"] = users;
    out_["commands"] = commands_;
    out_["inputs"] = inputs_;
  }

  json::object out_;
  std::map<std::string, std::uint64_t> messages_;
  std::uint64_t begun_ns_ = 0, newest_ns_ = 0, every_ = 1;
  Sequence sequence_;
  std::uint32_t faults_ = 0;
  std::uint64_t inputs_ = 0, commands_ = 0;
  std::map<std::uint32_t, json::object> users_;
};

}  // namespace

json::object recording_facts(const std::filesystem::path& file) {
  Facts facts;
  const proto::RecordingEnd end = proto::read_recording(
      file, [&facts](const std::string& topic, const auto& message) { return facts.receive(topic, message); });
  return facts.object(end);
}

std::string facts_text(const json::object& facts) {
  std::string text;
  for (const auto& field : facts) {
    const bool is_text = field.value().is_string();
    text.append(field.key()).append(": ");
    text += (is_text ? std::string(field.value().get_string()) : compact_json(field.value())) + "\n";
  }
  return text;
}

}  // namespace tandem::lab
