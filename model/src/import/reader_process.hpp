#pragma once

#include <filesystem>
#include <string>

#include "import/imports.hpp"

namespace bsp2::model {

/// The parts that a program of our own reads from a file. It lies among the modules, and needs a library that
/// most runs do not need, and that damaged files can bring to its end: so it runs in a process of its own,
/// with a limit to its memory and time, and what becomes of it is one message.
///
/// Started as a program, not forked: ranks of MPI and threads do not matter to it.
/// @param program its name. @param library what it is made with, for messages.
/// @throws bsp2::Error if there is no such program, it is of another build, or the file cannot be read.
ImportedParts parts_by_program(const std::string& program, const std::string& library,
                               const std::filesystem::path& path, const Fineness& fineness);

}  // namespace bsp2::model
