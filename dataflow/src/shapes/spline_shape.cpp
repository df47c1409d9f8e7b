#include "shapes/spline_shape.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::Float128;

// --- points ---

template <int D>
PlacedPoints<D>::PlacedPoints(const std::vector<double>& coordinates, std::size_t stride,
                              const Transformer<D>& placement) {
  lower_.fill(std::numeric_limits<long double>::infinity());
  upper_.fill(-std::numeric_limits<long double>::infinity());
  for (std::size_t at = 0; at < coordinates.size(); at += stride) {
    auto& point = points_.emplace_back();
    for (std::size_t i = 0; i < D; ++i) {
      Float128 sum = placement.matrix()[i][D];
      for (std::size_t j = 0; j < D; ++j)
        sum += placement.matrix()[i][j] * static_cast<Float128>(coordinates[at + j]);
      point[i] = static_cast<long double>(sum);
      lower_[i] = std::min(lower_[i], point[i]);
      upper_[i] = std::max(upper_[i], point[i]);
    }
  }
}

template <int D>
void PlacedPoints<D>::unite(const PlacedPoints& other) {
  for (std::size_t i = 0; i < D; ++i) {
    lower_[i] = std::min(lower_[i], other.lower_[i]);
    upper_[i] = std::max(upper_[i], other.upper_[i]);
  }
}

template <int D>
void PlacedPoints<D>::choose_frame() {
  long double half = 0, reach = 0;
  for (std::size_t i = 0; i < D; ++i) {
    frame_.origin[i] = static_cast<double>((lower_[i] + upper_[i]) / 2);
    half = std::max({half, upper_[i] - frame_.origin[i], frame_.origin[i] - lower_[i]});
    reach = std::max({reach, std::fabs(upper_[i]), std::fabs(lower_[i])});
  }
  half = std::max(half, reach * 0x1p-40L);  // of what is almost a point
  int exponent = 0;
  std::frexp(half > 0 ? half : 1.0L, &exponent);
  frame_.scale = std::ldexp(1.0, exponent);
}

/// Matrix products are good to far more than long doubles, which are in error by 2^-64 of the coordinates in
/// the model.
template <int D>
double PlacedPoints<D>::error() const {
  long double reach = 0;
  for (std::size_t i = 0; i < D; ++i) reach = std::max({reach, std::fabs(upper_[i]), std::fabs(lower_[i])});
  return static_cast<double>(reach / frame_.scale * 0x1p-61L) + 0x1p-51;
}

template <int D>
std::array<long double, D> PlacedPoints<D>::operator[](std::size_t index) const {
  auto point = points_[index];
  for (std::size_t i = 0; i < D; ++i) point[i] = (point[i] - frame_.origin[i]) / frame_.scale;
  return point;
}

