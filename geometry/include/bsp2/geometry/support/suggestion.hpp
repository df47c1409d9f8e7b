#pragma once

#include <span>
#include <string>
#include <string_view>

namespace bsp2 {

/// How many letters have to be changed, left out, put in or exchanged with the next one to make one word the
/// other. Source: Damerau (1964), in the form in which no letter is moved twice (optimal string alignment).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// "; did you mean 'cube'?": the known word that a mistyped one is nearest to, the first of several; empty
/// where none is near, that is within a third of the word's letters.
std::string suggestion(std::string_view word, std::span<const std::string_view> known);

}  // namespace bsp2
