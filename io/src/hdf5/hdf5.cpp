#include "hdf5/hdf5.hpp"

#include <algorithm>
#include <string_view>

namespace bsp2::io::hdf5 {
namespace {

/// A file that could not be closed, since the disk was full, stays in HDF5's tables, and its clean-up when
/// the program ends stumbles over it. All that we open we close ourselves, so there is nothing left for it to
/// do.
[[maybe_unused]] const bool leaves_exit_alone = H5dont_atexit() >= 0;

}  // namespace

std::string last_error() {
  std::string text;
  const auto keep_deepest = [](unsigned, const H5E_error2_t* error, void* data) -> herr_t {
    if (error->desc != nullptr && *error->desc != '\0') *static_cast<std::string*>(data) = error->desc;
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, keep_deepest, &text);
  // Of a failed call of the system HDF5 tells all, over two lines; the system's reason is what users need.
  constexpr std::string_view reason = "error message = '";
  if (const auto at = text.find(reason); at != std::string::npos) {
    const auto begin = at + reason.size();
    return text.substr(begin, text.find('\'', begin) - begin);
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.empty() ? "HDF5 gives no reason" : text;
}

void write_attribute(hid_t object, const char* name, const std::string& value) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  check(H5Tset_size(type, value.size() + 1));
  check(H5Tset_cset(type, H5T_CSET_UTF8));
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  check(H5Awrite(attribute, type, value.c_str()));
}

std::string read_text_attribute(hid_t object, const char* name) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Handle type(H5Aget_type(attribute), H5Tclose);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0)
    throw Failure(std::string("the attribute ") + name + " is no text");
  std::vector<char> text(H5Tget_size(type) + 1, '\0');
  check(H5Aread(attribute, type, text.data()));
  return text.data();
}

std::uint64_t row_count(hid_t dataset, const std::string& name, std::size_t columns) {
  const Handle space(H5Dget_space(dataset), H5Sclose);
  std::array<hsize_t, 2> size{0, 1};
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank != (columns == 1 ? 1 : 2)) throw Failure("the array " + name + " has another shape than expected");
  check(H5Sget_simple_extent_dims(space, size.data(), nullptr));
  if (size[1] != columns) throw Failure("the array " + name + " has another shape than expected");
  return size[0];
}

std::uint64_t array_length(hid_t file, const char* name) {
  const Handle dataset(H5Dopen2(file, name, H5P_DEFAULT), H5Dclose);
  const Handle space(H5Dget_space(dataset), H5Sclose);
  return static_cast<std::uint64_t>(check(H5Sget_simple_extent_npoints(space)));
}

std::string read_text(hid_t file, const std::string& name) {
  const std::vector<char> characters = read_array<char>(file, name);
  return {characters.begin(), characters.end()};
}

}  // namespace bsp2::io::hdf5
