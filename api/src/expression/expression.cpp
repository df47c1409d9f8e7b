#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "expression/node.hpp"

namespace bsp2 {
namespace {

using Node = Expression::Node;
using NodePointer = std::shared_ptr<const Node>;

using geometry::most_dimensions;
constexpr std::size_t most_tabs = 12;               // deeper nodes are not moved in any further
constexpr std::uint64_t most_bytes = 0xffff'ffffu;  // of a text

std::uint64_t sum(std::uint64_t a, std::uint64_t b) {
  return a > std::numeric_limits<std::uint64_t>::max() - b ? std::numeric_limits<std::uint64_t>::max()
                                                           : a + b;
}

/// What a node takes in a text, its operands besides.
std::uint64_t own_bytes(const Node& node) {
  return node.name.size() + node.text.size() + 2 * most_tabs + sizeof "() {\n}\n";
}

[[noreturn]] void refuse_dimensions(const std::string& name, int a, int b) {
  throw Error(name + ": solids of " + counted(a, "# dimension[s]") + " and of " + std::to_string(b) +
              " do not go together; extrude, embed, project and section change the dimension");
}

void check_dimension(const std::string& name, int dimension) {
  if (!geometry::is_dimension(dimension))
    throw Error(name + ": " + counted(dimension, "# dimension[s]; 1 to ") + std::to_string(most_dimensions) +
                " are possible");
}

/// Whether f(f(a, b), c) is f(a, b, c): what a loop of `solid = solid + next` makes is written as one node.
bool is_left_associative(const std::string& name) {
  return name == "union" || name == "difference" || name == "intersection" ||
         name == "symmetric_difference" || name == "product";
}

/// The operands of a node as they are written.
std::vector<const Node*> written_operands(const Node& node) {
  std::vector<const Node*> operands;
  const Node* at = &node;
  for (;;) {
    // Without operands, only a union is what nothing is: an intersection of none is empty, and stays so.
    const bool goes_on = is_left_associative(node.name) && !at->operands.empty() &&
                         at->operands.front()->name == node.name &&
                         (node.name == "union" || !at->operands.front()->operands.empty());
    for (std::size_t i = at->operands.size(); i-- > (goes_on ? 1U : 0U);)
      operands.push_back(at->operands[i].get());
    if (!goes_on) break;
    at = at->operands.front().get();
  }
  return operands;  // the last one first
}

/// Writes an expression, with a stack of its own: nesting costs memory only.
class Writer {
 public:
  explicit Writer(const Node& root) {
    text_.reserve(static_cast<std::size_t>(std::min(root.bytes, std::uint64_t{1} << 26)));
    open(root);
    while (!stack_.empty()) {
      Open& top = stack_.back();
      if (top.left.empty()) {
        stack_.pop_back();
        line("}");
        continue;
      }
      const Node* next = top.left.back();
      top.left.pop_back();
      open(*next);
    }
  }
  std::string take() { return std::move(text_); }

 private:
  struct Open {
    std::vector<const Node*> left;
  };
  std::string text_;
  std::vector<Open> stack_;

