#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "csg/csg_construct_nodes.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t most_dimensions = NodePool::most_dimensions;

/// Numbers in lists in lists ..., as many in each list as in its neighbours.
struct Grid {
  std::vector<std::size_t> counts;  ///< from the outermost list on
  std::vector<double> numbers;
};

Grid grid_of(const Value* value, const std::string& what) {
  Grid grid;
  for (const Value* first = value; first && first->kind == Value::vector; ++first) {
    if (first->size == 0) throw Error(what + " has an empty list");
    grid.counts.push_back(first->size);
  }
  if (grid.counts.empty() || grid.counts.size() > most_dimensions + 1)
    throw Error(what + " has to be a list of numbers, or lists of them");
  // The lists that are open, and how many of their elements are still to come.
  std::vector<std::size_t> open;
  for (const Value* at = value; at != value + value->span; ++at) {
    while (!open.empty() && open.back() == 0) open.pop_back();
    if (!open.empty()) --open.back();
    const std::size_t level = open.size();
    const bool is_list = level < grid.counts.size();
    if (is_list != (at->kind == Value::vector) || (is_list && at->size != grid.counts[level]))
      throw Error(what + " has lists of different lengths or depths");
    if (is_list) {
      open.push_back(at->size);
    } else if (at->kind == Value::number && std::isfinite(at->as_number)) {
      grid.numbers.push_back(at->as_number);
    } else {
      throw Error(what + " has to be of finite numbers");
    }
  }
  return grid;
}

/// The net of control points of a node; its weights are 1 where there are none.
struct ControlNet {
  int dimension = 0;
  std::vector<std::size_t> counts;  // along each parameter
  std::vector<double> points;       // with weights
};

ControlNet control_net(const Arguments& arguments, const std::string& node, int position) {
  const Value* points = arguments.find("points", position);
  if (!points) throw Error(node + ": needs the argument 'points'");
  Grid grid = grid_of(points, node + ": 'points'");
  ControlNet net;
  net.dimension = static_cast<int>(grid.counts.back());
  net.counts.assign(grid.counts.begin(), grid.counts.end() - 1);
  if (net.dimension < 2 || grid.counts.back() > most_dimensions)
    throw Error(node + ": points of " + counted(net.dimension, "# coordinate[s]; it takes 2 to ") +
                std::to_string(most_dimensions));
  if (net.counts.empty())
    throw Error(node +
                ": a single point; it takes a list of them, or lists of lists for a surface or a solid");
  std::vector<double> weights(grid.numbers.size() / grid.counts.back(), 1.0);
  if (const Value* given = arguments.find("weights")) {
    Grid weight_grid = grid_of(given, node + ": 'weights'");
    if (weight_grid.counts != net.counts)
      throw Error(node + ": there have to be as many weights as points, in the same lists");
    weights = std::move(weight_grid.numbers);
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto first = grid.numbers.begin() + static_cast<std::ptrdiff_t>(i * grid.counts.back());
    net.points.insert(net.points.end(), first, first + net.dimension);
    net.points.push_back(weights[i]);
  }
  return net;
}

/// A value for each parameter: from one that holds for all, or a list.
template <typename Read>
auto by_parameter(const Value* value, std::size_t parameters, const std::string& what, Read&& read) {
  std::vector<decltype(read(value))> all;
  if (value->kind != Value::vector) {
    all.assign(parameters, read(value));
    return all;
  }
  if (value->size != parameters)
    throw Error(what + " has to be one value, or a list of " + std::to_string(parameters) +
                ", one for each parameter");
  const Value* at = value + 1;
  for (std::size_t j = 0; j < parameters; at += at->span, ++j) all.push_back(read(at));
  return all;
}

/// Goes on from the last points to the first ones again, along a parameter.
void close_net(ControlNet& net, std::size_t parameter, std::size_t degree, const std::string& node) {
  const std::size_t count = net.counts[parameter], stride = static_cast<std::size_t>(net.dimension) + 1;
  if (count < degree)
    throw Error(node + ": a closed one of degree " + std::to_string(degree) +
                " takes at least as many points");
  std::size_t inner = stride, outer = 1;
  for (std::size_t j = 0; j < net.counts.size(); ++j)
    (j < parameter ? outer : inner) *= j == parameter ? 1 : net.counts[j];
  std::vector<double> points;
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t i = 0; i < count + degree; ++i) {
      const auto first = net.points.begin() + static_cast<std::ptrdiff_t>((o * count + i % count) * inner);
      points.insert(points.end(), first, first + static_cast<std::ptrdiff_t>(inner));
    }
  net.points = std::move(points);
  net.counts[parameter] += degree;
}

std::vector<std::vector<double>> knots_of(const Value* given, const ControlNet& net,
                                          const std::string& node) {
  const std::string what = node + ": 'knots'";
  std::vector<std::vector<double>> knots;
  if (given->kind == Value::vector && given->size > 0 && given[1].kind != Value::vector) {
    knots.push_back(grid_of(given, what).numbers);
  } else if (given->kind == Value::vector) {
    const Value* at = given + 1;
    for (std::uint32_t j = 0; j < given->size; at += at->span, ++j) {
      const Grid grid = grid_of(at, what);
      if (grid.counts.size() != 1) throw Error(what + " is nested too deeply");
      knots.push_back(grid.numbers);
    }
  }
  if (knots.size() != net.counts.size())
    throw Error(what + " has to be a list of numbers for each of the " +
                counted(net.counts.size(), "# parameter[s]"));
  return knots;
}

