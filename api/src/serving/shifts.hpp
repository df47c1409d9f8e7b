#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "serving/gaze.hpp"

namespace bsp2::api {

/// By how much things are moved where they are exploded: a region of cells as it lies, a piece of a surface
/// as its part does, that is as the middle of the box about the middles of all of its pieces.
class Shifts {
 public:
  using Details = std::vector<std::pair<std::uint64_t, std::shared_ptr<const Detail>>>;
  Shifts() = default;
  Shifts(const Gaze& gaze, const Details& all);
  /// @return nothing where no piece of its part was there.
  [[nodiscard]] std::optional<Gaze::Point> of(const Detail& detail) const;

 private:
  double by_ = 0;
  Gaze::Point middle_{};
  std::map<std::pair<std::uint64_t, std::int32_t>, Gaze::Point> middles_;  // by run and part
};

}  // namespace bsp2::api
