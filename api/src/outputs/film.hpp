#pragma once

#include <filesystem>
#include <functional>

#include "bsp2/outputs.hpp"
#include "bsp2/supersteps/render/rendering.hpp"

namespace bsp2::api {

/// @throws bsp2::Error for what makes no sense.
void check(const Film& film);

/// Picture number `i` of an animation. @param most_level of the cells.
supersteps::PictureOptions view_of(const Film& film, supersteps::PictureOptions view, unsigned i,
                                   unsigned most_level);

/// Draws the pictures of an animation and writes it. Not collective: of a result whose cells this process
/// has.
/// @param threads that draw. @param interrupted asked after each picture: true ends it without a file.
/// @return whether there is one.
/// @throws bsp2::Error as `supersteps::render` and `io::Animation`.
[[nodiscard]] bool draw_film(const Film& film, const supersteps::PictureOptions& view,
                             const supersteps::RunResult& result, unsigned threads,
                             const std::function<bool()>& interrupted, const std::filesystem::path& path);

}  // namespace bsp2::api