namespace {

// --- from B-splines to Bezier patches ---

/// A tensor-product net of control points, those of the last parameter next to each other.
struct Net {
  std::vector<std::size_t> counts;
  std::size_t stride = 0;
  std::vector<long double> numbers;
};

/// The spans [knots[s], knots[s + 1]] of the domain that are not empty.
std::vector<std::size_t> spans_of(const std::vector<double>& knots, std::size_t degree) {
  std::vector<std::size_t> spans;
  for (std::size_t s = degree; s + degree + 1 < knots.size(); ++s)
    if (knots[s] < knots[s + 1]) spans.push_back(s);
  return spans;
}

/// The polar form of span s at degree - r times its lower end and r times its upper end: Bezier point r of
/// the span. Combinations are convex. Source: L. Ramshaw, Blossoms Are Polar Forms (1989).
void polar_form(const std::vector<double>& knots, std::size_t s, std::size_t degree, std::size_t r,
                std::size_t width, std::vector<long double>& points) {
  for (std::size_t l = 1; l <= degree; ++l) {
    const long double t = l <= r ? knots[s + 1] : knots[s];
    for (std::size_t i = degree; i >= l; --i) {
      const std::size_t g = s - degree + i;
      const long double alpha =
          (t - knots[g]) / (static_cast<long double>(knots[g + degree - l + 1]) - knots[g]);
      for (std::size_t c = 0; c < width; ++c)
        points[i * width + c] = (1 - alpha) * points[(i - 1) * width + c] + alpha * points[i * width + c];
    }
  }
}

/// The net with degree + 1 points a span along one parameter.
Net to_bezier(const Net& net, std::size_t parameter, std::size_t degree, const std::vector<double>& knots) {
  const auto spans = spans_of(knots, degree);
  Net result = net;
  result.counts[parameter] = spans.size() * (degree + 1);
  std::size_t inner = net.stride, outer = 1;
  for (std::size_t j = 0; j < net.counts.size(); ++j)
    (j < parameter ? outer : inner) *= j == parameter ? 1 : net.counts[j];
  result.numbers.clear();
  std::vector<long double> points;
  for (std::size_t o = 0; o < outer; ++o)
    for (const std::size_t s : spans)
      for (std::size_t r = 0; r <= degree; ++r) {
        const auto first = net.numbers.begin() +
                           static_cast<std::ptrdiff_t>((o * net.counts[parameter] + s - degree) * inner);
        points.assign(first, first + static_cast<std::ptrdiff_t>((degree + 1) * inner));
        polar_form(knots, s, degree, r, inner, points);
        result.numbers.insert(result.numbers.end(), points.end() - static_cast<std::ptrdiff_t>(inner),
                              points.end());
      }
  return result;
}

/// Calls `visit` with each index of a box of these sizes, the last one running fastest.
template <typename Visit>
void for_each_index(const std::vector<std::size_t>& sizes, Visit&& visit) {
  std::vector<std::size_t> index(sizes.size(), 0);
  for (;;) {
    visit(index);
    std::size_t j = sizes.size();
    while (j > 0 && ++index[j - 1] == sizes[j - 1]) index[--j] = 0;
    if (j == 0) return;
  }
}

/// What a patch of D or fewer parameters is before it is one: of D parameters only faces become patches.
struct Block {
  std::vector<std::size_t> degrees;
  std::vector<std::pair<bool, bool>>
      at_end;  ///< by parameter: whether it is the first, and the last, of the net
  std::size_t stride = 0;
  std::vector<double> numbers;
};

std::vector<Block> blocks_of(const Net& net, const std::vector<std::uint32_t>& degrees) {
  std::vector<std::size_t> spans, points;
  for (std::size_t j = 0; j < degrees.size(); ++j) {
    points.push_back(degrees[j] + 1);
    spans.push_back(net.counts[j] / points[j]);
  }
  std::vector<Block> blocks;
  for_each_index(spans, [&](const std::vector<std::size_t>& span) {
    Block& block = blocks.emplace_back();
    block.degrees.assign(degrees.begin(), degrees.end());
    block.stride = net.stride;
    for (std::size_t j = 0; j < spans.size(); ++j)
      block.at_end.emplace_back(span[j] == 0, span[j] + 1 == spans[j]);
    for_each_index(points, [&](const std::vector<std::size_t>& i) {
      std::size_t at = 0;
      for (std::size_t j = 0; j < spans.size(); ++j) at = at * net.counts[j] + span[j] * points[j] + i[j];
      for (std::size_t c = 0; c < net.stride; ++c)
        block.numbers.push_back(static_cast<double>(net.numbers[at * net.stride + c]));
    });
  });
  return blocks;
}

/// A face of a block, where parameter j is at its lower (0) or upper (1) end, oriented as the boundary is.
Block face_of(const Block& block, std::size_t j, std::size_t side) {
  Block face;
  face.stride = block.stride;
  std::vector<std::size_t> points;
  for (std::size_t i = 0; i < block.degrees.size(); ++i) {
    if (i == j) continue;
    face.degrees.push_back(block.degrees[i]);
    points.push_back(block.degrees[i] + 1);
  }
  const bool reversed = (j % 2 == 0) != (side == 1);
  for_each_index(points, [&](std::vector<std::size_t> index) {
    if (reversed) index[0] = face.degrees[0] - index[0];
    std::size_t at = 0;
    for (std::size_t i = 0, k = 0; i < block.degrees.size(); ++i)
      at = at * (block.degrees[i] + 1) + (i == j ? side * block.degrees[j] : index[k++]);
    for (std::size_t c = 0; c < block.stride; ++c)
      face.numbers.push_back(block.numbers[at * block.stride + c]);
  });
  return face;
}

template <int D>
Patch<D> patch_of(Block block, bool rational) {
  Patch<D> patch;
  patch.rational = rational;
  patch.parameters = static_cast<std::uint8_t>(block.degrees.size());
  for (std::size_t j = 0; j < block.degrees.size(); ++j)
    patch.degrees[j] = static_cast<std::uint8_t>(block.degrees[j]);
  if (rational) {
    patch.coordinates = std::move(block.numbers);
  } else {
    for (std::size_t at = 0; at < block.numbers.size(); ++at)
      if (at % (D + 1) != D) patch.coordinates.push_back(block.numbers[at]);
  }
  return patch;
}

// --- whether patches are closed ---

/// The boundaries of patches of D - 1 parameters, D = 2 or 3: whether they cancel out.
template <int D>
class Boundary {
 public:
  /// @param piece_of the piece of each patch: its patches are turned together.
  Boundary(std::vector<Patch<D>>& patches, const std::vector<std::size_t>& piece_of)
      : patches_(patches), piece_of_(piece_of) {}

