#include "hdf5/array_file.hpp"
#include "hdf5/snapshot_format.hpp"
#include "outputs/modules.hpp"

BSP2_DEFINE_MODULE(bsp2::io::Hdf5Module, bsp2::io::snapshot::write, bsp2::io::snapshot::read,
                   bsp2::io::snapshot::is_of_others, bsp2::io::snapshot::add_surface,
                   bsp2::io::snapshot::read_surface, bsp2::io::write_arrays)
