#include "bsp2/geometry/support/suggestion.hpp"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace bsp2 {
namespace {

/// Words of which nobody makes the other by a slip are told apart before any table is filled.
bool may_be_near(std::string_view a, std::string_view b, std::size_t most) {
  return std::max(a.size(), b.size()) - std::min(a.size(), b.size()) <= most;
}

/// Letters that one of both words has and the other has not: of words that are as near, the one with the same
/// letters is meant.
std::size_t foreign_letters(std::string a, std::string b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  std::string foreign;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(foreign));
  return foreign.size();
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  // Three rows of the table of distances between the beginnings of both words.
  std::vector<std::size_t> before(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0U : 1U)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    std::swap(before, last);
    std::swap(last, row);
  }
  return last[b.size()];
}

std::string suggestion(std::string_view word, std::span<const std::string_view> known) {
  std::string_view nearest;
  std::pair<std::size_t, std::size_t> least;
  for (const std::string_view each : known) {
    const std::size_t most = (std::max(word.size(), each.size()) + 1) / 3;
    if (!may_be_near(word, each, most)) continue;
    const std::pair distance{edit_distance(word, each),
                             foreign_letters(std::string(word), std::string(each))};
    if (distance.first > most || (!nearest.empty() && distance >= least)) continue;
    nearest = each;
    least = distance;
  }
  return nearest.empty() ? std::string() : "; did you mean '" + std::string(nearest) + "'?";
}

}  // namespace bsp2
