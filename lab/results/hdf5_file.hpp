// Writes HDF5 files: groups, attributes, and a dataset for each column of a table.
#pragma once

#include <hdf5.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "lab/report/csv.hpp"

namespace tandem::lab {

/// Owns a handle of the HDF5 library and closes it on destruction. `close` is the library's function for this kind of
/// handle, such as H5Fclose for a file.
/// Fails   std::runtime_error: the handle is invalid
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

/// Creates the file under a temporary name, calls `fill` to write its content, and then renames it.
/// Fails   std::runtime_error: the file cannot be written
void write_hdf5(const std::filesystem::path& file, const std::function<void(hid_t)>& fill);

/// Replaces slashes in a name, because HDF5 would create a group at each slash.
std::string hdf5_name(std::string name);
Hdf5Handle hdf5_group(hid_t parent, const std::string& name);
// These functions write attributes. Fails: std::runtime_error if the disk is full.
void write_hdf5_number(hid_t object, const std::string& name, double value);
void write_hdf5_text(hid_t object, const std::string& name, const std::string& value);
/// Writes a group with a dataset for each column. The group has no time stamp, so that the same data give the same
/// file.
void write_hdf5_table(hid_t parent, const std::string& name, const CsvTable& table);

}  // namespace tandem::lab
