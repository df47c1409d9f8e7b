// Evaluates an OpenSCAD .csg file with the C++ library Manifold (a mesh kernel: its result is the boundary).
//
//     manifold_native MODEL.csg [--memo]
//
// The operands of a union, difference or intersection are given to it at once (BatchBoolean), which is its
// fastest way. With --memo equal subtrees are evaluated once. Prints one line of JSON: version, volume, area,
// triangles. Exit code 3: the model needs a node that is not handled here.
#include <manifold/manifold.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using manifold::Manifold;
using manifold::OpType;

struct Unsupported : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// --- Reading ---

/// A number, or a list; what is neither is left out.
struct Value {
  double number = 0;
  bool is_list = false;
  std::vector<Value> list;
};

struct Node {
  std::string name;
  std::map<std::string, Value, std::less<>> arguments;  ///< those without a name: "0", "1", ...
  std::vector<std::shared_ptr<const Node>> operands;

  [[nodiscard]] const Value* find(std::string_view key) const {
    const auto at = arguments.find(key);
    return at == arguments.end() ? nullptr : &at->second;
  }
  [[nodiscard]] double number(std::string_view key, double missing) const {
    const Value* value = find(key);
    return value == nullptr ? missing : value->number;
  }
};
using NodePointer = std::shared_ptr<const Node>;

class Reader {
 public:
  Reader(std::string text, bool memo) : text_(std::move(text)), memo_(memo) {}

  std::vector<NodePointer> read() {
    std::vector<NodePointer> nodes;
    for (skip(); at_ < text_.size(); skip())
      if (auto made = node()) nodes.push_back(std::move(made));
    return nodes;
  }

 private:
  std::string text_;
  std::size_t at_ = 0;
  bool memo_;
  std::map<std::string, NodePointer> known_;  // by text: what makes two subtrees equal

  [[noreturn]] void fail() const { throw std::runtime_error("cannot read this: " + text_.substr(at_, 40)); }
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  bool take(char c) {
    skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  std::string_view word() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 ||
                                  text_[at_] == '_' || text_[at_] == '$'))
      ++at_;
    return std::string_view(text_).substr(begin, at_ - begin);
  }
  Value value() {
    skip();
    Value made;
    if (take('[')) {
      made.is_list = true;
      while (!take(']')) {
        made.list.push_back(value());
        take(',');
      }
      return made;
    }
    if (take('"')) {
      const std::size_t end = text_.find('"', at_);
      if (end == std::string::npos) fail();
      at_ = end + 1;
      return made;
    }
    const auto [end, error] = std::from_chars(&text_[at_], text_.data() + text_.size(), made.number);
    if (error == std::errc()) {
      at_ = static_cast<std::size_t>(end - text_.data());
      return made;
    }
    const std::string_view name = word();
    if (name.empty()) fail();
    made.number = name == "true" ? 1 : 0;
    return made;
  }
  /// @return nothing of what is not drawn.
  NodePointer node() {
    const bool is_ghost = take('%');
    take('#');
    take('!');
    skip();
    const std::size_t begin = at_;
    auto made = std::make_shared<Node>();
    made->name = word();
    if (made->name.empty() || !take('(')) fail();
    for (int place = 0; !take(')'); take(',')) {
      skip();
      const std::size_t start = at_;
      std::string key(word());
      if (key.empty() || !take('=')) {
        at_ = start;
        key = std::to_string(place++);
      }
      made->arguments[key] = value();
    }
    if (take('{')) {
      while (!take('}'))
        if (auto operand = node()) made->operands.push_back(std::move(operand));
    } else {
      take(';');
    }
    if (is_ghost) return nullptr;
    if (!memo_) return made;
    return known_.try_emplace(text_.substr(begin, at_ - begin), made).first->second;
  }
};

// --- Evaluating ---

int fragments(const Node& node, double r) {
  const double fn = node.number("$fn", 0), fa = node.number("$fa", 12), fs = node.number("$fs", 2);
  if (r < 0x1p-20) return 3;
  if (fn > 0) return std::max(3, static_cast<int>(fn));
  return static_cast<int>(std::ceil(std::max(std::min(360 / fa, 2 * std::numbers::pi * r / fs), 5.0)));
}

Manifold cube(const Node& node) {
  manifold::vec3 size(1.0);
  if (const Value* given = node.find("size"))
    for (int i = 0; i < 3; ++i)
      size[i] = given->is_list ? given->list.at(static_cast<std::size_t>(i)).number : given->number;
  return size.x > 0 && size.y > 0 && size.z > 0 ? Manifold::Cube(size, node.number("center", 0) != 0)
                                                : Manifold();
}

/// OpenSCAD's: rings of points, none at the poles.
Manifold sphere(const Node& node) {
  const double r = node.number("r", 1);
  const int n = fragments(node, r), rings = (n + 1) / 2;
  manifold::SimplePolygon profile;
  const auto at = [&](int ring) {
    const double angle = std::numbers::pi * (ring + 0.5) / rings;
    return manifold::vec2(r * std::sin(angle), r * std::cos(angle));
  };
  profile.emplace_back(0, at(rings - 1).y);
  for (int ring = rings - 1; ring >= 0; --ring) profile.push_back(at(ring));
  profile.emplace_back(0, at(0).y);
  return Manifold::Revolve({profile}, n);
}

