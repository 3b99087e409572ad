#include "lab/results/hdf5_file.hpp"

#include <algorithm>
#include <stdexcept>

namespace tandem::lab {
namespace {

void check(herr_t status, const std::string& what) {
  if (status < 0) throw std::runtime_error(what + ": could not be written; is the disk full?");
}

void write_column(hid_t group, const std::string& name, const std::vector<double>& values) {
  const hsize_t size = values.size();
  const Hdf5Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose, name);
  // Time stamps are omitted, so that the same study gives the same file.
  const Hdf5Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, name);
  check(H5Pset_obj_track_times(properties.id(), false), name);
  const Hdf5Handle dataset(
      H5Dcreate2(group, name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, properties.id(), H5P_DEFAULT), H5Dclose,
      name);
  check(H5Dwrite(dataset.id(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), name);
}

}  // namespace

Hdf5Handle::Hdf5Handle(hid_t id, herr_t (*close)(hid_t), const std::string& what) : id_(id), close_(close) {
  if (id < 0) throw std::runtime_error(what + ": HDF5 could not make it; check the folder's rights and free space");
}

std::string hdf5_name(std::string name) {
  std::replace(name.begin(), name.end(), '/', '_');
  return name.empty() || name == "." ? "_" : name;
}

Hdf5Handle hdf5_group(hid_t parent, const std::string& name) {
  return Hdf5Handle(H5Gcreate2(parent, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose, name);
}

void write_hdf5_number(hid_t object, const std::string& name, double value) {
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Hdf5Handle attribute(H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space.id(), H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose, name);
  check(H5Awrite(attribute.id(), H5T_NATIVE_DOUBLE, &value), name);
}

void write_hdf5_text(hid_t object, const std::string& name, const std::string& value) {
  const Hdf5Handle type(H5Tcopy(H5T_C_S1), H5Tclose, name);
  check(H5Tset_size(type.id(), value.size() + 1), name);
  check(H5Tset_cset(type.id(), H5T_CSET_UTF8), name);
  const Hdf5Handle space(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Hdf5Handle attribute(H5Acreate2(object, name.c_str(), type.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT),
                             H5Aclose, name);
  check(H5Awrite(attribute.id(), type.id(), value.c_str()), name);
}

void write_hdf5_table(hid_t parent, const std::string& name, const CsvTable& table) {
  const Hdf5Handle group = hdf5_group(parent, hdf5_name(name));
  for (std::size_t i = 0; i < table.names.size(); ++i) {
    write_column(group.id(), hdf5_name(table.names[i]), table.columns[i]);
  }
}

void write_hdf5(const std::filesystem::path& file, const std::function<void(hid_t)>& fill) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // disables error output of the library, because errors are thrown
  const std::string unfinished = file.string() + ".unfinished";
  try {
    const Hdf5Handle out(H5Fcreate(unfinished.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose,
                         file.string());
    fill(out.id());
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw;
  }
  std::filesystem::rename(unfinished, file);
}

}  // namespace tandem::lab
