#include "viewer/viewer.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <thread>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "options/command_line.hpp"
#include "outputs/model_files.hpp"
#include "serving/scene.hpp"
#include "serving/server.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"
#include "viewed.hpp"
#include "viewer/file_watch.hpp"
#include "viewer/message.hpp"
#include "viewer/packing.hpp"

namespace bsp2::jobs {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

using namespace api;

std::map<std::uint32_t, std::vector<std::shared_ptr<const geometry::CellBatch>>> by_region(
    const supersteps::RunResult& result) {
  std::map<std::uint32_t, std::vector<std::shared_ptr<const geometry::CellBatch>>> regions;
  for (const auto& batch : result.mesh.batches)
    if (!batch->empty()) regions[batch->region.front()].push_back(batch);
  return regions;
}

TEST(Lattice, PlacesAreAtMostHalfAStepAwayAndOnAllFinerLattices) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-9, 9), share(0, 1);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const double scale = std::pow(10, exponent(random));
    Point lower, upper;
    for (std::size_t i = 0; i < 3; ++i) {
      lower[i] = (share(random) - 0.5) * scale;
      upper[i] = lower[i] + share(random) * scale;
    }
    const Lattice lattice(lower, upper);
    ASSERT_GE(lattice.step() * 0xffff,
              std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2]}));
    ASSERT_EQ(std::exp2(std::round(std::log2(lattice.step()))), lattice.step());
    Point point;
    for (std::size_t i = 0; i < 3; ++i) point[i] = lower[i] + share(random) * (upper[i] - lower[i]);
    const auto place = lattice.place(point);
    for (std::size_t i = 0; i < 3; ++i) {
      ASSERT_LE(std::abs(lattice.origin()[i] + lattice.step() * place[i] - point[i]),
                0.5000001 * lattice.step());
      ASSERT_EQ(std::remainder(lattice.origin()[i], lattice.step()), 0);
    }
  }
}

TEST(Packing, CellsOfARegionHaveTheirVolumeAndFewerTrianglesThanFacets) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(4); ++round) {
    const auto result = evaluated(random_model(random));
    double volume = 0;
    std::uint64_t cells = 0, drawn = 0, facets = 0;
    for (const auto& [region, batches] : by_region(result)) {
      const Decoded message(region_message(7, region, batches, {}, 1U << 30));
      EXPECT_EQ(message.header["kind"], "region");
      EXPECT_EQ(message.header["run"], 7);
      EXPECT_EQ(message.header["region"], region);
      EXPECT_FALSE(message.header.contains("coarse"));
      const auto corners = message.whole("triangles");
      ASSERT_EQ(message.header["opaque"].get<std::size_t>() * 3, corners.size());  // all is decided
      volume += volume_of(message.points(), corners);
      cells += message.header["inCells"].get<std::uint64_t>();
      drawn += corners.size() / 3;
      double told = 0;
      for (const double each : message.real("volumes")) told += each;
      double own = 0;
      for (const auto& batch : batches) {
        for (std::size_t cell = 0; cell < batch->size(); ++cell) own += batch->volume[cell];
        for (std::size_t f = 0; f + 1 < batch->facet_vertex_offset.size(); ++f)
          facets += batch->vertices_of_facet(f).size() - 2;
      }
      EXPECT_NEAR(told, own, 1e-5 * own);
      std::int64_t of_cells = 0;
      for (const std::int64_t each : message.whole("ofCell")) of_cells += each;
      EXPECT_EQ(of_cells * 3, static_cast<std::int64_t>(corners.size()));
      const auto parts = message.whole("parts");
      for (const std::int64_t part : parts) EXPECT_TRUE(part == 0 || part == 1);
    }
    EXPECT_NEAR(volume, result.report.in_volume, 1e-3 * result.report.in_volume);
    EXPECT_EQ(cells, result.report.in_cells);
    const Decoded fresh(
        region_message(7, 0, result.mesh.batches, {}, 1U << 30, Fresh{5, 2}));  // of all regions
    EXPECT_EQ(fresh.header["kind"], "fresh");
    EXPECT_EQ(fresh.header["number"], 5);
    EXPECT_EQ(fresh.header["ofStep"], 2);
    EXPECT_NEAR(volume_of(fresh.points(), fresh.whole("triangles")), volume, 1e-3 * volume);
    EXPECT_LE(drawn, facets);
  }
}

