#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/parallel.hpp"
#include "compile/distant_planes.hpp"
#include "compile/facet_corners.hpp"
#include "compile/resolve.hpp"
#include "lowering/lowering.hpp"
#include "lowering/shapes.hpp"
#include "shapes/preimage_shape.hpp"
#include "shapes/spline_shape.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Float128;
using geometry::HyperplaneTable;
using geometry::OrientedHyperplane;

/// Collects shapes and places occurrences: from the lowered tree to a network.
template <int D>
class Compiler {
 public:
  /// @param lowered is used up.
  Compiler(Lowered<D>& lowered, const CompileOptions& options) : lowered_(lowered), options_(options) {}

  Network<D> run() {
    make_shapes();
    std::vector<Producer<D>> producers = make_producers();
    double reach = 0;
    for (const Producer<D>& producer : producers)
      for (int i = 0; i < D; ++i)
        reach = std::max({reach, std::fabs(producer.lower[i]), std::fabs(producer.upper[i])});
    check_sizes(producers, reach);
    Box<D> box = bounds_of(lowered_, producers);
    if (box.is_empty()) {
      Network<D> network = empty_network();
      network.parts = std::move(lowered_.parts);
      return network;
    }
    is_a_point_ = is_a_point(producers, box);
    const bool bounded = box.is_finite();
    if (!bounded) box = hull_of(producers);
    check_proportions(box, reach);

    Network<D> network(HyperplaneTable<D>(box.lower, box.upper, reach));
    network.coincidence = options_.coincidence;
    network.bounds = box;
    network.parts = std::move(lowered_.parts);
    network.producers = std::move(producers);
    add_colours(network);
    colour_parts(network);
    network.program = std::move(lowered_.program);
    network.guards = std::move(lowered_.guards);
    add_planes(network, box);
    find_shared(network);
    network.axial_planes = AxialPlanes<D>(network.table, options_.coincidence);
    if (!bounded)
      network.warnings.push_back(
          "the solid has no bounds: it is the complement of something, or holds one; it is cut off at the "
          "bounds of its primitives; "
          "intersect it with a box to say where it ends");
    warn_of_flat_primitives(network);
    return network;
  }

 private:
  Lowered<D>& lowered_;  // its placements become those of the normalized frames
  const CompileOptions& options_;
  Shapes<D> shapes_;
  std::vector<std::uint32_t> shape_of_;  // of each occurrence

  void check_sizes(const std::vector<Producer<D>>& producers, double reach) const {
    for (std::size_t i = 0; i < producers.size(); ++i) {
      const Transformer<D>& placement = lowered_.occurrences[i].placement;
      if (!is_surely_small(placement, reach))
        at_its_place(producers[i].primitive, [&] { check_size(placement, reach); });
    }
  }

  /// By the exponents.
  static bool is_surely_small(const Transformer<D>& placement, double reach) {
    const auto exponent = [](Float128 x) { return geometry::Float128Bits(x).exponent_field(); };
    const int limit =
        exponent(static_cast<Float128>(std::min(largest, 0x1p20L * static_cast<long double>(reach))));
    for (const auto& row : placement.matrix())
      for (const Float128 entry : row)
        if (exponent(entry) >= limit) return false;
    return true;
  }

  /// Second moments are powers D + 2 of lengths, and all must stay far from the limits of a double.
  static constexpr long double largest = D < 6 ? 1e40L : 1e38L;
  [[noreturn]] static void refuse_size() {
    throw Error(std::string("the model is too large: lengths above ") + (D < 6 ? "1e40" : "1e38") +
                " or not finite; look for huge factors in its matrices");
  }

  static void check_size(const Transformer<D>& placement, double reach) {
    for (const auto& row : placement.matrix())
      for (const Float128 entry : row) {
        const auto size = std::fabs(static_cast<long double>(entry));
        if (!(size <= largest)) refuse_size();
        if (size > 0x1p20L * static_cast<long double>(reach))
          throw Error(
              "a primitive is modelled more than a million times its reach away from where its matrices put "
              "it; model it nearer to the origin");
      }
  }

  /// Errors in `work` get the place of the primitive.
  template <typename Work>
  void at_its_place(std::int32_t primitive, Work&& work) const {
    try {
      work();
    } catch (const Error& error) {
      throw Error((options_.place_of_primitive ? options_.place_of_primitive(primitive) : "") + error.what());
    }
  }

