#include <algorithm>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "bsp2/model/expression/line_finder.hpp"
#include "builder/matrix.hpp"
#include "builder/node_pool.hpp"
#include "builder/polyhedron.hpp"
#include "csg/csg_nodes.hpp"
#include "csg/csg_primitive_nodes.hpp"
#include "text/csg_scanner.hpp"

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
  Reader(std::string_view text, const std::string& name, const CsgOptions& options)
      : text_(text),
        name_(name),
        folder_(std::filesystem::path(name).parent_path()),
        options_(options),
        scanner_(text),
        lines_(text) {}

  Model read() {
    try {
      return read_nodes();
    } catch (const SyntaxError& error) {
      throw Error(located(error) + (error.is_source || is_source_at(text_, error.offset, reading_)
                                        ? std::string(source_hint)
                                        : ""));
    }
  }

 private:
  /// Why a subtree takes no part.
  enum class Absence : std::uint8_t { none, background, disabled };  // -, under %, under *

  struct Frame {
    const NodeRow* row = nullptr;
    Absence absence = Absence::none;
    bool is_root = false;    ///< tagged by !
    bool vanishes = false;   ///< a construct that leaves nothing
    bool is_bare = false;    ///< has no braces, so it ends with its one child
    bool is_own = false;     ///< it is, or holds, a node that OpenSCAD does not have
    std::size_t offset = 0;  ///< of the name
    std::string_view name;
    std::size_t first_operand = 0;  ///< its children's solids are operands_[first_operand..]
    std::size_t first_place = 0;    ///< and their primitives stand at places_[first_place..]
    std::size_t problem = none;     ///< index of the first problem in them
    [[nodiscard]] bool is(NodeKind kind) const { return row->kind == kind; }
    [[nodiscard]] bool is_construct() const { return row->category == NodeCategory::construct; }
    /// Of OpenSCAD's: from the plane to space, or of a drawing that it names.
    [[nodiscard]] bool is_extrusion() const { return is_construct() && row->result == 3; }
  };

  static constexpr std::size_t none = ~std::size_t{0};

  Model read_nodes();
  void read_node();
  Frame header();
  void modifiers(Frame& frame);
  [[nodiscard]] bool only_points_count(const Frame& frame, bool is_solid) const;
  [[nodiscard]] bool flat_points_count(const Frame& frame) const;
  std::optional<double> scale_of_maps();
  void remember_meshes(const Frame& frame, const Arguments& arguments, const Expression& made);
  Expression solid_of_hollow(const Frame& frame, const HollowPolyhedron& polyhedron);
  const Expression* known_polyhedron();
  Expression primitive_of(const Frame& frame, const Arguments& arguments);
  void interpret(Frame& frame);
  void interpret_construct(Frame& frame, const Arguments& arguments);
  void interpret_primitive(const Frame& frame, const Arguments& arguments);
  void close();
  void close_frame();
  void complete(const Frame& frame, Expression solid);
  int settle_dimension(Frame& frame);
  void forget_places(std::size_t operand);
  Expression solid_of(Frame& frame);
  Expression own_node_of(Frame& frame);
  Expression coloured(const Expression& child);
  Expression image_of(Frame& frame, const Expression& child);
  Expression sum_of(const Frame& frame, const Expression& a, const Expression& b, bool passes_over_empty);
  Expression sum_of(const Frame& frame, int dimension, std::span<const Expression> operands);
  Expression construction_of(const Frame& frame, int dimension, std::span<const Expression> operands);
  [[nodiscard]] SyntaxError nothing_left() const;
  Model result();
  [[noreturn]] void fail_open_frame();

  void note(Frame& frame, std::string text) {
    if (frame.problem != none) return;
    frame.problem = problems_.size();
    problems_.push_back({frame.offset, std::move(text)});
  }
  void warn(const Frame& frame, std::string text) {
    if (is_outside(frame) && is_told(warnings_, text)) return;
    if (warnings_.size() < most_warnings)
      warnings_.push_back({{frame.offset, std::move(text)}});
    else
      ++warnings_left_out_;
  }
  Warn warner(const Frame& frame) {
    return [this, &frame](std::string text) { warn(frame, std::move(text)); };
  }
  void remark(const Frame& frame, std::string text) {
    if (!is_told(notes_, text) && notes_.size() < most_warnings)
      notes_.push_back({{frame.offset, std::move(text)}});
  }
  /// What it is like is said by a font or a file, in the same words at each place.
  static bool is_outside(const Frame& frame) {
    return frame.is(NodeKind::text) || frame.is(NodeKind::import) || frame.is(NodeKind::surface) ||
           frame.is_extrusion();
  }
  static bool is_mesh(const Expression& solid) {
    const auto* shape = std::get_if<Primitive>(&solid.node().value);
    return shape != nullptr && std::holds_alternative<TriangleMesh>(*shape);
  }
  struct Remark {
    SyntaxError error;
    std::size_t more_places = 0;
  };
  /// Counts a place where it is told already.
  static bool is_told(std::vector<Remark>& remarks, const std::string& text) {
    const auto told = std::find_if(remarks.begin(), remarks.end(),
                                   [&](const Remark& each) { return each.error.text == text; });
    if (told == remarks.end()) return false;
    ++told->more_places;
    return true;
  }
  std::string located(const Remark& remark) {
    const std::size_t more = remark.more_places;
    return located(remark.error) + (more == 0 ? "" : counted(more, " (and at # more place[s])"));
  }
  std::string located(const SyntaxError& error) {
    if (is_imported(name_))  // the file is the model, and its text is ours
      return error.text.starts_with(name_ + ":") ? error.text : name_ + ": " + error.text;
    return name_ + ":" + lines_.at(error.offset) + ": " + error.text;
  }

  std::string_view text_;
  const std::string& name_;
  const std::filesystem::path folder_;  // what names of files are relative to
  CsgOptions options_;
  Scanner scanner_;
  std::string_view reading_;  // the name of the last node that was begun
  LineFinder lines_;
  NodePool pool_;
  std::vector<Frame> frames_{Frame{.row = &node_named("group"), .name = "the file"}};
  std::vector<Expression> operands_;
  std::vector<std::size_t> operand_places_;  // of each operand: its first place
  std::vector<std::size_t> places_;          // of the primitives that take part, in source order
  std::unordered_map<const Node*, std::size_t> constructs_at_;
  struct MatrixText {
    std::array<double, 16> affine;         // as OpenSCAD reads it
    std::vector<double> square;            // as it stands, if it is square
    std::optional<double> volume_scale{};  // once it was asked for
  };
  std::vector<MatrixText> matrices_;            // of the multmatrix frames
  std::vector<MakeOwn> own_nodes_;              // of the frames of nodes that OpenSCAD does not have
  std::vector<std::optional<Colour>> colours_;  // of the color frames
  std::vector<Construct> constructs_;           // of the frames of constructs that OpenSCAD has
  std::vector<SyntaxError> problems_;
  std::vector<Remark> warnings_, notes_;
  std::vector<Model::Mesh> meshes_;
  std::unordered_map<std::string_view, Expression>
      polyhedra_;                        // those with nothing to warn of, by the text of their arguments
  const Expression* known_ = nullptr;    // what the node that was begun last is, where that is known
  std::optional<SyntaxError> left_out_;  // the first open polyhedron that takes part
  std::size_t warnings_left_out_ = 0;
  bool root_tagged_ = false;
  Frame root_;  // once the subtree tagged by ! is complete
  Expression root_solid_;
  std::vector<std::size_t> root_places_;
  std::vector<Argument> arguments_;  // scratch
  std::vector<Value> tape_;
};

