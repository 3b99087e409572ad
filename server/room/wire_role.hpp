// Conversion of a user's role to and from its encoding in messages and recordings.
#pragma once

#include <optional>

#include "server/room/seat.hpp"
#include "tandem/control.pb.h"

namespace tandem::server {

inline wire::Role wire_role(UserRole role) noexcept {
  if (role == UserRole::kOperator) return wire::ROLE_OPERATOR;
  if (role == UserRole::kSignal) return wire::ROLE_SIGNAL;
  return role == UserRole::kManipulator ? wire::ROLE_MANIPULATOR : wire::ROLE_OBSERVER;
}

/// Converts the role in a message to a user's role.
/// Fails   returns nothing if a user cannot request this role
inline std::optional<UserRole> role_of(wire::Role role) noexcept {
  if (role == wire::ROLE_MANIPULATOR) return UserRole::kManipulator;
  if (role == wire::ROLE_OBSERVER) return UserRole::kObserver;
  if (role == wire::ROLE_OPERATOR) return UserRole::kOperator;
  if (role == wire::ROLE_SIGNAL) return UserRole::kSignal;
  return std::nullopt;
}

}  // namespace tandem::server