  /// The grid must resolve the solid, however far its largest primitive reaches. A solid that is almost
  /// nothing, such as the intersection of two that touch, gets some space around it.
  static void check_proportions(Box<D>& box, double reach) {
    double size = 0;
    for (int i = 0; i < D; ++i) size = std::max(size, box.upper[i] - box.lower[i]);
    if (!std::isfinite(size) || !(reach <= static_cast<double>(largest))) refuse_size();
    if (size > 0 && size < 1e-40) throw Error("the model is smaller than 1e-40; scale it up");
    if (size > 0 && reach > 0x1p68 * size)
      throw Error(
          "a primitive reaches more than 2^68 times farther than the solid is large; make that primitive "
          "smaller");
    const double missing = reach * 0x1p-40 - size;
    for (int i = 0; i < D && missing > 0; ++i) {
      box.lower[i] -= missing / 2;
      box.upper[i] += missing / 2;
    }
  }

  static Network<D> empty_network() {
    std::array<double, D> zero{}, one;
    one.fill(1);
    return Network<D>(HyperplaneTable<D>(zero, one, 1));
  }

  void add_colours(Network<D>& network) const {
    const auto& occurrences = lowered_.occurrences;
    if (std::none_of(occurrences.begin(), occurrences.end(),
                     [](const auto& occurrence) { return occurrence.colour != nullptr; }))
      return;
    const Occurrence<D>* first = nullptr;  // to which something may belong
    for (const Occurrence<D>& occurrence : occurrences) {
      const auto number = static_cast<std::size_t>(occurrence.number);
      if (network.colours.size() <= number) network.colours.resize(number + 1);
      if (occurrence.colour != nullptr) network.colours[number] = *occurrence.colour;
      if ((lowered_.program[occurrence.leaf] & Program::negated) != 0 || !occurrence.owns) continue;
      if (first == nullptr) first = &occurrence;
      network.has_colours = network.has_colours || colour_of(occurrence) != colour_of(*first);
    }
  }

  static std::optional<model::Colour> colour_of(const Occurrence<D>& occurrence) {
    return occurrence.colour != nullptr ? std::optional(*occurrence.colour) : std::nullopt;
  }

  /// A part has the colour that all of it has.
  void colour_parts(Network<D>& network) const {
    std::vector<bool> is_met(network.parts.size());
    for (const Occurrence<D>& occurrence : lowered_.occurrences) {
      if (network.parts.empty() || occurrence.part < 0) continue;
      const auto part = static_cast<std::size_t>(occurrence.part);
      const auto colour = colour_of(occurrence);
      if (!is_met[part])
        network.parts[part].colour = colour;
      else if (network.parts[part].colour != colour)
        network.parts[part].colour.reset();
      is_met[part] = true;
    }
  }

  void make_shapes() {
    constexpr std::size_t at_once = 4096;  // so that few meshes are held twice
    const auto& occurrences = lowered_.occurrences;
    std::vector<const model::Primitive*> next;
    for (std::size_t first = 0; first < occurrences.size(); first += at_once) {
      next.clear();
      const auto some = std::span(occurrences).subspan(first, std::min(at_once, occurrences.size() - first));
      for (const Occurrence<D>& occurrence : some) next.push_back(occurrence.primitive);
      shapes_.prepare(next, options_.threads);
    }
  }

  /// Placements become those of the shapes' normalized frames.
  std::vector<Producer<D>> make_producers() {
    constexpr std::size_t grain = 64;
    auto& occurrences = lowered_.occurrences;
    shape_of_.resize(occurrences.size());
    std::vector<Producer<D>> producers(occurrences.size());
    geometry::for_each_range(occurrences.size(), grain, options_.threads,
                             [&](std::size_t first, std::size_t end) {
                               for (std::size_t i = first; i < end; ++i) {
                                 Occurrence<D>& occurrence = occurrences[i];
                                 const Framed<D> framed = shapes_.of(*occurrence.primitive);
                                 shape_of_[i] = framed.shape;
                                 occurrence.placement = occurrence.placement.after(framed.frame);
                                 const Shape<D>& shape = shapes_[framed.shape];
                                 producers[i].primitive = occurrence.number;
                                 producers[i].part = occurrence.part;
                                 producers[i].guard = occurrence.guard;
                                 producers[i].leaf = occurrence.leaf;
                                 producers[i].owns = occurrence.owns;
                                 producers[i].undecided = shape.undecided;
                                 static_cast<Box<D>&>(producers[i]) = image_of(shape, occurrence.placement);
                               }
                             });
    return producers;
  }

