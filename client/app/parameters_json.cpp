// See parameters_json.hpp.
#include "client/app/parameters_json.hpp"

#include <string_view>

namespace tandem::client {
namespace {

namespace json = boost::json;

double in_ms(Duration duration) {
  return to_seconds(duration) * 1e3;
}

std::string_view name_of(net::JitterDistribution distribution) {
  switch (distribution) {
    case net::JitterDistribution::kPareto:
      return "pareto";
    case net::JitterDistribution::kTrace:
      return "trace";
    case net::JitterDistribution::kNormal:
      break;
  }
  return "normal";
}

}  // namespace

json::object to_json(const net::LinkParameters& link) {
  json::object result{{"delay_ms", in_ms(link.delay)},
                      {"jitter_ms", in_ms(link.jitter)},
                      {"jitter_correlation_ms", in_ms(link.jitter_correlation)},
                      {"distribution", name_of(link.distribution)},
                      {"delay_path", link.delay_path.name},
                      {"reordering", link.allows_reordering},
                      {"loss", link.loss},
                      {"bad_period_ms", in_ms(link.mean_bad_period)},
                      {"duplication", link.duplication},
                      {"rate_limit_bytes_per_s", link.rate_limit_bytes_per_s},
                      {"queue_limit", link.queue_limit}};
  if (!link.trace.empty()) {
    json::array& trace = result["trace_ms"].emplace_array();
    for (const Duration delay : link.trace) trace.push_back(in_ms(delay));
  }
  return result;
}

json::object to_json(const devices::HandParameters& hand) {
  return {{"mass_kg", hand.mass_kg},
          {"stiffness_n_per_m", hand.stiffness_n_per_m},
          {"damping_n_s_per_m", hand.damping_n_s_per_m},
          {"inertia_kg_m2", hand.inertia_kg_m2},
          {"stiffness_n_m_per_rad", hand.stiffness_n_m_per_rad},
          {"damping_n_m_s_per_rad", hand.damping_n_m_s_per_rad},
          {"tremor_rms_n", hand.tremor_rms_n},
          {"tremor_hz", hand.tremor_hz},
          {"encoder_step_m", hand.encoder_step_m},
          {"encoder_step_rad", hand.encoder_step_rad}};
}

}  // namespace tandem::client
