#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "editing/editor.hpp"
#include "shaping/cleaning.hpp"
#include "shaping/improving.hpp"
#include "shaping/pieces.hpp"
#include "shaping/sizing.hpp"
#include "shaping/surface.hpp"
#include "shaping/wanted_lengths.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

constexpr double very_good = Improver::very_good, good = Improver::good, fair = Improver::fair;
constexpr double bad = 0.1736, very_thin = 0.0175;  // have an angle below 10 degrees or above 170; 1 and 179
/// What may be moved is not used up at once: a share is left for what refining brings near to each other, and
/// one for the worst of what there is then.
constexpr double share_at_first = 0.8, share_when_refined = 0.9;

using geometry::Interruption;
class Shaping {
 public:
  Shaping(const Tetrahedra& mesh, const ShapeOptions& options) : options_(options), editor_(mesh) {}
  Shaping(const Piece& piece, const ShapeOptions& options)
      : options_(options), editor_(piece.mesh, piece.kind), shared_(piece.shared) {}

  ShapeReport run() {
    report_.tetrahedra_at_first = editor_.size();
    report_.turned_at_first = cleaner_.turned();
    report_.clean = options_.clean;
    if (options_.size > 0) cleaner_.allow(share_at_first * options_.clean);
    for (int pass = 0; pass < 5; ++pass) {
      if (pass == 4) cleaner_.allow(options_.clean);  // rather than that something stays turned over
      cleaner_.clean();
      cleaner_.absorb();
      if (cleaner_.turned() == 0) break;
      cleaner_.loosen();
    }
    cleaner_.clean();
    cleaner_.remember_moves();
    if (options_.size > 0) {
      make_good();
      absorb_more();
    }
    cleaner_.absorb();
    if (options_.size > 0 && options_.true_place) place_truly();
    report_.turned = cleaner_.turned();
    return report_;
  }
  /// Of a piece that shares points with others.
  void run_of_piece() {
    refine_well();
    finish();
  }
  /// What there is now.
  [[nodiscard]] Piece result() const {
    Piece piece;
    std::vector<std::uint32_t> map;
    piece.mesh = editor_.result(map);
    piece.kind.resize(piece.mesh.points.size());
    for (std::uint32_t p = 0; p < map.size(); ++p)
      if (map[p] != Editor::none) piece.kind[map[p]] = editor_.kind(p);
    for (const Piece::Shared& shared : shared_)
      piece.shared.push_back({map[shared.point], shared.of_whole, shared.wanted});
    piece.too_many = wanted_.too_many();
    return piece;
  }

 private:
  const ShapeOptions& options_;
  Editor editor_;
  ShapeReport report_;
  std::vector<Piece::Shared> shared_;  // points that stay
  WantedLengths wanted_{editor_, options_, shared_};
  Sizing sizing_{editor_, wanted_};
  Improver improver_{editor_, wanted_};
  Cleaner cleaner_{editor_, sizing_, improver_, options_, report_};

  /// See Editor::arrange.
  void arrange() {
    const std::vector<std::uint32_t> map = editor_.arrange();
    for (Piece::Shared& shared : shared_) shared.point = map[shared.point];
    wanted_.renumber(map);
    improver_.forget();
  }

  void make_good() {
    arrange();
    wanted_.find(false);
    for (int pass = 0; pass < 6; ++pass)
      if (sizing_.coarsen(1, fair) * 50 < editor_.point_count() && pass > 1) break;
    improver_.improve(good, false);
    const auto counts = wanted_.tetrahedra_by_part();
    const bool is_in_pieces = is_for_pieces(counts);
    is_in_pieces ? work_in_pieces(counts) : refine_well();
    cleaner_.allow(share_when_refined * options_.clean);
    clean_and_finish();  // what that has brought near to each other; not in pieces: what they share stays
    cleaner_.allow(options_.clean);
    if (thin() > 0) clean_and_finish();
    if (!is_in_pieces) refine_more();
    tell_details();
    if (!is_in_pieces && thin() > 0) refine_for_cleaned();
  }

  void tell_details() {
    report_.detail = wanted_.detail();
    report_.too_many = std::max(report_.too_many, wanted_.too_many());
  }

  /// Where many tetrahedra are bad still since details took too many, these are refined for as they need.
  void refine_more() {
    constexpr double usual = 0.01, less = 0.75;  // of all; of what was bad
    for (int again = 0; again < 3; ++again) {
      const double before = share_below(bad);
      if (before <= usual || !wanted_.find_urgent(points_around(bad))) return;
      refine_well();
      clean_and_finish();
      if (share_below(bad) > less * before) return;
    }
  }

  /// Those of tetrahedra of shapes below that, and their neighbours.
  [[nodiscard]] std::vector<std::uint32_t> points_around(double shape) const {
    std::vector<std::uint32_t> points;
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (!editor_.at(t).is_gone() && editor_.at(t).shape < shape)
        for (const std::uint32_t p : editor_.at(t).point) {
          const auto around = editor_.neighbours(p);
          points.insert(points.end(), around.begin(), around.end());
        }
    return points;
  }

