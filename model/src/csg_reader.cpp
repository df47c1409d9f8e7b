#include <algorithm>
#include <utility>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/csg.hpp"
#include "csg_nodes.hpp"
#include "csg_scanner.hpp"
#include "node_pool.hpp"

namespace bsp2::model {
namespace {

constexpr std::size_t most_warnings = 100;

/// Builds the expression while it reads, bottom up, with explicit stacks: the nesting of the text costs
/// memory, never call stack.
///
/// What a subtree cannot be (an unsupported node, an open polyhedron) is noted, not thrown, as long as it is
/// unknown whether the subtree takes part: a later `!` may leave it out. Errors of syntax are thrown at once.
class Reader {
 public:
  Reader(std::string_view text, const std::string& name)
      : text_(text), name_(name), scanner_(text), lines_(text) {}

  Model read() {
    try {
      return read_nodes();
    } catch (const SyntaxError& error) {
      throw Error(located(error));
    }
  }

 private:
  /// Why a subtree takes no part.
  enum class Absence : std::uint8_t {
    none,
    background,
    disabled
  };  // -, under % or an unsupported node, under *

  struct Frame {
    NodeKind kind = NodeKind::group;
    Absence absence = Absence::none;
    bool is_root = false;    ///< tagged by !
    bool vanishes = false;   ///< a multmatrix that leaves nothing
    std::size_t offset = 0;  ///< of the name
    std::string_view name;
    std::size_t first_operand = 0;  ///< its children's solids are operands_[first_operand..]
    std::size_t primitives = 0;     ///< occurrences of primitives in them
    std::size_t problem = none;     ///< index of the first problem in them
  };

  static constexpr std::size_t none = ~std::size_t{0};

  Model read_nodes();
  void read_node();
  Frame header();
  void modifiers(Frame& frame);
  void interpret(Frame& frame);
  void close();
  void complete(const Frame& frame, Expression solid);
  Expression solid_of(const Frame& frame);
  Model result();
  [[noreturn]] void fail_open_frame();

  void note(Frame& frame, std::string text) {
    if (frame.problem != none) return;
    frame.problem = problems_.size();
    problems_.push_back({frame.offset, std::move(text)});
  }
  std::string located(const SyntaxError& error) {
    return name_ + ":" + lines_.at(error.offset) + ": " + error.text;
  }

