#include "zip_file.hpp"

#include "bsp2/geometry/error.hpp"

namespace bsp2::model {

ZipFile::ZipFile(std::string_view bytes, const std::filesystem::path& path) : archive_(nullptr, &zip_discard) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source != nullptr) archive_.reset(zip_open_from_source(source, ZIP_RDONLY, &error));
  if (!archive_) {
    if (source != nullptr) zip_source_free(source);  // an archive would own it
    const std::string reason = zip_error_strerror(&error);
    zip_error_fini(&error);
    throw Error(path.string() + ": is no zip file, or a damaged one: " + reason);
  }
  zip_error_fini(&error);
}

ZipFile::Entry ZipFile::open(const std::string& name) const { return {zip_fopen(archive_.get(), name.c_str(), ZIP_FL_NOCASE), &zip_fclose}; }

ZipFile::Entry ZipFile::open_first(std::string_view ending) const {
  const zip_int64_t entries = zip_get_num_entries(archive_.get(), 0);
  for (zip_int64_t i = 0; i < entries; ++i) {
    const char* name = zip_get_name(archive_.get(), static_cast<zip_uint64_t>(i), 0);
    if (name != nullptr && std::string_view(name).ends_with(ending)) return {zip_fopen_index(archive_.get(), static_cast<zip_uint64_t>(i), 0), &zip_fclose};
  }
  return {entries > 0 ? zip_fopen_index(archive_.get(), 0, 0) : nullptr, &zip_fclose};
}

std::optional<std::string> ZipFile::text(const std::string& name, std::size_t most) const {
  const Entry entry = open(name);
  if (!entry) return std::nullopt;
  std::string text(most + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const zip_int64_t got = zip_fread(entry.get(), text.data() + size, text.size() - size);
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  if (size > most) return std::nullopt;
  text.resize(size);
  return text;
}

}  // namespace bsp2::model
