#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "expression/node.hpp"

namespace bsp2 {
namespace {

Expression text_node(std::string text, std::string source, std::vector<std::string> warnings) {
  auto node = std::make_shared<Expression::Node>();
  auto read = std::make_shared<model::Model>(model::parse_csg(text, source));
  node->dimension = read->expression.dimension();
  node->read = std::move(read);
  node->folder = folder_named_in(text, source);
  node->bytes = (node->folder.empty() ? text.size() : located(text, node->folder).size()) + 64;
  node->text = std::move(text);
  node->source = std::move(source);
  node->warnings = std::move(warnings);
  return Expression(std::move(node));
}

}  // namespace

Expression parse(std::string_view text, const std::string& name) {
  return guarded([&] { return text_node(std::string(text), name, {}); });
}

Expression load(const std::filesystem::path& path) {
  return guarded([&] {
    std::error_code error;
    if (model::is_imported(path) && std::filesystem::exists(path, error)) return imported(path);
    if (!model::is_scad(path)) return text_node(model::read_model_text(path), path.string(), {});
    model::ModelText translated = model::convert_scad(path);
    return text_node(std::move(translated.text), path.string() + ".csg", std::move(translated.warnings));
  });
}

}  // namespace bsp2
