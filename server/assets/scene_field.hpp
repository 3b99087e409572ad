// Location of a value in a scene file. Error messages about invalid scenes name it in the same form.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "proto/scene_ranges.hpp"

namespace tandem::server {

/// Error for a scene that cannot be used. what() names the file, the field with its index, the value and the valid
/// range:
///   peg.json: bodies[2].mass_kg is -1; it must be 0 (static) or more
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A field of a scene file, e.g. `bodies[2].mass_kg` of `peg.json`.
class SceneField {
 public:
  /// Constructs the location of the whole file.
  explicit SceneField(std::string origin) : origin_(std::move(origin)) {}

  SceneField in(const std::string& name) const;
  SceneField in(const std::string& name, std::size_t index) const;

  /// Name as in the file, e.g. `bodies[2].mass_kg`.
  const std::string& name() const { return field_; }
  /// Throws SceneError "<file>: <field> <text>".
  [[noreturn]] void refuse(const std::string& text) const;
  /// Throws SceneError if a number is outside [low, high]. Used for limits that depend on other fields, which `demand`
  /// describes in words.
  void require_within(double value, double low, double high, const std::string& demand) const;

 private:
  std::string origin_;
  std::string field_;
};

using proto::number_text;

}  // namespace tandem::server
