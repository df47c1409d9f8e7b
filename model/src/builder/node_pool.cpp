#include "builder/node_pool.hpp"

#include <algorithm>
#include <bit>
#include <functional>
#include <utility>

namespace bsp2::model {
namespace {

__extension__ using Wide = unsigned __int128;

/// Mixes values into a hash by multiplying and folding; quality is enough for open addressing.
class Hash {
 public:
  void add(std::uint64_t value) {
    const auto product = static_cast<Wide>(state_ ^ value) * 0x9E3779B97F4A7C15ull;
    state_ = static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64) ^ (state_ << 7);
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value + 0.0)); }  // -0 == 0, so it hashes as 0
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0x243F6A8885A308D3ull;
};

void add(Hash& hash, const Cuboid& cuboid) {
  for (const double size : cuboid.size) hash.add(size);
}

void add(Hash& hash, const Lathe& lathe) {
  hash.add(std::uint64_t{lathe.sides});
  for (const auto& [radius, z] : lathe.rings) hash.add(radius), hash.add(z);
}

void add(Hash& hash, const TriangleMesh& mesh) {
  for (const auto& point : mesh.points)
    for (const double x : point) hash.add(x);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) hash.add(std::uint64_t{corner});
}

void add(Hash& hash, const RegularPolygon& polygon) {
  hash.add(std::uint64_t{polygon.sides});
  hash.add(polygon.radius);
}

void add(Hash& hash, const ConvexPolygon& polygon) {
  for (const auto& point : polygon.points)
    for (const double x : point) hash.add(x);
}

void add(Hash& hash, const Round& round) {
  hash.add(round.bottom), hash.add(round.top);
  hash.add(std::uint64_t{round.sides});
  for (const double length : round.lengths) hash.add(length);
}

void add(Hash& hash, const Polytope& polytope) {
  for (const double x : polytope.corners) hash.add(x);
}

void add(Hash& hash, const Torus& torus) { hash.add(torus.major), hash.add(torus.minor); }

void add(Hash& hash, const Spline& spline) {
  for (const auto& piece : spline.pieces) {
    for (const std::uint32_t degree : piece.degrees) hash.add(std::uint64_t{degree});
    for (const auto& knots : piece.knots)
      for (const double knot : knots) hash.add(knot);
    for (const double x : piece.points) hash.add(x);
  }
}

void add(Hash& hash, const SubdivisionSurface& surface) {
  hash.add(static_cast<std::uint64_t>(surface.scheme));
  for (const double x : surface.points) hash.add(x);
  for (const auto& face : surface.faces)
    for (const std::uint32_t corner : face) hash.add(std::uint64_t{corner});
}

void add(Hash& hash, const Preimage& preimage) {
  std::visit([&](const auto& solid) { add(hash, solid); }, preimage.solid);
  for (const double x : preimage.map) hash.add(x);
}

void add(Hash& hash, const TellsOfItself auto& shape) {
  for (const double x : shape.numbers()) hash.add(x);
}

std::uint64_t hash_of(const Primitive& primitive) {
  Hash hash;
  hash.add(std::uint64_t{primitive.index()});
  std::visit([&](const auto& shape) { add(hash, shape); }, primitive);
  return hash.value();
}

std::uint64_t address(const Expression& e) { return reinterpret_cast<std::uintptr_t>(&e.node()); }

bool same_nodes(std::span<const Expression> a, std::span<const Expression> b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Expression& x, const Expression& y) { return x.same_node(y); });
}

}  // namespace

template <class Equal, class Make>
Expression NodePool::find_or_make(std::uint64_t hash, int dimension, Equal equal, Make make) {
  std::size_t at = hash & (slots_.size() - 1);
  for (; slots_[at].index != 0; at = (at + 1) & (slots_.size() - 1)) {
    if (slots_[at].hash != hash) continue;
    const Expression& candidate = nodes_[slots_[at].index - 1];
    if (candidate.dimension() == dimension && equal(candidate.node().value)) return candidate;
  }
  nodes_.emplace_back(make());
  slots_[at] = {hash, static_cast<std::uint32_t>(nodes_.size())};
  Expression made = nodes_.back();
  if (2 * nodes_.size() > slots_.size()) grow();
  return made;
}

void NodePool::grow() {
  std::vector<Slot> old(2 * slots_.size());
  old.swap(slots_);
  for (const Slot& slot : old) {
    if (slot.index == 0) continue;
    std::size_t at = slot.hash & (slots_.size() - 1);
    while (slots_[at].index != 0) at = (at + 1) & (slots_.size() - 1);
    slots_[at] = slot;
  }
}

