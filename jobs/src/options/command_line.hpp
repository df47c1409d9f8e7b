#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// What `view` was asked for.
struct ViewCommand : ViewerOptions {
  bool open = false;  ///< the link, in the browser
};

/// What `jobs` was asked for.
struct QueueCommand {
  enum class Action : std::uint8_t { split, run, merge, status } action = Action::status;
  std::filesystem::path folder;
  double job_seconds = 1;            ///< split: a job is about so much work for one thread; 0: a job a region
  std::optional<std::uint32_t> job;  ///< run: this one, and what it is divided into
  bool until_empty = false;          ///< run: then all others too
  bool all = false;                  ///< status: a line a job
  double lease_seconds = 120;        ///< run: a claim that nobody touched for so long is lost
  bool partial = false;              ///< merge: what is missing is FUZZY
};

/// What the program was asked for: `run`, or what is the same but for its options: `resume`, `export`,
/// `render`, `query` and `draw`; or `info`.
struct RunCommand {
  std::filesystem::path model;                  ///< what is evaluated
  std::optional<std::filesystem::path> resume;  ///< or gone on with
  Options options;                              ///< and how, with all that is written
  std::optional<std::filesystem::path> info;    ///< tell what this snapshot holds, and nothing else
  std::optional<std::filesystem::path> points;  ///< tell where these points are, and nothing else
  bool json = false;                            ///< and tell it as JSON
  bool stats = false, quiet = false;
  std::optional<std::filesystem::path> checked_mesh;  ///< tell what this mesh is like, and nothing else
  std::vector<unsigned> tables;  ///< only measure: the paper's tables for these numbers of nodes
  bool brief = false;            ///< only the first of them
  bool of_surface = false;       ///< one of the surface, in their place
  std::vector<unsigned> levels;  ///< and these levels, then to the end; empty: chosen by the model
  std::optional<QueueCommand>
      queue;  ///< work with a queue of jobs; to merge is to resume what they have found
  std::optional<ViewCommand> viewer;  ///< show the run in browsers, and again when its files are saved
};

/// Reads the arguments of the program (its name left out).
/// @return nothing if help or version was asked for and has been printed to `out`.
/// @throws bsp2::Error for arguments that make no sense, with a hint where help is.
std::optional<RunCommand> parse_command_line(const std::vector<std::string>& arguments, std::ostream& out);

}  // namespace bsp2::jobs
