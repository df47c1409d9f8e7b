#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "tetrahedra/editor.hpp"
#include "tetrahedra/pieces.hpp"

namespace bsp2::meshing {

/// How long edges shall be at each point of a mesh. Thread rule: one thread at a time, as the editor.
class WantedLengths {
 public:
  /// @param shared points at which the length is given. All must outlive it, and may change: see `find`.
  WantedLengths(const Editor& editor, const ShapeOptions& options, const std::vector<Piece::Shared>& shared)
      : editor_(editor), options_(options), shared_(shared) {}

  /// As the user wants it, but where the solid is finer: there short edges go over to long ones.
  /// @param from_seams only points at several parts want anything, the others what is fine beside them.
  void find(bool with_features, bool from_seams = false);
  /// Of a new point in the middle of an edge.
  void add_between(std::uint32_t u, std::uint32_t v, std::uint32_t middle);
  /// Of the edge between two points: endless if nothing is wanted of them.
  [[nodiscard]] double between(std::uint32_t p, std::uint32_t q) const;
  [[nodiscard]] const std::vector<double>& at_points() const { return wanted_; }
  /// About how many tetrahedra each part will have.
  [[nodiscard]] std::map<std::int32_t, double> tetrahedra_by_part() const;

 private:
  const Editor& editor_;
  const ShapeOptions& options_;
  const std::vector<Piece::Shared>& shared_;
  std::vector<double> wanted_;

  [[nodiscard]] double size_in(std::int32_t part) const;
  [[nodiscard]] double size_at(std::uint32_t p) const;
  [[nodiscard]] bool is_at_several_parts(std::uint32_t p) const;
  void grow(std::vector<std::pair<double, std::uint32_t>> known);
};

}  // namespace bsp2::meshing
