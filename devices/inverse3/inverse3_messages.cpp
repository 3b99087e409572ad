#include "devices/inverse3/inverse3_messages.hpp"

#include "common/base/buttons.hpp"
#include "common/base/json.hpp"

namespace tandem::devices {
namespace {

namespace json = boost::json;

constexpr std::size_t kMaxIdBytes = 128;

const json::value* field(const json::value* value, std::string_view name) {
  const json::object* const object = value != nullptr ? value->if_object() : nullptr;
  return object != nullptr ? object->if_contains(name) : nullptr;
}

const json::value* first_of(const json::value& message, std::string_view kind) {
  const json::value* const list = field(&message, kind);
  const json::array* const array = list != nullptr ? list->if_array() : nullptr;
  return array != nullptr && !array->empty() ? &array->front() : nullptr;
}

std::optional<double> number(const json::value* value) {
  if (value == nullptr || !value->is_number()) return std::nullopt;
  return value->to_number<double>();
}

std::optional<Vec3> vector(const json::value* value) {
  const auto x = number(field(value, "x")), y = number(field(value, "y")), z = number(field(value, "z"));
  if (!x || !y || !z) return std::nullopt;
  return Vec3(*x, *y, *z);
}

bool is_true(const json::value* value) {
  return value != nullptr && value->is_bool() && value->get_bool();
}

void read_grip(const json::value* grip, Inverse3State& state) {
  const json::value* const state_field = field(grip, "state");
  const json::value* const orientation = field(state_field, "orientation");
  const auto imaginary = vector(orientation);
  const auto real = number(field(orientation, "w"));
  if (imaginary && real) state.grip = Quat(*real, imaginary->x(), imaginary->y(), imaginary->z());
  const json::value* const buttons = field(state_field, "buttons");
  const bool is_clutching = is_true(field(buttons, "b")) || is_true(field(buttons, "c"));
  state.buttons = (is_true(field(buttons, "a")) ? kButtonGrab : 0U) | (is_clutching ? kButtonClutch : 0U);
}

}  // namespace

std::optional<Inverse3State> read_inverse3_state(std::string_view text) {
  json::error_code error;
  const json::value message = json::parse(json::string_view(text.data(), text.size()), error);
  if (error) return std::nullopt;
  const json::value* const device = first_of(message, "inverse3");
  const json::value* const id = field(device, "device_id");
  const json::value* const state_field = field(device, "state");
  if (id == nullptr || !(id->is_string() || id->is_number())) return std::nullopt;
  Inverse3State state;
  state.device_id = json::serialize(*id);
  if (state.device_id.size() > kMaxIdBytes) return std::nullopt;
  state.cursor_m = vector(field(state_field, "cursor_position"));
  state.cursor_m_per_s = vector(field(state_field, "cursor_velocity")).value_or(Vec3::Zero());
  read_grip(first_of(message, "wireless_verse_grip"), state);
  return state;
}

std::string inverse3_command(std::string_view device_id, const Vec3& force_n) {
  const json::object values{{"x", force_n.x()}, {"y", force_n.y()}, {"z", force_n.z()}};
  return R"({"inverse3":[{"device_id":)" + std::string(device_id) + R"(,"commands":{"set_cursor_force":{"values":)" +
         json::serialize(values) + "}}}]}";
}

}  // namespace tandem::devices
