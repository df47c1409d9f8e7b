#include "modules.hpp"

namespace bsp2::io {

const char* const module_layout = BSP2_MODULE_LAYOUT;

const VtkModule& vtk_module() {
  static const void* const module = load_module("bsp2-vtk", module_folder(), module_layout);
  return *static_cast<const VtkModule*>(module);
}

const Hdf5Module& hdf5_module() {
  static const void* const module = load_module("bsp2-hdf5", module_folder(), module_layout);
  return *static_cast<const Hdf5Module*>(module);
}

}  // namespace bsp2::io
