#pragma once

#include <filesystem>
#include <iosfwd>
#include <span>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace bsp2::jobs {

/// The points of a text: one a line, its coordinates between blanks or commas; empty lines and what follows a
/// # are passed over.
/// @param name of the text in messages. @return `dimension` numbers a point.
/// @throws bsp2::Error "name:line: ..." for a line that is no point, or one too far away to tell its distance
/// (beyond 1e150).
std::vector<double> read_points(std::istream& text, const std::string& name, int dimension);

/// Reads the points in a file; "-" is standard input. @throws bsp2::Error also if it cannot be read.
std::vector<double> read_points(const std::filesystem::path& path, int dimension);

/// The answers for people and spreadsheets: columns between tabs, under a line of their names; or as JSON,
/// where a number that does not exist is null. The distance is negative in the solid. All digits.
/// @param part_names of the model; where there are any, each answer has the name, too.
void print_answers(std::ostream& out, std::span<const double> points, const Locations& answers, int dimension,
                   bool json, const std::vector<std::string>& part_names = {});

}  // namespace bsp2::jobs
