#pragma once

#include <filesystem>
#include <vector>

namespace bsp2::api {

/// The files that a model is made of: itself, what it includes or uses, and files that it names between
/// quotation marks, as those which are imported, but for comments; those that are there.
std::vector<std::filesystem::path> files_of_model(const std::filesystem::path& model);

}  // namespace bsp2::api