Model Reader::read_nodes() {
  bool any = false;
  if (text_.starts_with("\xFF\xFE") || text_.starts_with("\xFE\xFF"))
    scanner_.fail("this text is UTF-16; save it as UTF-8");
  for (scanner_.skip_space(); !scanner_.at_end(); scanner_.skip_space(), any = true) {
    geometry::Interruption::check();
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
  notes_.clear();
  warnings_.clear();  // of what is not in the tree now
  meshes_.clear();
  left_out_.reset();
  warnings_left_out_ = 0;
}

Reader::Frame Reader::header() {
  const Frame& parent = frames_.back();
  Frame frame;
  const bool transparent = parent.row->takes_children();
  frame.absence = parent.absence == Absence::none && !transparent ? Absence::background : parent.absence;
  if (root_tagged_ && frame.absence == Absence::none && root_.is_root) frame.absence = Absence::background;
  modifiers(frame);
  frame.offset = scanner_.offset();
  frame.name = scanner_.identifier();
  if (frame.name.empty()) scanner_.fail("expected a node, found " + scanner_.here());
  reading_ = frame.name;
  frame.row = &node_named(frame.name);
  frame.is_own = frame.row->is_own();
  frame.first_operand = operands_.size();
  frame.first_place = places_.size();
  arguments_.clear();
  known_ = frame.is(NodeKind::polyhedron) ? known_polyhedron() : nullptr;
  if (known_ == nullptr) scanner_.arguments(arguments_, tape_);
  return frame;
}

/// A polyhedron that was read before, since many are written again and again, and to make sure that one is
/// closed takes long. @return null, or what stands here, which is passed over.
const Expression* Reader::known_polyhedron() {
  const std::size_t begin = scanner_.offset(), end = text_.find(')', begin);
  if (end == std::string_view::npos) return nullptr;
  const auto found = polyhedra_.find(text_.substr(begin, end + 1 - begin));
  if (found == polyhedra_.end()) return nullptr;
  scanner_.advance(end + 1 - begin);
  return &found->second;
}

/// Makes of the arguments what there is to make before the children are read.
void Reader::interpret(Frame& frame) {
  if (frame.absence != Absence::none) return;
  const Arguments arguments(arguments_, tape_);
  try {
    switch (frame.row->category) {
      case NodeCategory::group:
      case NodeCategory::boolean:
        break;
      case NodeCategory::colour:
        colours_.push_back(read_colour(arguments, warner(frame)));
        break;
      case NodeCategory::map:
        matrices_.push_back({read_matrix(arguments), read_square_matrix(arguments)});
        break;
      case NodeCategory::operation:
      case NodeCategory::construct:
        interpret_construct(frame, arguments);
        break;
      case NodeCategory::primitive:
        interpret_primitive(frame, arguments);
        break;
      case NodeCategory::unknown:
        note(frame, why_not(frame.name));
        break;
    }
  } catch (const Error& error) {
    note(frame, error.what());
  }
}

void Reader::interpret_construct(Frame& frame, const Arguments& arguments) {
  if (const auto* read = std::get_if<ReadOwn>(&frame.row->read)) {
    own_nodes_.emplace_back();
    own_nodes_.back() = (*read)(StrictArguments(frame.name, *frame.row->arguments, arguments));
    return;
  }
  constructs_.emplace_back();
  const auto construct = std::get<ReadConstruct>(frame.row->read)(arguments, warner(frame));
  frame.vanishes = !construct;
  if (construct) constructs_.back() = *construct;
  if (frame.is_extrusion() && arguments.find("file")) interpret_primitive(frame, arguments);
}

void Reader::interpret_primitive(const Frame& frame, const Arguments& arguments) {
  Expression made = primitive_of(frame, arguments);
  if (!only_points_count(frame, true)) remember_meshes(frame, arguments, made);
  operands_.push_back(std::move(made));
  operand_places_.push_back(places_.size());
  if (!pool_.is_empty(operands_.back())) places_.push_back(frame.offset);
}

/// What a node without children is.
Expression Reader::primitive_of(const Frame& frame, const Arguments& arguments) {
  if (known_ != nullptr) return *known_;
  bool is_sound = true;
  const Warn warn = [&](std::string text) {
    is_sound = false;
    this->warn(frame, std::move(text));
  };
  const Warn note = [&](std::string text) { remark(frame, std::move(text)); };
  const PrimitiveText text{frame.name, arguments, folder_, options_, pool_, warn, note};
  try {
    Expression made = frame.is_construct() ? make_import(text) : make_primitive(*frame.row, text);
    if (frame.is(NodeKind::polyhedron) && is_sound) {
      const std::size_t begin = frame.offset + frame.name.size();
      polyhedra_.emplace(text_.substr(begin, scanner_.offset() - begin), made);
    }
    return made;
  } catch (const HollowPolyhedron& polyhedron) {
    return solid_of_hollow(frame, polyhedron);
  }
}

/// Whether a hull takes what stands here as a set of points: nothing in between needs a solid. A minkowski
/// takes what is no solid by its points too, and a solid as it is.
bool Reader::only_points_count(const Frame& frame, bool is_solid) const {
  bool is_root = frame.is_root;
  for (std::size_t i = frames_.size(); i-- > 0 && !is_root;) {
    const Frame& around = frames_[i];
    if (around.is(NodeKind::hull) || (around.is(NodeKind::minkowski) && !is_solid)) return true;
    if (!around.row->only_unites() && !around.is(NodeKind::minkowski)) return false;
    is_root = around.is_root;
  }
  return false;
}

/// Whether what a frame makes counts though it encloses nothing, since a hull, a sum or a shadow takes its
/// points: nothing in between needs a solid.
bool Reader::flat_points_count(const Frame& frame) const {
  if (frame.is_root) return false;
  for (std::size_t i = frames_.size(); i-- > 0;) {
    const Frame& around = frames_[i];
    if (around.is(NodeKind::hull) || around.is(NodeKind::minkowski)) return true;
    if (around.is(NodeKind::projection)) return !std::get<Projection>(constructs_.back()).cut;
    if (!around.row->only_unites() || around.is_root) return false;
  }
  return false;
}

/// What the maps around the frame at hand multiply a solid's volume by; nothing if a construct makes another
/// solid of it.
std::optional<double> Reader::scale_of_maps() {
  double scale = 1;
  std::size_t matrix = matrices_.size();
  bool is_root = false;
  for (std::size_t i = frames_.size(); i-- > 0 && !is_root;) {
    if (frames_[i].is_construct()) return std::nullopt;
    if (frames_[i].row->category == NodeCategory::map) {
      MatrixText& map = matrices_[--matrix];
      if (!map.volume_scale) map.volume_scale = volume_scale(map.affine);
      scale *= *map.volume_scale;
    }
    is_root = frames_[i].is_root;
  }
  return scale;
}

/// A polyhedron, or the parts of an import, with what there is to say of them should they overlap themselves.
void Reader::remember_meshes(const Frame& frame, const Arguments& arguments, const Expression& made) {
  if (!frame.is(NodeKind::polyhedron) && !frame.is(NodeKind::import)) return;
  std::vector<Expression> open{made};  // united, named, coloured: no deeper than that
  while (!open.empty()) {
    const Expression at = std::move(open.back());
    open.pop_back();
    if (is_mesh(at))
      meshes_.push_back(
          {frame.offset,
           frame.is(NodeKind::import) ? folder_ / arguments.string("file", 0, "") : std::filesystem::path(),
           at, frame.is_root ? 1 : scale_of_maps()});
    const auto children = at.node().children();
    open.insert(open.end(), children.rbegin(), children.rend());
  }
}

/// OpenSCAD reports an open polyhedron and goes on without it; a hull takes its points all the same.
Expression Reader::solid_of_hollow(const Frame& frame, const HollowPolyhedron& polyhedron) {
  std::string text = polyhedron.what();
  if (only_points_count(frame, false)) {
    warn(frame, text + ". Only its points count here");
    return polyhedron.points.empty() ? pool_.empty(3) : pool_.primitive(spanned(polyhedron.points), 3);
  }
  if (polyhedron.is_open) {
    text += ". It encloses no volume and is left out";
    if (!left_out_) left_out_ = SyntaxError{frame.offset, text};
  }
  warn(frame, std::move(text));
  return pool_.empty(3);
}

void Reader::read_node() {
  Frame frame = header();
  interpret(frame);
  scanner_.skip_space();
  const char c = scanner_.peek();
  frame.is_bare = frame.row->takes_children() && scanner_.at_node();
  if (c != ';' && c != '{' && !frame.is_bare)
    scanner_.fail("expected ';' or '{' after '" + std::string(frame.name.substr(0, 60)) + "(...)', found " +
                  scanner_.here());
  if (!frame.is_bare) scanner_.advance();
  frames_.push_back(frame);
  if (c == ';') close();
}

/// Which dimension the operands of a frame have, by OpenSCAD's rule: that of the first one that is any
/// geometry, empty or not. Those of another dimension are taken out; but OpenSCAD has no rule for other
/// dimensions than 2 and 3, so they are an error.
int Reader::settle_dimension(Frame& frame) {
  const auto begin = operands_.begin() + static_cast<std::ptrdiff_t>(frame.first_operand);
  int dimension = frame.row->operands;
  for (auto at = begin; at != operands_.end() && dimension == 0; ++at) dimension = at->dimension();
  std::vector<std::size_t> dropped;
  for (auto at = begin; at != operands_.end(); ++at) {
    if (at->dimension() == 0 || at->dimension() == dimension) continue;
    const int other = at->dimension();
    if (frame.row->operands != 0 && (other > 3 || other < 2 || (frame.is(NodeKind::offset) && frame.is_own)))
      note(frame, "'" + std::string(frame.name) + "' takes children of " +
                      counted(dimension, "# dimension[s], not of ") + std::to_string(other) +
                      std::string(frame.row->instead));
    else if ((other != 2 && other != 3) || (dimension != 2 && dimension != 3))
      note(frame, "'" + std::string(frame.name) + "' has children of " + std::to_string(dimension) +
                      " and of " +
                      counted(other, "# dimension[s]; extrude, embed and project change the dimension"));
    if (!pool_.is_empty(*at)) dropped.push_back(static_cast<std::size_t>(at - operands_.begin()));
    *at = pool_.empty(0);
  }
  if (frame.row->name == "resize" && (dimension == 1 || dimension > 3))
    note(frame, "'resize' takes children of 2 or 3 dimensions, not of " + std::to_string(dimension) +
                    "; scale takes any");
  for (std::size_t i = dropped.size(); i-- > 0;) forget_places(dropped[i]);
  if (!dropped.empty())
    warn(frame, "'" + std::string(frame.name) + "' is " + std::to_string(dimension) +
                    "-dimensional here; its children of another dimension take no part");
  return dimension;
}

/// The primitives of an operand take no part after all.
void Reader::forget_places(std::size_t operand) {
  const std::size_t begin = operand_places_[operand],
                    end = operand + 1 < operands_.size() ? operand_places_[operand + 1] : places_.size();
  places_.erase(places_.begin() + static_cast<std::ptrdiff_t>(begin),
                places_.begin() + static_cast<std::ptrdiff_t>(end));
  for (std::size_t i = operand + 1; i < operand_places_.size(); ++i) operand_places_[i] -= end - begin;
}

Expression Reader::solid_of(Frame& frame) {
  if (!frame.row->takes_children())
    return operands_.size() > frame.first_operand ? operands_[frame.first_operand] : pool_.empty(0);
  if (std::holds_alternative<ReadOwn>(frame.row->read)) return own_node_of(frame);
  const int dimension = settle_dimension(frame);
  const auto operands = std::span<const Expression>(operands_).subspan(frame.first_operand);
  if (const auto* operation = std::get_if<Operation>(&frame.row->read))
    return pool_.boolean(*operation, dimension, operands);
  if (frame.is_construct()) return construction_of(frame, dimension, operands);
  const Expression united = pool_.boolean(Operation::unite, dimension, operands);
  if (frame.row->category == NodeCategory::colour) return coloured(united);
  return frame.row->category == NodeCategory::map ? image_of(frame, united) : united;
}

/// What a color makes of its children.
Expression Reader::coloured(const Expression& child) {
  const std::optional<Colour> colour = colours_.back();
  colours_.pop_back();
  return colour ? pool_.coloured(*colour, child) : child;
}

/// What a multmatrix makes of its children.
Expression Reader::image_of(Frame& frame, const Expression& child) {
  MatrixText text = std::move(matrices_.back());
  matrices_.pop_back();
  if (pool_.is_empty(child)) return child;
  const int dimension = child.dimension();
  std::vector<double> matrix;
  if (dimension == 2 || dimension == 3) {
    matrix = matrix_of_dimension(text.affine, dimension);
  } else {
    const auto stride = static_cast<std::size_t>(dimension) + 1;
    matrix = std::move(text.square);
    if (matrix.size() != stride * stride) {
      note(frame, "multmatrix: its children have " +
                      counted(dimension, "# dimension[s], so its matrix has to be ") +
                      std::to_string(stride) + " x " + std::to_string(stride) +
                      ", the translation in the last column");
      return pool_.empty(dimension);
    }
  }
  switch (normalize_affine(matrix)) {
    case MatrixKind::regular:
      return pool_.transform(std::move(matrix), child);
    case MatrixKind::singular:
      if (flat_points_count(frame)) {
        const Expression flat = pool_.construction(ProjectiveMap{std::move(matrix)}, dimension, {&child, 1});
        constructs_at_.try_emplace(&flat.node(), frame.offset);
        return flat;
      }
      warn(frame,
           "this multmatrix flattens its children (its determinant is 0), so they enclose nothing and are "
           "left out; only hull, minkowski and "
           "projection take the points of what is flat");
      break;
    case MatrixKind::not_finite:
      warn(frame, "this multmatrix removes its children: its matrix holds inf or nan");
      break;
  }
  return pool_.empty(dimension);
}

/// What a node that OpenSCAD does not have makes of its children.
Expression Reader::own_node_of(Frame& frame) {
  const MakeOwn make = std::move(own_nodes_.back());
  own_nodes_.pop_back();
  if (frame.problem != none) return pool_.empty(0);
  try {
    std::vector<Expression> operands;
    if (frame.is(NodeKind::product)) {
      for (std::size_t i = frame.first_operand; i < operands_.size(); ++i)
        if (operands_[i].dimension() != 0) operands.push_back(operands_[i]);
    } else {
      const int dimension = settle_dimension(frame);
      const auto children = std::span<const Expression>(operands_).subspan(frame.first_operand);
      if (frame.is(NodeKind::symmetric_difference))
        return pool_.boolean(Operation::symmetric_difference, dimension, children);
      if (dimension != 0) operands.push_back(pool_.boolean(Operation::unite, dimension, children));
    }
    if (frame.problem != none || operands.empty()) return pool_.empty(0);
    const Expression made = make(operands, pool_);
    if (frame.is_construct()) {
      if (std::any_of(operands.begin(), operands.end(),
                      [&](const Expression& e) { return pool_.is_empty(e); }))
        return pool_.empty(made.dimension());
      constructs_at_.try_emplace(&made.node(), frame.offset);
    }
    if (const auto* named = std::get_if<Named>(&made.node().value);
        named != nullptr && named->role == Named::Role::measure)
      constructs_at_.try_emplace(&made.node(), frame.offset);
    return made;
  } catch (const Error& error) {
    note(frame, error.what());
    return pool_.empty(0);
  }
}

/// @param passes_over_empty whether the sum is one of them if the other one is empty, also where only
/// evaluating it tells so.
Expression Reader::sum_of(const Frame& frame, const Expression& a, const Expression& b,
                          bool passes_over_empty) {
  if (pool_.is_empty(a)) return passes_over_empty ? b : a;
  if (pool_.is_empty(b)) return passes_over_empty ? a : b;
  const Expression pair[] = {a, b};
  const Expression sum = pool_.construction(MinkowskiSum{passes_over_empty}, a.dimension(), pair);
  constructs_at_.try_emplace(&sum.node(), frame.offset);
  return sum;
}

Expression Reader::sum_of(const Frame& frame, int dimension, std::span<const Expression> operands) {
  Expression sum = pool_.empty(dimension);
  for (const Expression& operand : operands) sum = sum_of(frame, sum, operand, true);
  return sum;
}

Expression Reader::construction_of(const Frame& frame, int dimension, std::span<const Expression> operands) {
  const Construct construct = constructs_.back();
  constructs_.pop_back();
  const int result = frame.row->result != 0 ? frame.row->result : dimension;
  if (frame.is(NodeKind::minkowski)) {
    // OpenSCAD 2021.01 passes over empty solids. In the plane it does so only if the first child and one more
    // are something.
    if (dimension == 2 && operands.size() > 1)
      return sum_of(frame, operands[0], sum_of(frame, dimension, operands.subspan(1)), false);
    return sum_of(frame, dimension, operands);
  }
  const Expression operand = pool_.boolean(Operation::unite, dimension, operands);
  if (frame.vanishes || pool_.is_empty(operand)) return pool_.empty(result);
  const Expression made = pool_.construction(construct, result, {&operand, 1});
  constructs_at_.try_emplace(&made.node(), frame.offset);
  return made;
}

/// The end of a node, and of those around it that have no braces.
void Reader::close() {
  do close_frame();
  while (frames_.back().is_bare);
}

void Reader::close_frame() {
  Frame frame = frames_.back();
  frames_.pop_back();
  if (frame.absence != Absence::none) return;
  Expression solid = solid_of(frame);
  operands_.erase(operands_.begin() + static_cast<std::ptrdiff_t>(frame.first_operand), operands_.end());
  operand_places_.resize(operands_.size());
  complete(frame, std::move(solid));
}

/// Hands a finished subtree that takes part to its parent.
void Reader::complete(const Frame& frame, Expression solid) {
  if (pool_.is_empty(solid)) places_.resize(frame.first_place);
  if (frame.is_root) {
    root_ = frame;
    places_.erase(places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(frame.first_place));
    root_places_ = std::move(places_);
    places_.assign(frame.first_place, 0);  // nothing of the rest counts
    root_solid_ = std::move(solid);
    return;
  }
  Frame& parent = frames_.back();
  parent.is_own = parent.is_own || frame.is_own;
  if (parent.problem == none) parent.problem = frame.problem;
  operands_.push_back(std::move(solid));
  operand_places_.push_back(frame.first_place);
}

/// Of a model that is an open polyhedron alone: with what was odd about it before, which may be why it is
/// open, and which nobody is told as a warning.
SyntaxError Reader::nothing_left() const {
  SyntaxError error{left_out_->offset, left_out_->text + ", and nothing else is left of the model"};
  std::size_t more = 0;
  constexpr std::size_t most = 3;
  for (const Remark& warning : warnings_) {
    if (warning.error.offset != left_out_->offset || warning.error.text == left_out_->text) continue;
    if (more++ < most) error.text += "; " + warning.error.text;
  }
  if (more > most) error.text += "; and " + counted(more - most, "# more warning[s]");
  return error;
}

Model Reader::result() {
  Frame& top = frames_.front();
  Model model;
  if (!root_tagged_ && top.problem == none) model.expression = solid_of(top);
  const std::size_t problem = root_tagged_ ? root_.problem : top.problem;
  if (problem != none) throw Error(located(problems_[problem]));
  if (root_tagged_) {
    model.expression = root_solid_;
    model.part_offsets = std::move(root_places_);
  } else {
    if (pool_.is_empty(model.expression)) places_.clear();
    model.part_offsets = std::move(places_);
  }
  if (left_out_ && pool_.is_empty(model.expression)) throw nothing_left();
  model.primitive_count = model.part_offsets.size();
  model.construct_offsets = std::move(constructs_at_);
  model.meshes = std::move(meshes_);
  std::erase_if(model.meshes, [&](const Model::Mesh& mesh) {
    return !std::binary_search(model.part_offsets.begin(), model.part_offsets.end(), mesh.offset);
  });
  if (model.expression.dimension() == 0) model.expression = pool_.empty(3);
  for (const Remark& warning : warnings_) model.warnings.push_back(located(warning));
  for (const Remark& each : notes_) model.notes.push_back(located(each));
  if (warnings_left_out_ > 0)
    model.warnings.push_back(name_ + ": and " + counted(warnings_left_out_, "# more warning[s]"));
  return model;
}

}  // namespace

std::string place_in(std::string_view text, const std::string& name, std::size_t offset) {
  return name + ":" + LineFinder(text).at(std::min(offset, text.size()));
}

Model parse_csg(std::string_view text, const std::string& name, const CsgOptions& options) {
  return Reader(text, name, options).read();
}

Model read_csg(const std::filesystem::path& path, const CsgOptions& options) {
  return parse_csg(read_model_text(path), path.string(), options);
}

}  // namespace bsp2::model