Manifold cylinder(const Node& node) {
  const double h = node.number("h", 1), r1 = node.number("r1", 1), r2 = node.number("r2", 1);
  const bool is_centred = node.number("center", 0) != 0;
  if (!(h > 0 && r1 >= 0 && r2 >= 0 && r1 + r2 > 0)) return {};
  const int n = fragments(node, std::max(r1, r2));
  if (r1 > 0) return Manifold::Cylinder(h, r1, r2, n, is_centred);
  const Manifold upside = Manifold::Cylinder(h, r2, 0, n, is_centred).Mirror({0, 0, 1});
  return is_centred ? upside : upside.Translate({0, 0, h});
}

/// Faces are fans: convex ones, which is what generators write. Points in one place are one vertex.
Manifold polyhedron(const Node& node) {
  const Value *points = node.find("points"), *faces = node.find("faces");
  if (points == nullptr || faces == nullptr) return {};
  std::map<std::array<double, 3>, std::uint64_t> numbers;
  std::vector<std::uint64_t> number_of;
  manifold::MeshGL64 mesh;
  mesh.numProp = 3;
  for (const Value& point : points->list) {
    const std::array<double, 3> p{point.list.at(0).number, point.list.at(1).number, point.list.at(2).number};
    const auto [place, is_new] = numbers.try_emplace(p, numbers.size());
    number_of.push_back(place->second);
    if (is_new) mesh.vertProperties.insert(mesh.vertProperties.end(), p.begin(), p.end());
  }
  for (const Value& face : faces->list)
    for (std::size_t i = 2; i < face.list.size(); ++i) {
      const auto corner = [&](std::size_t k) {
        return number_of.at(static_cast<std::size_t>(face.list[k].number));
      };
      const std::uint64_t a = corner(0), b = corner(i - 1), c = corner(i);
      if (a != b && b != c && c != a)  // .csg: clockwise seen from outside
        mesh.triVerts.insert(mesh.triVerts.end(), {c, b, a});
    }
  return Manifold(mesh);
}

class Evaluator {
 public:
  explicit Evaluator(bool memo) : memo_(memo) {}

  Manifold evaluate(const NodePointer& node) {
    if (const auto known = done_.find(node.get()); known != done_.end()) return known->second;
    Manifold made = make(*node);
    if (memo_) {
      made.NumTri();  // operations are lazy: what is shared is evaluated now, once
      done_.emplace(node.get(), made);
    }
    return made;
  }
  Manifold united(const std::vector<NodePointer>& nodes) { return combined(nodes, OpType::Add); }

 private:
  bool memo_;
  std::map<const Node*, Manifold> done_;

  Manifold combined(const std::vector<NodePointer>& nodes, OpType operation) {
    std::vector<Manifold> solids;
    for (const NodePointer& node : nodes) solids.push_back(evaluate(node));
    return solids.size() == 1 ? solids.front() : Manifold::BatchBoolean(solids, operation);
  }
  Manifold image(const Node& node) {
    const Value* matrix = node.find("0") != nullptr ? node.find("0") : node.find("m");
    const Manifold solid = united(node.operands);
    if (matrix == nullptr) return solid;
    const auto entry = [&](std::size_t i, std::size_t j) { return matrix->list.at(i).list.at(j).number; };
    const double w = entry(3, 3) == 0 ? 1 : entry(3, 3);
    manifold::mat3x4 map;
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 3; ++i)
        map[j][i] = entry(static_cast<std::size_t>(i), static_cast<std::size_t>(j)) / w;
    return solid.Transform(map);
  }
  Manifold make(const Node& node) {
    const std::string& name = node.name;
    if (name == "cube") return cube(node);
    if (name == "sphere") return sphere(node);
    if (name == "cylinder") return cylinder(node);
    if (name == "polyhedron") return polyhedron(node);
    if (name == "multmatrix") return image(node);
    if (name == "difference") return combined(node.operands, OpType::Subtract);
    if (name == "intersection") return combined(node.operands, OpType::Intersect);
    if (name == "union" || name == "group" || name == "render" || name == "color")
      return united(node.operands);
    throw Unsupported(name);
  }
};

std::string text_of(const char* path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(std::string("cannot read ") + path);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::fputs("usage: manifold_native MODEL.csg [--memo]\n", stderr);
    return 2;
  }
  const bool memo = count > 2 && std::string_view(arguments[2]) == "--memo";
  try {
    const std::vector<NodePointer> nodes = Reader(text_of(arguments[1]), memo).read();
    const Manifold solid = Evaluator(memo).united(nodes);
    std::printf(R"({"version": "%s", "volume": %.17g, "area": %.17g, "triangles": %zu})"
                "\n",
                MANIFOLD_VERSION_TEXT, solid.Volume(), solid.SurfaceArea(), solid.NumTri());
    return 0;
  } catch (const Unsupported& node) {
    std::printf("{\"unsupported\": \"%s\"}\n", node.what());
    return 3;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "manifold_native: %s\n", error.what());
    return 1;
  }
}
