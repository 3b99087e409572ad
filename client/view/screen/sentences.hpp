// Sentences for the panels, which describe the state of a session to the user. No display is needed.
#pragma once

#include <string>
#include <string_view>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"

namespace tandem::client {

/// Returns a sentence about the users in the room, e.g. "You are the operator, with ben."
std::string people_sentence(const ClientIoSnapshot& io);
/// Returns a sentence about the force on the hand, e.g. "1.2 N on your hand."
/// In      view  null if none was received yet
std::string force_sentence(const View* view);
/// Returns a sentence about the delay of the link, e.g. "52 ms there and back, of which 50 ms are simulated here."
/// In      one_way  delay of the simulated link in each direction
std::string delay_sentence(double round_trip_ms, Duration one_way);
/// Returns a sentence about the effect of a stage on the hand. Empty if no stage has this name.
std::string_view stage_sentence(std::string_view stage);
/// Returns the reason why no force is displayed, with the remedy. Empty while a force is displayed, and for a fault
/// that ends by itself within half a second.
std::string force_problem(const View* view, const ClientIoSnapshot& io);

}  // namespace tandem::client
