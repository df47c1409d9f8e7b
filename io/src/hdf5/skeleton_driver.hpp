#pragma once

#include <cstdint>
#include <vector>

#include "hdf5/hdf5.hpp"

namespace bsp2::io::hdf5 {

/// While one lives, files are made of which HDF5 writes all but the raw data: these it gives a place, and we
/// keep where that is. Whoever has the data writes them there without HDF5, whose own way for several
/// processes takes many times as long as one process does. One at a time in a process.
class SkeletonDriver {
 public:
  SkeletonDriver();
  ~SkeletonDriver();
  SkeletonDriver(const SkeletonDriver&) = delete;
  SkeletonDriver& operator=(const SkeletonDriver&) = delete;

  /// Lets files of this access list be written so.
  void set(hid_t file_access) const;
  /// Where raw data belong, in the order in which HDF5 was given them, since this was asked last.
  static std::vector<std::uint64_t> take_places();

 private:
  hid_t id_;
};

}  // namespace bsp2::io::hdf5
