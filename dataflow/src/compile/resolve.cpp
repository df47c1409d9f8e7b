#include "compile/resolve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "bsp2/model/expression/bottom_up.hpp"
#include "constructs/extrusion.hpp"
#include "constructs/offset.hpp"
#include "constructs/outline.hpp"
#include "constructs/roof.hpp"
#include "operands/enclosure.hpp"
#include "operands/faceting.hpp"
#include "operands/nd_constructs.hpp"
#include "operands/nested.hpp"

namespace bsp2::dataflow {
namespace {

using model::Boolean;
using model::Construction;
using model::Expression;
using model::Node;
using model::Primitive;
using model::Transform;

using Rewriting = model::BottomUp<Expression>;

Expression make(int dimension, Node::Value value) {
  return Expression(std::make_shared<Node>(dimension, std::move(value)));
}

Expression united(int dimension, std::vector<Expression> solids) {
  std::erase_if(solids, [](const Expression& solid) { return is_empty(solid) && solid.node().parts == 0; });
  if (solids.empty()) return Expression(dimension);
  return solids.size() == 1 ? solids[0] : model::unite(std::move(solids));
}

/// A Boolean of images, some of which may have turned out empty.
Expression boolean_of(const Boolean& boolean, int dimension, std::vector<Expression> images) {
  using model::Operation;
  switch (boolean.operation) {
    case Operation::unite:
      return united(dimension, std::move(images));
    case Operation::intersect:
      if (std::any_of(images.begin(), images.end(), is_empty)) return Expression(dimension);
      break;
    case Operation::subtract:
      if (is_empty(images[0])) return Expression(dimension);
      break;
    case Operation::symmetric_difference:
    case Operation::complement:
      break;
  }
  return make(dimension, Boolean{boolean.operation, std::move(images)});
}

/// The image of a node as one part that stands for all of those in the node, whatever it was made of.
Expression one_part(const Expression& image, std::uint64_t parts) {
  if (std::holds_alternative<Primitive>(image.node().value) && parts == 1) return image;
  if (const auto* boolean = std::get_if<Boolean>(&image.node().value))
    return make(image.dimension(), Boolean{boolean->operation, boolean->children, parts});
  return make(image.dimension(), Boolean{model::Operation::unite, {image}, parts});
}

/// A Boolean of these images, as one part where the node is one.
Expression boolean_of(const Boolean& boolean, const Node& node, std::vector<Expression> images) {
  Expression image = boolean_of(boolean, node.dimension, std::move(images));
  return image.node().parts == node.parts
             ? image
             : one_part(image, node.parts);  // other than the node's: it is empty
}

/// The outermost colour and name around the first primitive of an operand.
struct Looks {
  std::optional<model::Colour> colour;
  std::optional<std::string> part;

  /// What is made of operands that are no more looks like the first of them, unless something around it says
  /// else.
  [[nodiscard]] Expression on(Expression image) const {
    if (is_empty(image)) return image;
    const int dimension = image.dimension();
    if (part) image = make(dimension, model::Named{model::Named::Role::part, *part, std::move(image)});
    return colour ? make(dimension, model::Coloured{*colour, std::move(image)}) : image;
  }
};

Looks looks_of(const Expression& operand) {
  Looks looks;
  const Node* node = &operand.node();
  for (; !node->children().empty(); node = &node->children().front().node()) {
    if (const auto* boolean = std::get_if<Boolean>(&node->value);
        boolean != nullptr && boolean->operation == model::Operation::complement)
      break;
    if (const auto* coloured = std::get_if<model::Coloured>(&node->value);
        coloured != nullptr && !looks.colour)
      looks.colour = coloured->colour;
    const auto* named = std::get_if<model::Named>(&node->value);
    if (named != nullptr && named->role == model::Named::Role::part && !looks.part) looks.part = named->name;
  }
  return looks;
}

/// The looks of constructs that are operands of another one say no more.
void take_looks_off(const Construction& construction, std::vector<Expression>& images) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!std::holds_alternative<Construction>(construction.operands[i].node().value)) continue;
    if (const auto* coloured = std::get_if<model::Coloured>(&images[i].node().value))
      images[i] = Expression(coloured->child);
    if (const auto* named = std::get_if<model::Named>(&images[i].node().value))
      images[i] = Expression(named->child);
  }
}

