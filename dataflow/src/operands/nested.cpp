#include "operands/nested.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <type_traits>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/process/consumer.hpp"
#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "lowering/lowering.hpp"
#include "regions/even_regions.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Float128;
using geometry::Matrix;

class CellCollector : public Consumer {
 public:
  std::vector<geometry::CellBatch> batches;
  void consume(const std::shared_ptr<const Refinement>& refinement) override {
    batches.push_back(refinement->cells);
  }
};

/// Calls add(point) for the corners of a primitive in its own frame.
template <int D, typename Add>
void visit_corners(const model::Cuboid& cuboid, Add&& add) {
  for (unsigned corner = 0; corner < 1u << D; ++corner) {
    std::array<double, D> point;
    for (unsigned i = 0; i < D; ++i) point[i] = corner >> i & 1 ? cuboid.size[i] : 0;
    add(point);
  }
}

template <int D, typename Add>
void visit_corners(const model::Lathe& lathe, Add&& add) {
  if constexpr (D == 3) {
    for (std::uint32_t j = 0; j < lathe.sides; ++j) {
      const auto [c, s] = geometry::corner_direction(j, lathe.sides);
      for (const auto& [radius, z] : lathe.rings)
        add(std::array<double, 3>{radius * std::ldexp(static_cast<double>(c), -53),
                                  radius * std::ldexp(static_cast<double>(s), -53), z});
    }
  }
}

template <int D, typename Add>
void visit_corners(const model::TriangleMesh& mesh, Add&& add) {
  if constexpr (D == 3) {
    std::vector<bool> used(mesh.points.size());
    for (const auto& triangle : mesh.triangles)
      for (const std::uint32_t corner : triangle) used[corner] = true;
    for (std::size_t i = 0; i < used.size(); ++i)
      if (used[i]) add(mesh.points[i]);
  }
}

template <int D, typename Add>
void visit_corners(const model::RegularPolygon& polygon, Add&& add) {
  if constexpr (D == 2) {
    for (std::uint32_t j = 0; j < polygon.sides; ++j) {
      const auto [c, s] = geometry::corner_direction(j, polygon.sides);
      add(std::array<double, 2>{polygon.radius * std::ldexp(static_cast<double>(c), -53),
                                polygon.radius * std::ldexp(static_cast<double>(s), -53)});
    }
  }
}

template <int D, typename Add>
void visit_corners(const model::ConvexPolygon& polygon, Add&& add) {
  if constexpr (D == 2 || D == 3)
    for (const auto& point : polygon.points) {
      std::array<double, D> corner{};
      std::copy(point.begin(), point.end(), corner.begin());
      add(corner);
      if (D < 3) continue;
      corner[D - 1] = 1;
      add(corner);
    }
}

template <int D, typename Add>
void visit_corners(const model::Polytope& polytope, Add&& add) {
  for (std::size_t i = 0; i < polytope.corners.size(); i += D) {
    std::array<double, D> corner;
    std::copy_n(polytope.corners.begin() + static_cast<std::ptrdiff_t>(i), D, corner.begin());
    add(corner);
  }
}

template <int D, typename Add, typename Curved>
void visit_corners(const Curved&, Add&&) {
  throw std::logic_error("curved solids are enclosed or refused before their corners are asked for");
}

template <std::size_t D>
Points flat(const std::vector<std::array<double, D>>& points) {
  Points numbers;
  for (const auto& point : points) numbers.insert(numbers.end(), point.begin(), point.end());
  return numbers;
}

template <int D>
PointSet<D> placed_corners(const Occurrence<D>& occurrence) {
  PointSet<D> points;
  const Matrix<D>& matrix = occurrence.placement.matrix();
  const auto add = [&](const std::array<double, D>& local) {
    auto& point = points.emplace_back();
    for (int i = 0; i < D; ++i) {
      Float128 sum = matrix[i][D];
      for (int j = 0; j < D; ++j) sum += matrix[i][j] * static_cast<Float128>(local[j]);
      point[i] = static_cast<double>(sum);
    }
  };
  std::visit([&](const auto& primitive) { visit_corners<D>(primitive, add); }, *occurrence.primitive);
  return points;
}

/// Whether the program only unites primitives.
template <int D>
bool is_union(const Lowered<D>& lowered) {
  for (std::size_t at = 0; at < lowered.program.size(); at += Network<D>::header) {
    const Word kind = lowered.program[at] & Network<D>::kind_mask;
    if (kind != Network<D>::kind_unite && kind != Network<D>::kind_leaf) return false;
    if ((lowered.program[at] & Network<D>::negated) != 0) return false;
  }
  return true;
}