  static Box<D> image_of(const Shape<D>& shape, const Transformer<D>& placement) {
    if (shape.ball_axes) return placement.image_of_round(*shape.ball_axes);
    return shape.rings.empty() ? placement.image(shape.bounds) : placement.image(shape.rings);
  }

  static constexpr std::uint32_t no_map = ~std::uint32_t{0};

  /// Adds the maps of the producers that the box does not miss. Makes room for all that is added for these,
  /// at least for those with flat faces.
  /// @return the map of each producer.
  std::vector<std::uint32_t> add_maps(Network<D>& network, const Box<D>& box) const {
    constexpr std::size_t grain = 64;
    const auto& producers = network.producers;
    std::vector<std::uint32_t> map_of(producers.size(), no_map);
    std::size_t planes = 0;
    std::uint32_t maps = 0;
    for (std::size_t i = 0; i < producers.size(); ++i) {
      if (box.misses(producers[i])) continue;
      map_of[i] = maps++;
      planes += shapes_[shape_of_[i]].covector_count;
    }
    if (planes > std::numeric_limits<std::uint32_t>::max())
      throw Error("the model's primitives have more than 4,294,967,295 half-spaces; divide it");
    network.planes.reserve(planes);
    network.table.reserve(maps);
    const std::uint32_t first_map = network.table.add_maps(maps);
    for (std::uint32_t& map : map_of)
      if (map != no_map) map += first_map;
    geometry::for_each_range(
        producers.size(), grain, options_.threads, [&](std::size_t first, std::size_t end) {
          for (std::size_t i = first; i < end; ++i)
            if (map_of[i] != no_map)
              network.table.set_map(map_of[i], lowered_.occurrences[i].placement.matrix(), producers[i].lower,
                                    producers[i].upper);
        });
    return map_of;
  }

  bool is_a_point_ = false;

  static double width_of(const Box<D>& box) {
    double width = 0;
    for (int i = 0; i < D; ++i) width = std::max(width, box.upper[i] - box.lower[i]);
    return width;
  }

  /// Whether a model is no more than what corners of all its primitives are rounded by, as where they touch
  /// in a point: there is nothing solid in it.
  static bool is_a_point(std::span<const Producer<D>> producers, const Box<D>& box) {
    constexpr double rounded_by = 0x1p-48;
    double least = std::numeric_limits<double>::infinity();  // how far the nearest of them reaches
    for (const Producer<D>& producer : producers) {
      double reach = 0;
      for (int i = 0; i < D; ++i)
        reach = std::max({reach, std::fabs(producer.lower[i]), std::fabs(producer.upper[i])});
      least = std::min(least, reach);
    }
    return width_of(box) <= rounded_by * least;
  }

  /// Enclosures of patches are computed in double precision: they are off by 2^-52 of how far the control
  /// points reach, twice at least. Where that is more than what tells hyperplanes apart in the model, halving
  /// patches decides nothing and does not end.
  static bool is_known_well(double scale, const Box<D>& box) {
    constexpr double apart = 1e-9;
    return scale * enclosures_are_off <= apart * width_of(box);
  }
  static constexpr double enclosures_are_off = 0x1p-51;
  [[noreturn]] static void refuse_reach(double scale) {
    std::ostringstream text;
    text << "the control points of a spline or subdivision surface reach " << scale
         << " units, far beyond the model: "
         << "the surface is known to " << scale * enclosures_are_off
         << " units there, which is too coarse to cut it; move the points that are so far away "
         << "nearer, or leave them out";
    throw Error(text.str());
  }

  /// Patches are halved in all parameters at once. Where a point lies far outside of the model they are that
  /// much longer one way than the other, and as many come into each cell: the time grows with their square.
  static void check_steepness(double scale, const Box<D>& box) {
    constexpr double most = 2048;  // which takes some seconds
    if (scale <= most * width_of(box)) return;
    std::ostringstream text;
    text
        << "the control points of a spline or subdivision surface reach " << scale
        << " units, far beyond the model: that is more than " << most
        << " times as far as the model is wide, and to cut a surface that is so steep would take minutes, or "
           "hours; move the points that are so far away nearer, or leave them out";
    throw Error(text.str());
  }

