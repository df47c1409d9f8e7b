#pragma once

#include <cstring>
#include <filesystem>
#include <string>

/// Shared libraries of our own that are loaded when they are first asked for. What needs a large library of
/// others that most runs do not need lives in one: cmake/module.cmake builds it, docs/modules.md tells how
/// they are made and what can go wrong.
namespace bsp2 {

/// What a module, or a program that reads files, is refused with that is not in the folder of modules, and
/// what to do.
std::string why_not_in(const std::filesystem::path& folder);

/// Loads `NAME.so` from a folder; it is never unloaded. Any thread.
/// @param layout what the program and the module must have in common to understand each other: a digest of
/// the headers whose types pass between them, and of the compiler. Each has it as BSP2_MODULE_LAYOUT.
/// @return what its `bsp2_module` returns.
/// @throws Error if it is not there, if it cannot be loaded, if it is another module, or if it was built with
/// another layout.
const void* load_module(const std::string& name, const std::filesystem::path& folder, const char* layout);

/// Where the modules are: beside the program's folder, or beneath that of the shared library libbsp2.so, in
/// builds as in installations, however they were moved. Nowhere else: what was built from other sources, or
/// is somebody else's, is not the program's.
/// @throws Error if the program's own place is not known.
std::filesystem::path module_folder();

/// What a module does: `Module` is a struct of pointers to functions, and has the module's `name`. The first
/// call loads it. Any thread.
/// @param layout the BSP2_MODULE_LAYOUT of the room that asks. @throws Error as load_module.
template <typename Module>
const Module& loaded_module(const char* layout) {
  static const void* const module = load_module(Module::name, module_folder(), layout);
  return *static_cast<const Module*>(module);
}

}  // namespace bsp2

/// Each module has one of these: what it can do; null if it has another name or the program another layout.
extern "C" [[gnu::visibility("default")]] const void* bsp2_module(const char* name, const char* layout);

/// Defines it. @param Module the struct; what follows are its functions.
#define BSP2_DEFINE_MODULE(Module, ...)                                                                    \
  const void* bsp2_module(const char* name, const char* layout) {                                          \
    static constexpr Module module{__VA_ARGS__};                                                           \
    return std::strcmp(name, Module::name) == 0 && std::strcmp(layout, BSP2_MODULE_LAYOUT) == 0 ? &module  \
                                                                                                : nullptr; \
  }