/// The corners of each flat primitive that nothing but unions are around: no cell tells of these.
template <int D>
std::vector<PointSet<D>> flat_parts(const Lowered<D>& lowered) {
  std::vector<PointSet<D>> parts;
  std::size_t end_of_others = 0;  // of the outermost combiner at hand that does not unite
  for (std::size_t at = 0; at < lowered.program.size();) {
    const Word* word = lowered.program.data() + at;
    const Word kind = word[0] & Network<D>::kind_mask;
    if (kind != Network<D>::kind_leaf) {
      if (kind != Network<D>::kind_unite && at >= end_of_others) end_of_others = at + word[1];
      at += Network<D>::header;
      continue;
    }
    const Occurrence<D>& occurrence = lowered.occurrences[word[2]];
    const bool is_united = at >= end_of_others && (word[0] & Network<D>::negated) == 0;
    if (is_united && model::is_flat(*occurrence.primitive)) parts.push_back(placed_corners(occurrence));
    at += word[1];
  }
  return parts;
}

/// Corners and content of a convex hull.
struct Hull2 {
  static std::optional<std::pair<PointSet<2>, double>> of(const PointSet<2>& points) {
    const model::Expression hull = model::convex_hull(points);
    const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
    if (primitive == nullptr) return std::nullopt;
    const PointSet<2>& corners = std::get<model::ConvexPolygon>(*primitive).points;
    double area = 0;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto &p = corners[i], &q = corners[(i + 1) % corners.size()], &o = corners[0];
      area += ((p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0])) / 2;
    }
    return std::pair{corners, area};
  }
};

struct Hull3 {
  static std::optional<std::pair<PointSet<3>, double>> of(const PointSet<3>& points) {
    const model::Expression hull = model::convex_hull(points);
    const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
    if (primitive == nullptr) return std::nullopt;
    const auto& mesh = std::get<model::TriangleMesh>(*primitive);
    double volume = 0;
    const auto& o = mesh.points[0];
    for (const auto& [a, b, c] : mesh.triangles) {
      std::array<double, 3> u, v, w;
      for (int i = 0; i < 3; ++i) {
        u[i] = mesh.points[a][i] - o[i];
        v[i] = mesh.points[b][i] - o[i];
        w[i] = mesh.points[c][i] - o[i];
      }
      volume += (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                 u[2] * (v[0] * w[1] - v[1] * w[0])) /
                6;
    }
    return std::pair{mesh.points, volume};
  }
};

/// Of any dimension.
template <int D>
struct HullD {
  static std::optional<std::pair<PointSet<D>, double>> of(const PointSet<D>& points) {
    if constexpr (D == 1) {
      const auto [low, high] = std::minmax_element(points.begin(), points.end());
      return std::pair{PointSet<1>{*low, *high}, (*high)[0] - (*low)[0]};
    } else {
      const model::Expression hull = model::convex_hull(D, flat(points));
      const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
      if (primitive == nullptr) return std::nullopt;
      const auto& polytope = std::get<model::Polytope>(*primitive);
      PointSet<D> corners;
      visit_corners<D>(polytope, [&](const std::array<double, D>& corner) { corners.push_back(corner); });
      return std::pair{std::move(corners), polytope.content};
    }
  }
};

/// Cells put together where their union is convex: their hull then has no more content than they have.
template <int D>
class CellMerger {
 public:
  struct Item {
    PointSet<D> points;
    std::array<double, D> centre;
    double volume;
  };

  std::vector<PointSet<D>> run(std::vector<Item> items) {
    if (!items.empty()) merge(items);
    return std::move(parts_);
  }

 private:
  std::vector<PointSet<D>> parts_;

