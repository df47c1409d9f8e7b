#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/network/axial_planes.hpp"
#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/dataflow/process/program.hpp"
#include "bsp2/dataflow/shapes/lathe.hpp"
#include "bsp2/dataflow/shapes/mesh.hpp"
#include "bsp2/dataflow/shapes/preimage.hpp"
#include "bsp2/dataflow/shapes/round_solids.hpp"
#include "bsp2/dataflow/shapes/spline.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// What answers for a primitive, and in which list of the network it is.
enum class ProducerKind : std::uint8_t {
  convex,    ///< a list of half-spaces
  lathe,     ///< convex, with very many half-spaces: Network::lathes
  mesh,      ///< Network::meshes
  round,     ///< Network::rounds; its half-spaces are its flat faces
  spline,    ///< Network::splines
  preimage,  ///< Network::preimages
};

/// Whether solids of the kind are enclosed ever closer, and never met.
constexpr bool is_curved(ProducerKind kind) {
  switch (kind) {
    case ProducerKind::convex:
    case ProducerKind::lathe:
    case ProducerKind::mesh:
      return false;
    case ProducerKind::round:
    case ProducerKind::spline:
    case ProducerKind::preimage:
      return true;
  }
  return false;
}

/// What the producers of a network are made of: one occurrence of a primitive, placed in the model. The box
/// contains it, rounded outward. ConvexProducer, LatheProducer, MeshProducer, RoundProducer, TorusProducer,
/// SplineProducer and PreimageProducer say how each kind answers.
/// Source: the paper, section 4.1, "Producers".
template <int D>
struct Producer : Box<D> {
  std::int32_t primitive = 0;  ///< its number in the source, in the order of the source (Node::parts)
  std::int32_t part = 0;       ///< index into Network::parts, or no_part; 0 if the whole model is one
  std::int32_t guard = -1;     ///< index into Network::guards: the innermost one around it, or -1
  std::uint32_t leaf = 0;      ///< where it is in Network::program
  std::uint32_t first_plane = 0,
                plane_count = 0;  ///< convex: its half-spaces, inside negative, in Network::planes
  ProducerKind kind = ProducerKind::convex;
  std::uint32_t index = 0;  ///< of what it is, in the list of its kind; of convex ones there is none
  bool undecided = false;   ///< convex, and only its outside is known: inside it cells stay FUZZY
  bool owns = true;         ///< cells may belong to it: it is not subtracted, nor in a complement
  /// Code + 1 of the producer's own hyperplane that bounds it along an axis from below / above, or 0.
  std::array<std::array<std::uint32_t, 2>, D> bounding_plane{};
};

/// A combiner of the program other than a union. Below unions alone, what is in a producer is in the solid.
struct Guard {
  std::uint32_t begin;  ///< in Network::program
  std::int32_t around;  ///< index of the next one outside, or -1
};

/// What of a model has a name: all that belongs to operands under `part` nodes of this name, or under
/// colours.
struct Part {
  std::string name;
  std::optional<model::Colour> colour;  ///< if all of it has one and the same
};

/// What divides a model into parts.
enum class Parts : std::uint8_t {
  none,    ///< nothing: the whole is one
  named,   ///< `part` nodes; of nested ones the outermost counts
  colours  ///< colours; of nested ones the outermost counts, as where they are drawn
};