/// What there is to know about a construct before it is made.
struct ConstructRow {
  const char* name;          ///< that messages about it begin with
  bool is_bounded = true;    ///< it goes by the points of its operands, so that these have to be bounded
  bool is_monotone = false;  ///< it makes of a larger solid a larger one, up to nothing but rounding
  bool passes_on = false;    ///< it goes through the expression, so that what is round stays so
  bool takes_flat = false;   ///< the points of what is flat count in it
  bool takes_round = false;  ///< it knows what to do with round solids
};

/// Whether it is affine, and may be singular.
bool is_affine(const model::ProjectiveMap& map) {
  const auto d =
      static_cast<std::ptrdiff_t>(std::lround(std::sqrt(static_cast<double>(map.matrix.size())))) - 1;
  return std::all_of(map.matrix.end() - 1 - d, map.matrix.end() - 1, [](double x) { return x == 0; });
}

ConstructRow row_of(const model::LinearExtrusion& extrusion) {
  const bool straight = extrusion.is_straight();
  return {.name = "linear_extrude", .is_monotone = straight, .passes_on = straight, .takes_round = straight};
}
ConstructRow row_of(const model::RotateExtrusion&) { return {.name = "rotate_extrude"}; }
ConstructRow row_of(const model::Offset&) { return {.name = "offset"}; }
ConstructRow row_of(const model::Hull&) { return {.name = "hull", .is_monotone = true, .takes_flat = true}; }
ConstructRow row_of(const model::MinkowskiSum&) {
  return {.name = "minkowski", .is_monotone = true, .takes_flat = true};
}
ConstructRow row_of(const model::Projection& projection) {
  return {.name = "projection", .takes_flat = !projection.cut};
}
ConstructRow row_of(const model::Resize&) { return {.name = "resize"}; }
ConstructRow row_of(const model::Fill&) { return {.name = "fill"}; }
ConstructRow row_of(const model::Roof&) { return {.name = "roof"}; }
ConstructRow row_of(const model::Product&) {  // which asks for bounds itself
  return {
      .name = "product", .is_bounded = false, .is_monotone = true, .passes_on = true, .takes_round = true};
}
ConstructRow row_of(const model::Shadow&) {
  return {.name = "project", .is_monotone = true, .takes_round = true};
}
ConstructRow row_of(const model::Section&) {
  return {
      .name = "section", .is_bounded = false, .is_monotone = true, .passes_on = true, .takes_round = true};
}
ConstructRow row_of(const model::ProjectiveMap& map) {
  const bool affine = is_affine(map);
  return {.name = affine ? "multmatrix" : "projective",
          .is_bounded = false,
          .is_monotone = true,
          .takes_flat = affine,
          .takes_round = true};
}
ConstructRow row_of(const model::Sweep&) {
  return {.name = "sweep", .is_monotone = true, .takes_round = true};
}
ConstructRow row_of(const model::Growth& growth) {
  const bool nothing = growth.distance == 0;
  return {.name = growth.distance < 0 ? "shrink" : "grow",
          .is_bounded = !nothing,
          .is_monotone = true,
          .passes_on = nothing,
          .takes_round = nothing};
}

ConstructRow row_of(const model::Construct& construct) {
  return std::visit([](const auto& what) { return row_of(what); }, construct);
}

class Resolver {
 public:
  Resolver(const CompileOptions& options, std::vector<std::string>& warnings)
      : options_(options), warnings_(warnings) {
    options_.tell_of_nested = [this](const std::string& warning) {
      const auto first = warnings_.begin() + static_cast<std::ptrdiff_t>(first_of_construct_);
      if (std::find(first, warnings_.end(), warning) == warnings_.end()) warnings_.push_back(warning);
    };
  }
  Resolver(const Resolver&) = delete;
  Resolver& operator=(const Resolver&) = delete;