  /// Turns pieces so that they fit, if that helps. @param gap by how far edges that count as one are apart.
  bool is_closed(double& gap) {
    collect();
    weld(gap);
    count_uses(gap);
    turn_pieces();
    return std::all_of(uses_.begin(), uses_.end(), [&](const auto& entry) {
      int sum = 0;
      for (const Use& use : entry.second) sum += use.sign * turned_[use.piece];
      return sum == 0;
    });
  }

 private:
  static constexpr double tolerance = 1e-9;
  using Place = std::array<double, D + 1>;  // a control point, and its weight by those of the edge's ends
  struct Edge {
    std::size_t first, count, piece;  // places
    int sign;
  };
  struct Use {
    std::size_t piece;
    int sign;
  };
  std::vector<Patch<D>>& patches_;
  const std::vector<std::size_t>& piece_of_;
  std::vector<Place> places_;
  std::vector<std::uint32_t> welded_;  // by place
  std::vector<Edge> edges_;
  std::map<std::vector<std::uint32_t>, std::vector<Use>> uses_;
  std::vector<int> turned_;

  void add(const Patch<D>& patch, std::size_t piece, std::size_t first, std::size_t step, std::size_t count,
           int sign) {
    edges_.push_back({places_.size(), count, piece, sign});
    const auto weight = [&](std::size_t i) {
      return patch.rational ? patch.coordinates[(first + i * step) * (D + 1) + D] : 1.0;
    };
    for (std::size_t i = 0; i < count; ++i) {
      const auto point = patch.point(first + i * step);
      Place& place = places_.emplace_back();
      std::copy(point.begin(), point.end(), place.begin());
      place[D] = weight(i) / std::sqrt(weight(0) * weight(count - 1));
    }
  }

  void collect() {
    for (std::size_t i = 0; i < patches_.size(); ++i) {
      const Patch<D>& patch = patches_[i];
      const std::size_t piece = piece_of_[i], m = patch.degrees[0] + std::size_t{1};
      if constexpr (D == 2) {
        add(patch, piece, 0, 1, 1, -1);
        add(patch, piece, m - 1, 1, 1, 1);
      } else if constexpr (D == 3) {
        const std::size_t n = patch.degrees[1] + std::size_t{1};
        add(patch, piece, 0, n, m, 1);
        add(patch, piece, (m - 1) * n, 1, n, 1);
        add(patch, piece, n - 1, n, m, -1);
        add(patch, piece, 0, 1, n, -1);
      }
    }
  }

