#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

/// What is told of the command line: help, completion by a shell and the manual page, all from the one tree
/// of commands.
///
/// Rules for whoever adds an option: the first line of its description stands alone, since short help shows
/// no more; so does the first paragraph of a command's footer.
namespace bsp2::jobs {

/// Help that fits a screen: of a command with many options those most used. `--help-all` prints all, by
/// topic.
std::shared_ptr<CLI::Formatter> make_help_formatter();

/// How a shell's word may go on.
struct Completion {
  std::string word, description;
};
struct Completions {
  std::vector<Completion> words;
  bool files = false;  ///< or any file
};

/// @param words what was typed after the program's name; the last one, maybe empty, is to be completed.
Completions completions_of(const CLI::App& app, std::span<const std::string> words);

/// A line a completion, "word TAB description", and ":files" where a file may stand.
std::string completion_lines(const CLI::App& app, std::span<const std::string> words);

inline constexpr const char* completion_word = "__complete";  ///< how the scripts ask for them

/// @param shell bash, zsh or fish.
/// @return what a shell has to read to complete the words of bsp2.
std::string completion_script(const std::string& shell);

/// The page bsp2(1), as man reads it (troff).
std::string manual_page(const CLI::App& app);

/// The names of the commands of a command.
std::vector<std::string> command_names(const CLI::App& app);

}  // namespace bsp2::jobs
