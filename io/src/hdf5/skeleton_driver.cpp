#include "hdf5/skeleton_driver.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>
#include <utility>

#include "files/replacing.hpp"

namespace bsp2::io::hdf5 {
namespace {

std::vector<std::uint64_t> places;

/// As HDF5 wants it: what it knows of a file comes first.
struct File {
  H5FD_t known;
  int descriptor;
  haddr_t allocated, size;
};

File* of(H5FD_t* file) { return reinterpret_cast<File*>(file); }
const File* of(const H5FD_t* file) { return reinterpret_cast<const File*>(file); }

/// What HDF5 says of it is what the system says. @return what HDF5 takes for a failure.
herr_t failed(const char* function, unsigned line) {
  const std::string reason = std::generic_category().message(errno);
  H5Epush2(H5E_DEFAULT, __FILE__, function, line, H5E_ERR_CLS, H5E_IO, H5E_WRITEERROR, "%s", reason.c_str());
  return -1;
}

H5FD_t* open_file(const char* name, unsigned, hid_t, haddr_t) {
  const int descriptor = ::open(name, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) {
    failed(__func__, __LINE__);
    return nullptr;
  }
  return &(new File{{}, descriptor, 0, 0})->known;
}

herr_t close_file(H5FD_t* file) {
  const std::unique_ptr<File> ended(of(file));
  return ::close(ended->descriptor) == 0 ? 0 : failed(__func__, __LINE__);
}

herr_t query(const H5FD_t*, unsigned long* features) {
  if (features != nullptr)
    *features = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_AGGREGATE_SMALLDATA;
  return 0;
}

haddr_t allocated(const H5FD_t* file, H5FD_mem_t) { return of(file)->allocated; }
herr_t allocate(H5FD_t* file, H5FD_mem_t, haddr_t end) {
  of(file)->allocated = end;
  return 0;
}
haddr_t size(const H5FD_t* file, H5FD_mem_t) { return of(file)->size; }

/// What has never been written is 0.
herr_t read(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, std::size_t bytes, void* to) {
  auto* begin = static_cast<char*>(to);
  while (bytes > 0) {
    const ssize_t part = ::pread(of(file)->descriptor, begin, bytes, static_cast<off_t>(at));
    if (part < 0 && errno == EINTR) continue;
    if (part < 0) return failed(__func__, __LINE__);
    if (part == 0) {
      std::memset(begin, 0, bytes);
      return 0;
    }
    begin += part;
    at += static_cast<haddr_t>(part);
    bytes -= static_cast<std::size_t>(part);
  }
  return 0;
}

herr_t write(H5FD_t* file, H5FD_mem_t kind, hid_t, haddr_t at, std::size_t bytes, const void* from) {
  of(file)->size = std::max(of(file)->size, at + bytes);
  if (kind == H5FD_MEM_DRAW) {
    places.push_back(at);
    return 0;
  }
  return write_at(of(file)->descriptor, at, from, bytes) ? 0 : failed(__func__, __LINE__);
}

herr_t truncate(H5FD_t* file, hid_t, hbool_t) {
  if (::ftruncate(of(file)->descriptor, static_cast<off_t>(of(file)->allocated)) != 0)
    return failed(__func__, __LINE__);
  of(file)->size = of(file)->allocated;
  return 0;
}

H5FD_class_t make_class() {
  H5FD_class_t driver{};
  driver.name = "bsp2_skeleton";
  driver.maxaddr = (haddr_t{1} << 63) - 1;
  driver.fc_degree = H5F_CLOSE_STRONG;
  driver.open = open_file;
  driver.close = close_file;
  driver.query = query;
  driver.get_eoa = allocated;
  driver.set_eoa = allocate;
  driver.get_eof = size;
  driver.read = read;
  driver.write = write;
  driver.truncate = truncate;
  constexpr H5FD_mem_t shared[] = H5FD_FLMAP_DICHOTOMY;  // raw data, and all else
  std::copy(std::begin(shared), std::end(shared), driver.fl_map);
  return driver;
}

}  // namespace

SkeletonDriver::SkeletonDriver() : id_(-1) {
  static const H5FD_class_t driver = make_class();
  id_ = check(H5FDregister(&driver));
  places.clear();
}

SkeletonDriver::~SkeletonDriver() { H5FDunregister(id_); }

void SkeletonDriver::set(hid_t file_access) const { check(H5Pset_driver(file_access, id_, nullptr)); }

std::vector<std::uint64_t> SkeletonDriver::take_places() { return std::exchange(places, {}); }

}  // namespace bsp2::io::hdf5