TEST(Packing, WhatIsTooMuchGetsCoarserAndSaysSo) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> at(0, 1);
  std::vector<LooseTriangle> triangles;
  for (std::uint32_t i = 0; i < 5000; ++i) {  // small ones everywhere in a unit cube
    const Point corner{at(random), at(random), at(random)};
    triangles.push_back({{corner, Point{corner[0] + 0.01, corner[1], corner[2]},
                          Point{corner[0], corner[1] + 0.01, corner[2]}},
                         i});
  }
  const Lattice lattice({0, 0, 0}, {1.01, 1.01, 1});
  const auto [all, bits] = packed(triangles, 5000, lattice, 5000);
  EXPECT_EQ(bits, 16U);
  EXPECT_EQ(all.triangles.size(), 15000U);
  const auto [fewer, fewer_bits] = packed(triangles, 5000, lattice, 800);
  EXPECT_LT(fewer_bits, 16U);
  EXPECT_LE(fewer.triangles.size(), 2400U);
  std::uint64_t owned = 0;
  for (const std::uint32_t each : fewer.of_owner) owned += each;
  EXPECT_EQ(owned * 3, fewer.triangles.size());
}

/// Each edge of the triangles of a part is used equally often in both directions, at places that are the same
/// in all pieces: there are no gaps.
void expect_closed(const std::map<std::int64_t, std::map<std::pair<Point, Point>, int>>& edges_of_part) {
  for (const auto& [part, edges] : edges_of_part)
    for (const auto& [edge, uses] : edges) {
      const auto back = edges.find({edge.second, edge.first});
      ASSERT_TRUE(back != edges.end() && back->second == uses) << "part " << part;
    }
}

TEST(Packing, PiecesOfASurfaceAreClosedPartByPartAndHaveTheirVolumes) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(4); ++round) {
    const auto result = evaluated(random_model(random));
    ASSERT_TRUE(result.faces);
    for (const std::size_t most : {std::size_t{1} << 30, result.faces->triangles.size() / 2}) {
      std::map<std::int64_t, std::map<std::pair<Point, Point>, int>> edges;
      std::map<std::int64_t, double> volumes;
      std::size_t triangles = 0;
      for (const std::string& bytes : surface_messages(3, *result.faces, most)) {
        const Decoded message(bytes);
        const auto points = message.points();
        const auto corners = message.whole("triangles");
        const std::int64_t part = message.header["part"];
        volumes[part] += volume_of(points, corners);
        triangles += corners.size() / 3;
        for (std::size_t i = 0; i < corners.size(); ++i)
          ++edges[part][{points[corners[i]], points[corners[i % 3 == 2 ? i - 2 : i + 1]]}];
        EXPECT_EQ(message.whole("edges").size() % 2, 0U);
        for (const std::int64_t end : message.whole("edges"))
          ASSERT_LT(end, static_cast<std::int64_t>(points.size()));
        EXPECT_EQ(message.header.contains("coarse"), most < (1U << 30));
      }
      EXPECT_LE(triangles, most);
      expect_closed(edges);
      if (most < (1U << 30)) continue;
      for (const auto& part : result.report.named_parts)
        EXPECT_NEAR(volumes[part.part], part.volume, 1e-3 * result.report.in_volume) << part.name;
    }
  }
}

TEST(Packing, ACubeHasTwelveFeatureEdgesAndAFineCylinderThoseOfItsEnds) {
  const auto edges_of = [](const std::string& text) {
    std::size_t edges = 0;
    for (const std::string& bytes : surface_messages(1, *evaluated(text).faces, 1U << 30))
      edges += Decoded(bytes).whole("edges").size() / 2;
    return edges;
  };
  EXPECT_EQ(edges_of("cube(size = [1, 2, 3]);"), 12U);
  EXPECT_EQ(edges_of("cylinder($fn = 64, h = 3, r1 = 1, r2 = 1);"), 128U);
  EXPECT_EQ(edges_of("cylinder($fn = 6, h = 3, r1 = 1, r2 = 1);"), 18U);
}