Expression make_bezier(const StrictArguments& strict) {
  const Arguments& arguments = strict.all();
  ControlNet net = control_net(arguments, "bezier", 0);
  std::vector<std::uint32_t> degrees;
  for (const std::size_t count : net.counts) degrees.push_back(static_cast<std::uint32_t>(count - 1));
  return bezier(net.dimension, std::move(degrees), std::move(net.points));
}

Expression make_bspline(const StrictArguments& strict) {
  const Arguments& arguments = strict.all();
  const std::string node(strict.node());  // bspline or nurbs
  ControlNet net = control_net(arguments, node, 1);
  const std::size_t parameters = net.counts.size();
  Spline::Piece piece;
  piece.degrees.assign(parameters, 3);
  if (const Value* degree = arguments.find("degree", 0))
    piece.degrees = by_parameter(degree, parameters, node + ": 'degree'", [&](const Value* value) {
      if (value->kind != Value::number || !(value->as_number >= 1 && value->as_number <= 15) ||
          value->as_number != std::trunc(value->as_number))
        throw Error(node + ": a degree is a whole number from 1 to 15");
      return static_cast<std::uint32_t>(value->as_number);
    });
  std::vector<std::uint8_t> closed(parameters, 0);
  if (const Value* value = arguments.find("closed"))
    closed = by_parameter(value, parameters, node + ": 'closed'", [&](const Value* each) {
      if (each->kind != Value::boolean) throw Error(node + ": 'closed' is true or false");
      return static_cast<std::uint8_t>(each->as_number != 0);
    });
  const Value* knots = arguments.find("knots");
  if (knots && std::find(closed.begin(), closed.end(), 1) != closed.end())
    throw Error(node + ": 'closed' goes with equal distances between knots; leave out 'knots', or 'closed'");
  for (std::size_t j = 0; j < parameters; ++j) {
    if (closed[j] != 0) {
      close_net(net, j, piece.degrees[j], node);
      std::vector<double>& uniform = piece.knots.emplace_back();
      for (std::size_t i = 0; i < net.counts[j] + piece.degrees[j] + 1; ++i)
        uniform.push_back(static_cast<double>(i));
    } else {
      if (net.counts[j] < piece.degrees[j] + std::size_t{1})
        throw Error(node + ": " + counted(net.counts[j], "# point[s]; degree ") +
                    std::to_string(piece.degrees[j]) + " takes at least " +
                    std::to_string(piece.degrees[j] + 1));
      piece.knots.push_back(clamped_knots(piece.degrees[j], net.counts[j]));
    }
  }
  if (knots) {
    piece.knots = knots_of(knots, net, node);
    for (std::size_t j = 0; j < parameters; ++j)
      if (piece.knots[j].size() != net.counts[j] + piece.degrees[j] + 1)
        throw Error(node + ": " + counted(piece.knots[j].size(), "# knot[s]; ") +
                    counted(net.counts[j], "# point[s] of degree ") + std::to_string(piece.degrees[j]) +
                    " take " + std::to_string(net.counts[j] + piece.degrees[j] + 1));
  }
  piece.points = std::move(net.points);
  return spline(net.dimension, {std::move(piece)});
}

Expression make_subdivision(const StrictArguments& strict) {
  const Arguments& arguments = strict.all();
  const Value *points = arguments.find("points", 0), *faces = arguments.find("faces", 1);
  if (!points || !faces) throw Error("subdivision: needs the arguments 'points' and 'faces'");
  Grid grid = grid_of(points, "subdivision: 'points'");
  if (grid.counts.size() != 2 || grid.counts[1] < 3)
    throw Error("subdivision: 'points' has to be a list of points of 3 coordinates");
  SubdivisionSurface surface;
  surface.points = std::move(grid.numbers);
  if (faces->kind != Value::vector)
    throw Error("subdivision: 'faces' has to be a list of lists of point numbers");
  const Value* at = faces + 1;
  for (std::uint32_t f = 0; f < faces->size; at += at->span, ++f) {
    const Grid face = grid_of(at, "subdivision: 'faces'");
    auto& corners = surface.faces.emplace_back();
    for (const double corner : face.numbers) {
      if (face.counts.size() != 1 || !(corner >= 0 && corner < 4294967295.0) || corner != std::trunc(corner))
        throw Error("subdivision: a face is a list of point numbers");
      corners.push_back(static_cast<std::uint32_t>(corner));
    }
  }
  const std::string scheme = arguments.string("scheme", 2, "catmull-clark");
  if (scheme != "catmull-clark" && scheme != "loop")
    throw Error("subdivision: there is no scheme '" + scheme.substr(0, 60) +
                "'; there are catmull-clark and loop");
  if (scheme == "loop") surface.scheme = SubdivisionSurface::Scheme::loop;
  return subdivision_surface(static_cast<int>(grid.counts[1]), std::move(surface));
}

}  // namespace

std::span<const NodeRow> spline_nodes() {
  using enum NodeCategory;
  static constexpr NodeRow rows[] = {
      {"bezier", primitive, make_bezier, "points weights"},
      {"bspline", primitive, make_bspline, "degree points knots weights closed"},
      {"nurbs", primitive, make_bspline, "degree points knots weights closed"},
      {"subdivision", primitive, make_subdivision, "points faces scheme"},
  };
  static_assert(std::ranges::all_of(rows, &NodeRow::is_sound));
  return rows;
}

}  // namespace bsp2::model
