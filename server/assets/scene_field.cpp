#include "server/assets/scene_field.hpp"

#include <cmath>
#include <cstdio>

namespace tandem::server {

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%g", value);
  return text;
}

SceneField SceneField::in(const std::string& name) const {
  SceneField field = *this;
  field.field_ += (field_.empty() ? "" : ".") + name;
  return field;
}

SceneField SceneField::in(const std::string& name, std::size_t index) const {
  return in(name + "[" + std::to_string(index) + "]");
}

void SceneField::refuse(const std::string& text) const {
  throw SceneError(origin_ + ": " + (field_.empty() ? "" : field_ + " ") + text);
}

void SceneField::require_within(double value, double low, double high, const std::string& demand) const {
  // Written so that NaN is refused too.
  if (value >= low && value <= high) return;
  refuse("is " + number_text(value) + "; it must be " + demand);
}

void SceneField::require_positive(double value, double high) const {
  if (value > 0 && value <= high) return;
  refuse("is " + number_text(value) + "; it must be more than 0 and at most " + number_text(high));
}

void SceneField::require_at_least_zero(double value, double high) const {
  require_within(value, 0, high, "from 0 to " + number_text(high));
}

Vec3 SceneField::complete_vec3(google::protobuf::RepeatedField<double>& values, const Vec3& fallback,
                               double magnitude) const {
  if (values.empty()) values.Add(fallback.data(), fallback.data() + 3);
  if (values.size() != 3) {
    refuse("has " + std::to_string(values.size()) + " numbers; it must have 3 (x, y, z)");
  }
  for (int i = 0; i < 3; ++i) {
    if (std::abs(values[i]) <= magnitude) continue;
    refuse("has " + number_text(values[i]) + "; each number must be finite and within +-" + number_text(magnitude));
  }
  return {values[0], values[1], values[2]};
}

}  // namespace tandem::server
