#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"
#include "bsp2/viewing.hpp"
#include "serving/scene.hpp"
#include "serving/server.hpp"
#include "viewer/packing.hpp"

namespace bsp2::api {

/// The page's files, as the build has made them, beside the program's modules.
/// @throws bsp2::Error if they are not there, which says what to do.
PageFiles load_page();

/// Shows runs in browsers while they go on: makes messages of what a run finds, and serves them.
///
/// Thread rule: all functions are called by the main thread. The work of a process that is alone is done by a
/// thread of the viewer's own, which takes the newest picture and leaves out those that it had no time for.
/// Of several ranks each packs its own regions, between two steps, and the master serves them.
class Viewer {
 public:
  /// @param serves on the master, where the pages are.
  Viewer(const ViewerOptions& command, bool serves);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  [[nodiscard]] const Server& server() const { return *server_; }  ///< on the master
  /// Another run begins; what there is to be seen stays until it has something. @param model its name.
  void begin(const std::string& model);
  void superstep(const std::string& name, Phase phase);
  void progress(double done, std::uint64_t cells);
  /// How the run shall go on: soon something to see of the whole, then ever longer steps.
  [[nodiscard]] supersteps::Steering steer();
  /// Cells that have just been decided: shown until the next picture holds them. Of a process that is alone.
  void add(const std::shared_ptr<const geometry::CellBatch>& cells);
  /// What there is after a step. Collective.
  void show(const supersteps::RunResult& now, supersteps::Ranks& ranks);
  /// The run is over. On the master. @param result whose surface replaces cells; its figures are told.
  void finish(const supersteps::RunResult& result);
  /// The run has failed, or was given up.
  void fail(const std::string& text);
  /// Waits until all that was to be shown is in the scene.
  void drain();

 private:
  using Clock = std::chrono::steady_clock;
  using Batches = std::vector<std::shared_ptr<const geometry::CellBatch>>;  // shared with the run

  /// What a run has found so far; the cells are shared with it.
  struct Picture {
    std::uint64_t run = 0;
    unsigned step = 0;  ///< counted from 1
    int dimension = 3;
    Batches batches;
    std::vector<std::int32_t> rank_of_region;
    std::vector<std::optional<supersteps::Rgba>> colour_of_primitive;
    std::vector<std::string> part_names;
    supersteps::Bounds bounds;
    std::optional<geometry::Brep> faces;
    std::optional<supersteps::RunReport> report;  ///< of a run that is over
  };
  using Send = std::function<void(const std::string& key, std::string bytes)>;

  ViewerOptions command_;
  Scene scene_;
  std::uint64_t run_ = 0;
  std::string model_;
  Clock::time_point began_ = Clock::now(), told_{}, steered_{};
  std::optional<double> last_budget_;
  unsigned steps_ = 0;
  int dimension_ = 3;
  double seconds_of_steps_ = 0;
  std::string superstep_;
  Phase phase_ = Phase::preparation;
  double done_ = 0;      // of the superstep
  double computed_ = 0;  // of space, by all steps
  std::uint64_t cells_ = 0;
  bool was_shown_ = false;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<double> camera_;                ///< of the page that spoke last; empty: none
  std::optional<Picture> newest_, finished_;  ///< to be packed by the thread
  Batches fresh_;  ///< likewise; of the step `fresh_step_`, after the newest picture
  unsigned fresh_step_ = 0;
  bool ends_ = false, is_busy_ = false;
  std::exception_ptr failed_;

  std::uint64_t packed_run_ = 0;  ///< of whom the next are; of the thread that packs
  std::uint64_t oldest_run_ = 1;  ///< of which something may be in the scene; of whoever packs
  Looks looks_;
  std::size_t fresh_triangles_ = 0;  ///< since the last picture
  std::uint64_t fresh_messages_ = 0;
  std::map<std::uint32_t, std::uint64_t> sent_;  ///< region by region: what the cells were like
  std::vector<std::int32_t> rank_before_;        ///< of each region, when they were packed last
  std::thread packer_;
  std::unique_ptr<Server> server_;  ///< goes first

  void hear(const std::string& text);
  void tell(const char* state);
  void pack_again_and_again();
  [[nodiscard]] bool has_newer() const;
  void hand_over(std::optional<Picture>& place, Picture picture);
  void pack(const Picture& picture, const Send& send, unsigned ranks, int rank, bool may_stop);
  void pack_emptied(const Picture& picture, const Send& send, int rank);
  void pack_fresh(const Batches& batches, unsigned step);
  void pack_model(const Picture& picture);
  void pack_end(const Picture& picture);
  [[nodiscard]] std::string model_message(const Picture& picture) const;
  [[nodiscard]] Picture picture_of(const supersteps::RunResult& result) const;
};

}  // namespace bsp2::api
