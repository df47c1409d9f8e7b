#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace bsp2::api {

/// The files that a model is made of: itself, what it includes or uses, and files that it names between
/// quotation marks, as those which are imported, but for comments; those that are there.
std::vector<std::filesystem::path> files_of_model(const std::filesystem::path& model);

/// Likewise those of a model whose text is at hand. @param model where it is, or was.
std::vector<std::filesystem::path> files_of_text(const std::string& text, const std::filesystem::path& model);

}  // namespace bsp2::api
