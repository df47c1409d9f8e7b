#include "hdf5/array_file.hpp"

#include <array>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "hdf5/hdf5.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using hdf5::check;
using hdf5::Handle;

template <typename T>
void write_values(hid_t file, const Hdf5Array& array, const T* values) {
  const std::array<hsize_t, 2> size{array.rows, array.columns};
  const Handle space(H5Screate_simple(array.columns == 1 ? 1 : 2, size.data(), nullptr), H5Sclose);
  const hid_t in_memory = std::is_same_v<T, double> ? H5T_NATIVE_DOUBLE : H5T_NATIVE_INT64;
  const hid_t in_file = std::is_same_v<T, double> ? H5T_IEEE_F64LE : H5T_STD_I64LE;
  const Handle dataset(H5Dcreate2(file, array.name, in_file, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
                       H5Dclose);
  if (array.rows > 0) check(H5Dwrite(dataset, in_memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, values));
}

}  // namespace

void write_arrays(const fs::path& path, const std::vector<Hdf5Array>& arrays, const std::string& names) {
  const hdf5::Silence silence;
  fs::path unfinished = path;
  unfinished += ".unfinished";
  try {
    Handle file(H5Fcreate(unfinished.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
    for (const Hdf5Array& array : arrays)
      array.reals != nullptr ? write_values(file, array, array.reals)
                             : write_values(file, array, array.integers);
    hdf5::write_attribute(file, "names", names);
    file.close();
    fs::rename(unfinished, path);
  } catch (const std::exception& error) {
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    throw Error("cannot write '" + path.string() + "': " + error.what());
  }
}

}  // namespace bsp2::io
