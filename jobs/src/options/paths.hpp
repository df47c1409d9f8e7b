#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "options/checks.hpp"
#include "options/command_line.hpp"

/// Files and folders that a command reads or writes.
namespace bsp2::jobs {

/// An option that names a file or a folder.
inline CLI::Option* add_path(CLI::App& app, const std::string& option, std::string& path,
                             const std::string& description, const std::string& type) {
  return app.add_option(option, path, description)->check(is_named())->type_name(type);
}

/// What a command works on: it has to be there.
template <class Path>
void add_input(CLI::App& app, const char* name, Path& path, const std::string& description) {
  app.add_option(name, path, description)->required()->check(is_named())->type_name("");
}

constexpr auto model_words = "the model: a .csg or .scad file", snapshot_words = "what --snapshot wrote",
               model_or_snapshot_words = "a .csg or .scad file, or what --snapshot wrote";

/// What `mesh`, `render`, `draw` and `view` work on: a snapshot, of which nothing is computed, or a model.
/// @throws bsp2::Error if an option says of a snapshot what a model is taken for: that it has from its run.
void choose_input(RunCommand& command, const std::filesystem::path& input);

}  // namespace bsp2::jobs