Expression NodePool::primitive(Primitive primitive, int dimension) {
  return find_or_make(
      hash_of(primitive) + static_cast<std::uint64_t>(dimension), dimension,
      [&](const auto& value) {
        return std::holds_alternative<Primitive>(value) && std::get<Primitive>(value) == primitive;
      },
      [&] { return Expression(std::make_shared<Node>(dimension, std::move(primitive))); });
}

Expression NodePool::boolean(Operation operation, int dimension, std::span<const Expression> operands,
                             bool one_part) {
  const auto vanishes = [this](const Expression& e) { return is_empty(e); };
  if (operands.empty()) return empty(dimension);
  if (operation == Operation::subtract && is_empty(operands.front())) return empty(dimension);
  if (operation == Operation::intersect && std::any_of(operands.begin(), operands.end(), vanishes))
    return empty(dimension);
  operands_.assign(operands.begin(), operands.end());
  if (operation != Operation::complement)
    std::erase_if(operands_, vanishes);  // what is not in nothing is everything
  if (operands_.empty()) return empty(dimension);
  if (operands_.size() == 1 && operation != Operation::complement) return operands_.front();

  Hash hash;
  hash.add(0x100 + static_cast<std::uint64_t>(operation) + (one_part ? 0x80 : 0));
  for (const Expression& operand : operands_) hash.add(address(operand));
  const auto equal = [&](const auto& value) {
    const auto* other = std::get_if<Boolean>(&value);
    return other && other->operation == operation && (other->parts != 0) == one_part &&
           same_nodes(other->children, operands_);
  };
  return find_or_make(hash.value(), dimension, equal, [&] {
    return Expression(std::make_shared<Node>(dimension, Boolean{operation, operands_, one_part ? 1U : 0U}));
  });
}

Expression NodePool::transform(std::vector<double> matrix, const Expression& child) {
  if (is_empty(child)) return child;
  for (double& entry : matrix) entry += 0.0;  // no -0: nodes that compare equal look equal
  Hash hash;
  hash.add(std::uint64_t{0x200});
  for (const double entry : matrix) hash.add(entry);
  hash.add(address(child));
  const auto equal = [&](const auto& value) {
    const auto* other = std::get_if<Transform>(&value);
    return other && other->child.same_node(child) && other->matrix == matrix;
  };
  return find_or_make(hash.value(), child.dimension(), equal, [&] {
    return Expression(std::make_shared<Node>(child.dimension(), Transform{std::move(matrix), child}));
  });
}

Expression NodePool::coloured(const Colour& colour, const Expression& child) {
  if (is_empty(child)) return child;
  Hash hash;
  hash.add(std::uint64_t{0x400});
  for (const double channel : colour) hash.add(channel);
  hash.add(address(child));
  const auto equal = [&](const auto& value) {
    const auto* other = std::get_if<Coloured>(&value);
    return other && other->child.same_node(child) && other->colour == colour;
  };
  return find_or_make(hash.value(), child.dimension(), equal, [&] {
    return Expression(std::make_shared<Node>(child.dimension(), Coloured{colour, child}));
  });
}

Expression NodePool::named(Named::Role role, const std::string& name, const Expression& child) {
  if (is_empty(child)) return child;
  Hash hash;
  hash.add(0x500 + static_cast<std::uint64_t>(role));
  hash.add(static_cast<std::uint64_t>(std::hash<std::string>()(name)));
  hash.add(address(child));
  const auto equal = [&](const auto& value) {
    const auto* other = std::get_if<Named>(&value);
    return other && other->child.same_node(child) && other->role == role && other->name == name;
  };
  return find_or_make(hash.value(), child.dimension(), equal, [&] {
    return Expression(std::make_shared<Node>(child.dimension(), Named{role, name, child}));
  });
}

Expression NodePool::adopt(const Expression& made) {
  const Node& node = made.node();
  if (const auto* one = std::get_if<Primitive>(&node.value)) return primitive(*one, node.dimension);
  if (const auto* map = std::get_if<Transform>(&node.value)) return transform(map->matrix, adopt(map->child));
  const auto& of = std::get<Boolean>(node.value);
  std::vector<Expression> children;
  for (const Expression& child : of.children) children.push_back(adopt(child));
  return boolean(of.operation, node.dimension, children, of.parts != 0);
}

Expression NodePool::construction(const Construct& construct, int dimension,
                                  std::span<const Expression> operands) {
  Hash hash;
  hash.add(0x300 + static_cast<std::uint64_t>(construct.index()));
  for (const Expression& operand : operands) hash.add(address(operand));
  const auto equal = [&](const auto& value) {
    const auto* other = std::get_if<Construction>(&value);
    return other && other->construct == construct && same_nodes(other->operands, operands);
  };
  return find_or_make(hash.value(), dimension, equal, [&] {
    return Expression(
        std::make_shared<Node>(dimension, Construction{construct, {operands.begin(), operands.end()}}));
  });
}

}  // namespace bsp2::model