  void tabs() { text_.append(std::min(stack_.size(), most_tabs), '\t'); }
  void line(const char* what) {
    tabs();
    (text_ += what) += '\n';
  }
  void open(const Node& node) {
    tabs();
    if (node.is_text()) {
      ((text_ += "group() {\n") += embedded(node.text, node.folder)) += '\n';
      return line("}");
    }
    (((text_ += node.name) += '(') += node.text) += ')';
    if (node.operands.empty() && node.name != "union") {
      text_ += ";\n";
      return;
    }
    text_ += " {\n";
    stack_.push_back({written_operands(node)});
  }
};

/// Sines of degrees, exact where they are rational or known better than by radians.
double sine(double degrees) {
  double x = std::fmod(degrees, 360.0);
  bool is_negative = false;
  if (x < 0) x += 360;
  if (x >= 180) {
    x -= 180;
    is_negative = true;
  }
  if (x > 90) x = 180 - x;
  double value = 0;
  if (x == 30)
    value = 0.5;
  else if (x == 90)
    value = 1;
  else if (x > 45)
    value = std::cos((90 - x) * std::numbers::pi / 180);
  else if (x == 45)
    value = std::numbers::sqrt2 / 2;
  else
    value = std::sin(x * std::numbers::pi / 180);
  return is_negative && value != 0 ? -value : value;
}
double cosine(double degrees) { return sine(std::fmod(degrees, 360.0) + 90); }

using Matrix = std::vector<double>;  // (D+1) x (D+1), row by row

Matrix identity(int dimension) {
  const auto n = static_cast<std::size_t>(dimension) + 1;
  Matrix matrix(n * n);
  for (std::size_t i = 0; i < n; ++i) matrix[i * n + i] = 1;
  return matrix;
}

void check_size(const std::string& name, std::size_t size, int dimension) {
  if (size != static_cast<std::size_t>(dimension))
    throw Error(name + ": " + counted(size, "# number[s]") + " for a solid of " +
                counted(dimension, "# dimension[s]"));
}

void check_space(const std::string& name, int dimension) {
  if (dimension != 3)
    throw Error(name + ": it turns solids of three dimensions, not of " + std::to_string(dimension) +
                "; rotate_plane takes any");
}

}  // namespace

Expression::Node::~Node() {
  std::vector<NodePointer> left = std::move(operands);
  while (!left.empty()) {
    const NodePointer last = std::move(left.back());
    left.pop_back();
    if (last.use_count() != 1) continue;
    std::atomic_thread_fence(std::memory_order_acquire);  // what other threads did that held it has been done
    auto& below = const_cast<Node&>(*last).operands;      // nobody else sees it any more
    std::move(below.begin(), below.end(), std::back_inserter(left));
    below.clear();
  }
}

Expression::Expression() {
  static const std::shared_ptr<const Node> empty = node("union").node_;
  node_ = empty;
}

Expression Expression::node(const std::string& name, const Arguments& arguments,
                            const std::vector<Expression>& operands, std::optional<int> dimension) {
  std::string text;
  std::size_t bytes = 0;
  for (const auto& [argument, value] : arguments) bytes += argument.size() + value.text_.size() + 5;
  text.reserve(bytes);
  for (const auto& [argument, value] : arguments) {
    if (!value.is_finite_) throw Error(name + ": '" + argument + "' has to be of finite numbers");
    if (!text.empty()) text += ", ";
    ((text += argument) += " = ") += value.text_;
  }
  return made(name, std::move(text), operands.data(), operands.size(),
              dimension.value_or(operands.empty() ? 3 : operands.front().dimension()));
}

Expression Expression::made(std::string name, std::string arguments, const Expression* operands,
                            std::size_t count, int dimension) {
  auto node = std::make_shared<Node>();
  node->name = std::move(name);
  node->text = std::move(arguments);
  node->dimension = dimension;
  check_dimension(node->name, dimension);
  node->bytes = own_bytes(*node);
  node->operands.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    if (operands[i].dimension() != operands[0].dimension() && node->name != "product")
      refuse_dimensions(node->name, operands[0].dimension(), operands[i].dimension());
    node->operands.push_back(operands[i].node_);
    node->bytes = sum(node->bytes, operands[i].node_->bytes);
  }
  return Expression(std::move(node));
}

int Expression::dimension() const { return node_->dimension; }
std::uint64_t Expression::text_bytes() const { return node_->bytes; }

std::string Expression::to_text() const {
  if (node_->bytes > most_bytes)
    throw Error(
        "the expression is too large to be written: what its operands share would stand there more "
        "than " +
        std::to_string(node_->bytes >> 30) + " GB long");
  return node_->is_text() ? located(node_->text, node_->folder) : Writer(*node_).take();
}

Expression Expression::translate(const Vector& by) const {
  check_size("translate", by.size(), dimension());
  Matrix matrix = identity(dimension());
  for (std::size_t i = 0, n = by.size() + 1; i + 1 < n; ++i) matrix[i * n + n - 1] = by[i];
  return transform(matrix);
}

Expression Expression::rotate(double degrees) const {
  if (dimension() != 2) check_space("rotate", dimension());
  return rotate_plane(degrees, 1, 2);
}

Expression Expression::rotate(const std::array<double, 3>& degrees) const {
  check_space("rotate", dimension());
  const double sx = sine(degrees[0]), cx = cosine(degrees[0]), sy = sine(degrees[1]), cy = cosine(degrees[1]),
               sz = sine(degrees[2]), cz = cosine(degrees[2]);
  return transform(Matrix{cy * cz, cz * sx * sy - cx * sz, cx * cz * sy + sx * sz, 0,  //
                          cy * sz, cx * cz + sx * sy * sz, cx * sy * sz - cz * sx, 0,  //
                          -sy, cy * sx, cx * cy, 0,                                    //
                          0, 0, 0, 1});
}

Expression Expression::rotate(double degrees, const std::array<double, 3>& axis) const {
  check_space("rotate", dimension());
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 0)) throw Error("rotate: the axis has no direction");
  const double x = axis[0] / length, y = axis[1] / length, z = axis[2] / length;
  const double s = sine(degrees), c = cosine(degrees), t = 1 - c;
  return transform(Matrix{t * x * x + c, t * x * y - s * z, t * x * z + s * y, 0,  //
                          t * x * y + s * z, t * y * y + c, t * y * z - s * x, 0,  //
                          t * x * z - s * y, t * y * z + s * x, t * z * z + c, 0,  //
                          0, 0, 0, 1});
}

