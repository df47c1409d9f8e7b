#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "operands/faceting.hpp"

/// Constructs that need corners, of solids that have none: a truly round solid lies between a polytope in it
/// and one around it. Sums, hulls, sweeps, shadows and projective maps are monotone, so what they make of the
/// solid lies between what they make of these two; between them cells stay FUZZY.
namespace bsp2::dataflow {

/// Whether there is anything in it that a construct can only enclose: truly round, a spline or the like, or
/// enclosed already.
bool is_only_enclosed(const model::Expression& solid);

/// Whether there is anything in it that has no polytopes but its cells: splines, subdivision surfaces, and
/// prisms and sections of what is curved.
bool is_refined(const model::Expression& solid);

/// Whether products with all that is in it, and sections of it, are known.
bool has_prisms(const model::Expression& solid);

/// The solid with polytopes in the place of what is round, all of them such that nothing is left out
/// (Facets::around), or nothing is added (Facets::inside). A symmetric difference becomes a union of
/// differences: what is surely in one of two and not in the other, or perhaps so.
/// @throws bsp2::Error for symmetric differences of too many that are round.
model::Expression with_facets(const model::Expression& solid, Facets facets, const CompileOptions& options);

/// How many corners the circles of their polytopes have, as text: "64", or "64 and 128"; empty if nothing is
/// round in them.
std::string circle_corners_text(const std::vector<model::Expression>& solids);

/// A solid whose circles have so many corners at most where nobody has said how many ($fn).
model::Expression with_fewer_corners(const model::Expression& solid, std::uint32_t corners);

/// What lies between two solids, as one: IN in the first, OUT outside of the second, FUZZY between.
model::Expression between(const model::Expression& inside, const model::Expression& around,
                          const CompileOptions& options);

/// Parts of which only the outside is known, whose union is the solid.
model::Expression undecided(const model::Expression& solid, const CompileOptions& options);

}  // namespace bsp2::dataflow
