#include "client/view/screen/sentences.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

namespace tandem::client {
namespace {

struct FaultSentence {
  haptics::SafetyFault fault;
  const char* sentence;
};
/// Sentences for the faults of the safety chain, the most important fault first. All other faults need no sentence,
/// because they end by themselves within half a second.
constexpr std::array kFaults{
    FaultSentence{haptics::kSafetyInvalidSample,
                  "No force: the device does not report where it is. Check its cable and its calibration."},
    FaultSentence{haptics::kSafetyNotFinite,
                  "No force: the computed force was invalid. Let go and move away; it returns by itself."},
    FaultSentence{haptics::kSafetyTooFast,
                  "No force: the hand moved too fast. Hold it still; the force returns within half a second."},
    FaultSentence{haptics::kSafetySilence,
                  "No force: the server has not sent for 150 ms. The force returns when it sends again."},
    FaultSentence{haptics::kSafetySlow,
                  "No force: this machine or the server is too slow for 1 kHz. Close other programs."},
    FaultSentence{haptics::kSafetyLate,
                  "No force: this machine was late for the hand. Close other programs; tandem-doctor tests it."},
    FaultSentence{haptics::kSafetyClutched, "Clutch: the tool stays, and there is no force until you let go of C."},
};

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kStageSentences{{
    {"local-model", "You feel things at once; the hands of others are predicted."},
    {"late-pose", "You feel a spring to where the server last showed your tool: it drags with the delay."},
    {"hold", "You feel the server's last force. It rings in stiff contact when the delay is long."},
    {"linear", "You feel the server's force, continued along a line."},
    {"ar", "You feel the server's force, continued by a model of its past."},
    {"ar-spline", "You feel the server's force, continued by a smoothed model of its past."},
    {"wave", "You feel the server through wave variables: calm at any constant delay, but soft."},
    {"god-object", "You feel fixed bodies at once, and what moves a round trip late."},
}};

std::string printed(const char* format, double value) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::string others_of(const ClientIoSnapshot& io) {
  std::string others;
  for (const wire::UserJoined& user : io.users) others += (others.empty() ? "" : ", ") + printable(user.name());
  return others;
}

}  // namespace

std::string people_sentence(const ClientIoSnapshot& io) {
  if (io.joined == nullptr) return "Not in a room yet.";
  std::string sentence = "You are here";
  if (io.joined->role() == wire::ROLE_OPERATOR) sentence = "You are the operator";
  if (io.joined->role() == wire::ROLE_OBSERVER) sentence = "You observe";
  const std::string others = others_of(io);
  return sentence + (others.empty() ? ", alone." : ", with " + others + ".");
}

std::string force_sentence(const View* view) {
  if (view == nullptr) return "No force yet.";
  const double force_n = view->record.displayed_on_hand_D.f.norm();
  if (force_n < 0.005) return "Nothing presses on your hand.";
  return printed("%.1f N on your hand", force_n) + (view->record.is_clamped ? ", the most it may be." : ".");
}

std::string delay_sentence(double round_trip_ms, Duration one_way) {
  const std::string sentence = printed("%.0f ms there and back", round_trip_ms);
  const double simulated_ms = 2e3 * to_seconds(one_way);
  return simulated_ms <= 0 ? sentence + "."
                           : sentence + printed(", of which %.0f ms are simulated here.", simulated_ms);
}

std::string_view stage_sentence(std::string_view stage) {
  const auto found = std::ranges::find(kStageSentences, stage, [](const auto& each) { return each.first; });
  return found == kStageSentences.end() ? std::string_view{} : found->second;
}

std::string force_problem(const View* view, const ClientIoSnapshot& io) {
  if (view == nullptr || io.joined == nullptr) return "";
  if (io.joined->role() == wire::ROLE_OBSERVER) return "";
  const haptics::SafetyFaults faults = view->record.safety_faults;
  for (const FaultSentence& each : kFaults) {
    if ((faults & each.fault) != 0) return each.sentence;
  }
  return "";
}

}  // namespace tandem::client
