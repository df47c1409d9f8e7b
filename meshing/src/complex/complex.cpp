#include "bsp2/meshing/complex/complex.hpp"

#include "bsp2/geometry/surface/plane_names.hpp"
#include "complex/complex_maker.hpp"

namespace bsp2::meshing {

Complex conforming_complex(const geometry::HyperplaneTable<3>& table,
                           std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
                           unsigned threads) {
  ComplexMaker maker(table, geometry::family_planes(table, batches), threads);
  maker.load(batches);
  return maker.run();
}

}  // namespace bsp2::meshing
