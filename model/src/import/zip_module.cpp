#include "import/zip_module.hpp"

#include <zip.h>

#include <cstring>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/module.hpp"
#include "import/part_names.hpp"

namespace bsp2::model {
namespace {

class OpenEntry final : public ZipFile::Entry {
 public:
  explicit OpenEntry(zip_file_t* file) : file_(file, &zip_fclose) {}
  int read(char* buffer, int size) override {
    return static_cast<int>(zip_fread(file_.get(), buffer, static_cast<zip_uint64_t>(size)));
  }

 private:
  std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file_;
};

class OpenZip final : public ZipFile {
 public:
  OpenZip(std::string_view bytes, const std::filesystem::path& path)
      : archive_(nullptr, &zip_discard), path_(path.string()) {
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

  [[nodiscard]] std::unique_ptr<Entry> open(const std::string& name) const override {
    const zip_int64_t number = zip_name_locate(archive_.get(), name.c_str(), ZIP_FL_NOCASE);
    return number < 0 ? nullptr : open_number(static_cast<zip_uint64_t>(number));
  }

  [[nodiscard]] std::unique_ptr<Entry> open_first(std::string_view ending) const override {
    const zip_int64_t entries = zip_get_num_entries(archive_.get(), 0);
    for (zip_int64_t i = 0; i < entries; ++i) {
      const char* name = zip_get_name(archive_.get(), static_cast<zip_uint64_t>(i), 0);
      if (name != nullptr && std::string_view(name).ends_with(ending))
        return open_number(static_cast<zip_uint64_t>(i));
    }
    return entries > 0 ? open_number(0) : nullptr;
  }

 private:
  std::unique_ptr<zip_t, void (*)(zip_t*)> archive_;
  std::string path_;

  [[nodiscard]] std::unique_ptr<Entry> open_number(zip_uint64_t number) const {
    if (zip_file_t* file = zip_fopen_index(archive_.get(), number, 0))
      return std::make_unique<OpenEntry>(file);
    const std::string why = reason();
    const char* const name = zip_get_name(archive_.get(), number, 0);
    throw Error(path_ + ": '" + printable_name(name == nullptr ? "" : name) + "' in it " + why);
  }

  /// Why an entry that is there could not be opened.
  [[nodiscard]] std::string reason() const {
    zip_error_t* const error = zip_get_error(archive_.get());
    switch (zip_error_code_zip(error)) {
      case ZIP_ER_NOPASSWD:
      case ZIP_ER_ENCRNOTSUPP:
        return "is encrypted; write the file without a password";
      case ZIP_ER_COMPNOTSUPP:
        return "is packed by a method that is not known here; write the file with the usual one (deflate)";
      default:
        return std::string("cannot be unpacked: ") + zip_error_strerror(error);
    }
  }
};

std::unique_ptr<ZipFile> open_archive(std::string_view bytes, const std::filesystem::path& path) {
  return std::make_unique<OpenZip>(bytes, path);
}

}  // namespace
}  // namespace bsp2::model

BSP2_DEFINE_MODULE(bsp2::model::ZipModule, bsp2::model::open_archive)
