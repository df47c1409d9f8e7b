// Snapshots: the file as HDF5 with its arrays, and the archives in it. The first byte says which of them the
// input is.
#include <boost/archive/archive_exception.hpp>
#include <span>

#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "fuzz.hpp"

namespace {

template <typename T>
void read_archive(std::span<const char> bytes) {
  try {
    T object;
    bsp2::dataflow::from_bytes(bytes, object);
  } catch (const boost::archive::archive_exception&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return -1;
  if (data[0] != 0x89) {  // the first byte of an HDF5 file
    const std::span<const char> bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
    if (data[0] % 2 == 0)
      read_archive<bsp2::dataflow::Region<3>>(bytes);
    else
      read_archive<bsp2::geometry::CellBatch>(bytes);
    return 0;
  }
  const auto file = bsp2::fuzzing::file_of(data, size, ".h5");
  try {
    bsp2::io::read_surface(file, 2, true);
  } catch (const bsp2::Error&) {
  }
  try {
    bsp2::io::read_snapshot(file);
  } catch (const bsp2::Error&) {
  }
  return 0;
}
