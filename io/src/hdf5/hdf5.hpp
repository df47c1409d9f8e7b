#pragma once

#include <hdf5.h>

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

/// HDF5 with owners and exceptions: as much of it as snapshots need.
namespace bsp2::io::hdf5 {

/// An HDF5 call failed. What HDF5 itself has to say about it is kept as text.
class Failure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The first cause on HDF5's error stack.
std::string last_error();

template <typename T>
T check(T result) {
  if (result < 0) throw Failure(last_error());
  return result;
}

/// Owns an HDF5 identifier.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle(hid_t id, Close function) : id_(check(id)), close_(function) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }
  /// Closes it now. @throws Failure: a file may fail at the last moment.
  void close() { check(close_(std::exchange(id_, -1))); }

 private:
  hid_t id_;
  Close close_;
};

/// While one lives, HDF5 prints nothing.
class Silence {
 public:
  Silence() {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Silence() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

// The types of our arrays: in memory, and in files (the same on all machines).
template <typename T>
hid_t memory_type();
template <typename T>
hid_t file_type();

#define BSP2_HDF5_TYPE(T, MEMORY, FILE) \
  template <>                           \
  inline hid_t memory_type<T>() {       \
    return MEMORY;                      \
  }                                     \
  template <>                           \
  inline hid_t file_type<T>() {         \
    return FILE;                        \
  }
BSP2_HDF5_TYPE(double, H5T_NATIVE_DOUBLE, H5T_IEEE_F64LE)
BSP2_HDF5_TYPE(std::uint8_t, H5T_NATIVE_UINT8, H5T_STD_U8LE)
BSP2_HDF5_TYPE(std::uint16_t, H5T_NATIVE_UINT16, H5T_STD_U16LE)
BSP2_HDF5_TYPE(std::uint32_t, H5T_NATIVE_UINT32, H5T_STD_U32LE)
BSP2_HDF5_TYPE(std::uint64_t, H5T_NATIVE_UINT64, H5T_STD_U64LE)
BSP2_HDF5_TYPE(std::int32_t, H5T_NATIVE_INT32, H5T_STD_I32LE)
BSP2_HDF5_TYPE(char, H5T_NATIVE_UINT8, H5T_STD_U8LE)  // bytes: never converted
#undef BSP2_HDF5_TYPE

template <typename T>
void write_attribute(hid_t object, const char* name, T value) {
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, file_type<T>(), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(H5Awrite(attribute, memory_type<T>(), &value));
}
template <typename T>
T read_attribute(hid_t object, const char* name) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  if (H5Sget_simple_extent_npoints(space) != 1)
    throw Failure(std::string("the attribute ") + name + " is no single number");
  T value{};
  check(H5Aread(attribute, memory_type<T>(), &value));
  return value;
}
void write_attribute(hid_t object, const char* name, const std::string& value);
std::string read_text_attribute(hid_t object, const char* name);

/// The number of rows. @param columns expected width of them; 1: a plain list. @throws Failure if it has
/// another shape.
std::uint64_t row_count(hid_t dataset, const std::string& name, std::size_t columns);

/// A whole array.
template <typename T>
std::vector<T> read_array(hid_t file, const std::string& name, std::size_t columns = 1) {
  const Handle dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  std::vector<T> values(row_count(dataset, name, columns) * columns);
  if (!values.empty())
    check(H5Dread(dataset, memory_type<T>(), H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()));
  return values;
}

/// Some rows of an array. @param rows begins and ends, ascending.
template <typename T>
std::vector<T> read_rows(hid_t file, const std::string& name,
                         const std::vector<std::pair<std::uint64_t, std::uint64_t>>& rows,
                         std::size_t columns = 1) {
  const Handle dataset(H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  const std::uint64_t length = row_count(dataset, name, columns);
  std::uint64_t wanted = 0;
  for (const auto& [begin, end] : rows) {
    if (end > length) throw Failure("the array " + name + " is too short");
    wanted += end - begin;
  }
  std::vector<T> values(wanted * columns);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  std::size_t at = 0;
  for (const auto& [begin, end] : rows) {
    if (begin == end) continue;
    const std::array<hsize_t, 2> start{begin, 0}, count{end - begin, columns};
    check(H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
    const Handle memory(H5Screate_simple(columns == 1 ? 1 : 2, count.data(), nullptr), H5Sclose);
    check(H5Dread(dataset, memory_type<T>(), memory, space, H5P_DEFAULT, values.data() + at));
    at += (end - begin) * columns;
  }
  return values;
}
std::uint64_t array_length(hid_t file, const char* name);
std::string read_text(hid_t file, const std::string& name);

}  // namespace bsp2::io::hdf5