/// The compiled expression: producers, and the combiners over them as a flat program (see Program).
///
/// Transformers are gone: their maps are folded into the producers' hyperplanes. Complements are pushed down
/// to the leaves, nested combiners of one kind are one n-ary combiner.
template <int D>
struct Network : Program {
  geometry::HyperplaneTable<D> table;
  std::vector<Producer<D>> producers;
  std::vector<geometry::OrientedHyperplane> planes;
  std::vector<bool> shared;    ///< by hyperplane: whether it is in `planes` more than once
  std::vector<Lathe> lathes;   ///< D = 3 only
  std::vector<Turned> turned;  ///< likewise: all stacks of polygons, by their maps
  std::vector<Mesh> meshes;    ///< D = 3 only
  std::vector<RoundSolid<D>> rounds;
  std::vector<Spline<D>> splines;
  std::vector<Preimage<D>> preimages;
  std::vector<Word> program;  ///< empty: the solid is empty
  std::vector<Guard> guards;
  std::vector<std::optional<model::Colour>> colours;  ///< of each primitive; empty where the model has none
  bool has_colours = false;                           ///< several
  std::vector<Part> parts;  ///< that have a name, in the order of the source; none: the whole model is part 0
  Box<D> bounds = Box<D>::empty();  ///< of the solid, before anything is evaluated
  double coincidence = 0;           ///< what it was compiled with: CompileOptions::coincidence
  AxialPlanes<D> axial_planes;
  std::vector<std::string> warnings;  ///< what the user should know about the solid that was compiled

  explicit Network(geometry::HyperplaneTable<D> table_) : table(std::move(table_)) {}

  /// The cut across an axis at the last position of the table's grid that is <= value, or the model's
  /// hyperplane there.
  [[nodiscard]] geometry::HyperplaneId axial_cut(int axis, double value) const {
    return axial_planes.cut(table, axis, table.axis_position(axis, value));
  }
  /// Whether cells are told apart by what they belong to: no cell has points of two parts, and a cut where
  /// the part changes is never given back.
  [[nodiscard]] bool is_divided() const { return !parts.empty(); }
  /// What a cell belongs to, by its owner.
  [[nodiscard]] std::int32_t primitive_of(std::int32_t owner) const {
    if (owner < 0) return geometry::no_primitive;
    const Producer<D>& producer = producers[static_cast<std::size_t>(owner)];
    return producer.owns ? producer.primitive : geometry::no_primitive;
  }
  [[nodiscard]] std::int32_t part_of(std::int32_t owner) const {
    if (!is_divided()) return 0;
    return owner >= 0 ? producers[static_cast<std::size_t>(owner)].part : geometry::no_part;
  }
  /// Whether several convex producers end in this hyperplane, or one of many half-spaces does twice.
  [[nodiscard]] bool is_shared(geometry::HyperplaneId id) const { return id < shared.size() && shared[id]; }
  /// Whether it has solids that are refined without end.
  [[nodiscard]] bool is_round() const { return !rounds.empty() || !splines.empty() || !preimages.empty(); }
  [[nodiscard]] std::span<const geometry::OrientedHyperplane> planes_of(const Producer<D>& producer) const {
    return {planes.data() + producer.first_plane, producer.plane_count};
  }
};

struct CompileOptions {
  double coincidence = 1e-9;  ///< hyperplanes closer than this share of the bounding box are one
  Parts parts = Parts::named;
  unsigned threads = 1;  ///< that place primitives; the network is the same for any number
  /// What messages about a construct, or about a primitive, begin with: its place in the source. May be
  /// missing.
  std::function<std::string(const model::Node&)> place_of;
  std::function<std::string(std::int32_t)> place_of_primitive;
  /// Is told what there is to say about a solid that is evaluated on the way, since a construct is made of
  /// what comes out. May be missing.
  std::function<void(const std::string&)> tell_of_nested;
  bool is_nested = false;  ///< it is such a solid: its primitives have no numbers that anybody knows
};

/// Lowers an expression to a network. @pre expression.dimension() == D.
/// A solid that only complements bound is cut off at the bounds of its primitives. That, and primitives that
/// are thinner than the tolerance, are told in the network's warnings.
/// @throws bsp2::Error if lengths are too large or too small, absolutely or for each other.
/// Source: the paper, section 4.2, "Compilation".
template <int D>
Network<D> compile(const model::Expression& expression, const CompileOptions& options);

}  // namespace bsp2::dataflow