/// The cells depend on the model alone, whoever looks at them from wherever while they are made.
TEST(Steering, ARunThatIsWatchedFindsTheSameCells) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(4); ++round) {
    const std::string text = random_model(random);
    const auto expected = evaluated(text);
    supersteps::RunOptions options;
    options.model = "random.csg";
    options.text = std::make_shared<const std::string>(text);
    options.threads = 2;
    options.boundary = options.faces = true;
    options.most_regions = 4;
    options.finds_rounds = false;
    unsigned steps = 0, frames = 0;
    std::uniform_real_distribution<double> place(-30, 30);
    options.steer = [&](unsigned step) {
      EXPECT_EQ(step, steps++);
      supersteps::Steering steering;
      steering.order = random() % 2 == 0 ? Order::depth : Order::priority;
      steering.eye.resize(random() % 5);  // other than 0 and 3 coordinates are none
      for (double& x : steering.eye) x = place(random);
      if (step < 20) steering.budget_seconds = 1e-4 * static_cast<double>(1 + random() % 10);
      return steering;
    };
    options.on_frame = [&](const supersteps::RunResult& now, unsigned) {
      ++frames;
      EXPECT_EQ(now.round_faces, nullptr);
    };
    const auto result = supersteps::run(options);
    EXPECT_EQ(steps, frames);
    EXPECT_LE(result.report.regions, 4U);
    EXPECT_EQ(result.report.digest, expected.report.digest);
    EXPECT_EQ(result.report.boundary->digest, expected.report.boundary->digest);
    EXPECT_TRUE(result.report.complete);
  }
}

TEST(Scene, SlowReadersGetTheNewestOfEachKeyOnceAndInOrder) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  Scene scene;
  std::map<std::string, std::string> newest, read;  // what a reader that sees all at last must know
  std::map<std::string, int> versions;
  std::uint64_t at = 0;
  const auto key_of = [](const std::string& bytes) { return bytes.substr(0, bytes.find('=')); };
  const auto read_one = [&] {
    const auto next = scene.after(at);
    if (!next) return false;
    EXPECT_GT(next->number, at);
    at = next->number;
    const std::string key = key_of(*next->bytes);
    EXPECT_NE(read[key], *next->bytes) << "the same twice";
    EXPECT_EQ(newest[key], *next->bytes) << "something old";
    read[key] = *next->bytes;
    return true;
  };
  for (int i = 0; i < samples::rounds(2000); ++i) {
    const std::string key = "k" + std::to_string(random() % 20);
    const std::string bytes = key + "=" + std::to_string(++versions[key]);
    scene.put(key, bytes);
    newest[key] = bytes;
    EXPECT_LE(scene.size(), 20U);  // whatever the reader does
    if (random() % 7 == 0) read_one();
  }
  while (read_one()) {
  }
  EXPECT_EQ(read, newest);
  scene.remove("k1");  // and k10 to k19
  EXPECT_EQ(scene.size(), 9U);
}

TEST(Scene, TellsWhoBeginsWhatTheRestIsShownWith) {
  Scene scene;
  scene.put("region", "1");
  scene.put_first("model", "old");
  scene.put("region", "2");
  const auto old_reader = scene.after(0);
  ASSERT_TRUE(old_reader);
  EXPECT_EQ(*old_reader->bytes, "old");
  scene.put_first("model", "new");
  const auto read_from = [&](std::uint64_t at) {
    std::vector<std::string> all;
    for (auto next = scene.after(at); next; next = scene.after(at)) {
      all.push_back(*next->bytes);
      at = next->number;
    }
    return all;
  };
  EXPECT_EQ(read_from(old_reader->number), (std::vector<std::string>{"2", "new"}));
  EXPECT_EQ(read_from(0), (std::vector<std::string>{"new", "2", "new"}));
}

