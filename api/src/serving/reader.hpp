#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "serving/gaze.hpp"
#include "serving/scene.hpp"
#include "serving/shifts.hpp"

namespace bsp2::api {

/// Levels that have been asked for, and things without some of their parts: made at first, and kept as long
/// as there is room. Of one thread.
class Levels {
 public:
  explicit Levels(std::size_t most_bytes = std::size_t{64} << 20) : most_bytes_(most_bytes) {}
  Scene::Bytes at(const Scene::Entry& entry, int level);
  /// What is left of something without parts that are hidden: itself if it has none of these. A number of its
  /// own, the same as long as it is kept.
  Scene::Entry without(const Scene::Entry& entry, const std::set<std::int32_t>& hidden);
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  struct Key {
    std::uint64_t number;
    int level;
    std::vector<std::int32_t> hidden;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  struct Kept {
    Key key;
    Scene::Entry entry;
  };
  std::size_t most_bytes_, bytes_ = 0;
  std::uint64_t last_ = std::uint64_t{1} << 62;  ///< number of what has been made; no scene comes so far
  std::list<Kept> kept_;                         ///< those that were asked for last stand first
  std::map<Key, std::list<Kept>::iterator> place_;

  [[nodiscard]] const Scene::Entry* known(const Key& key);
  Scene::Entry keep(Key key, Scene::Entry entry);
};

/// What a plane of a gaze cuts open of a scene, as a message. Of one thread.
/// @param state what the page has of it; 0: nothing. It becomes that of what is returned.
/// @return null if the page has it.
using Sections = std::function<Scene::Bytes(const Scene& scene, const Gaze& gaze, std::size_t plane,
                                            std::uint64_t& state)>;

/// What one page has got of a scene, and gets next.
///
/// Messages in their order, each at the level that the page can see; and once it has them all, sections, and
/// those again that it sees finer than it has them. What it has finer than it sees it keeps, until that is so
/// much that drawing it takes long, and less than half would do, or it is wanted of voxels. What holds hidden
/// parts comes without them. A page that does not tell where it looks gets all as it is. Of one thread.
class Reader {
 public:
  /// What a page may have of what it sees without getting any of it coarser: some 500,000 triangles.
  static constexpr std::size_t enough_bytes = std::size_t{8} << 20;
  struct Next {
    Scene::Bytes bytes;
    bool is_text = false;  ///< that all is there which the newest gaze asks for
  };
  /// @param tells the page will: until then it gets nothing that has levels.
  Reader(const Scene& scene, Levels& levels, bool tells, std::size_t enough = enough_bytes,
         Sections sections = {})
      : scene_(scene), levels_(levels), tells_(tells), enough_(enough), sections_(std::move(sections)) {}
  void look(const Gaze& gaze);
  /// @return nothing if there is nothing now.
  std::optional<Next> next();
  /// Of how many messages it knows what the page has: not many more than there are.
  [[nodiscard]] std::size_t held() const { return held_.size(); }

 private:
  const Scene& scene_;
  Levels& levels_;
  bool tells_;
  std::size_t enough_;
  Sections sections_;
  std::uint64_t at_ = 0;
  std::optional<Gaze> gaze_;
  Shifts shifts_;
  bool is_planned_ = true, is_told_ = true;
  struct Held {
    int level;
    std::size_t bytes;
    std::vector<std::int32_t> without;  ///< of its parts
    std::shared_ptr<const Detail> of;   ///< what it is a level of
  };
  std::unordered_map<std::uint64_t, Held> held_;  ///< by number of the message
  struct Planned {
    std::uint64_t number;
    bool is_needed;  ///< else it only takes less
  };
  std::vector<Planned> to_come_;                  ///< the next one at the end
  std::array<std::uint64_t, 3> sections_held_{};  ///< their states, by axis
  std::size_t sections_to_come_ = 0;              ///< planes of the gaze, from the first one on

  Scene::Bytes take(const Scene::Entry& entry, bool is_needed = true);
  Scene::Bytes next_section();
  [[nodiscard]] Gaze::Wanted wanted(const Detail& detail) const;
  void forget_old();
  void plan();
};

}  // namespace bsp2::api
