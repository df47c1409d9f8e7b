#pragma once

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "regions/region_mesh.hpp"

namespace bsp2::supersteps {

/// Collection, as far as it is hidden: cells go to the master, or up a tree of masters, while others are
/// computed.
///
/// Cells travel as the workers decide them, with the syncs of ProgressExchange. Which region has which of
/// them is known when the trees of a round are; then this travels, and the master puts the regions together.
/// The trees stay with the regions until all is computed. What is sent by one rank arrives in that order,
/// also up a tree.
///
/// Thread rule: by the main thread, as a consumer too. `finish` is collective.
class CellStream : public dataflow::Consumer {
 public:
  /// @param how master or tree; automatic: as master, and all give it up when the master has too many.
  /// @param keeps the meshes on all ranks hold their cells, too.
  CellStream(Ranks& ranks, Collect how, bool keeps) : ranks_(ranks), how_(how), keeps_(keeps) {}

  /// Whether the meshes hold the cells of their regions, too.
  [[nodiscard]] bool keeps() const { return keeps_; }
  /// Whether the cells of this rank are needed here: for the meshes, or by the master's end of the stream.
  [[nodiscard]] bool holds_here() const { return keeps_ || ranks_.is_master(); }
  /// What was found before, region by region: sent likewise. Where cells are not kept, the meshes lose them.
  void begin(RegionMeshes& meshes);
  void consume(const std::shared_ptr<const dataflow::Refinement>& refinement) override;
  /// Which regions the cells have that this rank has found since the last time. @param cells on the master:
  /// these themselves.
  void deal(const Assignment& assignment, const RegionCells& cells);

  /// Hands over what waits to the next sync. @return whether some of it goes to a rank that has to pass it
  /// on.
  bool send();
  /// One message of those that `send` made.
  void take(std::string_view message);

  /// The master has more than `automatic` allows.
  [[nodiscard]] bool is_full() const;
  /// No more is sent, and what came is forgotten. All ranks do it after the same sync.
  void abandon();
  [[nodiscard]] bool is_abandoned() const { return is_abandoned_; }
  /// Brings the rest. Collective. @return on the master all cells, by regions.
  RegionCells finish();

 private:
  Ranks& ranks_;
  Collect how_;
  bool keeps_, is_abandoned_ = false;
  std::deque<std::string> waiting_;  // messages for the next rank on the way to the master
  std::map<std::int32_t, CollectingConsumer>
      undealt_;              // on the master: cells of each rank whose regions are not known yet
  RegionCells cells_;        // on the master
  std::uint64_t count_ = 0;  // on the master: cells that came

  [[nodiscard]] int next_rank() const;
  void put(const RegionCells& cells);
};

}  // namespace bsp2::supersteps
