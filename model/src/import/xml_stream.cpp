#include "import/xml_stream.hpp"

#include <charconv>
#include <cmath>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "import/imports.hpp"
#include "import/text_cursor.hpp"

namespace bsp2::model {
namespace {

std::string_view view_of(const xmlChar* text) {
  return text != nullptr ? reinterpret_cast<const char*>(text) : "";
}

std::string_view trimmed(std::string_view word) {
  const std::size_t first = word.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return {};
  return word.substr(first, word.find_last_not_of(" \t\r\n") - first + 1);
}

std::string quoted(std::string_view word) {
  std::string text = "'";
  for (const char c : word.substr(0, 40)) text += c >= ' ' && c < 0x7F ? c : '?';
  return text += "'";
}

}  // namespace

XmlStream::XmlStream(Read read, std::string name)
    : read_(std::move(read)),
      text_name_(std::move(name)),
      reader_(xmlReaderForIO(&XmlStream::read, nullptr, this, nullptr, nullptr,
                             XML_PARSE_NONET | XML_PARSE_NOWARNING),
              &xmlFreeTextReader) {
  if (!reader_) throw Error(text_name_ + ": cannot be read");
  xmlTextReaderSetErrorHandler(reader_.get(), &XmlStream::note_error, this);
}

int XmlStream::read(void* context, char* buffer, int size) {
  auto& self = *static_cast<XmlStream*>(context);
  try {
    return self.read_(buffer, size);
  } catch (...) {  // not through the parser, which is C
    self.thrown_ = std::current_exception();
    return -1;
  }
}

void XmlStream::note_error(void* context, const char* message, xmlParserSeverities severity,
                           xmlTextReaderLocatorPtr) {
  auto& self = *static_cast<XmlStream*>(context);
  if (severity == XML_PARSER_SEVERITY_ERROR && self.problem_.empty())
    self.problem_ = trimmed(message != nullptr ? message : "");
}

bool XmlStream::next() {
  if (std::exchange(ends_at_once_, false)) {
    event_ = Event::end;
    return true;
  }
  while (true) {
    const int got = xmlTextReaderRead(reader_.get());
    if (thrown_) std::rethrow_exception(thrown_);
    if (got == 0 && problem_.empty()) return false;
    if (got <= 0 || !problem_.empty())
      fail("this is no XML: " + (problem_.empty() ? "the text cannot be read" : problem_));
    name_ = view_of(xmlTextReaderConstLocalName(reader_.get()));
    switch (xmlTextReaderNodeType(reader_.get())) {
      case XML_READER_TYPE_ELEMENT:
        event_ = Event::begin;
        ends_at_once_ = xmlTextReaderIsEmptyElement(reader_.get()) == 1;
        return true;
      case XML_READER_TYPE_END_ELEMENT:
        event_ = Event::end;
        return true;
      case XML_READER_TYPE_TEXT:
      case XML_READER_TYPE_CDATA:
        event_ = Event::text;
        return true;
      default:
        break;
    }
  }
}

std::string_view XmlStream::value() const { return view_of(xmlTextReaderConstValue(reader_.get())); }

void XmlStream::visit_attributes(const std::function<void(std::string_view, std::string_view)>& visit) {
  while (xmlTextReaderMoveToNextAttribute(reader_.get()) == 1)
    visit(view_of(xmlTextReaderConstLocalName(reader_.get())),
          view_of(xmlTextReaderConstValue(reader_.get())));
  xmlTextReaderMoveToElement(reader_.get());
}

double XmlStream::coordinate(std::string_view word) const {
  const auto value = to_number(trimmed(word));
  if (!value) fail("expected a number, found " + quoted(word));
  if (!(std::fabs(*value) <= largest_coordinate))
    fail("the number " + quoted(word) + " is not finite or too large");
  return *value;
}

std::uint32_t XmlStream::index(std::string_view word) const {
  word = trimmed(word);
  std::uint32_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size())
    fail("expected the number of a point or an object, found " + quoted(word));
  return value;
}

void XmlStream::fail(const std::string& text) const {
  throw Error(text_name_ + ":" + std::to_string(xmlTextReaderGetParserLineNumber(reader_.get())) + ": " +
              text);
}

}  // namespace bsp2::model