  void add_planes(Network<D>& network, const Box<D>& box) {
    HyperplaneTable<D>& table = network.table;
    table.add_covectors(shapes_.take_covectors());
    const auto placement = [&](std::size_t i) -> const Transformer<D>& {
      return lowered_.occurrences[i].placement;
    };
    const std::vector<std::uint32_t> map_of = add_maps(network, box);
    std::vector<std::uint32_t> first_occurrence, maps(network.producers.size());  // maps: of round solids
    first_occurrence.reserve(network.producers.size());
    std::map<std::size_t, PreimageFrame<D>> frames;   // by producer
    std::map<std::size_t, PlacedPatches<D>> patches;  // by producer
    std::uint32_t rounds = 0;
    for (std::size_t i = 0; i < network.producers.size(); ++i) {
      Producer<D>& producer = network.producers[i];
      const Shape<D>& shape = shapes_[shape_of_[i]];
      first_occurrence.push_back(0);
      std::optional<std::uint32_t> first;
      const bool matters = map_of[i] != no_map;
      if (matters && shape.covector_count > 0 && table.orientation(map_of[i]) != 0)
        first = table.add_occurrences(map_of[i], shape.first_covector, shape.covector_count);
      if (first && shape.turned) network.turned.push_back({map_of[i], producer.primitive, shape.turned});
      if (matters && shape.is_spline()) {
        const auto& placed =
            patches
                .emplace(i, shape.spline != nullptr ? place<D>(*shape.spline, placement(i))
                                                    : place<D>(*shape.subdivision, placement(i)))
                .first->second;
        const bool is_known = is_known_well(placed.placement.scale, box);
        if (!is_known && is_a_point_) {
          make_empty(producer);
          continue;
        }
        first = 0;  // it has no half-spaces
        ++rounds;
        at_its_place(producer.primitive, [&] {
          if (!is_known) refuse_reach(placed.placement.scale);
          if (!placed.roots.empty() && placed.roots.front().parameters > 1)
            check_steepness(placed.placement.scale, box);
        });
        std::array<double, D> factors;
        factors.fill(placed.placement.scale);
        maps[i] = table.add_map(Transformer<D>::scaling(factors, placed.placement.origin).matrix());
      } else if (matters && shape.is_round()) {
        maps[i] = table.add_map(placement(i).matrix());
        if (shape.preimage != nullptr) {
          const auto& frame = frames.emplace(i, PreimageFrame<D>(producer)).first->second;
          frames.at(i).map = table.add_map(Transformer<D>::scaling(frame.scale, frame.origin).matrix());
        }
        if (table.orientation(maps[i]) != 0) {
          first = first.value_or(0);  // a ball has no half-spaces
          ++rounds;
        }
      }
      if (first)
        first_occurrence.back() = *first;
      else if (matters)
        flatten(producer);
      else
        make_empty(producer);
    }
    std::vector<std::size_t> meshes;  // the producers that are meshes
    std::vector<OrientedHyperplane> codes = table.merge(options_.coincidence, options_.threads);
    const auto planes_of = [&](std::size_t i) {
      return std::span(codes).subspan(first_occurrence[i], shapes_[shape_of_[i]].covector_count);
    };
    const auto facets_of = [&](const auto i) {
      return merged_facets(i, placement(i).matrix(), map_of[i], planes_of(i));
    };
    if constexpr (D == 3) keep_corners(network, facets_of, planes_of);
    part_distant(network, map_of, planes_of);
    for (std::size_t i = 0; i < network.producers.size(); ++i) {
      Producer<D>& producer = network.producers[i];
      if (producer.is_empty()) continue;
      const Shape<D>& shape = shapes_[shape_of_[i]];
      const auto own = planes_of(i);
      if (shape.is_round()) {
        const std::uint32_t ids = network.table.free_ids() / rounds--;
        if (shape.is_spline()) {
          add_spline(network, producer, std::move(patches.at(i)), maps[i], ids);
          continue;
        }
        if (shape.preimage != nullptr) {
          at_its_place(producer.primitive, [&] {
            add_preimage(network, producer, *shape.preimage, maps[i], frames.at(i), ids, box);
          });
          continue;
        }
        add_half_spaces(network, producer, own);
        if (producer.is_empty()) continue;
        add_round(network, producer, shape.place_round(table, maps[i], ids));
        continue;
      }
      if constexpr (D == 3) {
        if (shape.mesh != nullptr && !shape.mesh->convex) {
          producer.kind = ProducerKind::mesh;
          producer.index = static_cast<std::uint32_t>(meshes.size());
          meshes.push_back(i);
          continue;
        }
        if (shape.lathe != nullptr) {
          const auto facets = own.first(shape.lathe->facet_count);
          add_half_spaces(network, producer, facets);
          if (producer.is_empty()) continue;
          // LatheProducer finds the half-spaces by their place among all.
          network.planes.resize(producer.first_plane);
          network.planes.insert(network.planes.end(), facets.begin(), facets.end());
          producer.plane_count = static_cast<std::uint32_t>(facets.size());
          producer.kind = ProducerKind::lathe;
          producer.index = static_cast<std::uint32_t>(network.lathes.size());
          network.lathes.push_back(place_lathe(*shape.lathe, placement(i), own, table.radius(),
                                               options_.coincidence * table.width()));
          continue;
        }
      }
      add_half_spaces(network, producer, own);
    }
    if constexpr (D == 3) place_meshes(network, meshes, facets_of);
  }

