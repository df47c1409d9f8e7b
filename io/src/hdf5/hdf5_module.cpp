#include "outputs/modules.hpp"
#include "hdf5/snapshot_format.hpp"

BSP2_DEFINE_MODULE(bsp2::io::Hdf5Module, bsp2::io::snapshot::write, bsp2::io::snapshot::read)
