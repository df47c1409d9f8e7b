#include <cstring>

#include "modules.hpp"
#include "snapshot_format.hpp"

const void* bsp2_module(const char* layout) {
  static constexpr bsp2::io::Hdf5Module module{bsp2::io::snapshot::write, bsp2::io::snapshot::read};
  return std::strcmp(layout, BSP2_MODULE_LAYOUT) == 0 ? &module : nullptr;
}