  std::string_view text_;
  const std::string& name_;
  Scanner scanner_;
  LineFinder lines_;
  NodePool pool_;
  std::vector<Frame> frames_{Frame{}};  // the file is a group
  std::vector<Expression> operands_;
  std::vector<double> matrices_;  // of the multmatrix frames
  std::vector<SyntaxError> problems_, warnings_;
  std::size_t warnings_left_out_ = 0;
  bool root_tagged_ = false;
  Frame root_;  // once the subtree tagged by ! is complete
  Expression root_solid_;
  std::vector<Argument> arguments_;  // scratch
  std::vector<Value> tape_;
};

Model Reader::read_nodes() {
  bool any = false;
  for (scanner_.skip_space(); !scanner_.at_end(); scanner_.skip_space(), any = true) {
    if (scanner_.peek() == '}') {
      if (frames_.size() == 1) scanner_.fail("this '}' closes nothing");
      scanner_.advance();
      close();
    } else if (scanner_.peek() == ';') {
      scanner_.advance();  // an empty statement
    } else {
      read_node();
    }
  }
  if (frames_.size() > 1) fail_open_frame();
  if (!any) throw Error(name_ + ": holds no model: there is no node in it");
  return result();
}

void Reader::fail_open_frame() {
  const Frame& frame = frames_.back();
  const std::string opened = lines_.at(frame.offset);
  scanner_.fail("the text ends inside '" + std::string(frame.name) + "' of " + opened +
                "; a '}' is missing, or the file is cut off");
}

void Reader::modifiers(Frame& frame) {
  bool root = false, background = false, disabled = false;
  for (;; scanner_.advance(), scanner_.skip_space()) {
    const char c = scanner_.peek();
    if (c == '!')
      root = true;
    else if (c == '%')
      background = true;
    else if (c == '*')
      disabled = true;
    else if (c != '#')
      break;
  }
  // What is disabled is not in the tree at all, so nothing in it can be the root. The first root in the tree
  // counts.
  if (disabled)
    frame.absence = Absence::disabled;
  else if (background && frame.absence == Absence::none)
    frame.absence = Absence::background;
  if (!root || root_tagged_ || frame.absence == Absence::disabled) return;
  root_tagged_ = frame.is_root = true;
  frame.absence = Absence::none;
  warnings_.clear();  // of what is not in the tree now
  warnings_left_out_ = 0;
}

Reader::Frame Reader::header() {
  const Frame& parent = frames_.back();
  Frame frame;
  const bool transparent = parent.kind != NodeKind::unsupported && parent.kind < NodeKind::cube;
  frame.absence = parent.absence == Absence::none && !transparent ? Absence::background : parent.absence;
  if (root_tagged_ && frame.absence == Absence::none && root_.is_root) frame.absence = Absence::background;
  modifiers(frame);
  frame.offset = scanner_.offset();
  frame.name = scanner_.identifier();
  if (frame.name.empty()) scanner_.fail("expected a node, found " + scanner_.here());
  frame.kind = node_kind(frame.name);
  frame.first_operand = operands_.size();
  scanner_.arguments(arguments_, tape_);
  return frame;
}

/// Makes of the arguments what there is to make before the children are read.
void Reader::interpret(Frame& frame) {
  if (frame.absence != Absence::none) return;
  const Arguments arguments(arguments_, tape_);
  const auto warn = [&](std::string text) {
    if (warnings_.size() < most_warnings)
      warnings_.push_back({frame.offset, std::move(text)});
    else
      ++warnings_left_out_;
  };
  switch (frame.kind) {
    case NodeKind::unsupported:
    case NodeKind::unknown:
      note(frame, why_not(frame.name, frame.kind));
      break;
    case NodeKind::multmatrix: {
      const std::vector<double> matrix = read_matrix(arguments, warn);
      frame.vanishes = matrix.empty();
      matrices_.insert(matrices_.end(), matrix.begin(), matrix.end());
      break;
    }
    case NodeKind::group:
    case NodeKind::difference:
    case NodeKind::intersection:
      break;
    default:
      try {
        operands_.push_back(make_primitive(frame.kind, arguments, pool_, warn));
        frame.primitives = 1;
      } catch (const Error& error) {
        note(frame, error.what());
      }
  }
}

void Reader::read_node() {
  Frame frame = header();
  interpret(frame);
  scanner_.skip_space();
  const char c = scanner_.peek();
  if (c != ';' && c != '{')
    scanner_.fail("expected ';' or '{' after '" + std::string(frame.name.substr(0, 60)) + "(...)', found " +
                  scanner_.here());
  scanner_.advance();
  frames_.push_back(frame);
  if (c == ';') close();
}

Expression Reader::solid_of(const Frame& frame) {
  const auto operands = std::span<const Expression>(operands_).subspan(frame.first_operand);
  switch (frame.kind) {
    case NodeKind::difference:
      return pool_.boolean(Operation::subtract, operands);
    case NodeKind::intersection:
      return pool_.boolean(Operation::intersect, operands);
    case NodeKind::multmatrix: {
      if (frame.vanishes) return pool_.empty();
      const Expression child = pool_.boolean(Operation::unite, operands);
      const Expression image = pool_.transform(std::span(matrices_).last(16), child);
      matrices_.resize(matrices_.size() - 16);
      return image;
    }
    default:
      return pool_.boolean(Operation::unite, operands);  // a group, or a primitive, which is its only operand
  }
}

void Reader::close() {
  const Frame frame = frames_.back();
  frames_.pop_back();
  if (frame.absence != Absence::none) return;
  Expression solid = solid_of(frame);
  operands_.erase(operands_.begin() + static_cast<std::ptrdiff_t>(frame.first_operand), operands_.end());
  complete(frame, std::move(solid));
}

/// Hands a finished subtree that takes part to its parent.
void Reader::complete(const Frame& frame, Expression solid) {
  const std::size_t primitives = solid.same_node(pool_.empty()) ? 0 : frame.primitives;
  if (frame.is_root) {
    root_ = frame;
    root_.primitives = primitives;
    root_solid_ = std::move(solid);
    return;
  }
  Frame& parent = frames_.back();
  parent.primitives += primitives;
  if (parent.problem == none) parent.problem = frame.problem;
  operands_.push_back(std::move(solid));
}

Model Reader::result() {
  Frame& top = frames_.front();
  const std::size_t problem = root_tagged_ ? root_.problem : top.problem;
  if (problem != none) throw SyntaxError(problems_[problem]);
  Model model;
  if (root_tagged_) {
    model.expression = root_solid_;
    model.primitive_count = root_.primitives;
  } else {
    model.expression = pool_.boolean(Operation::unite, operands_);
    model.primitive_count = top.primitives;
  }
  for (const SyntaxError& warning : warnings_) model.warnings.push_back(located(warning));
  if (warnings_left_out_ > 0)
    model.warnings.push_back(name_ + ": and " + std::to_string(warnings_left_out_) + " more warnings");
  return model;
}

}  // namespace

Model parse_csg(std::string_view text, const std::string& name) {
  return Reader(text, name).read();
}

Model read_csg(const std::filesystem::path& path) {
  return parse_csg(read_text(path), path.string());
}

}  // namespace bsp2::model
