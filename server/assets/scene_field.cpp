#include "server/assets/scene_field.hpp"

namespace tandem::server {

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

}  // namespace tandem::server