  /// Of merging, as a length.
  [[nodiscard]] double tolerance_in(const Network<D>& network) const {
    return options_.coincidence * network.table.width();
  }

  /// Those of a mesh, with the planes that they have now. Of D = 3.
  MergedFacets merged_facets(std::size_t i, const geometry::Matrix<3>& matrix, std::uint32_t map,
                             std::span<OrientedHyperplane> planes) const {
    const Shape<D>& shape = shapes_[shape_of_[i]];
    return {*shape.mesh, matrix, map, shape.first_covector, planes};
  }

  /// Takes merging back for convex solids whose facets solids elsewhere represent. @param planes_of the
  /// hyperplanes of any producer.
  template <typename PlanesOf>
  void part_distant(Network<D>& network, const std::vector<std::uint32_t>& map_of,
                    const PlanesOf& planes_of) const {
    const bool has_any = std::ranges::any_of(shape_of_, [&](std::uint32_t shape) {
      return shapes_[shape].is_convex() && shapes_[shape].covector_count >= facets_to_part;
    });
    if (!(options_.coincidence > 0) || !has_any) return;
    std::vector<PlacedPlanes<D>> solids;
    for (std::size_t i = 0; i < network.producers.size(); ++i)
      if (const Shape<D>& shape = shapes_[shape_of_[i]]; !network.producers[i].is_empty())
        solids.push_back(
            {&network.producers[i], map_of[i], shape.first_covector, planes_of(i), shape.is_convex()});
    part_distant_planes<D>(network.table, solids, tolerance_in(network), options_.threads);
  }

  /// Takes merging back where corners of meshes would move, or few facets have been. @param facets_of those
  /// of a producer that is a mesh. @param planes_of the hyperplanes of any producer.
  template <typename FacetsOf, typename PlanesOf>
  void keep_corners(Network<3>& network, const FacetsOf& facets_of, const PlanesOf& planes_of) const {
    if (!(options_.coincidence > 0)) return;
    std::vector<std::size_t> meshes;
    for (std::size_t i = 0; i < network.producers.size(); ++i)
      if (const auto& mesh = shapes_[shape_of_[i]].mesh;
          mesh && !mesh->convex && !network.producers[i].is_empty())
        meshes.push_back(i);
    const double tolerance = tolerance_in(network);
    const auto corners_of = [&](std::size_t i) {
      return FacetCorners(network.table, facets_of(i), tolerance);
    };
    std::vector<char> moves(meshes.size()), is_tilted(meshes.size());
    geometry::for_each_range(meshes.size(), 16, options_.threads, [&](std::size_t first, std::size_t end) {
      for (std::size_t k = first; k < end; ++k) {
        const FacetCorners corners = corners_of(meshes[k]);
        moves[k] = corners.stay() ? 0 : 1;
        is_tilted[k] = corners.tilted() > 0 ? 1 : 0;
      }
    });
    HyperplaneTable<3>::Unmerging unmerging(network.table);
    for (std::size_t k = 0; k < meshes.size(); ++k)
      if (moves[k] != 0) corners_of(meshes[k]).keep(unmerging);
    if (std::ranges::find(is_tilted, 1) == is_tilted.end()) return;
    const std::vector<bool> shared = shared_planes(network, planes_of);
    for (std::size_t k = 0; k < meshes.size(); ++k)
      if (is_tilted[k] != 0) corners_of(meshes[k]).part_few(shared, unmerging);
  }

