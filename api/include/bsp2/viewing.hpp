#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "bsp2/error.hpp"
#include "bsp2/evaluation.hpp"

/// Models in the browser, while they are evaluated: docs/viewing.md. Part of bsp2.hpp, which says what holds
/// of all.
namespace bsp2 {

/// How a model is shown. As the options of `bsp2 view` of the same name.
struct ViewerOptions {
  std::string address = "127.0.0.1";  ///< that is listened to, as numbers
  std::uint16_t port = 0;             ///< 0: one that is free
  bool stay = false;                  ///< when the last page is closed
  std::uint64_t triangles = 1500000;  ///< that are sent of cells, and of a surface
  std::optional<double> budget;  ///< seconds between two pictures; none: short at first, then ever longer
  std::optional<Order> order;    ///< none: the largest first, and soon depth first
  bool follows_eye = false;      ///< what looks largest from where a page looks is refined first
  Vector eye;                    ///< of the page at first; empty: by the model
  std::function<void(const std::string& link)> serves;  ///< on the master: the link can be opened from now on
  std::function<void(const Figures&)> evaluated;        ///< on each rank: the figures are of the master
  std::function<void(const Error&)> failed;             ///< one that can be mended: the file is watched on
};

/// Shows the model, or the snapshot, in a file; again whenever a file that it is made of is saved, until the
/// last page is closed, or Options::stop says so. The surface is shown at the end. Collective.
/// @param options without those that the viewer decides: `outputs`, `budget`, `collect`, `order`; `stop` is
/// asked in the computation.
/// @throws Error if nothing can be served; with several ranks also for a mistake in the model.
BSP2_API void view(const std::filesystem::path& file, const ViewerOptions& viewer = {},
                   const Options& options = {}, const Ranks& ranks = {});
/// Shows an expression, which is evaluated once, as the model in a file is shown.
BSP2_API void view(const Expression& expression, const ViewerOptions& viewer = {},
                   const Options& options = {}, const Ranks& ranks = {});

}  // namespace bsp2
