#include "modules.hpp"

#include <dlfcn.h>

#include <system_error>

#include "bsp2/geometry/error.hpp"

namespace bsp2::io {
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

}  // namespace

const char* const module_layout = BSP2_IO_LAYOUT;

const void* load_module(const std::string& name, const fs::path& folder, const char* layout) {
  const std::string file = name + ".so";
  const fs::path path = folder / file;
  std::error_code ignored;
  if (!fs::exists(path, ignored))
    refuse(file, "it is not in '" + folder.string() +
                     "'; it comes with the program, and both have to keep their places to each other in the build folder or installation");
  void* const library = ::dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) refuse("'" + path.string() + "'", reason_of(path));
  const auto entry = reinterpret_cast<decltype(&bsp2_module)>(::dlsym(library, "bsp2_module"));
  const void* const module = entry == nullptr ? nullptr : entry(layout);
  if (module == nullptr) refuse("'" + path.string() + "'", "it belongs to another build of bsp2; build or install the program and its modules together");
  return module;
}

fs::path module_folder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) throw Error("cannot find the modules of bsp2: where the program lies is not known, as /proc/self/exe cannot be read: " + error.message());
  return (program.parent_path() / BSP2_IO_MODULES_FROM_PROGRAM).lexically_normal();
}

const VtkModule& vtk_module() {
  static const void* const module = load_module("bsp2-vtk", module_folder());
  return *static_cast<const VtkModule*>(module);
}

const Hdf5Module& hdf5_module() {
  static const void* const module = load_module("bsp2-hdf5", module_folder());
  return *static_cast<const Hdf5Module*>(module);
}

}  // namespace bsp2::io
