#include "bsp2/geometry/support/module.hpp"

#include <dlfcn.h>
#include <elf.h>
#include <link.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <system_error>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"

namespace bsp2 {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void refuse(const std::string& module, const std::string& why) {
  throw Error("cannot load " + module + ": " + why);
}

/// What the dynamic linker has to say about a library, which it may begin with the library's path.
std::string reason_of(const fs::path& path) {
  const std::string reason = ::dlerror(), place = path.string() + ": ";
  return reason.starts_with(place) ? reason.substr(place.size()) : reason;
}

/// How long a library has to be by what its header tells; 0 if that is no header of a library for this
/// machine.
std::uint64_t length_by_header(std::istream& file) {
  Elf64_Ehdr header{};
  if (!file.read(reinterpret_cast<char*>(&header), sizeof header) ||
      std::memcmp(header.e_ident, ELFMAG, SELFMAG) != 0 || header.e_ident[EI_CLASS] != ELFCLASS64 ||
      header.e_phentsize != sizeof(Elf64_Phdr))
    return 0;
  std::uint64_t length = std::max(header.e_phoff + header.e_phnum * sizeof(Elf64_Phdr),
                                  header.e_shoff + std::uint64_t{header.e_shnum} * header.e_shentsize);
  file.seekg(static_cast<std::streamoff>(header.e_phoff));
  Elf64_Phdr segment{};
  for (unsigned i = 0; i < header.e_phnum && file.read(reinterpret_cast<char*>(&segment), sizeof segment);
       ++i)
    length = std::max(length, segment.p_offset + segment.p_filesz);
  return length;
}

/// The dynamic linker maps what the header tells of, and dies of a bus error where a file that was cut off
/// has nothing to map.
void check_length(const fs::path& path) {
  std::error_code unknown;
  const std::uint64_t length = fs::file_size(path, unknown);
  std::ifstream file(path, std::ios::binary);
  const std::uint64_t whole = length_by_header(file);
  if (!unknown && length < whole)
    refuse("'" + path.string() + "'", "it is cut off: " + counted(length, "# byte[s] of ") + grouped(whole) +
                                          " are there; build or install it again");
}

/// The shared library that this is a part of; empty in a program.
fs::path own_library() {
  Dl_info place{};
  link_map* object = nullptr;
  if (::dladdr1(reinterpret_cast<const void*>(&load_module), &place, reinterpret_cast<void**>(&object),
                RTLD_DL_LINKMAP) == 0 ||
      object == nullptr || *object->l_name == '\0')
    return {};
  std::error_code unknown;
  const fs::path library = fs::canonical(object->l_name, unknown);  // it may be a link elsewhere
  return unknown ? fs::path(object->l_name) : library;
}

}  // namespace

std::string why_not_in(const fs::path& folder) {
#ifdef BSP2_MODULES_LATER
  return "it is not in '" + folder.string() +
         "'; this program was built in a hurry and without it: 'cmake --build " BSP2_MODULES_LATER
         " --target bsp2_modules' builds what is left";
#else
  return "it is not in '" + folder.string() +
         "'; it comes with the program, and both have to keep their places to each other in the build folder "
         "or installation";
#endif
}

const void* load_module(const std::string& name, const fs::path& folder, const char* layout) {
  const std::string file = name + ".so";
  const fs::path path = folder / file;
  std::error_code error;
  if (!fs::exists(path, error) && error) refuse("'" + path.string() + "'", error.message());
  if (!fs::exists(path, error)) refuse(file, why_not_in(folder));
  check_length(path);
  void* const library = ::dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) refuse("'" + path.string() + "'", reason_of(path));
  const auto entry = reinterpret_cast<decltype(&bsp2_module)>(::dlsym(library, "bsp2_module"));
  const void* const module = entry == nullptr ? nullptr : entry(name.c_str(), layout);
  if (module == nullptr)
    refuse("'" + path.string() + "'",
           "it belongs to another build of bsp2; build or install the program and its modules together");
  return module;
}

fs::path module_folder() {
  std::error_code error;
  if (const fs::path library = own_library(); !library.empty())
    return (library.parent_path() / BSP2_MODULES_FROM_LIBRARY).lexically_normal();
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error)
    throw Error(
        "cannot find the modules of bsp2: where the program lies is not known, as /proc/self/exe cannot be "
        "read: " +
        error.message());
  return (program.parent_path() / BSP2_MODULES_FROM_PROGRAM).lexically_normal();
}

}  // namespace bsp2
