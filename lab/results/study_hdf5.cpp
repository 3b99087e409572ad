#include "lab/results/study_hdf5.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/report/csv.hpp"
#include "lab/results/hdf5_file.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

void write_value(hid_t object, const std::string& name, const json::value& value) {
  if (value.is_null()) {
    write_hdf5_number(object, name, std::numeric_limits<double>::quiet_NaN());
  } else if (value.is_number()) {
    write_hdf5_number(object, name, value.to_number<double>());
  } else if (value.is_bool()) {
    write_hdf5_number(object, name, value.get_bool() ? 1 : 0);
  } else {
    write_hdf5_text(object, name, value.is_string() ? std::string(value.get_string()) : compact_json(value));
  }
}

void write_fields(hid_t object, const json::object& fields) {
  for (const auto& field : fields) {
    if (field.key() != "users") write_value(object, std::string(field.key()), field.value());
  }
}

void write_samples(hid_t trial, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool is_of_a_user = !name.empty() && name[0] >= '1' && name[0] <= '9';
    if (entry.path().extension() == ".csv" && (is_of_a_user || name == "bodies.csv")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  const Hdf5Handle samples = hdf5_group(trial, "samples");
  for (const auto& file : files) {
    write_hdf5_table(samples.id(), file.stem().string(), read_csv(file));
  }
}

void write_users(hid_t trial, const json::object& row) {
  const json::value* list = row.if_contains("users");
  if (list == nullptr || !list->is_array()) return;
  const Hdf5Handle users = hdf5_group(trial, "users");
  for (const json::value& user : list->get_array()) {
    const std::string name(user.at("name").as_string());
    write_fields(hdf5_group(users.id(), hdf5_name(name)).id(), user.as_object());
  }
}

std::string number_name(std::size_t index) {
  const std::string digits = std::to_string(index);
  return std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

}  // namespace

void write_study_hdf5(const std::filesystem::path& file, std::span<const TrialResult> results) {
  write_hdf5(file, [results](hid_t out) {
    const Hdf5Handle trials = hdf5_group(out, "trials");
    for (std::size_t i = 0; i < results.size(); ++i) {
      const Hdf5Handle trial = hdf5_group(trials.id(), number_name(i));
      write_fields(trial.id(), results[i].row);
      write_users(trial.id(), results[i].row);
      if (!results[i].samples.empty()) write_samples(trial.id(), results[i].samples);
    }
  });
}

}  // namespace tandem::lab
