#pragma once

#include "import/zip_file.hpp"

namespace bsp2::model {

/// What bsp2-zip does.
struct ZipModule {
  static constexpr const char* name = "bsp2-zip";
  std::unique_ptr<ZipFile> (*open_zip)(std::string_view bytes, const std::filesystem::path& path);
};

}  // namespace bsp2::model