  static double distance(const Place& a, const Place& b) {
    double most = 0;
    for (std::size_t i = 0; i <= D; ++i) most = std::max(most, std::fabs(a[i] - b[i]));
    return most;
  }

  /// Places within the tolerance of each other are one. They are near to each other also along a line in no
  /// special direction.
  void weld(double& gap) {
    constexpr double direction[] = {0.7131, 0.5377, 0.4303, 0.1331};
    std::vector<std::pair<double, std::uint32_t>> order;
    for (std::uint32_t i = 0; i < places_.size(); ++i) {
      double along = 0;
      for (std::size_t j = 0; j <= D; ++j) along += direction[j] * places_[i][j];
      order.emplace_back(along, i);
    }
    std::sort(order.begin(), order.end());
    welded_.resize(places_.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::uint32_t place = order[i].second;
      welded_[place] = place;
      for (std::size_t j = i; j-- > 0 && order[i].first - order[j].first <= 2 * tolerance;) {
        const std::uint32_t known = welded_[order[j].second];
        if (const double apart = distance(places_[place], places_[known]); apart <= tolerance) {
          welded_[place] = known;
          gap = std::max(gap, apart);
          break;
        }
      }
    }
  }

  /// Whether an edge is a point.
  [[nodiscard]] bool is_point(const Edge& edge, double& gap) const {
    double most = 0;
    for (std::size_t i = 1; i < edge.count; ++i)
      for (std::size_t j = 0; j < D; ++j)
        most = std::max(most, std::fabs(places_[edge.first + i][j] - places_[edge.first][j]));
    if (most > tolerance) return false;
    gap = std::max(gap, most);
    return true;
  }

  void count_uses(double& gap) {
    for (const Edge& edge : edges_) {
      turned_.resize(std::max(turned_.size(), edge.piece + 1), 1);
      if (edge.count > 1 && is_point(edge, gap)) continue;
      std::vector<std::uint32_t> key(welded_.begin() + static_cast<std::ptrdiff_t>(edge.first),
                                     welded_.begin() + static_cast<std::ptrdiff_t>(edge.first + edge.count));
      std::vector<std::uint32_t> back(key.rbegin(), key.rend());
      if (edge.count > 1 && key == back) continue;  // there and back
      const int sign = back < key ? -edge.sign : edge.sign;
      uses_[std::min(key, back)].push_back({edge.piece, sign});
    }
  }

  /// Pieces that meet at an edge go along it in opposite directions.
  void turn_pieces() {
    std::vector<std::vector<std::pair<std::size_t, int>>> neighbours(turned_.size());
    for (const auto& [key, uses] : uses_) {
      if (uses.size() != 2 || uses[0].piece == uses[1].piece) continue;
      const int fit = -uses[0].sign * uses[1].sign;
      neighbours[uses[0].piece].emplace_back(uses[1].piece, fit);
      neighbours[uses[1].piece].emplace_back(uses[0].piece, fit);
    }
    std::vector<bool> seen(turned_.size(), false);
    for (std::size_t start = 0; start < turned_.size(); ++start) {
      std::vector<std::size_t> open{start};
      while (!open.empty()) {
        const std::size_t piece = open.back();
        open.pop_back();
        if (seen[piece]) continue;
        seen[piece] = true;
        for (const auto& [other, fit] : neighbours[piece]) {
          if (seen[other]) continue;
          turned_[other] = turned_[piece] * fit;
          open.push_back(other);
        }
      }
    }
    for (std::size_t i = 0; i < patches_.size(); ++i)
      if (turned_[piece_of_[i]] < 0) reverse(patches_[i]);
  }

