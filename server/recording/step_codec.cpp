#include "server/recording/step_codec.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "proto/coupling_fields.hpp"
#include "proto/recording/exact_state.hpp"
#include "proto/state_codec.hpp"
#include "server/room/wire_role.hpp"

namespace tandem::server {
namespace {

using haptics::CouplingParameters;
constexpr std::array kCoefficients{
    &CouplingParameters::stiffness_n_per_m,     &CouplingParameters::damping_n_s_per_m,
    &CouplingParameters::stiffness_n_m_per_rad, &CouplingParameters::damping_n_m_s_per_rad,
    &CouplingParameters::force_limit_n,         &CouplingParameters::torque_limit_n_m,
    &CouplingParameters::saturation_softness,   &CouplingParameters::curve_sharpness};

void write(const CouplingParameters& from, google::protobuf::RepeatedField<double>& to) {
  for (const auto coefficient : kCoefficients) to.Add(from.*coefficient);
}

bool read(const google::protobuf::RepeatedField<double>& from, CouplingParameters& to) {
  if (from.size() != static_cast<int>(kCoefficients.size())) return false;
  for (std::size_t i = 0; i < kCoefficients.size(); ++i) to.*kCoefficients[i] = from[static_cast<int>(i)];
  return std::ranges::all_of(from, [](double number) { return number >= 0; });  // also refuses NaN
}

/// FNV-1a hash that takes 64-bit words instead of bytes, and folds the result to 32 bits.
class Hash {
 public:
  void add(std::uint64_t word) noexcept { value_ = (value_ ^ word) * 0x100000001b3U; }
  void add(double number) noexcept { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const Vec3& a) noexcept {
    for (const double number : a) add(number);
  }
  void add(const RigidState& state) noexcept {
    add(state.X.p);
    for (const double number : {state.X.q.w(), state.X.q.x(), state.X.q.y(), state.X.q.z()}) add(number);
    add(state.V.v);
    add(state.V.w);
  }
  std::uint32_t folded() const noexcept { return static_cast<std::uint32_t>(value_ ^ (value_ >> 32U)); }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

std::uint32_t hash_of(const physics::ToolState& tool) noexcept {
  Hash hash;
  hash.add(tool.tool);
  hash.add(tool.wrench_on_hand_W.f);
  hash.add(tool.wrench_on_hand_W.t);
  hash.add(std::uint64_t{tool.held.value});
  hash.add(tool.energy_into_world_j);
  hash.add(tool.energy_from_world_j);
  return hash.folded();
}

}  // namespace

wire::RecordedCommand recorded(const RoomCommand& command) {
  wire::RecordedCommand out;
  out.set_kind(static_cast<wire::RecordedCommand::Kind>(command.kind));
  out.set_seat(command.seat.index);
  out.set_user(command.seat.user.value);
  if (command.kind == RoomCommand::Kind::kJoin) {
    out.set_role(wire_role(command.seat.role));
    out.set_tool(command.seat.tool);
    out.set_leaves_gaps(command.seat.leaves_gaps);
    write(command.seat.coupling_bounds, *out.mutable_coupling_bounds());
    out.set_user_name(command.seat.user_name.data());
  }
  out.set_body(command.body.value);
  out.set_request(command.request);
  if (command.kind == RoomCommand::Kind::kSetCoupling) {
    write(command.coupling, *out.mutable_coupling());
    if (command.law != nullptr) out.set_law(std::string(command.law->name));
  }
  if (command.kind == RoomCommand::Kind::kPlace) {
    out.set_beside(command.beside.value);
    proto::write_exact({command.X_SB, Twist{}}, *out.mutable_placed());
  }
  out.set_level(command.level);
  out.set_is_weightless(command.is_weightless);
  if (command.kind == RoomCommand::Kind::kSetSignal) {
    out.set_signal(command.signal);
    out.set_value(command.signal_value.value);
    out.set_confidence(command.signal_value.confidence);
    out.set_age_steps(command.signal_value.age_steps);
  }
  return out;
}

std::optional<RoomCommand> command_of(const wire::RecordedCommand& in) {
  RoomCommand command;
  if (in.kind() < 0 || in.kind() > static_cast<int>(RoomCommand::Kind::kSetSignal)) return std::nullopt;
  if (in.seat() >= proto::kMaxUsers || in.tool() >= proto::kMaxUsers || in.level() >= kMaxLevels) return std::nullopt;
  if (in.signal() >= kMaxSignals || !std::isfinite(in.value()) || !std::isfinite(in.confidence())) return std::nullopt;
  command.kind = static_cast<RoomCommand::Kind>(in.kind());
  command.seat.index = static_cast<std::uint8_t>(in.seat());
  command.seat.user = UserId{in.user()};
  command.seat.role = role_of(in.role()).value_or(UserRole::kObserver);
  command.seat.tool = static_cast<std::uint8_t>(in.tool());
  command.seat.leaves_gaps = in.leaves_gaps();
  command.level = static_cast<std::uint8_t>(in.level());
  command.is_weightless = in.is_weightless();
  command.signal = static_cast<std::uint8_t>(in.signal());
  command.signal_value = {in.value(), in.confidence(), in.age_steps()};
  command.body = BodyId{in.body()};
  command.request = in.request();
  const bool is_join = command.kind == RoomCommand::Kind::kJoin;
  if (is_join && !read(in.coupling_bounds(), command.seat.coupling_bounds)) return std::nullopt;
  if (command.kind == RoomCommand::Kind::kSetCoupling) {
    if (!read(in.coupling(), command.coupling)) return std::nullopt;
    if (!in.law().empty() && (command.law = haptics::find_coupling_law(in.law())) == nullptr) return std::nullopt;
  }
  if (command.kind == RoomCommand::Kind::kPlace) {
    command.beside = BodyId{in.beside()};
    command.X_SB = proto::read_exact(in.placed()).X;
    if (!is_finite(command.X_SB) || std::abs(command.X_SB.q.norm() - 1) > 1e-6) return std::nullopt;
  }
  std::ranges::copy(std::string_view(in.user_name()).substr(0, command.seat.user_name.size() - 1),
                    command.seat.user_name.begin());
  return command;
}

wire::RecordedInput recorded(const TakenInput& input) {
  wire::RecordedInput out;
  out.set_seat(static_cast<std::uint32_t>(input.seat));
  proto::Bytes payload;
  proto::append_client_update(input.update, payload);
  out.mutable_update()->ParseFromArray(payload.data(), static_cast<int>(payload.size()));
  return out;
}

/// Converts a recorded input after a check by the parser for network input. The parser normalises the rotation, but the
/// room has used the rotation as recorded. The recorded rotation is therefore copied back after the check.
std::optional<TakenInput> input_of(const wire::RecordedInput& in) {
  TakenInput input{in.seat(), {}};
  const std::string payload = in.update().SerializeAsString();
  if (in.seat() >= proto::kMaxUsers ||
      proto::parse_client_update(std::as_bytes(std::span(payload)), input.update) != proto::DropReason::kNone) {
    return std::nullopt;
  }
  const wire::Rotation& q = in.update().handle().q();
  input.update.handle.X.q = Quat(q.w(), q.x(), q.y(), q.z());
  return input;
}

StateHashes hashes_of(const Room& room) noexcept {
  const LoadedScene& scene = room.scene();
  StateHashes hashes;
  for (std::size_t i = 0; i < scene.world.bodies.size(); ++i) {
    Hash hash;
    if (scene.world.bodies[i].mass.mass_kg > 0) hash.add(room.world().body(body_id_at(i)));
    hashes.bodies.push_back(hash.folded());
  }
  for (std::size_t i = 0; i < scene.soft_bodies.size(); ++i) {
    Hash hash;
    for (const Vec3& node : room.world().soft_nodes_W(i)) hash.add(node);
    hashes.bodies.push_back(hash.folded());
  }
  if (const Game* const game = room.game()) hashes.bodies.push_back(hash_of(game->status()));
  for (std::size_t i = 0; i < scene.world.tools.size(); ++i) hashes.tools.push_back(hash_of(room.world().tool(i)));
  return hashes;
}

}  // namespace tandem::server