  /// What is as thin as what is cleaned, where no moves are left, is refined for, if that leaves fewer thin
  /// tetrahedra: flakes are but divided into more of them.
  void refine_for_cleaned() {
    const std::uint64_t before = thin();
    if (!wanted_.begin_again_with_cleaned()) return;
    State as_it_was = state();
    refine_well();
    clean_and_finish();
    thin() < before ? tell_details() : go_back(std::move(as_it_was));
  }

  /// Where thin tetrahedra are left, and nobody says how much may move, that may be more, if it helps.
  void absorb_more() {
    if (!(options_.clean > 0) || !options_.clean_by_place.is_empty() || cleaner_.turned() > 0 || thin() == 0)
      return;
    const Tetrahedra before = mesh();
    const std::uint64_t all = thin_by_themselves(before);
    std::uint64_t left = all;
    for (double most = 2 * options_.clean; left > 0 && most <= options_.most_clean; most *= 2) {
      State as_it_was = state();
      cleaner_.allow(most);
      cleaner_.remember_moves();
      clean_and_finish();
      const Tetrahedra now = mesh();
      const std::uint64_t thin = thin_by_themselves(now);
      if (thin >= left || !has_all_of(now, before, most + options_.clean)) {
        go_back(std::move(as_it_was));
        continue;
      }
      left = thin;
      report_.clean = most;
      report_.thin_spared = all - left;
    }
  }

  [[nodiscard]] Tetrahedra mesh() const {
    std::vector<std::uint32_t> map;
    return editor_.result(map);
  }

  /// How many have an angle below 1 degree that the solid does not have.
  static std::uint64_t thin_by_themselves(const Tetrahedra& mesh) {
    const Quality quality = quality_of(mesh);
    return quality.tetrahedra_below[0] - quality.of_solid[0];
  }

  /// Whether no more of the volume of a part is lost than hardly any, and no wall or fin: what moves its two
  /// sides to each other makes others better as well. Who says how much is absorbed wants that; who does not,
  /// does not.
  static bool has_all_of(const Tetrahedra& now, const Tetrahedra& before, double reach) {
    constexpr double share = 1e-3;
    const std::int32_t last = before.part.empty() ? -1 : *std::ranges::max_element(before.part);
    const auto parts = static_cast<std::size_t>(last + 1);
    return std::ranges::equal(volumes_of(before, parts), volumes_of(now, parts),
                              [](double a, double b) { return std::abs(a - b) <= share * a; }) &&
           Surface(now).is_near_all_of(before, reach);
  }

  /// What steps that may not help can be taken back to.
  struct State {
    Editor editor;
    WantedLengths wanted;
    Moves moves;
    Improver::Tried tried;
    ShapeReport report;
  };
  [[nodiscard]] State state() const {
    return {editor_, wanted_, cleaner_.moves(), improver_.tried(), report_};
  }
  void go_back(State state) {
    editor_ = std::move(state.editor);
    wanted_ = std::move(state.wanted);
    cleaner_.take_back(std::move(state.moves));
    cleaner_.allow(state.report.clean);
    improver_.take_back(std::move(state.tried));
    report_ = state.report;
  }

  void refine_well() {
    for (int pass = 0; pass < 10; ++pass) {
      arrange();
      const auto before = static_cast<double>(editor_.count());
      wanted_.find_finer();
      refine_once();
      const double change = std::abs(static_cast<double>(editor_.count()) - before);
      if (!wanted_.may_be_finer() && change < 0.02 * before) break;
    }
  }

  void refine_once() {
    sizing_.refine();
    for (int again = 0; again < 3; ++again)
      if (sizing_.coarsen() * 50 < editor_.point_count()) break;
    improver_.improve(good, false);
    sizing_.smooth_all();
  }

  /// Edges near what pieces share; what is fine beside it stays so.
  void refine_seam(const std::vector<std::uint32_t>& seam) {
    const std::uint64_t since = editor_.clock();
    for (const std::uint32_t p : seam) editor_.touch(p);
    wanted_.find_finest();
    sizing_.coarsen(since);
    for (int pass = 0; pass < 6; ++pass) {
      wanted_.find_finer();
      const std::uint64_t split = sizing_.refine(since);
      improver_.improve(good, false);
      sizing_.smooth_all();
      if (split == 0) break;
    }
  }

  [[nodiscard]] std::uint64_t thin() const { return below(very_thin); }
  [[nodiscard]] double share_below(double shape) const {
    return static_cast<double>(below(shape)) / static_cast<double>(std::max<std::size_t>(editor_.count(), 1));
  }
  [[nodiscard]] std::uint64_t below(double shape) const {
    std::uint64_t count = 0;
    for (std::uint32_t t = 0; t < editor_.size(); ++t)
      if (!editor_.at(t).is_gone() && editor_.at(t).shape < shape) ++count;
    return count;
  }