  Expression run(const Expression& root) {
    const Expression image = resolved_.run(
        root, [](const Expression& at) { return at.node().resolved ? std::optional(at) : std::nullopt; },
        [this](const Node& node, std::vector<Expression> images) -> Expression {
          if (const auto* boolean = std::get_if<Boolean>(&node.value)) {
            if (boolean->operation != model::Operation::unite) leave_out_flats(images);
            return boolean_of(*boolean, node, std::move(images));
          }
          if (const auto* transform = std::get_if<Transform>(&node.value))
            return is_empty(images[0]) ? images[0]
                                       : make(node.dimension, Transform{transform->matrix, images[0]});
          if (const auto* coloured = std::get_if<model::Coloured>(&node.value))
            return is_empty(images[0]) ? images[0]
                                       : make(node.dimension, model::Coloured{coloured->colour, images[0]});
          if (const auto* named = std::get_if<model::Named>(&node.value))
            return is_empty(images[0]) && images[0].node().parts == 0
                       ? images[0]
                       : make(node.dimension, model::Named{named->role, named->name, images[0]});
          const Looks looks = looks_of(images.front());
          take_looks_off(std::get<Construction>(node.value), images);
          return looks.on(one_part(image_of(node, images), node.parts));
        });
    return without_flats(image);
  }

 private:
  CompileOptions options_;  // which tell this of what is evaluated for a construct: several times, for some
  std::vector<std::string>& warnings_;
  std::size_t first_of_construct_ = 0;  // of the warnings: those of the construct that is being made
  Rewriting resolved_, lifted_, faceted_, without_flats_;
  /// A flat result of a construct, and what there is to say where nobody takes its points.
  struct Flat {
    Expression solid;  // is kept, so its address stays its own
    std::string warning;
  };
  std::unordered_map<const Node*, Flat> flats_;
  std::unordered_set<std::string> told_of_flats_;

  /// Remembers what is flat of the image of a construct.
  template <typename Place>
  void note_flats(const Construction& construction, const Expression& image, Place&& place) {
    const auto note = [&](const Expression& solid) {
      const auto* primitive = std::get_if<Primitive>(&solid.node().value);
      if (primitive == nullptr || !model::is_flat(*primitive)) return;
      const std::string what = row_of(construction.construct).name;
      flats_.insert_or_assign(&solid.node(), Flat{solid, place() + what + ": all its points lie " +
                                                             model::flat_place(solid.dimension()) +
                                                             ", so it encloses nothing and is left out"});
    };
    note(image);
    for (const Expression& child : image.node().children()) note(child);
  }

  void leave_out_flats(std::vector<Expression>& solids) {
    for (Expression& solid : solids) solid = without_flats(solid);
  }

  /// The solid without flat results of constructs, for all but those that take points: one warning for each
  /// construct.
  Expression without_flats(const Expression& solid) {
    if (flats_.empty()) return solid;
    return without_flats_.run(
        solid,
        [this](const Expression& at) {
          const bool stays =
              std::holds_alternative<Primitive>(at.node().value) && !flats_.contains(&at.node());
          return stays ? std::optional(at) : std::nullopt;
        },
        [this](const Node& node, std::vector<Expression> images) -> Expression {
          if (const auto* boolean = std::get_if<Boolean>(&node.value))
            return boolean_of(*boolean, node, std::move(images));
          if (const auto* transform = std::get_if<Transform>(&node.value))
            return is_empty(images[0]) ? images[0]
                                       : make(node.dimension, Transform{transform->matrix, images[0]});
          if (const auto* coloured = std::get_if<model::Coloured>(&node.value))
            return make(node.dimension, model::Coloured{coloured->colour, images[0]});
          if (const auto* named = std::get_if<model::Named>(&node.value))
            return make(node.dimension, model::Named{named->role, named->name, images[0]});
          const std::string& warning = flats_.at(&node).warning;
          if (told_of_flats_.insert(warning).second) warnings_.push_back(warning);
          return one_part(Expression(node.dimension), node.parts);
        });
  }

  /// The solid with polyhedra in the place of what is round: other constructs need corners.
  Expression faceted(const Expression& solid) {
    return faceted_.run(
        solid, [](const Expression& at) { return at.node().faceted ? std::optional(at) : std::nullopt; },
        [this](const Node& node, std::vector<Expression> images) -> Expression {
          if (const auto* boolean = std::get_if<Boolean>(&node.value))
            return make(node.dimension, Boolean{boolean->operation, std::move(images)});
          if (const auto* transform = std::get_if<Transform>(&node.value))
            return make(node.dimension, Transform{transform->matrix, images[0]});
          if (!images.empty()) return images[0];  // see Looks
          return faceted_primitive(std::get<Primitive>(node.value), node.dimension, options_);
        });
  }