  static void reverse(Patch<D>& patch) {
    const std::size_t rows = patch.degrees[0] + std::size_t{1};
    const auto row = static_cast<std::ptrdiff_t>(patch.coordinates.size() / rows);
    for (std::size_t i = 0; i < rows / 2; ++i)
      std::swap_ranges(patch.coordinates.begin() + static_cast<std::ptrdiff_t>(i) * row,
                       patch.coordinates.begin() + static_cast<std::ptrdiff_t>(i + 1) * row,
                       patch.coordinates.end() - static_cast<std::ptrdiff_t>(i + 1) * row);
  }
};

}  // namespace

template <int D>
PlacedPatches<D> place(const model::Spline& spline, const Transformer<D>& placement) {
  PlacedPatches<D> result;
  std::vector<PlacedPoints<D>> points;
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const auto& piece : spline.pieces) {
    points.emplace_back(piece.points, D + 1, placement);
    for (std::size_t at = D; at < piece.points.size(); at += D + 1) {
      least = std::min(least, piece.points[at]);
      most = std::max(most, piece.points[at]);
    }
  }
  for (auto& other : points) points[0].unite(other);
  for (auto& other : points) {
    other.unite(points[0]);
    other.choose_frame();
  }
  const bool rational = least < most;
  result.placement = points[0].frame();
  result.weight_ratio = most / least;
  double roundings = 4;
  std::vector<std::size_t> piece_of;
  for (std::size_t i = 0; i < spline.pieces.size(); ++i) {
    const auto& piece = spline.pieces[i];
    Net net{{}, D + 1, {}};
    for (std::size_t j = 0; j < piece.degrees.size(); ++j)
      net.counts.push_back(piece.knots[j].size() - piece.degrees[j] - 1);
    for (std::size_t p = 0; p < points[i].size(); ++p) {
      const long double weight = piece.points[p * (D + 1) + D] / most;
      for (const long double x : points[i][p]) net.numbers.push_back(x * weight);
      net.numbers.push_back(weight);
    }
    for (std::size_t j = 0; j < piece.degrees.size(); ++j)
      net = to_bezier(net, j, piece.degrees[j], piece.knots[j]);
    for (Block& block : blocks_of(net, piece.degrees)) {
      if (piece.degrees.size() < D) {
        result.roots.push_back(patch_of<D>(std::move(block), rational));
      } else {
        for (std::size_t j = 0; j < D; ++j)
          for (const std::size_t side : {0U, 1U})
            if (side == 0 ? block.at_end[j].first : block.at_end[j].second)
              result.roots.push_back(patch_of<D>(face_of(block, j, side), rational));
      }
    }
    piece_of.resize(result.roots.size(), i);
    double degrees = 4;
    for (const std::uint32_t degree : piece.degrees) degrees += degree;
    roundings = std::max(roundings, degrees);
  }
  // Long doubles lose next to nothing; numbers are rounded to doubles once, and then divided by their weight.
  result.error = points[0].error() + roundings * 0x1p-53 * (rational ? 4 * result.weight_ratio : 1);
  if constexpr (D == 2 || D == 3) {
    if (result.roots.front().parameters == D - 1) {
      double gap = 0;
      result.closed = Boundary<D>(result.roots, piece_of).is_closed(gap);
      result.error += 4 * gap;  // what fills the gaps is held too
    }
  }
  return result;
}

template <int D>
Box<D> bounds_of(const model::Spline& spline) {
  Box<D> box = Box<D>::empty();
  for (const auto& piece : spline.pieces)
    for (std::size_t at = 0; at < piece.points.size(); at += D + 1) {
      std::array<double, D> point;
      std::copy_n(piece.points.begin() + static_cast<std::ptrdiff_t>(at), D, point.begin());
      box.unite({point, point});
    }
  return box;
}

#define BSP2_INSTANTIATE(D)                                                        \
  template class PlacedPoints<D>;                                                  \
  template PlacedPatches<D> place<D>(const model::Spline&, const Transformer<D>&); \
  template Box<D> bounds_of<D>(const model::Spline&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
