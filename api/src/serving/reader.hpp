#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "serving/gaze.hpp"
#include "serving/scene.hpp"

namespace bsp2::api {

/// Levels that have been asked for: made at first, and kept as long as there is room. Of one thread.
class Levels {
 public:
  explicit Levels(std::size_t most_bytes = std::size_t{64} << 20) : most_bytes_(most_bytes) {}
  Scene::Bytes at(const Scene::Entry& entry, int level);
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  using Key = std::pair<std::uint64_t, int>;
  std::size_t most_bytes_, bytes_ = 0;
  std::list<std::pair<Key, Scene::Bytes>> kept_;  ///< those that were asked for last stand first
  std::map<Key, std::list<std::pair<Key, Scene::Bytes>>::iterator> place_;
};

/// What one page has got of a scene, and gets next.
///
/// Messages in their order, each at the level that the page can see; and once it has them all, those again
/// that it sees finer than it has them. What it has finer than it sees it keeps, until that is so much that
/// drawing it takes long, and less than half would do, or it is wanted of voxels. A page that does not tell
/// where it looks gets all as it is. Of one thread.
class Reader {
 public:
  /// What a page may have of what it sees without getting any of it coarser: some 500,000 triangles.
  static constexpr std::size_t enough_bytes = std::size_t{8} << 20;
  struct Next {
    Scene::Bytes bytes;
    bool is_text = false;  ///< that all is there which the newest gaze asks for
  };
  /// @param tells the page will: until then it gets nothing that has levels.
  Reader(const Scene& scene, Levels& levels, bool tells, std::size_t enough = enough_bytes)
      : scene_(scene), levels_(levels), tells_(tells), enough_(enough) {}
  void look(const Gaze& gaze);
  /// @return nothing if there is nothing now.
  std::optional<Next> next();

 private:
  const Scene& scene_;
  Levels& levels_;
  bool tells_;
  std::size_t enough_;
  std::uint64_t at_ = 0;
  std::optional<Gaze> gaze_;
  bool is_planned_ = true, is_told_ = true;
  struct Held {
    int level;
    std::size_t bytes;
  };
  std::unordered_map<std::uint64_t, Held> held_;  ///< by number of the message
  struct Planned {
    std::uint64_t number;
    bool is_needed;  ///< else it only takes less
  };
  std::vector<Planned> to_come_;  ///< the next one at the end

  Scene::Bytes take(const Scene::Entry& entry, bool is_needed = true);
  void plan();
};

}  // namespace bsp2::api