/// What a server answers to bytes that are sent to it.
std::string answer_of(std::uint16_t port, const std::string& request) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{.sin_family = AF_INET, .sin_port = htons(port), .sin_addr = {htonl(INADDR_LOOPBACK)}};
  EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(::send(socket, request.data(), request.size(), MSG_NOSIGNAL),
            static_cast<ssize_t>(request.size()));
  std::string answer(1 << 16, '\0');
  std::size_t size = 0;
  for (ssize_t more = 1; more > 0 && size < answer.size();
       size += static_cast<std::size_t>(std::max<ssize_t>(0, more)))
    more = ::recv(socket, answer.data() + size, answer.size() - size, 0);
  ::close(socket);
  answer.resize(size);
  return answer;
}

class Serving : public ::testing::Test {
 protected:
  Scene scene_;
  Server server_{{},
                 {{"", {"text/html", "the page"}}, {"view.js", {"text/javascript", "the script"}}},
                 scene_,
                 [](const std::string&) {}};
  std::string host_ = "127.0.0.1:" + std::to_string(server_.port());

  [[nodiscard]] std::string ask(const std::string& target, const std::string& host,
                                const std::string& more = "") const {
    return answer_of(server_.port(), "GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n" + more + "\r\n");
  }
  [[nodiscard]] int code(const std::string& target, const std::string& host,
                         const std::string& more = "") const {
    const std::string answer = ask(target, host, more);
    return answer.size() > 12 ? std::stoi(answer.substr(9, 3)) : 0;
  }
};

TEST_F(Serving, WhoHasTheLinkGetsThePage) {
  const std::string path = "/" + server_.token() + "/";
  EXPECT_EQ(server_.link(), "http://" + host_ + path);
  const std::string answer = ask(path, host_);
  EXPECT_NE(answer.find("200 OK"), std::string::npos);
  EXPECT_TRUE(answer.ends_with("the page"));
  EXPECT_NE(answer.find("Content-Security-Policy: default-src 'self'"), std::string::npos);
  EXPECT_TRUE(ask(path + "view.js", host_).ends_with("the script"));
  EXPECT_TRUE(ask(path + "view.js?x", "localhost:" + std::to_string(server_.port())).ends_with("the script"));
}

TEST_F(Serving, NobodyElseGetsAnything) {
  const std::string path = "/" + server_.token() + "/";
  std::string wrong = server_.token();
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  EXPECT_EQ(code("/", host_), 403);
  EXPECT_EQ(code("/view.js", host_), 403);
  EXPECT_EQ(code("/" + wrong + "/", host_), 403);
  EXPECT_EQ(code("/" + server_.token(), host_), 403);
  EXPECT_EQ(code("//" + server_.token() + "/", host_), 403);
  for (const std::string host :
       {"example.org", "example.org:80", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.example.org", ""})
    EXPECT_EQ(code(path, host.ends_with("org") ? host + ":" + std::to_string(server_.port()) : host), 403)
        << host;
  for (const std::string name :
       {"../etc/passwd", "%2e%2e/etc/passwd", "..", "view.js/", "/etc/passwd", "nothing"})
    EXPECT_EQ(code(path + name, host_), 404) << name;
  EXPECT_EQ(
      answer_of(server_.port(), "POST " + path + " HTTP/1.1\r\nHost: " + host_ + "\r\n\r\n").substr(9, 3),
      "405");
}

constexpr const char* upgrade =
    "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";

TEST_F(Serving, PagesOfOthersGetNoData) {
  const std::string path = "/" + server_.token() + "/data";
  EXPECT_EQ(code(path, host_, std::string(upgrade) + "Origin: http://example.org\r\n"), 403);
  EXPECT_EQ(code("/data", host_, upgrade), 403);
  EXPECT_EQ(code(path, "example.org:" + std::to_string(server_.port()), upgrade), 403);
  EXPECT_EQ(server_.visits(), 0U);
}

TEST_F(Serving, GarbageAndSilenceDoNoHarm) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int i = 0; i < samples::rounds(50); ++i) {
    std::string garbage;
    for (std::uint32_t n = random() % 300; n > 0; --n) garbage += static_cast<char>(random() % 256);
    answer_of(server_.port(), garbage + "\r\n\r\n");
  }
  answer_of(server_.port(), "GET /" + std::string(100000, 'x') + " HTTP/1.1\r\n\r\n");
  EXPECT_EQ(code("/" + server_.token() + "/", host_), 200);
}