  /// The hyperplanes that more than one producer has, by id.
  template <typename PlanesOf>
  static std::vector<bool> shared_planes(const Network<3>& network, const PlanesOf& planes_of) {
    const auto& producers = network.producers;
    std::vector<std::size_t> owner(network.table.size(), producers.size());
    std::vector<bool> shared(network.table.size());
    for (std::size_t i = 0; i < producers.size(); ++i) {
      if (producers[i].is_empty()) continue;
      for (const OrientedHyperplane plane : planes_of(i)) {
        if (owner[plane.id()] != producers.size() && owner[plane.id()] != i) shared[plane.id()] = true;
        owner[plane.id()] = i;
      }
    }
    return shared;
  }

  /// @param producers that are meshes. @param facets_of those of a producer.
  template <typename FacetsOf>
  void place_meshes(Network<3>& network, const std::vector<std::size_t>& producers,
                    const FacetsOf& facets_of) const {
    std::vector<std::optional<Mesh>> placed(producers.size());
    constexpr std::size_t grain = 16;
    geometry::for_each_range(
        producers.size(), grain, options_.threads, [&](std::size_t first, std::size_t end) {
          for (std::size_t k = first; k < end; ++k) {
            const std::size_t i = producers[k];
            const Shape<3>& shape = shapes_[shape_of_[i]];
            placed[k] = place_mesh(*shape.mesh, lowered_.occurrences[i].placement.matrix(),
                                   network.table.grid_exponent(), facets_of(i).planes);
            placed[k]->first = {facets_of(i).map, shape.first_covector};
            placed[k]->is_exact = has_exact_planes(network.table, *placed[k]);
            if (options_.coincidence > 0 && !placed[k]->is_exact)
              placed[k]->moved = FacetCorners(network.table, facets_of(i), tolerance_in(network)).moved();
          }
        });
    // What lies between hyperplanes that merging has moved apart has one answer of all meshes.
    const bool are_exact = std::ranges::all_of(placed, [](const auto& mesh) { return mesh->is_exact; });
    for (auto& mesh : placed) mesh->is_exact = are_exact;
    network.meshes.reserve(placed.size());
    for (auto& mesh : placed) network.meshes.push_back(std::move(*mesh));
  }

  /// The half-spaces of a convex producer, each once. One that merging has made flat is empty.
  void add_half_spaces(Network<D>& network, Producer<D>& producer, std::span<const OrientedHyperplane> own) {
    std::vector<OrientedHyperplane>& planes = own_planes_;
    planes.assign(own.begin(), own.end());
    std::sort(planes.begin(), planes.end(), [](auto a, auto b) { return a.code < b.code; });
    planes.erase(std::unique(planes.begin(), planes.end()), planes.end());
    for (std::size_t i = 0; i + 1 < planes.size(); ++i)
      if (planes[i].id() == planes[i + 1].id()) return flatten(producer);
    producer.first_plane = static_cast<std::uint32_t>(network.planes.size());
    producer.plane_count = static_cast<std::uint32_t>(planes.size());
    network.planes.insert(network.planes.end(), planes.begin(), planes.end());
    for (const OrientedHyperplane plane : planes) note_bounding_plane(network, producer, plane);
  }

  static void find_shared(Network<D>& network) {
    std::vector<bool> seen(network.table.size());
    network.shared.resize(network.table.size());
    for (const OrientedHyperplane plane : network.planes) {
      if (seen[plane.id()]) network.shared[plane.id()] = true;
      seen[plane.id()] = true;
    }
  }

  std::vector<OrientedHyperplane> own_planes_;  // of one producer

  void add_round(Network<D>& network, Producer<D>& producer, RoundSolid<D> solid) {
    for (const OrientedHyperplane tangent :
         std::visit([](const auto& placed) { return placed.axis_tangents(); }, solid))
      note_bounding_plane(network, producer, tangent);
    producer.kind = ProducerKind::round;
    producer.index = static_cast<std::uint32_t>(network.rounds.size());
    network.rounds.push_back(std::move(solid));
  }

  /// If it bounds the producer along an axis.
  static void note_bounding_plane(const Network<D>& network, Producer<D>& producer,
                                  OrientedHyperplane plane) {
    const auto h = network.table.rounded(plane.id());
    for (int axis = 0; axis < D; ++axis)
      if (std::fabs(h.normal[axis]) > 1 - 1e-12)
        producer.bounding_plane[axis][(h.normal[axis] > 0) != plane.flipped() ? 1 : 0] = plane.code + 1;
  }

