// Drawings of a megabyte that are made to take long, or much memory: read or refused, soon.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <string>

#include "model/drawing_helpers.hpp"
#include "support/rounds.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t megabyte = 1'000'000;
/// Of the processor, on a slow one; without a bound each of these drawings takes minutes, or all memory.
constexpr double most_seconds = 30;

/// @return the message of the refusal; empty if it is read.
std::string outcome(const DrawingFile& file, const std::string& text, const std::function<void()>& read) {
  EXPECT_LE(text.size(), megabyte + 1000);
  file.write(text);
  const std::clock_t start = std::clock();
  std::string message;
  try {
    read();
  } catch (const Error& error) {
    message = file.without_path(error.what());
  }
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  EXPECT_LT(seconds, most_seconds) << message;
  if (std::getenv("BSP2_TELL_SECONDS") != nullptr) std::printf("%.2f s: %s\n", seconds, message.c_str());
  return message;
}

std::string repeated(const std::string& text, std::size_t bytes) {
  std::string all;
  while (all.size() + text.size() <= bytes) all += text;
  return all;
}

/// As many uses of an element as make more than a million elements of it: 10^6 by six levels of ten.
std::string used_often(const std::string& element) {
  std::string text = "<defs><g id=\"u0\">" + element + "</g>";
  for (int i = 1; i <= 6; ++i) {
    text += "<g id=\"u" + std::to_string(i) + "\">";
    for (int k = 0; k < 9; ++k) text += "<use href=\"#u" + std::to_string(i - 1) + "\"/>";
    text += "</g>";
  }
  return text + "</defs><use href=\"#u5\"/>";
}