  void merge(std::span<Item> items) {  // depth: log2 of the number of cells
    if (items.size() == 1) {
      parts_.push_back(std::move(items[0].points));
      return;
    }
    PointSet<D> all;
    double volume = 0;
    for (const Item& item : items) {
      all.insert(all.end(), item.points.begin(), item.points.end());
      volume += item.volume;
    }
    using Hull = std::conditional_t<D == 2, Hull2, std::conditional_t<D == 3, Hull3, HullD<D>>>;
    if (auto hull = Hull::of(all); hull && hull->second <= volume * (1 + 1e-9)) {
      parts_.push_back(std::move(hull->first));
      return;
    }
    int axis = 0;
    double widest = -1;
    for (int i = 0; i < D; ++i) {
      const auto [low, high] =
          std::minmax_element(items.begin(), items.end(),
                              [i](const Item& a, const Item& b) { return a.centre[i] < b.centre[i]; });
      if (high->centre[i] - low->centre[i] > widest) widest = high->centre[i] - low->centre[i], axis = i;
    }
    std::stable_sort(items.begin(), items.end(),
                     [axis](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
    merge(items.first(items.size() / 2));
    merge(items.subspan(items.size() / 2));
  }
};

template <int D, typename Visit>
void for_each_cell(const std::vector<geometry::CellBatch>& batches, geometry::Label label, Visit&& visit) {
  for (const geometry::CellBatch& batch : batches)
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      if (batch.label[cell] != label) continue;
      const auto numbers = batch.cell_points(cell);
      PointSet<D> points(numbers.size() / D);
      for (std::size_t i = 0; i < numbers.size(); ++i) points[i / D][i % D] = numbers[i];
      visit(std::move(points), batch.volume[cell]);
    }
}

/// The IN cells.
template <int D>
std::vector<PointSet<D>> merged(const std::vector<geometry::CellBatch>& batches) {
  std::vector<typename CellMerger<D>::Item> items;
  for_each_cell<D>(batches, geometry::Label::in, [&](PointSet<D> points, double volume) {
    std::array<double, D> centre{};
    for (const auto& point : points)
      for (int i = 0; i < D; ++i) centre[i] += point[i] / static_cast<double>(points.size());
    items.push_back({std::move(points), centre, volume});
  });
  return CellMerger<D>().run(std::move(items));
}

/// Without places: its primitives are numbered by themselves.
/// @param tells whether there is anything to say about what it loses: not where that counts all the same.
template <int D>
Network<D> nested_network(const model::Expression& solid, const CompileOptions& options, bool tells = true) {
  Network<D> network =
      compile<D>(solid, {.coincidence = options.coincidence, .parts = Parts::none, .is_nested = true});
  if (tells && options.tell_of_nested)
    for (const std::string& warning : network.warnings) options.tell_of_nested(warning);
  return network;
}

/// The IN cells, and with a refinement those that it leaves FUZZY; in an order that is always the same.
template <int D>
std::vector<geometry::CellBatch> cells_of(const Network<D>& network, const Fineness* fineness = nullptr) {
  if (network.program.empty()) return {};
  std::vector<Region<D>> regions = even_regions(network, fineness != nullptr ? fineness->cuts : 0);
  CellCollector collector;
  Consumer* const consumers[] = {&collector};
  EvaluateOptions how;
  how.interrupted = geometry::Interruption::is_wanted;
  how.keep_fuzzy = fineness != nullptr;
  if (fineness != nullptr) how.tolerance = fineness->thickness * network.table.width();
  evaluate<D>(network, std::move(regions), how, consumers);
  geometry::Interruption::check();
  return std::move(collector.batches);
}

template <int D>
std::vector<geometry::CellBatch> evaluate_cells(const model::Expression& solid, const CompileOptions& options,
                                                const Fineness* fineness = nullptr, bool tells = true) {
  return cells_of<D>(nested_network<D>(solid, options, tells), fineness);
}

}  // namespace

void evaluate_plane_cells(const model::Expression& solid, const CompileOptions& options,
                          const UseCells& use) {
  const Network<2> network = nested_network<2>(solid, options);
  use(network, cells_of<2>(network));
}

bool is_convex(const model::Primitive& primitive) {
  const auto* mesh = std::get_if<model::TriangleMesh>(&primitive);
  return mesh == nullptr || mesh->convex;
}

template <int D>
PointSet<D> spanning_points(const model::Expression& solid, const CompileOptions& options) {
  PointSet<D> all;
  const Lowered<D> lowered = lower<D>(solid);
  if (is_union(lowered)) {
    for (const auto& occurrence : lowered.occurrences) {
      const PointSet<D> corners = placed_corners(occurrence);
      all.insert(all.end(), corners.begin(), corners.end());
    }
    return all;
  }
  const std::vector<PointSet<D>> flats = flat_parts(lowered);
  for_each_cell<D>(evaluate_cells<D>(solid, options, nullptr, flats.empty()), geometry::Label::in,
                   [&](PointSet<D> points, double) { all.insert(all.end(), points.begin(), points.end()); });
  for (const PointSet<D>& flat : flats) all.insert(all.end(), flat.begin(), flat.end());
  return all;
}

template <int D>
std::vector<PointSet<D>> convex_parts(const model::Expression& solid, const CompileOptions& options) {
  std::vector<PointSet<D>> parts;
  const Lowered<D> lowered = lower<D>(solid);
  const auto all_convex = [&] {
    return std::all_of(lowered.occurrences.begin(), lowered.occurrences.end(),
                       [](const auto& o) { return is_convex(*o.primitive); });
  };
  if (is_union(lowered) && all_convex()) {
    for (const auto& occurrence : lowered.occurrences) parts.push_back(placed_corners(occurrence));
    return parts;
  }
  std::vector<PointSet<D>> flats = flat_parts(lowered);
  parts = merged<D>(evaluate_cells<D>(solid, options, nullptr, flats.empty()));
  for (PointSet<D>& flat : flats) parts.push_back(std::move(flat));
  return parts;
}

