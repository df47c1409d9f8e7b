#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/expression.hpp"

/// What all makers of nodes share.
namespace bsp2::model {

inline Expression make_node(int dimension, Node::Value value) {
  return Expression(std::make_shared<Node>(dimension, std::move(value)));
}

/// @throws Error that names `what`, unless all numbers are finite.
inline void require_finite(std::span<const double> numbers, const char* what) {
  if (!std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); }))
    throw Error(std::string(what) + ": not a finite number");
}

}  // namespace bsp2::model
