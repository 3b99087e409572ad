// HDF5 as the lab writes it: groups, attributes, and a dataset for each column of a table.
#pragma once

#include <hdf5.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// A handle of the library; every kind has its own way to be closed.
/// Fails   std::runtime_error: the library could not make it
class Hdf5Handle {
 public:
  Hdf5Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what);
  ~Hdf5Handle() { close_(id_); }
  Hdf5Handle(const Hdf5Handle&) = delete;
  Hdf5Handle& operator=(const Hdf5Handle&) = delete;
  hid_t id() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Makes the file, lets `fill` write into it, and gives it its name only then.
/// Fails   std::runtime_error: it cannot be written
void write_hdf5(const std::filesystem::path& file, const std::function<void(hid_t)>& fill);

/// Fit for a name: a slash would be a group of its own.
std::string hdf5_name(std::string name);
Hdf5Handle hdf5_group(hid_t parent, const std::string& name);
// Attributes. Fail: std::runtime_error, the disk takes no more.
void write_hdf5_number(hid_t object, const std::string& name, double value);
void write_hdf5_text(hid_t object, const std::string& name, const std::string& value);
/// A group with a dataset a column; without the time of writing, so that the same data give the same file.
void write_hdf5_table(hid_t parent, const std::string& name, const CsvTable& table);

}  // namespace tandem::lab
