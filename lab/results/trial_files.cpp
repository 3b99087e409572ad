#include "lab/results/trial_files.hpp"

#include <stdexcept>
#include <string>

#include "common/base/json_fields.hpp"
#include "common/base/json_pretty.hpp"
#include "lab/results/output_files.hpp"
#include "lab/results/output_folder.hpp"
#include "lab/results/results.hpp"

namespace tandem::lab {
namespace {

// Converts a user name to a file name, because user names may contain any character.
std::string file_name(const std::string& user_name, std::size_t index) {
  std::string result;
  for (const char c : user_name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-';
    result += is_plain ? c : '_';
  }
  return std::to_string(index + 1) + "-" + result + ".csv";
}

}  // namespace

TrialFiles::TrialFiles(const Experiment& experiment, const std::filesystem::path& folder)
    : experiment_(experiment), folder_(made_folder(folder.string())) {
  std::filesystem::remove(folder_ / "trial.json");
  const auto every = static_cast<std::uint64_t>(experiment.sample_period / kHapticPeriod);
  for (std::size_t i = 0; i < experiment.users.size(); ++i) {
    traces_.push_back(std::make_unique<client::TraceWriter>(folder_ / file_name(experiment.users[i].name, i), every));
  }
}

void TrialFiles::finish(const SessionTrace& trace, const std::string& key, const HtmlReport& report) {
  for (const auto& writer : traces_) {
    if (!writer->flush()) {
      throw std::runtime_error(folder_.string() + ": a trace could not be written; is the disk full?");
    }
  }
  boost::json::object details{{"key", key}};
  for (const auto& field : results_json(experiment_, trace)) details[field.key()] = field.value();
  // Files are written in the order of their names, so trial.json is the last one.
  write_all_files(folder_.string(),
                  with_report({{"bodies.csv", bodies_csv(trace)}, {"trial.json", pretty_json(details)}}, report));
}

bool has_trial_files(const std::filesystem::path& folder, const std::string& key) {
  const std::filesystem::path file = folder / "trial.json";
  if (!std::filesystem::is_regular_file(file)) return false;
  try {
    const boost::json::value details = parse_json(read_text_file(file), file.string());
    const auto* own = details.is_object() ? details.get_object().if_contains("key") : nullptr;
    return own != nullptr && *own == boost::json::value(key);
  } catch (const std::exception&) {
    return false;  // a file is incomplete, so the trial runs again
  }
}

}  // namespace tandem::lab
