#include "proto/drop_reason.hpp"

namespace tandem::proto {

// The switch has no default case, so that the compiler warns about a reason without a name.
std::string_view name_of(DropReason reason) {
  switch (reason) {
    case DropReason::kNone:
      return "none";
    case DropReason::kTooShort:
      return "too_short";
    case DropReason::kTooLong:
      return "too_long";
    case DropReason::kVersion:
      return "version";
    case DropReason::kType:
      return "type";
    case DropReason::kTag:
      return "tag";
    case DropReason::kUnknownConnection:
      return "unknown_connection";
    case DropReason::kLate:
      return "late";
    case DropReason::kDuplicate:
      return "duplicate";
    case DropReason::kSequenceJump:
      return "sequence_jump";
    case DropReason::kMalformed:
      return "malformed";
    case DropReason::kNotFinite:
      return "not_finite";
    case DropReason::kOverwritten:
      return "overwritten";
    case DropReason::kSendFailed:
      return "send_failed";
    case DropReason::kSimulatedLoss:
      return "simulated_loss";
    case DropReason::kNotAllowed:
      return "not_allowed";
    case DropReason::kCount:
      break;
  }
  return "unknown";
}

}  // namespace tandem::proto
