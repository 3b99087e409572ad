#include "server/app/server_report.hpp"

#include "proto/drop_reason.hpp"

namespace tandem::server {
namespace {

boost::json::object quantiles_us(const Histogram& histogram) {
  const auto us = [](Duration duration) { return to_seconds(duration) * 1e6; };
  return {{"p50", us(histogram.quantile(0.5))},
          {"p99", us(histogram.quantile(0.99))},
          {"p999", us(histogram.quantile(0.999))},
          {"max", us(histogram.max())}};
}

boost::json::object drops(const proto::DropCounters& counters) {
  boost::json::object object;
  for (std::size_t i = 1; i < static_cast<std::size_t>(proto::DropReason::kCount); ++i) {
    const auto reason = static_cast<proto::DropReason>(i);
    if (counters.count(reason) > 0) object[proto::name_of(reason)] = counters.count(reason);
  }
  return object;
}

boost::json::object refusals(const HubCounters& counters) {
  boost::json::object object;
  for (std::size_t code = 0; code < counters.refusals.size(); ++code) {
    if (counters.refusals[code] > 0) object[wire::ErrorCode_Name(static_cast<int>(code))] = counters.refusals[code];
  }
  return object;
}

boost::json::object recording(const RoomRecorder& recorder) {
  return {{"file", recorder.file().path().string()},          {"files", recorder.file().parts()},
          {"bytes", recorder.file().bytes_written()},         {"messages", recorder.file().messages_written()},
          {"messages_lost", recorder.file().messages_lost()}, {"steps_lost", recorder.steps_lost()}};
}

}  // namespace

boost::json::object report_json(const LiveServer& server, const ServerRecorder* recorder) {
  const std::vector<RoomTiming> timings = server.room_timings();
  boost::json::array rooms;
  for (std::size_t i = 0; i < timings.size(); ++i) {
    const RoomTiming& timing = timings[i];
    const std::vector<std::string>& notes = server.rooms()[i]->scene().notes;
    rooms.push_back(boost::json::object{{"name", server.rooms()[i]->name()},
                                        {"notes", boost::json::array(notes.begin(), notes.end())},
                                        {"steps", timing.steps},
                                        {"overruns", timing.overruns},
                                        {"missed", timing.missed},
                                        {"slow", timing.slow},
                                        {"lateness_us", quantiles_us(timing.lateness)},
                                        {"step_time_us", quantiles_us(timing.step_time)}});
    if (recorder != nullptr) rooms.back().as_object()["recording"] = recording(*recorder->rooms()[i]);
  }
  const HubCounters& counters = server.counters();
  return {{"program", "tandem-server"},
          {"version", TANDEM_VERSION},
          {"port", server.port()},
          {"up_s", to_seconds(server.up())},
          {"joins", counters.joins},
          {"refusals", refusals(counters)},
          {"failed_handshakes", server.failed_handshakes()},
          {"datagrams", boost::json::object{{"received", counters.datagrams_received},
                                            {"sent", counters.datagrams_sent},
                                            {"received_drops", drops(counters.received_drops)},
                                            {"sent_drops", drops(counters.sent_drops)},
                                            {"items_thinned", counters.bodies_thinned},
                                            {"suppressed", counters.updates_suppressed},
                                            {"paced", counters.updates_paced}}},
          {"rooms", std::move(rooms)}};
}

}  // namespace tandem::server
