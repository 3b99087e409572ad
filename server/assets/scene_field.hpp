// Where in a scene file a value stands, so that every refusal names it the same way.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/base/spatial.hpp"
#include "google/protobuf/repeated_field.h"

namespace tandem::server {

/// A scene that cannot be used. what() names the file, the field with its index, the value and what would be right:
///   peg.json: bodies[2].mass_kg is -1; it must be 0 (static) or more
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A field of a scene file, e.g. `bodies[2].mass_kg` of `peg.json`.
class SceneField {
 public:
  /// The whole file.
  explicit SceneField(std::string origin) : origin_(std::move(origin)) {}

  SceneField in(const std::string& name) const;
  SceneField in(const std::string& name, std::size_t index) const;

  /// Throws SceneError "<file>: <field> <text>".
  [[noreturn]] void refuse(const std::string& text) const;
  /// Refuses a number that is not finite or not within [low, high]; `demand` says in words what it must be.
  void require_within(double value, double low, double high, const std::string& demand) const;
  /// Refuses what is not finite, not positive or above `high`.
  void require_positive(double value, double high) const;
  void require_at_least_zero(double value, double high) const;
  /// Three numbers; an absent array is filled with `fallback`.
  Vec3 complete_vec3(google::protobuf::RepeatedField<double>& values, const Vec3& fallback, double magnitude) const;

  const std::string& origin() const { return origin_; }

 private:
  std::string origin_;
  std::string field_;
};

/// A number for people: as short as it can be with 6 digits.
std::string number_text(double value);

}  // namespace tandem::server
