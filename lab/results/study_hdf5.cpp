#include "lab/results/study_hdf5.hpp"

#include <hdf5.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "common/base/json_pretty.hpp"
#include "lab/report/csv.hpp"

namespace tandem::lab {
namespace {

namespace json = boost::json;

/// A handle of the library; every kind has its own way to be closed.
class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
    if (id < 0) throw std::runtime_error(what + ": HDF5 could not make it; check the folder's rights and free space");
  }
  ~Handle() { close_(id_); }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  hid_t id() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

void check(herr_t status, const std::string& what) {
  if (status < 0) throw std::runtime_error(what + ": could not be written; is the disk full?");
}

/// A slash in a name would be a group of its own.
std::string plain(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name.empty() || name == "." ? "_" : name;
}

Handle group_in(hid_t parent, const std::string& name) {
  return Handle(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name);
}

void write_number(hid_t object, const std::string& name, double value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                         H5Aclose, name);
  check(H5Awrite(attribute.id(), H5T_NATIVE_DOUBLE, &value), name);
}

void write_text(hid_t object, const std::string& name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, name);
  check(H5Tset_size(type.id(), value.size() + 1), name);
  check(H5Tset_cset(type.id(), H5T_CSET_UTF8), name);
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute(H5Acreate2(object, name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         name);
  check(H5Awrite(attribute.id(), type.id(), value.c_str()), name);
}

void write_value(hid_t object, const std::string& name, const json::value& value) {
  if (value.is_null()) {
    write_number(object, name, std::numeric_limits<double>::quiet_NaN());
  } else if (value.is_number()) {
    write_number(object, name, value.to_number<double>());
  } else if (value.is_bool()) {
    write_number(object, name, value.get_bool() ? 1 : 0);
  } else {
    write_text(object, name, value.is_string() ? std::string(value.get_string()) : compact_json(value));
  }
}

void write_fields(hid_t object, const json::object& fields) {
  for (const auto& field : fields) {
    if (field.key() != "users") write_value(object, std::string(field.key()), field.value());
  }
}

void write_column(hid_t group, const std::string& name, const std::vector<double>& values) {
  const hsize_t size = values.size();
  const Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose, name);
  // Without the time of writing, so that the same study gives the same file.
  const Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, name);
  check(H5Pset_obj_track_times(properties.id(), false), name);
  const Handle dataset(
      H5Dcreate2(group, name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, properties.id(), H5P_DEFAULT), H5Dclose,
      name);
  check(H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), name);
}

void write_samples(hid_t trial, const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool is_of_a_user = !name.empty() && name[0] >= '1' && name[0] <= '9';
    if (entry.path().extension() == ".csv" && (is_of_a_user || name == "bodies.csv")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  const Handle samples = group_in(trial, "samples");
  for (const auto& file : files) {
    const CsvTable table = read_csv(file);
    const Handle group = group_in(samples.id(), plain(file.stem().string()));
    for (std::size_t i = 0; i < table.names.size(); ++i) {
      write_column(group.id(), plain(table.names[i]), table.columns[i]);
    }
  }
}

void write_users(hid_t trial, const json::object& row) {
  const json::value* list = row.if_contains("users");
  if (list == nullptr || !list->is_array()) return;
  const Handle users = group_in(trial, "users");
  for (const json::value& user : list->get_array()) {
    const std::string name(user.at("name").as_string());
    write_fields(group_in(users.id(), plain(name)).id(), user.as_object());
  }
}

std::string number_name(std::size_t index) {
  const std::string digits = std::to_string(index);
  return std::string(digits.size() < 4 ? 4 - digits.size() : 0, '0') + digits;
}

}  // namespace

void write_study_hdf5(const std::filesystem::path& file, std::span<const TrialResult> results) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors are thrown, not printed
  const std::string unfinished = file.string() + ".unfinished";
  {
    const Handle out(H5Fcreate(unfinished.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose, file.string());
    const Handle trials = group_in(out.id(), "trials");
    for (std::size_t i = 0; i < results.size(); ++i) {
      const Handle trial = group_in(trials.id(), number_name(i));
      write_fields(trial.id(), results[i].row);
      write_users(trial.id(), results[i].row);
      if (!results[i].samples.empty()) write_samples(trial.id(), results[i].samples);
    }
  }
  std::filesystem::rename(unfinished, file);
}

}  // namespace tandem::lab