  void clean_and_finish() {
    cleaner_.clean();
    cleaner_.remember_moves();
    finish();
  }

  void finish() {
    for (int pass = 0; pass < 6; ++pass) {
      if (improver_.improve(pass < 3 ? fair : good, true) == 0) break;
      sizing_.smooth_all();
    }
    for (int pass = 0; pass < 2; ++pass) {
      improver_.improve(very_good, false);
      sizing_.smooth_all();
    }
    // The worst ones, as long as that helps.
    for (int pass = 0; pass < 20 && improver_.improve(fair, true) > 0; ++pass) sizing_.smooth_all();
  }

  // --- parts by themselves ---

  /// Whether there are several, and enough to do for what that costs.
  [[nodiscard]] bool is_for_pieces(const std::map<std::int32_t, double>& expected) const {
    double sum = 0;
    for (const auto& [part, count] : expected) sum += count;
    return expected.size() > 1 && sum >= options_.by_parts_from;
  }

  /// Each part becomes a mesh of its own, in which what it shares stays; what comes of that does not depend
  /// on who makes it. Then the seams are improved.
  void work_in_pieces(const std::map<std::int32_t, double>& expected) {
    arrange();
    wanted_.find(true, true);
    sizing_.refine();
    improver_.improve(good, false);
    sizing_.smooth_all();
    arrange();
    wanted_.find(true);
    const Piece whole = result();
    std::vector<Piece> pieces = divided(whole, wanted_.at_points());
    editor_ = Editor({});
    std::sort(pieces.begin(), pieces.end(), [&](const Piece& a, const Piece& b) {
      return expected.at(a.mesh.part.front()) > expected.at(b.mesh.part.front());
    });
    replace_all(pieces, options_.threads, [this](const Piece& piece) {
      Shaping shaping(piece, options_);
      shaping.run_of_piece();
      return shaping.result();
    });
    for (const Piece& piece : pieces) report_.too_many = std::max(report_.too_many, piece.too_many);
    std::vector<std::uint32_t> seam;
    const Piece all = joined(whole, std::move(pieces), seam);
    editor_ = Editor(all.mesh, all.kind);
    settle_all_but(seam);
    refine_seam(seam);
  }

  /// What is away from these points was improved already.
  void settle_all_but(const std::vector<std::uint32_t>& seam) {
    std::vector<bool> is_near(editor_.point_count(), false);
    for (const std::uint32_t p : seam)
      for (const std::uint32_t q : editor_.neighbours(p)) is_near[q] = true;
    for (std::uint32_t p = 0; p < is_near.size(); ++p)
      if (!is_near[p]) editor_.settle(p);
    improver_.settle_all_but(is_near);
  }

  /// Points of the surface go to where they belong, as far as what is around them lets them, and those inside
  /// make room.
  void place_truly() {
    std::vector<std::uint32_t> planes;
    std::vector<std::pair<std::uint32_t, Point>> left;
    for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
      if (editor_.star(p).empty() || editor_.kind(p) == Editor::inside) continue;
      Interruption::check();
      editor_.find_planes(p, planes);
      if (const auto place = options_.true_place(planes, editor_.point(p))) left.emplace_back(p, *place);
    }
    std::vector<Point> before;
    for (const auto& [p, place] : left) before.push_back(editor_.point(p));
    auto open = left;
    for (int pass = 0; pass < 6 && !open.empty(); ++pass) {
      std::erase_if(open, [&](const auto& item) { return put_towards(item.first, item.second); });
      for (std::uint32_t p = 0; p < editor_.point_count(); ++p) {
        Interruption::check();
        if (editor_.kind(p) == Editor::inside) editor_.smooth(p);
      }
    }
    for (std::size_t i = 0; i < left.size(); ++i) {
      const double moved = std::sqrt(squared_distance(before[i], editor_.point(left[i].first)));
      report_.placed += moved > 0 ? 1 : 0;
      report_.largest_placing = std::max(report_.largest_placing, moved);
    }
  }

  /// @return whether it has got there.
  bool put_towards(std::uint32_t p, const Point& place) {
    Interruption::check();
    for (const double share : {1.0, 0.5, 0.25}) {
      Point to = editor_.point(p);
      for (std::size_t k = 0; k < 3; ++k) to[k] = share < 1 ? to[k] + share * (place[k] - to[k]) : place[k];
      if (editor_.put(p, to, fair)) return share == 1;
    }
    return false;
  }
};

}  // namespace

ShapeReport shape(Tetrahedra& mesh, const ShapeOptions& options) {
  Shaping shaping(mesh, options);
  mesh = {};
  const ShapeReport report = shaping.run();
  mesh = shaping.result().mesh;
  return report;
}

}  // namespace bsp2::meshing
