#include "bsp2/model/expression/csg.hpp"
#include "evaluation/ranks.hpp"
#include "expression/node.hpp"

namespace bsp2 {
namespace {

Expression text_node(std::string text, std::string source, std::vector<std::string> warnings) {
  auto node = std::make_shared<Expression::Node>();
  auto read = std::make_shared<model::Model>(model::parse_csg(text, source));
  node->dimension = read->expression.dimension();
  node->read = std::move(read);
  node->bytes = text.size() + 64;
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
