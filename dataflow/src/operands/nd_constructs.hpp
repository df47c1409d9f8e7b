#pragma once

#include <functional>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"

/// The constructs that work in any dimension, made of primitives and Booleans. Operands are resolved, and not
/// empty. All throw bsp2::Error for operands that they cannot take.
namespace bsp2::dataflow {

/// Nothing at all, and not only a solid that turns out so.
bool is_empty(const model::Expression& solid);

/// Whether a solid reaches to infinity: all primitives are bounded, so far outside of them it is everywhere,
/// or nowhere.
bool is_unbounded(const model::Expression& solid);

/// Whether it is one convex primitive, polytope or round, wherever it is placed: its own hull.
bool is_convex_primitive(const model::Expression& solid);

/// Whether all primitives have corners, or are balls, for which most constructs are known.
bool is_of_polytopes_and_balls(const model::Expression& solid);

struct ConstructContext {
  const CompileOptions& options;
  std::function<model::Expression(const model::Expression&)>
      faceted;  ///< the same with polyhedra in the place of what is round
};

model::Expression image_of(const model::Product&, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::Shadow& shadow, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::Section& section, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::ProjectiveMap& map, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::Sweep& sweep, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::Growth& growth, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::MinkowskiSum&, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);
model::Expression image_of(const model::Hull&, const std::vector<model::Expression>& operands,
                           const ConstructContext& context);

}  // namespace bsp2::dataflow
