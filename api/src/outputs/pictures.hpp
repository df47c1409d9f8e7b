#pragma once

#include <filesystem>

#include "bsp2/outputs.hpp"
#include "bsp2/supersteps/render/rendering.hpp"

namespace bsp2::api {

/// What the words of a user mean. @throws bsp2::Error for what makes no sense.
supersteps::PictureOptions picture_options(const View& view, supersteps::PictureFormat format);

/// @throws bsp2::Error if the ending names none.
supersteps::PictureFormat format_of(const std::filesystem::path& path);

}  // namespace bsp2::api
