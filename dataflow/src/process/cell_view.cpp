#include "bsp2/dataflow/process/cell_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

template <int D>
CellExtent<D>::CellExtent(const geometry::Cell<D>& cell) {
  const geometry::VertexRange<D> range = geometry::vertex_range(cell);
  for (int i = 0; i < D; ++i) {
    const double low = this->lower[i] = range.lower[i] - range.error;
    const double high = this->upper[i] = range.upper[i] + range.error;
    centre[i] = range.sum[i] / static_cast<double>(cell.vertices().size());
    middle[i] = (low + high) / 2;
    half[i] = (high - low) / 2 * (1 + 0x1p-40);
  }
}

template <int D>
double CellExtent<D>::radius(const geometry::Cell<D>& cell) const {
  double square = 0, error = 0;
  for (const auto& vertex : cell.vertices()) {
    double sum = 0;
    for (int i = 0; i < D; ++i) sum += (vertex.x[i] - centre[i]) * (vertex.x[i] - centre[i]);
    square = std::max(square, sum);
    error = std::max(error, vertex.error);
  }
  return std::sqrt(square) * (1 + 0x1p-40) + error;
}

template <int D>
std::array<int, D> CellExtent<D>::axes_by_length() const {
  std::array<int, D> axes;
  for (int i = 0; i < D; ++i) axes[i] = i;
  std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return length(a) > length(b); });
  return axes;
}

template <int D>
double CellView<D>::thickness() const {
  if constexpr (D == 1) {
    return extent_.length(0);
  } else {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t facet = 0; facet < cell_->facet_count(); ++facet) {
      const auto plane = cell_->facet_hyperplane(facet);
      const auto h = table().rounded(plane.id());
      double furthest = 0;
      for (const auto& vertex : cell_->vertices())
        furthest = std::max(furthest, std::fabs(h.at(vertex.x)) + vertex.error);
      least = std::min(least, furthest + h.error);
    }
    return least;
  }
}

#define BSP2_INSTANTIATE(D)      \
  template struct CellExtent<D>; \
  template class CellView<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