  void add_spline(Network<D>& network, Producer<D>& producer, PlacedPatches<D> placed, std::uint32_t map,
                  std::uint32_t ids) {
    const auto tree = std::make_shared<PatchTree<D>>(std::move(placed.roots), placed.placement, placed.error,
                                                     placed.weight_ratio, placed.closed, ids);
    check_hyperplanes(tree->count(), ids);
    producer.kind = ProducerKind::spline;
    producer.index = static_cast<std::uint32_t>(network.splines.size());
    network.splines.push_back({tree, network.table.add_family(map, geometry::SharedFamily<D>(tree))});
  }

  void add_preimage(Network<D>& network, Producer<D>& producer, const model::Preimage& preimage,
                    std::uint32_t map, const PreimageFrame<D>& frame, std::uint32_t ids, const Box<D>& box) {
    HyperplaneTable<D>& table = network.table;
    auto placed = place_preimage<D>(preimage, table.map(map).inverse(table.radius()), frame, ids);
    if (std::holds_alternative<model::Spline>(preimage.solid) ||
        std::holds_alternative<model::SubdivisionSurface>(preimage.solid)) {
      // The width of the model, as it is and in units of what the control points reach.
      double width = 0, in_frame = 0;
      for (int i = 0; i < D; ++i) {
        width = std::max(width, box.upper[i] - box.lower[i]);
        in_frame = std::max(in_frame, placed.weight[i] * (box.upper[i] - box.lower[i]));
      }
      if (in_frame > 0 && !is_known_well(width / in_frame, box)) refuse_reach(width / in_frame);
    }
    check_hyperplanes(placed.planes->count(), ids);
    producer.kind = ProducerKind::preimage;
    producer.index = static_cast<std::uint32_t>(network.preimages.size());
    placed.first = table.add_family(frame.map, geometry::SharedFamily<D>(placed.planes));
    network.preimages.push_back(std::move(placed));
  }

  std::set<std::int32_t> flat_primitives_;
  std::int32_t flat_primitive_ = 0;  // the first one
  Box<D> flat_box_;

  /// The pieces of one drawing are one primitive.
  void flatten(Producer<D>& producer) {
    if (flat_primitives_.empty()) {
      flat_primitive_ = producer.primitive;
      flat_box_ = producer;
    }
    flat_primitives_.insert(producer.primitive);
    make_empty(producer);
  }

  void warn_of_flat_primitives(Network<D>& network) const {
    if (flat_primitives_.empty()) return;
    std::ostringstream text;
    if (options_.place_of_primitive) text << options_.place_of_primitive(flat_primitive_);
    const std::size_t count = flat_primitives_.size();
    const bool is_merged = options_.coincidence > 0;
    text << counted(count, "# primitive[s] [is|are] ");
    if (is_merged)
      text << "thinner than the tolerance, " << options_.coincidence << " of "
           << (options_.is_nested ? "what it is made of" : "the model") << ", and left out: ";
    else
      text << counted(count,
                      "flat to the last bit of [its|their] numbers, so [it encloses|they enclose] nothing, "
                      "and left out: ");
    if (count > 1) text << "the first one is ";
    if (!options_.is_nested) text << "primitive " << flat_primitive_ << ", ";
    text << "between (";
    for (int i = 0; i < D; ++i) text << (i == 0 ? "" : ", ") << flat_box_.lower[i];
    text << ") and (";
    for (int i = 0; i < D; ++i) text << (i == 0 ? "" : ", ") << flat_box_.upper[i];
    text << ")";
    if (is_merged) text << "; --coincidence 0 keeps all that the numbers of the model express";
    network.warnings.push_back(text.str());
  }

  static void make_empty(Producer<D>& producer) { static_cast<Box<D>&>(producer) = Box<D>::empty(); }
};

}  // namespace

template <int D>
Network<D> compile(const model::Expression& expression, const CompileOptions& options) {
  std::vector<std::string> warnings;
  const model::Expression resolved = resolve(expression, options, warnings);
  Lowered<D> lowered = lower<D>(resolved, options.parts);
  Network<D> network = Compiler<D>(lowered, options).run();
  network.warnings.insert(network.warnings.begin(), warnings.begin(), warnings.end());
  return network;
}

#define BSP2_INSTANTIATE(D) template Network<D> compile<D>(const model::Expression&, const CompileOptions&);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
