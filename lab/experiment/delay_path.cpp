#include "lab/experiment/delay_path.hpp"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "common/base/folders.hpp"
#include "common/base/json_fields.hpp"

namespace tandem::lab {
namespace {

namespace fs = std::filesystem;

fs::path file_called(const std::string& name, const fs::path& directory) {
  if (fs::path(name).extension() == ".json") return directory / name;
  const fs::path folder = data_folder() / "links";
  const fs::path shipped = folder / (name + ".json");
  if (name.find('/') == std::string::npos && fs::is_regular_file(shipped)) return shipped;
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".json") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  std::string known;
  for (const std::string& each : names) known.append(known.empty() ? "" : ", ").append(each);
  throw std::invalid_argument("delay_path is \"" + name + "\"; it must be a .json file or shipped: " + known);
}

}  // namespace

net::DelayPath delay_path_called(const std::string& name, const fs::path& directory) {
  constexpr double kMaxLength_s = 86400, kMaxDelay_ms = 10000;
  net::DelayPath path;
  if (name.empty()) return path;
  path.name = name;
  const fs::path file = file_called(name, directory);
  JsonFields fields(parse_json(read_text_file(file), file.string()), file.string());
  fields.text("description", "");
  path.starts_anywhere = fields.boolean("starts_anywhere", true);
  const std::vector<double> times_s = fields.numbers("times_s", 0, kMaxLength_s);
  const std::vector<double> delays_ms = fields.numbers("delays_ms", 0, kMaxDelay_ms);
  fields.finish();
  if (times_s.size() < 2 || times_s.size() != delays_ms.size()) {
    fields.fail("delays_ms", "times_s and delays_ms must have the same number of values, two or more");
  }
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    path.points.push_back({from_seconds(times_s[i]), from_seconds(delays_ms[i] * 1e-3)});
  }
  net::LinkParameters link;
  link.delay_path = path;
  if (const std::string problem = link.problem(); !problem.empty()) fields.fail("times_s", problem);
  return path;
}

}  // namespace tandem::lab
