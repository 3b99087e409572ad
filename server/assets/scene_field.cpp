#include "server/assets/scene_field.hpp"

#include "common/net/text.hpp"

namespace tandem::server {
namespace {

constexpr std::size_t kMaxErrorBytes = 4000;

}  // namespace

SceneField SceneField::in(const std::string& name) const {
  SceneField field = *this;
  field.field_ += (field_.empty() ? "" : ".") + name;
  return field;
}

SceneField SceneField::in(const std::string& name, std::size_t index) const {
  return in(name + "[" + std::to_string(index) + "]");
}

void SceneField::refuse(const std::string& text) const {
  // The text may quote parts of the file, so it is made printable.
  throw SceneError(net::printable(origin_ + ": " + (field_.empty() ? "" : field_ + " ") + text, kMaxErrorBytes));
}

void SceneField::require_within(double value, double low, double high, const std::string& demand) const {
  // The condition is written such that NaN is refused, too.
  if (value >= low && value <= high) return;
  refuse("is " + number_text(value) + "; it must be " + demand);
}

}  // namespace tandem::server