  /// What a construct is made of; warnings and errors get the place of the construct.
  Expression image_of(const Node& node, std::vector<Expression>& images) {
    const auto& construction = std::get<Construction>(node.value);
    const ConstructRow row = row_of(construction.construct);
    if (!row.takes_flat) leave_out_flats(images);
    if (std::any_of(images.begin(), images.end(), is_empty))
      return without_empty(construction, images, node.dimension);
    const auto place = [&] { return options_.place_of ? options_.place_of(node) : ""; };
    const std::size_t before = first_of_construct_ = warnings_.size();
    try {
      const auto& construct = construction.construct;
      const bool passes_on = row.passes_on && std::ranges::all_of(images, has_prisms);
      if ((row.is_bounded || row.passes_on != passes_on) &&
          std::any_of(images.begin(), images.end(), is_unbounded))
        throw Error(std::string(row.name) +
                    ": the solid has no bounds; intersect it with something that has");
      Expression image = !passes_on && std::any_of(images.begin(), images.end(), is_only_enclosed)
                             ? enclosed_image_of(construct, images)
                             : image_of(construct, images);
      for (std::size_t i = before; i < warnings_.size(); ++i) warnings_[i].insert(0, place());
      note_flats(construction, image, place);
      return image;
    } catch (const Error& error) {
      throw Error(place() + error.what());
    }
  }

  /// What a construct is made of if operands are empty: nothing, but for sums that pass over these.
  static Expression without_empty(const Construction& construction, const std::vector<Expression>& operands,
                                  int dimension) {
    const auto* sum = std::get_if<model::MinkowskiSum>(&construction.construct);
    const auto something = std::find_if_not(operands.begin(), operands.end(), is_empty);
    if (sum == nullptr || !sum->passes_over_empty || something == operands.end())
      return Expression(dimension);
    return *something;
  }

  Expression image_of(const model::Construct& construct, std::vector<Expression> images) {
    if (!row_of(construct).takes_round)
      for (Expression& operand : images) operand = faceted(operand);
    return std::visit([&](const auto& what) { return construct_of(what, images); }, construct);
  }

  /// What it makes of operands that it cannot take as they are.
  Expression enclosed_image_of(const model::Construct& construct, std::vector<Expression> operands) {
    if (takes_these(construct, operands))
      return std::visit([&](const auto& what) { return construct_of(what, operands); }, construct);
    if (const auto* sum = std::get_if<model::MinkowskiSum>(&construct)) {
      if (sum->passes_over_empty) return enclosed_sum(std::move(operands));
      limit_pairs(operands);
    }
    const auto image_with = [&](Facets facets) {
      std::vector<Expression> polytopes;
      for (const Expression& operand : operands) polytopes.push_back(with_facets(operand, facets, options_));
      return image_of(construct, std::move(polytopes));
    };
    const ConstructRow row = row_of(construct);
    if (row.is_monotone) return between(image_with(Facets::inside), image_with(Facets::around), options_);
    if (std::any_of(operands.begin(), operands.end(), is_refined))
      throw Error(
          std::string(row.name) +
          ": a spline, a subdivision surface, or a section or product of something curved has no corners");
    const std::string corners = circle_corners_text(operands);
    warnings_.push_back(
        std::string(row.name) + ": what is round in it is taken as polyhedra in it" +
        (corners.empty() ? "" : ", with " + corners + " corners to a circle; $fn says how many"));
    return image_with(Facets::inside);
  }

  /// Whether an operand is empty the polytopes around it tell: those inside are none of what is thin.
  Expression enclosed_sum(std::vector<Expression> operands) {
    const auto is_nothing = [&](const Expression& operand) {
      return !is_union(operand) &&
             convex_parts(with_facets(operand, Facets::around, options_), options_).empty();
    };
    if (is_nothing(operands[0])) return operands[1];
    if (is_nothing(operands[1])) return operands[0];
    return enclosed_image_of(model::MinkowskiSum{}, std::move(operands));
  }

