#pragma once

#include <filesystem>
#include <string>

/// Shared libraries of our own that are loaded when they are first asked for. What needs a large library of others that most runs do not
/// need lives in one: cmake/module.cmake builds it, docs/modules.md tells how they are made and what can go wrong.
namespace bsp2 {

/// Loads `NAME.so` from a folder; it is never unloaded. Any thread.
/// @param layout what the program and the module must have in common to understand each other: a digest of the headers whose types
/// pass between them, and of the compiler. Each has it as BSP2_MODULE_LAYOUT.
/// @return what its `bsp2_module` returns.
/// @throws Error if it is not there, if it cannot be loaded, or if it was built with another layout.
const void* load_module(const std::string& name, const std::filesystem::path& folder, const char* layout);

/// Where the modules are: beside the program's folder, in builds as in installations, however they were moved. Nowhere else: what was
/// built from other sources, or is somebody else's, is not the program's. @throws Error if the program's own place is not known.
std::filesystem::path module_folder();

}  // namespace bsp2

/// Each module has one of these, its only symbol: what it can do, a struct of pointers to functions; null if the program has another layout.
extern "C" [[gnu::visibility("default")]] const void* bsp2_module(const char* layout);