namespace {

template <int D>
model::Expression replaced(const model::Expression& solid, int dimension,
                           const std::function<model::Expression(const PlacedPrimitive&)>& leaf) {
  using Net = Network<D>;
  const Lowered<D> lowered = lower<D>(solid);
  struct Open {
    Word kind;
    std::size_t end;
    std::vector<model::Expression> operands;
  };
  const auto substitute = [&](const Occurrence<D>& occurrence, bool negated, bool both) {
    PlacedPrimitive placed{occurrence.primitive,
                           D,
                           {},
                           negated,
                           both,
                           [&occurrence] { return flat(placed_corners(occurrence)); }};
    for (const auto& row : occurrence.placement.matrix())
      for (const Float128 entry : row) placed.matrix.push_back(static_cast<double>(entry));
    placed.matrix.resize((D + 1) * (D + 1));
    placed.matrix.back() = 1;
    return leaf(placed);
  };
  std::vector<Open> open{{Net::kind_unite, lowered.program.size(), {}}};
  for (std::size_t at = 0; at < lowered.program.size();) {
    const Word* word = lowered.program.data() + at;
    const Word kind = word[0] & Net::kind_mask;
    if (kind == Net::kind_leaf) {
      const bool negated = (word[0] & Net::negated) != 0;
      const bool both = std::any_of(open.begin(), open.end(),
                                    [](const Open& around) { return around.kind == Net::kind_differ; });
      model::Expression made = substitute(lowered.occurrences[word[2]], negated, both);
      if (negated) made = model::complement(std::move(made));
      open.back().operands.push_back(std::move(made));
      at += word[1];
    } else {
      open.push_back({kind, at + word[1], {}});
      at += Net::header;
    }
    while (open.size() > 1 && open.back().end == at) {
      Open done = std::move(open.back());
      open.pop_back();
      const model::Expression nothing(dimension);
      const bool none = done.operands.empty();
      open.back().operands.push_back(
          done.kind == Net::kind_intersect
              ? (none ? model::complement(nothing) : model::intersect(std::move(done.operands)))
          : none                         ? nothing
          : done.kind == Net::kind_unite ? model::unite(std::move(done.operands))
                                         : model::symmetric_difference(std::move(done.operands)));
    }
  }
  if (open.front().operands.empty()) return model::Expression(dimension);
  return open.front().operands.size() == 1 ? open.front().operands[0]
                                           : model::unite(std::move(open.front().operands));
}

}  // namespace

model::Expression with_primitives_replaced(
    const model::Expression& solid, int dimension,
    const std::function<model::Expression(const PlacedPrimitive&)>& leaf) {
  return geometry::in_dimension(solid.dimension(),
                                [&](auto d) { return replaced<d()>(solid, dimension, leaf); });
}

bool is_union(const model::Expression& solid) {
  return geometry::in_dimension(solid.dimension(), [&](auto d) { return is_union(lower<d()>(solid)); });
}

Points spanning_points(const model::Expression& solid, const CompileOptions& options) {
  return geometry::in_dimension(solid.dimension(),
                                [&](auto d) { return flat(spanning_points<d()>(solid, options)); });
}

RefinedCells refined_cells(const model::Expression& solid, const Fineness& fineness,
                           const CompileOptions& options) {
  return geometry::in_dimension(solid.dimension(), [&](auto d) {
    const auto batches = evaluate_cells<d()>(solid, options, &fineness);
    RefinedCells cells;
    for (const auto& part : merged<d()>(batches)) cells.in.push_back(flat(part));
    for_each_cell<d()>(batches, geometry::Label::fuzzy,
                       [&](const PointSet<d()>& points, double) { cells.fuzzy.push_back(flat(points)); });
    return cells;
  });
}

std::vector<Points> convex_parts(const model::Expression& solid, const CompileOptions& options) {
  return geometry::in_dimension(solid.dimension(), [&](auto d) {
    std::vector<Points> parts;
    for (const auto& part : convex_parts<d()>(solid, options)) parts.push_back(flat(part));
    return parts;
  });
}

#define BSP2_INSTANTIATE(D)                                                                 \
  template PointSet<D> spanning_points<D>(const model::Expression&, const CompileOptions&); \
  template std::vector<PointSet<D>> convex_parts<D>(const model::Expression&, const CompileOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