TEST(Server, SaysWhyItCannotListen) {
  Scene scene;
  const auto nothing = [](const std::string&) {};
  EXPECT_THROW(Server({"no address", 0}, {}, scene, nothing), Error);
  const Server first({}, {}, scene, nothing);
  try {
    const Server second({"127.0.0.1", first.port()}, {}, scene, nothing);
    FAIL() << "two servers at one port";
  } catch (const Error& error) {
    EXPECT_NE(
        std::string(error.what()).find("cannot listen on 127.0.0.1, port " + std::to_string(first.port())),
        std::string::npos);
  }
}

TEST(Server, KnowsItsOwnNames) {
  EXPECT_TRUE(is_own_host("127.0.0.1:80", "127.0.0.1", 80));
  EXPECT_TRUE(is_own_host("127.0.0.1", "127.0.0.1", 80));
  EXPECT_TRUE(is_own_host("localhost:4711", "127.0.0.1", 4711));
  EXPECT_TRUE(is_own_host("[::1]:4711", "::1", 4711));
  EXPECT_TRUE(is_own_host("192.0.2.7:4711", "0.0.0.0", 4711));
  EXPECT_FALSE(is_own_host("example.org:4711", "0.0.0.0", 4711));
  EXPECT_FALSE(is_own_host("192.0.2.7:4711", "192.0.2.8", 4711));
  EXPECT_FALSE(is_own_host("192.0.2.7:4711", "127.0.0.1", 4711));
}

void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

TEST(FileWatch, SeesWhatAModelIsMadeOf) {
  const samples::TemporaryFolder folder;
  const fs::path model = folder.path() / "a.scad", included = folder.path() / "lib" / "b.scad",
                 used = folder.path() / "c.scad", mesh = folder.path() / "lib" / "mesh.stl",
                 other = folder.path() / "other.scad";
  fs::create_directories(included.parent_path());
  write(model,
        "include <lib/b.scad>\nuse <c.scad>\n x = 1 < 2; s = \"no file\"; // \"other.scad\"\n"
        "u = \"http://x\"; /*/ include <other.scad>\n \"other.scad\" */\n");
  write(included, "import(\"mesh.stl\"); import(file = \"later.stl\");\n");
  write(used, "include <lib//../a.scad>\n");
  write(mesh, "solid\n");
  write(other, "cube();\n");
  const auto files = files_of_model(model);
  EXPECT_EQ(std::set<fs::path>(files.begin(), files.end()),
            (std::set<fs::path>{model, included, used, mesh, included.parent_path() / "later.stl"}));
  for (const fs::path& changed : {model, included, used, mesh}) {
    FileWatch watch(model);
    EXPECT_FALSE(watch.has_changed()) << changed;
    write(other, "sphere();\n");
    write(folder.path() / "new", "x");
    fs::rename(folder.path() / "new", changed);                   // as editors save
    std::this_thread::sleep_for(std::chrono::milliseconds(110));  // it looks ten times a second
    EXPECT_TRUE(watch.has_changed()) << changed;
    watch.begin();
    EXPECT_FALSE(watch.has_changed());
    write(model, "include <lib/b.scad>\nuse <c.scad>\n");
    write(included, "import(\"mesh.stl\");\n");
  }
}

RunCommand parsed(const std::vector<std::string>& arguments) {
  std::ostringstream ignored;
  return parse_command_line(arguments, ignored).value();
}

