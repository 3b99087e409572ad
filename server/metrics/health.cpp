#include "server/metrics/health.hpp"

#include <iomanip>
#include <sstream>

namespace tandem::server {

std::string standstill(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now) {
  std::ostringstream text;
  const auto check = [&](const std::string& name, LocalTime went_round) {
    if (now - went_round <= kGoesRoundWithin) return;
    text << (text.tellp() > 0 ? "; " : "") << name << " has stood still for " << std::fixed << std::setprecision(1)
         << to_seconds(now - went_round) << " s";
  };
  if (!pulse.is_serving) return "";
  check("io", pulse.io);
  for (std::size_t i = 0; i < pulse.rooms.size(); ++i) check("room " + rooms[i], pulse.rooms[i]);
  return text.str();
}

std::string why_not_ready(const ServerPulse& pulse, const std::vector<std::string>& rooms, LocalTime now) {
  if (pulse.is_stopping) return "the server is stopping";
  if (!pulse.is_serving) return "the server does not listen yet";
  return standstill(pulse, rooms, now);
}

}  // namespace tandem::server