Expression Expression::rotate_plane(double degrees, int from, int to) const {
  if (from < 1 || to < 1 || from > dimension() || to > dimension() || from == to)
    throw Error("rotate_plane: axes " + std::to_string(from) + " and " + std::to_string(to) +
                " of a solid of " +
                counted(dimension(), "# dimension[s]; two of them, from 1, span a plane"));
  Matrix matrix = identity(dimension());
  const auto n = static_cast<std::size_t>(dimension()) + 1, i = static_cast<std::size_t>(from - 1),
             j = static_cast<std::size_t>(to - 1);
  matrix[i * n + i] = matrix[j * n + j] = cosine(degrees);
  matrix[j * n + i] = sine(degrees);
  matrix[i * n + j] = -matrix[j * n + i];
  return transform(matrix);
}

Expression Expression::scale(double factor) const {
  return scale(Vector(static_cast<std::size_t>(dimension()), factor));
}

Expression Expression::scale(const Vector& factors) const {
  check_size("scale", factors.size(), dimension());
  Matrix matrix = identity(dimension());
  for (std::size_t i = 0, n = factors.size() + 1; i + 1 < n; ++i) matrix[i * n + i] = factors[i];
  return transform(matrix);
}

Expression Expression::mirror(const Vector& normal) const {
  check_size("mirror", normal.size(), dimension());
  double square = 0;
  for (const double x : normal) square += x * x;
  if (!(square > 0)) throw Error("mirror: the normal has no direction");
  Matrix matrix = identity(dimension());
  for (std::size_t i = 0, n = normal.size() + 1; i + 1 < n; ++i)
    for (std::size_t j = 0; j + 1 < n; ++j) matrix[i * n + j] -= 2 * normal[i] * normal[j] / square;
  return transform(matrix);
}

Expression Expression::transform(std::span<const double> matrix) const {
  const auto n = static_cast<std::size_t>(dimension()) + 1;
  if (matrix.size() != n * n && !(n == 3 && matrix.size() == 16))
    throw Error("transform: " + counted(matrix.size(), "# number[s]; a solid of ") +
                counted(dimension(), "# dimension[s] takes a matrix of ") + std::to_string(n) + " x " +
                std::to_string(n));
  const std::size_t width = matrix.size() == 16 ? 4 : n;
  for (std::size_t i = 0; i + 1 < width; ++i)
    if (matrix[(width - 1) * width + i] != 0)
      throw Error("transform: the last row has to be 0 ... 0 1; projective takes any");
  if (!(matrix.back() != 0)) throw Error("transform: the last number of the matrix is 0");
  // The language has 4 x 4 matrices for the plane.
  const Value m = width == 3 ? Value::rows(Matrix{matrix[0], matrix[1], 0, matrix[2],  //
                                                  matrix[3], matrix[4], 0, matrix[5],  //
                                                  0, 0, matrix[8], 0,                  //
                                                  0, 0, 0, matrix[8]},
                                           4)
                             : Value::rows(matrix, width);
  if (!m.is_finite_) throw Error("transform: 'm' has to be of finite numbers");
  return made("multmatrix", "m = " + m.text_, this, 1, dimension());
}

Expression Expression::transform(const std::vector<Vector>& rows) const {
  Matrix matrix;
  for (const Vector& row : rows) {
    if (row.size() != rows.size())
      throw Error("transform: the matrix has " + counted(rows.size(), "# row[s], and one of ") +
                  counted(row.size(), "# number[s]"));
    matrix.insert(matrix.end(), row.begin(), row.end());
  }
  return transform(std::span<const double>(matrix));
}

Expression Expression::projective(std::span<const double> matrix) const {
  const auto n = static_cast<std::size_t>(dimension()) + 1;
  if (matrix.size() != n * n) check_size("projective", matrix.size(), static_cast<int>(n * n));
  return node("projective", {{"m", Value::rows(matrix, n)}}, {*this});
}

Expression Expression::resize(const std::array<double, 3>& size, const std::array<bool, 3>& automatic) const {
  return node("resize", {{"newsize", size}, {"auto", automatic}}, {*this});
}

Expression Expression::part(const std::string& name) const { return node("part", {{"name", name}}, {*this}); }
Expression Expression::measure(const std::string& name) const {
  return node("measure", {{"name", name}}, {*this});
}
Expression Expression::color(const std::string& name, double alpha) const {
  return node("color", {{"c", name}, {"alpha", alpha}}, {*this});
}
Expression Expression::color(double red, double green, double blue, double opacity) const {
  return node("color", {{"c", std::array{red, green, blue, opacity}}}, {*this});
}

}  // namespace bsp2