std::string refusal_of(const std::vector<std::string>& arguments) {
  try {
    parsed(arguments);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

TEST(ViewCommand, TellsModelsFromSnapshotsAndSteps) {
  const samples::TemporaryFolder folder;
  const std::string model = folder.path() / "a.csg", snapshot = folder.path() / "saved";
  write(model, "cube();\n");
  write(snapshot, "\x89HDF\r\n\x1a\n");
  const RunCommand command = parsed({"view", model});
  ASSERT_TRUE(command.viewer);
  EXPECT_EQ(command.model, model);
  EXPECT_FALSE(command.viewer->order || command.viewer->budget || command.options.steps ||
               command.viewer->stay);
  EXPECT_EQ(command.viewer->address, "127.0.0.1");
  const RunCommand saved = parsed({"view", snapshot, "--stay", "--port", "4711"});
  EXPECT_EQ(saved.resume, snapshot);
  EXPECT_EQ(saved.viewer->port, 4711);
  EXPECT_TRUE(saved.viewer->stay);
  const RunCommand steered =
      parsed({"view", model, "--order", "view", "--budget", "500ms", "--eye", "1,2,3"});
  EXPECT_TRUE(steered.viewer->follows_eye);
  EXPECT_EQ(steered.viewer->order, Order::priority);
  EXPECT_EQ(steered.viewer->budget, 0.5);
  EXPECT_FALSE(steered.options.budget);
  EXPECT_EQ(steered.viewer->eye, (std::vector<double>{1, 2, 3}));
  EXPECT_FALSE(parsed({"run", model}).viewer);
  for (const std::vector<std::string>& command : {std::vector<std::string>{"draw", snapshot, "-o", "a.svg"},
                                                  {"render", snapshot, "-o", "a.png"},
                                                  {"mesh", snapshot, "-o", "a.msh"}})
    EXPECT_EQ(parsed(command).resume, snapshot) << command[0];
  EXPECT_FALSE(parsed({"draw", model, "-o", "a.svg"}).resume);
}

/// Once the surface is there nobody has to wait, and the link was told before.
TEST(View, ShowsAnExpressionAndTheSurfaceOfIt) {
  std::string link;
  Figures found;
  const ViewerOptions viewer{.serves = [&](const std::string& told) { link = told; },
                             .evaluated =
                                 [&](const Figures& figures) {
                                   EXPECT_NE(link, "");
                                   found = figures;
                                 }};
  const Options options{.threads = 1, .stop = [&] { return found.in_cells > 0; }};
  try {
    load_page();
  } catch (const Error& error) {
    GTEST_SKIP() << error.what();
  }
  view(cuboid({3, 4, 5}) - cuboid({1, 1, 1}).translate({1, 1, 1}), viewer, options);
  EXPECT_TRUE(link.starts_with("http://127.0.0.1:")) << link;
  EXPECT_FALSE(found.is_interrupted);
  EXPECT_DOUBLE_EQ(found.in_volume, 59);
  ASSERT_TRUE(found.boundary);
  EXPECT_DOUBLE_EQ(found.boundary->area, 94 + 6);
}

TEST(View, SaysThatAnEyeIsOfOtherDimensionsThanTheModel) {
  try {
    load_page();
  } catch (const Error& error) {
    GTEST_SKIP() << error.what();
  }
  for (const std::vector<double>& eye : {std::vector<double>{1, 2}, {1, 2, 3}}) {
    const bool is_right = eye.size() == 3;
    std::string said;
    bool is_over = false;
    const ViewerOptions viewer{.eye = eye,
                               .evaluated = [&](const Figures&) { is_over = true; },
                               .failed = [&](const Error& error) { said = error.what(); }};
    const Options options{.threads = 1, .stop = [&] { return is_over || !said.empty(); }};
    view(cuboid({3, 4, 5}), viewer, options);
    EXPECT_EQ(said, is_right ? "" : "the eye has 2 coordinates, the model has 3 dimensions");
  }
}

TEST(ViewCommand, RefusesWhatMakesNoSense) {
  EXPECT_NE(refusal_of({"view", "/there/is/none.csg"}).find("cannot read '/there/is/none.csg'"),
            std::string::npos);
  const samples::TemporaryFolder folder;
  const std::string model = folder.path() / "a.csg";
  write(model, "cube();\n");
  EXPECT_NE(refusal_of({"view", model, "--port", "70000"}).find("--port"), std::string::npos);
  for (const char* eye : {"here", "1", "1,2,3,4"})
    EXPECT_NE(refusal_of({"view", model, "--eye", eye}).find("--eye"), std::string::npos);
  EXPECT_NE(refusal_of({"view", model, "--angle", "1"}).find("--eye"), std::string::npos);
  EXPECT_NE(refusal_of({"view", model, "--triangles", "3"}).find("--triangles"), std::string::npos);
}

}  // namespace
}  // namespace bsp2::jobs
