#include "bsp2/io/outputs/animation.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;

struct Chunk {
  std::string kind, data;
  friend bool operator==(const Chunk&, const Chunk&) = default;
};

std::uint32_t number_at(const std::string& text, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number = number << 8 | static_cast<unsigned char>(text.at(at + i));
  return number;
}
std::string text_of(std::uint32_t number) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(number >> shift & 0xff);
  return text;
}

const std::string signature = "\x89PNG\r\n\x1a\n";

std::string png_of(const std::vector<Chunk>& chunks) {
  std::string png = signature;
  for (const auto& [kind, data] : chunks) {
    const std::string body = kind + data;
    png += text_of(static_cast<std::uint32_t>(data.size())) + body +
           text_of(static_cast<std::uint32_t>(
               crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()))));
  }
  return png;
}

/// All sums are right, or the test fails.
std::vector<Chunk> chunks_of(const std::string& png) {
  EXPECT_EQ(png.substr(0, 8), signature);
  std::vector<Chunk> chunks;
  for (std::size_t at = 8; at < png.size();) {
    const std::uint32_t length = number_at(png, at);
    const std::string body = png.substr(at + 4, 4 + length);
    EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())),
              number_at(png, at + 8 + length));
    chunks.push_back({body.substr(0, 4), body.substr(4)});
    at += 12 + length;
  }
  return chunks;
}

std::string read(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// https://www.w3.org/TR/png-3/: what a player sees are the pictures, one after the other.
TEST(Animation, ApngHoldsItsPicturesInOrder) {
  const auto seed = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  samples::TemporaryFolder folder;
  const fs::path path = folder.path() / "film.apng";
  const std::string head = text_of(30) + text_of(20) + std::string("\x08\x02\0\0\0", 5);
  std::vector<std::string> pictures;  // their compressed pixels
  const auto animation = Animation::begin(path, 20);
  for (int i = 0; i < 7; ++i) {
    std::vector<Chunk> chunks{{"IHDR", head}, {"bKGD", "123456"}};
    pictures.emplace_back();
    for (unsigned part = 0; part <= random() % 3; ++part) {
      std::string data(1 + random() % 50, ' ');
      for (char& c : data) c = static_cast<char>(random());
      chunks.push_back({"IDAT", data});
      pictures.back() += data;
    }
    chunks.push_back({"IEND", ""});
    animation->add(png_of(chunks));
  }
  EXPECT_FALSE(fs::exists(path));
  animation->end();
  const auto chunks = chunks_of(read(path));
  ASSERT_EQ(chunks.size(), 3 + 2 * pictures.size());
  EXPECT_EQ(chunks[0], (Chunk{"IHDR", head}));
  EXPECT_EQ(chunks[1], (Chunk{"acTL", text_of(7) + text_of(0)}));
  EXPECT_EQ(chunks.back(), (Chunk{"IEND", ""}));
  std::uint32_t sequence = 0;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const Chunk &control = chunks[2 + 2 * i], &data = chunks[3 + 2 * i];
    EXPECT_EQ(control,
              (Chunk{"fcTL", text_of(sequence++) + text_of(30) + text_of(20) + text_of(0) + text_of(0) +
                                 std::string("\0\x64\x07\xd0\0\0", 6)}));  // 100 / 2000 of a second
    if (i == 0) {
      EXPECT_EQ(data, (Chunk{"IDAT", pictures[i]}));
    } else {
      EXPECT_EQ(data, (Chunk{"fdAT", text_of(sequence++) + pictures[i]}));
    }
  }
}

TEST(Animation, OfAnEndingThatIsNoneIsRefused) {
  for (const char* name : {"film.png", "film", "film.apng.txt"})
    EXPECT_THROW(Animation::check(name), Error) << name;
  EXPECT_NO_THROW(Animation::check("film.apng"));
  samples::TemporaryFolder folder;
  Animation::begin(folder.path() / "film.apng", 25).reset();  // given up
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

/// What stands in for ffmpeg keeps the pictures.
TEST(Animation, OthersAreMadeByFfmpeg) {
  samples::TemporaryFolder folder;
  const fs::path program = folder.path() / "ffmpeg", film = folder.path() / "film.mp4";
  const auto stand_in = [&](const std::string& does) {
    std::ofstream(program) << "#!/bin/sh\nfor last; do :; done\n" << does << "\n";
    fs::permissions(program, fs::perms::owner_all);
  };
  const std::string path = std::getenv("PATH") != nullptr ? std::getenv("PATH") : "";
  ::setenv("PATH", (folder.path().string() + ":" + path).c_str(), 1);
  const auto make = [&] {
    const auto animation = Animation::begin(film, 25);
    for (int i = 0; i < 300; ++i) animation->add(std::string(1000, static_cast<char>('a' + i % 26)));
    animation->end();
  };
  stand_in("exec cat > \"${last#file:}\"");
  EXPECT_NO_THROW(make());
  EXPECT_EQ(fs::file_size(film), 300000U);
  stand_in("cat > /dev/null; exit 3");
  EXPECT_THROW(make(), Error);
  stand_in("exit 3");
  EXPECT_THROW(make(), Error);
  EXPECT_EQ(fs::file_size(film), 300000U);  // that of before
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(folder.path())) files += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(files, 2U);
  ::setenv("PATH", "", 1);
  EXPECT_THROW(Animation::check("film.gif"), Error);
  ::setenv("PATH", path.c_str(), 1);
}

}  // namespace
}  // namespace bsp2::io
