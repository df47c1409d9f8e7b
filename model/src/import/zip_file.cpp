#include "import/zip_file.hpp"

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/module.hpp"
#include "import/zip_module.hpp"

namespace bsp2::model {

std::unique_ptr<ZipFile> open_zip(std::string_view bytes, const std::filesystem::path& path) {
  return loaded_module<ZipModule>(BSP2_MODULE_LAYOUT).open_zip(bytes, path);
}

int Unpacking::read(ZipFile::Entry& entry, char* buffer, int size) {
  const int got = entry.read(buffer, size);
  if (got <= 0) return got;
  if (static_cast<std::size_t>(got) > left_)
    throw Error(name_ + ": is more than " + std::to_string(most_times) +
                " times as long once it is unpacked, as no file of a solid is, but one that is made to fill "
                "the memory");
  left_ -= static_cast<std::size_t>(got);
  return got;
}

std::optional<std::string> ZipFile::text(const std::string& name, std::size_t most) const {
  const std::unique_ptr<Entry> entry = open(name);
  if (!entry) return std::nullopt;
  std::string text(most + 1, '\0');
  std::size_t size = 0;
  while (size < text.size()) {
    const int got = entry->read(text.data() + size, static_cast<int>(text.size() - size));
    if (got < 0) return std::nullopt;
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  if (size > most) return std::nullopt;
  text.resize(size);
  return text;
}

}  // namespace bsp2::model
