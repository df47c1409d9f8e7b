#include "modules.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <system_error>

#include "bsp2/geometry/error.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void refuse(const std::string& module, const std::string& why) {
  throw Error("cannot load " + module + ": " + why);
}

std::string listed(std::span<const fs::path> folders) {
  std::string text;
  for (const fs::path& folder : folders) text += (text.empty() ? "'" : ", nor in '") + folder.string() + "'";
  return text;
}

/// What the dynamic linker has to say about a library, which it may begin with the library's path.
std::string reason_of(const fs::path& path) {
  const std::string reason = ::dlerror(), place = path.string() + ": ";
  return reason.starts_with(place) ? reason.substr(place.size()) : reason;
}

}  // namespace

const char* const module_layout = BSP2_IO_LAYOUT;

const void* load_module(const std::string& name, std::span<const fs::path> folders, const char* layout) {
  const std::string file = name + ".so";
  std::error_code ignored;
  const auto folder = std::find_if(folders.begin(), folders.end(), [&](const fs::path& candidate) { return fs::exists(candidate / file, ignored); });
  if (folder == folders.end())
    refuse(file, "it is not in " + listed(folders) +
                     "; it comes with the program, and both have to keep their places to each other in the build folder or installation");
  const fs::path path = *folder / file;
  void* const library = ::dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) refuse("'" + path.string() + "'", reason_of(path));
  const auto entry = reinterpret_cast<decltype(&bsp2_module)>(::dlsym(library, "bsp2_module"));
  const void* const module = entry == nullptr ? nullptr : entry(layout);
  if (module == nullptr) refuse("'" + path.string() + "'", "it belongs to another build of bsp2; build or install the program and its modules together");
  return module;
}

std::vector<fs::path> module_folders() {
  std::error_code ignored;
  std::vector<fs::path> folders;
  if (const fs::path program = fs::read_symlink("/proc/self/exe", ignored); !program.empty())
    folders.push_back((program.parent_path() / BSP2_IO_MODULES_FROM_PROGRAM).lexically_normal());
  if (const fs::path built = BSP2_IO_BUILT_MODULES; folders.empty() || folders[0] != built) folders.push_back(built);
  return folders;
}

const VtkModule& vtk_module() {
  static const void* const module = load_module("bsp2-vtk", module_folders());
  return *static_cast<const VtkModule*>(module);
}

const Hdf5Module& hdf5_module() {
  static const void* const module = load_module("bsp2-hdf5", module_folders());
  return *static_cast<const Hdf5Module*>(module);
}

}  // namespace bsp2::io