TEST(DrawingBounds, Svg) {
  if (samples::is_sanitized) GTEST_SKIP() << "a sanitizer makes it too slow for bounds of time";
  DrawingFile file("drawing.svg");
  const auto refusal = [&](const std::string& elements) {
    return outcome(file, "<svg xmlns=\"http://www.w3.org/2000/svg\">" + elements + "</svg>",
                   [&] { import_svg(file.path(), 72, false, {}, file.remarks()); });
  };
  const std::string style = repeated("mask:none;", megabyte - 10'000);
  EXPECT_EQ(refusal(used_often("<rect style=\"" + style + "\" width=\"1\" height=\"1\"/>"))
                .find("import: FILE: its "),
            0U);
  EXPECT_EQ(refusal(used_often("<path d=\"" + repeated("M0 0", megabyte - 10'000) + "\"/>"))
                .find("import: FILE has more than 20000000 points"),
            0U);
  EXPECT_EQ(refusal(used_often("<path d=\"x" + std::string(megabyte - 10'000, ' ') + "\"/>"))
                .find("import: FILE: its <use> elements draw"),
            0U);
  EXPECT_EQ(refusal(used_often("<g transform=\"" + repeated("scale(1)", megabyte - 10'000) + "\"/>"))
                .find("import: FILE: its <use> elements draw"),
            0U);
  EXPECT_EQ(refusal("<style>" + repeated(".a{mask:none}", megabyte / 5) + "</style>" +
                    repeated("<g class=\"a\"/>", megabyte * 3 / 4))
                .find("import: FILE: its elements have styles"),
            0U);
  // Lines with a width: round ones with many chords, wide ones, and ones that cross themselves again and
  // again.
  std::mt19937 random(1);
  const auto points = [&](std::size_t bytes, int width, int height) {
    std::string text;
    for (int i = 0; text.size() < bytes; ++i)
      text += std::to_string(random() % static_cast<unsigned>(width)) + "," +
              std::to_string(height < 0 ? (i % 2) * -height
                                        : static_cast<int>(random() % static_cast<unsigned>(height))) +
              " ";
    return text;
  };
  for (const std::string stroke :
       {"stroke-linejoin=\"round\" stroke-linecap=\"round\" stroke-width=\"1e11\"", "stroke-width=\"1\"",
        "stroke-width=\"100000\"", "stroke-linejoin=\"round\" stroke-width=\"0.01\""})
    for (const std::size_t bytes : {megabyte / 200, megabyte / 2})
      for (const int height : {99'999, -99'999}) {
        SCOPED_TRACE(stroke + ", " + std::to_string(bytes) + " bytes, height " + std::to_string(height));
        const std::string message =
            refusal("<polyline " + stroke + " points=\"" + points(bytes, 99'999, height) + "\"/>");
        EXPECT_TRUE(message.empty() ||
                    message.find("import: FILE: the outlines of its lines with a width have too many ") == 0)
            << message;
        if (bytes > megabyte / 10) {
          EXPECT_NE(message, "");
        }
      }
  // What people draw is read: twenty thousand points along a spiral, a thousand that hatch an area.
  std::string spiral, hatching;
  for (int i = 0; i < 20'000; ++i) {
    const double angle = i * 0.01, radius = 10 + i * 0.01;
    spiral += std::to_string(radius * std::cos(angle)) + " " + std::to_string(radius * std::sin(angle)) + " ";
  }
  for (int i = 0; i < 1000; ++i)
    hatching += std::to_string(i / 2) + "," + std::to_string((i + 1) / 2 % 2 * 1000) + " ";
  EXPECT_EQ(
      refusal("<polyline points=\"" + spiral.substr(0, megabyte) + "\" style=\"stroke-linejoin:round\"/>"),
      "");
  EXPECT_EQ(refusal("<polyline stroke-width=\"0.1\" points=\"" + hatching + "\"/>"), "");
}

TEST(DrawingBounds, Dxf) {
  if (samples::is_sanitized) GTEST_SKIP() << "a sanitizer makes it too slow for bounds of time";
  DrawingFile file("drawing.dxf");
  const auto refusal = [&](const std::string& blocks, const std::string& entities,
                           const Resolution& resolution = {}) {
    return outcome(file,
                   "0\nSECTION\n2\nBLOCKS\n" + blocks + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n" + entities +
                       "0\nENDSEC\n0\nEOF\n",
                   [&] { import_dxf(file.path(), "", {}, resolution, file.remarks()); });
  };
  const auto block = [](const std::string& head, const std::string& entities) {
    return "0\nBLOCK\n2\nB\n" + head + entities + "0\nENDBLK\n";
  };
  const std::string numbers = repeated("60\n0\n", megabyte - 1000), rows = "70\n900\n71\n900\n",
                    few_rows = "70\n500\n71\n900\n", too_large = "import: FILE is too large: ";
  const std::string line = "0\nLINE\n10\n0\n20\n0\n11\n1\n21\n1\n",
                    many_lines = "import: a DXF drawing of more than a million lines";
  EXPECT_EQ(refusal(block("", line), "0\nINSERT\n" + numbers + "2\nB\n" + few_rows), "")
      << "an array with a long head is drawn";
  EXPECT_EQ(refusal(block("", "0\nTEXT\n"), "0\nINSERT\n" + numbers + "2\nB\n" + rows).find(too_large), 0U);
  EXPECT_EQ(refusal(block(numbers, "0\nINSERT\n2\nC\n") + "0\nBLOCK\n2\nC\n" + line + "0\nENDBLK\n",
                    "0\nINSERT\n2\nB\n" + rows)
                .find(too_large),
            0U);
  EXPECT_EQ(refusal(block("", "0\nLINE\n" + numbers), "0\nINSERT\n2\nB\n" + rows).find(too_large), 0U);
  EXPECT_EQ(refusal(block("", "0\n" + std::string(megabyte - 1000, 'X') + "\n"), "0\nINSERT\n2\nB\n" + rows)
                .find(too_large),
            0U);
  EXPECT_EQ(refusal(block("", "0\nCIRCLE\n10\n1e20\n40\n1\n"), "0\nINSERT\n2\nB\n" + rows, {.fn = 100'000}),
            many_lines);
  EXPECT_EQ(refusal("", repeated("0\nCIRCLE\n10\n1e20\n40\n1\n", megabyte - 1000), {.fn = 100'000}),
            many_lines);
  EXPECT_EQ(refusal("", repeated("0\nCIRCLE\n40\n1\n", megabyte - 1000), {.fn = 100'000}), many_lines);
  std::string spline = "0\nSPLINE\n71\n3\n";
  for (int i = 0; i < 30'000; ++i)
    spline += "11\n" + std::to_string(i) + "\n21\n" + std::to_string(i % 7) + "\n";
  EXPECT_EQ(refusal(block("", spline), "0\nINSERT\n2\nB\n" + rows).find("import: "), 0U);
  // As many lines as fit, each with points of its own.
  std::string lines;
  for (int i = 0; lines.size() < megabyte - 100; ++i)
    lines += "0\nLINE\n10\n" + std::to_string(i) + "\n21\n9\n";
  EXPECT_EQ(refusal("", lines), "");
}

}  // namespace
}  // namespace bsp2::model
