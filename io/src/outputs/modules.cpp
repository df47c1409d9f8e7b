#include "outputs/modules.hpp"

namespace bsp2::io {

const char* const module_layout = BSP2_MODULE_LAYOUT;

const VtkModule& vtk_module() { return loaded_module<VtkModule>(module_layout); }

const Hdf5Module& hdf5_module() { return loaded_module<Hdf5Module>(module_layout); }

const OcctModule& occt_module() { return loaded_module<OcctModule>(module_layout); }

const PdfModule& pdf_module() { return loaded_module<PdfModule>(module_layout); }

}  // namespace bsp2::io