  /// Each pair of convex parts has a sum: two tori of 64 segments each take many minutes. So operands get
  /// fewer corners where that makes fewer pairs.
  /// @throws bsp2::Error where so many are left of cells of splines and the like that the sum would not end.
  void limit_pairs(std::vector<Expression>& operands) {
    const std::size_t pairs = with_fewer_pairs(operands);
    if (pairs > 10'000 && std::any_of(operands.begin(), operands.end(), is_refined))
      throw Error("minkowski: of splines, subdivision surfaces and the like the cells are added, and " +
                  counted(pairs,
                          "# pair[s] of them [is|are] too many (10,000 at most); add a convex solid, or one "
                          "with fewer parts"));
  }

  /// @return how many pairs are left.
  std::size_t with_fewer_pairs(std::vector<Expression>& operands) {
    constexpr std::size_t most_pairs = 600;
    const auto pairs_of = [&](const std::vector<Expression>& solids) {
      std::size_t product = 1;
      for (const Expression& solid : solids)
        product *= convex_parts(with_facets(solid, Facets::around, options_), options_).size();
      return product;
    };
    const std::size_t at_first = pairs_of(operands);
    if (at_first <= most_pairs) return at_first;
    const std::vector<Expression> given = operands;
    for (const std::uint32_t corners : {48U, 32U, 24U, 16U}) {
      std::vector<Expression> coarser;
      for (const Expression& operand : given) coarser.push_back(with_fewer_corners(operand, corners));
      const std::size_t now = pairs_of(coarser);
      if (now >= at_first) return at_first;
      operands = std::move(coarser);
      if (now > most_pairs && corners > 16) continue;
      warnings_.push_back(
          "minkowski: " + counted(at_first, "# pair[s] of convex parts [is|are] too many: circles get ") +
          counted(corners, "# corner[s] at most where $fn does not say how many"));
      return now;
    }
    return at_first;
  }

  /// Whether it knows the image of all that is round in its operands.
  static bool takes_these(const model::Construct& construct, const std::vector<Expression>& operands) {
    if (std::holds_alternative<model::Hull>(construct)) return is_convex_primitive(operands[0]);
    if (std::holds_alternative<model::ProjectiveMap>(construct)) return true;
    if (std::holds_alternative<model::Shadow>(construct) || std::holds_alternative<model::Sweep>(construct))
      return is_union(operands[0]) && is_of_polytopes_and_balls(operands[0]);
    return false;
  }

  /// The constructs of any dimension.
  template <typename What>
  Expression construct_of(const What& what, const std::vector<Expression>& operands) {
    return dataflow::image_of(what, operands, ConstructContext{options_, [this](const Expression& solid) {
                                                                 return faceted(solid);
                                                               }});
  }

  Expression construct_of(const model::LinearExtrusion& extrusion, const std::vector<Expression>& operands) {
    if (extrusion.twist == 0 && extrusion.scale[0] == extrusion.scale[1] && extrusion.scale[0] != 1)
      return tapered(extrusion, operands[0]);
    if (!extrusion.is_straight())
      return extrude_outline(extrusion, outline_of(operands[0], options_), options_.coincidence);
    const auto& d = extrusion.direction;
    const double back = extrusion.center ? 0.5 : 0;
    const double matrix[] = {1, 0, d[0], -back * d[0], 0, 1, d[1], -back * d[1],
                             0, 0, d[2], -back * d[2], 0, 0, 0,    1};
    return model::transform(matrix, lifted(operands[0]));
  }

  /// A cone over a plane solid, or its lower part: a projective image of the prism, so Booleans stay what
  /// they are.
  static Expression tapered(const model::LinearExtrusion& extrusion, const Expression& solid) {
    const double scale = extrusion.scale[0];
    const auto& d = extrusion.direction;
    const double back = extrusion.center ? 0.5 : 0;
    return with_primitives_replaced(solid, 3, [&](const PlacedPrimitive& placed) {
      PointSet<3> points;
      const Points corners = placed.corners();
      for (std::size_t i = 0; i < corners.size(); i += 2) {
        const double x = corners[i], y = corners[i + 1];
        points.push_back({x - back * d[0], y - back * d[1], -back * d[2]});
        points.push_back({scale * x + (1 - back) * d[0], scale * y + (1 - back) * d[1], (1 - back) * d[2]});
      }
      return model::convex_hull(points);
    });
  }

  /// The product of a bounded plane solid with the interval [0, 1]: every primitive becomes a prism, all else
  /// stays.
  Expression lifted(const Expression& solid) {
    return lifted_.run(
        solid, [](const Expression&) -> std::optional<Expression> { return std::nullopt; },
        [this](const Node& node, std::vector<Expression> images) -> Expression {
          if (const auto* boolean = std::get_if<Boolean>(&node.value))
            return make(3, Boolean{boolean->operation, std::move(images)});
          if (const auto* transform = std::get_if<Transform>(&node.value)) {
            const auto& m = transform->matrix;
            return make(
                3, Transform{{m[0], m[1], 0, m[2], m[3], m[4], 0, m[5], 0, 0, 1, 0, 0, 0, 0, 1}, images[0]});
          }
          if (!images.empty()) return images[0];  // see Looks
          return std::visit([this](const auto& primitive) { return this->prism(primitive); },
                            std::get<Primitive>(node.value));
        });
  }
  Expression unit_prism(const Primitive& primitive) {
    return construct_of(model::Product{}, {make(2, primitive), model::cuboid({1})});
  }
  static Expression prism(const model::Cuboid& square) {
    return make(3, model::Cuboid{{square.size[0], square.size[1], 1}});
  }
  static Expression prism(const model::RegularPolygon& circle) {
    return make(3, model::Lathe{circle.sides, {{circle.radius, 0}, {circle.radius, 1}}});
  }
  static Expression prism(const model::ConvexPolygon& polygon) { return make(3, polygon); }
  static Expression prism(const model::Round& disk) {
    return make(3, model::Round{disk.bottom, disk.top, {1}, disk.sides, disk.fineness});
  }
  Expression prism(const model::Spline& spline) { return unit_prism(spline); }
  Expression prism(const model::Preimage& section) { return unit_prism(section); }
  Expression prism(const model::Polytope& shadow) { return unit_prism(shadow); }
  static Expression prism(const auto&) {
    throw std::logic_error("it is no plane solid, or its prisms are not known");
  }

  Expression construct_of(const model::RotateExtrusion& extrusion, const std::vector<Expression>& operands) {
    Outline outline = outline_of(operands[0], options_);
    double low = 0, high = 0;
    for (const auto& path : outline)
      for (const auto& p : path) low = std::min(low, p[0]), high = std::max(high, p[0]);
    // What reaches over the axis by less than OpenSCAD's grid ends at the axis.
    const double grid = 0x1p-16;
    if (low < -grid && high > grid) {
      warnings_.push_back("a rotate_extrude is empty: its profile reaches from x = " + std::to_string(low) +
                          " to " + std::to_string(high) + "; it has to stay on one side of the axis x = 0");
      return Expression(3);
    }
    double start = extrusion.start;
    if (high <= grid && low < -grid) {  // the left side turns as well
      start += 180;
      for (auto& path : outline)
        for (auto& p : path) p[0] = -p[0];
    }
    for (auto& path : outline)
      for (auto& p : path) p[0] = std::max(p[0], 0.0);
    const double sides = model::side_count(std::max(high, -low), extrusion.resolution);
    if (!(sides <= model::max_sides))
      throw Error("rotate_extrude: more than " + std::to_string(model::max_sides) + " segments");
    const auto segments =
        static_cast<std::uint32_t>(std::max(std::trunc(sides * std::fabs(extrusion.angle) / 360), 1.0));
    return revolve_outline(outline, start, extrusion.angle, segments, options_.coincidence);
  }

  Expression construct_of(const model::Offset& offset, const std::vector<Expression>& operands) {
    return plane_solid(offset_outline(offset, outline_of(operands[0], options_)));
  }

  Expression construct_of(const model::Roof& roof, const std::vector<Expression>& operands) {
    const Outline outline = outline_of(operands[0], options_);
    if (outline.empty()) return Expression(3);
    std::array<double, 2> low = outline[0][0], high = low;
    for (const auto& path : outline)
      for (const auto& p : path)
        for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
    // No point is farther from the outline than half its width, and no roof is higher than that.
    const double height = 0.53 * std::min(high[0] - low[0], high[1] - low[1]);
    // Where nothing is merged the walls have to be the outline's: else what sticks out of it, by rounding,
    // would stay as high as the prism.
    const std::vector<Expression> base{options_.coincidence < outline_coincidence ? plane_solid(outline)
                                                                                  : operands[0]};
    std::vector<Expression> solids{construct_of(model::LinearExtrusion{.direction = {0, 0, height}}, base)};
    for (Expression& piece : pieces_above_roof(roof, outline, height)) solids.push_back(std::move(piece));
    return model::subtract(std::move(solids));
  }

  Expression construct_of(const model::Fill&, const std::vector<Expression>& operands) {
    std::vector<Expression> filled;
    for (const auto& path : outline_of(operands[0], options_))
      if (signed_area(path) > 0) filled.push_back(model::polygon(path));
    return united(2, std::move(filled));
  }

  static Expression plane_solid(const Outline& outline) {
    std::vector<std::array<double, 2>> points;
    std::vector<std::vector<std::uint32_t>> paths;
    for (const auto& path : outline) {
      auto& cycle = paths.emplace_back();
      for (const auto& p : path) {
        cycle.push_back(static_cast<std::uint32_t>(points.size()));
        points.push_back(p);
      }
    }
    return paths.empty() ? Expression(2) : model::polygon(points, paths);
  }

  Expression construct_of(const model::Projection& projection, const std::vector<Expression>& operands) {
    std::vector<Expression> shadows;
    for (const auto& part : convex_parts<3>(operands[0], options_)) {
      PointSet<2> shadow;
      if (projection.cut)
        shadow = section(part);
      else
        for (const auto& p : part) shadow.push_back({p[0], p[1]});
      shadows.push_back(model::convex_hull(shadow));
    }
    return united(2, std::move(shadows));
  }

  /// Points whose hull is the section of a convex solid at z = 0; a face that lies there counts.
  static PointSet<2> section(const PointSet<3>& part) {
    double reach = 0;
    for (const auto& p : part) reach = std::max({reach, std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
    const double grid = reach * 0x1p-44;  // above the rounding of the points
    PointSet<2> cut;
    const auto side = [&](const auto& p) { return p[2] > grid ? 1 : p[2] < -grid ? -1 : 0; };
    for (const auto& p : part)
      if (side(p) == 0) cut.push_back({p[0], p[1]});
    const auto cross = [&](const auto& p, const auto& q) {
      if (side(p) * side(q) >= 0) return;
      const double t = p[2] / (p[2] - q[2]);
      cut.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])});
    };
    if (std::all_of(part.begin(), part.end(), [&](const auto& p) { return side(p) >= 0; }) ||
        std::all_of(part.begin(), part.end(), [&](const auto& p) { return side(p) <= 0; }))
      return cut;
    const Expression hull = model::convex_hull(part);
    if (is_empty(hull)) return cut;
    const auto& mesh = std::get<model::TriangleMesh>(std::get<Primitive>(hull.node().value));
    for (const auto& triangle : mesh.triangles)
      for (int k = 0; k < 3; ++k)
        if (triangle[k] < triangle[(k + 1) % 3])
          cross(mesh.points[triangle[k]], mesh.points[triangle[(k + 1) % 3]]);
    return cut;
  }

  template <int D>
  Expression resized(const model::Resize& resize, const Expression& operand) {
    std::array<double, D> low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (const auto& p : spanning_points<D>(operand, options_))
      for (int i = 0; i < D; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
    if (!(low[0] < high[0])) return Expression(D);
    int largest = 0;
    for (int i = 1; i < D; ++i)
      if (resize.size[i] > resize.size[largest]) largest = i;
    const double automatic =
        resize.size[largest] > 0 ? resize.size[largest] / (high[largest] - low[largest]) : 1;
    std::vector<double> matrix((D + 1) * (D + 1));
    matrix.back() = 1;
    for (int i = 0; i < D; ++i)
      matrix[i * (D + 2)] = resize.size[i] > 0    ? resize.size[i] / (high[i] - low[i])
                            : resize.automatic[i] ? automatic
                                                  : 1;
    return model::transform(matrix, operand);
  }

  Expression construct_of(const model::Resize& resize, const std::vector<Expression>& operands) {
    return operands[0].dimension() == 2 ? resized<2>(resize, operands[0]) : resized<3>(resize, operands[0]);
  }
};

}  // namespace

model::Expression resolve(const model::Expression& expression, const CompileOptions& options,
                          std::vector<std::string>& warnings) {
  return expression.node().resolved ? expression : Resolver(options, warnings).run(expression);
}

}  // namespace bsp2::dataflow
