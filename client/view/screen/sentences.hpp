// Sentences of the panels: the state of a session in plain words. No display is needed.
#pragma once

#include <string>
#include <string_view>

#include "client/haptics/view.hpp"
#include "client/net/client_io.hpp"

namespace tandem::client {

/// Users in the room, e.g. "You are the operator, with ben."
std::string people_sentence(const ClientIoSnapshot& io);
/// Force on the hand, e.g. "1.2 N on your hand." In  view  null: none received yet
std::string force_sentence(const View* view);
/// Delay of the link, e.g. "52 ms there and back, of which 50 ms are simulated here."
/// In      one_way  delay of the simulated link in each direction
std::string delay_sentence(double round_trip_ms, Duration one_way);
/// Effect of a stage on the hand. Empty for a name that is no stage.
std::string_view stage_sentence(std::string_view stage);
/// Reason for a missing force, with the remedy. Empty while a force is displayed, and for a fault that ends by itself
/// within half a second.
std::string force_problem(const View* view, const ClientIoSnapshot& io);

}  // namespace tandem::client
