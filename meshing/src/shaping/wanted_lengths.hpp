#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "editing/editor.hpp"
#include "shaping/pieces.hpp"

namespace bsp2::meshing {

/// How long edges shall be at each point of a mesh. Thread rule: one thread at a time, as the editor.
class WantedLengths {
 public:
  /// @param shared points at which the length is given. All must outlive it, and may change: see `find`.
  WantedLengths(const Editor& editor, const ShapeOptions& options, const std::vector<Piece::Shared>& shared)
      : editor_(&editor), options_(&options), shared_(&shared) {}

  /// As the user wants it, but where the solid has details that are finer: there short edges go over to long
  /// ones. @param from_seams only points at several parts want anything, the others what is fine beside them.
  void find(bool with_details, bool from_seams = false);
  /// Finds lengths for finer details than the call before, unless that makes too many tetrahedra.
  void find_finer();
  /// Whether the next call of that could find finer details.
  [[nodiscard]] bool may_be_finer() const;
  /// From now on what is as thin as what is cleaned is a detail, too: where no moves are left for it.
  /// @return whether there is room for that; then all begins again with coarse ones.
  bool begin_again_with_cleaned();
  /// Details at these points, and where edges between such points are divided, are to be as fine as they
  /// need, for which as many tetrahedra again may be added: step by step, as `find_finer` is called.
  /// @return whether there is room for a step.
  bool find_urgent(std::span<const std::uint32_t> points);
  /// After Editor::arrange.
  void renumber(const std::vector<std::uint32_t>& map);
  /// With the finest details, whatever that makes: what is there may be as fine.
  void find_finest();
  /// Of a new point in the middle of an edge.
  void add_between(std::uint32_t u, std::uint32_t v, std::uint32_t middle);
  /// Of the edge between two points: endless if nothing is wanted of them.
  [[nodiscard]] double between(std::uint32_t p, std::uint32_t q) const;
  [[nodiscard]] const std::vector<double>& at_points() const { return wanted_; }
  /// How fine the details are, as a share of the length that the user wants.
  [[nodiscard]] double detail() const { return along_.least; }
  /// How many tetrahedra finer details would have made, if these were too many; else 0.
  [[nodiscard]] double too_many() const { return too_many_; }
  /// About how many tetrahedra each part will have.
  [[nodiscard]] std::map<std::int32_t, double> tetrahedra_by_part() const;

 private:
  const Editor* editor_;
  const ShapeOptions* options_;
  const std::vector<Piece::Shared>* shared_;
  std::vector<double> wanted_;
  /// Details of one kind: those along strips and walls take tetrahedra by their length, short edges a few
  /// each.
  struct Details {
    double least = 0;     ///< how fine they are, as a share of the length that the user wants
    double step = 0;      ///< to what share of that they get finer next; above the last one: not at all
    bool is_cut = false;  ///< some are finer than that
    bool leaves_out_cleaned = false;  ///< what is as thin as what is cleaned is none
    void begin();
    void take_smaller_steps();
    [[nodiscard]] bool may_be_finer() const;
  };
  Details along_{.leaves_out_cleaned = true}, short_;
  double too_many_ = 0;
  double without_details_ = 0;  ///< tetrahedra that are to be expected
  double growth_ = options_->growth;
  bool has_grown_faster_ = false;          ///< or that was tried in vain
  double most_ = options_->most;           ///< of them that may be added
  std::vector<bool> is_urgent_;            ///< by point
  Details urgent_{.least = 1, .step = 1};  ///< at these, if they are finer

  [[nodiscard]] double size_at(std::uint32_t p) const;
  [[nodiscard]] bool is_urgent(std::uint32_t p) const { return p < is_urgent_.size() && is_urgent_[p]; }
  [[nodiscard]] bool is_at_several_parts(std::uint32_t p) const;
  void find_short_edges();
  void find_strips_and_walls();
  void find_strip(std::uint32_t m, std::uint32_t u, std::uint32_t v);
  void find_wall(std::uint32_t t, std::size_t top);
  void want_detail(std::uint32_t p, double thickness, double times, Details& details);
  [[nodiscard]] bool may_grow_faster() const;
  void hurry(std::uint32_t p);
  bool find_finer_that_fit();
  bool find_finer_urgent();
  bool fits_with(double least_along, double least_short);
  [[nodiscard]] bool fits();
  [[nodiscard]] double expected() const;
  void grow(std::vector<std::pair<double, std::uint32_t>> known);
};

}  // namespace bsp2::meshing
