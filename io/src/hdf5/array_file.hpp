#pragma once

#include "outputs/modules.hpp"

namespace bsp2::io {

/// See Hdf5Module::write_arrays.
void write_arrays(const std::filesystem::path& path, const std::vector<Hdf5Array>& arrays,
                  const std::string& names);

}  // namespace bsp2::io
