#pragma once

#include <libxml/xmlreader.h>

#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace bsp2::model {

/// The elements of an XML text, one after the other, in memory that does not grow with it. Names are without
/// namespaces.
class XmlStream {
 public:
  enum class Event : std::uint8_t { begin, text, end };
  /// Fills a buffer; gives the number of bytes, 0 at the end, < 0 for an error. What it throws, `next`
  /// throws.
  using Read = std::function<int(char*, int)>;

  /// @param name the name of the text in messages.
  XmlStream(Read read, std::string name);
  XmlStream(const XmlStream&) = delete;
  XmlStream& operator=(const XmlStream&) = delete;
  ~XmlStream() = default;

  /// Goes to the next event. @return false at the end of the text. @throws bsp2::Error where it is no XML.
  bool next();
  [[nodiscard]] Event event() const { return event_; }
  /// Of the element that begins or ends.
  [[nodiscard]] std::string_view name() const { return name_; }
  /// Of a text.
  [[nodiscard]] std::string_view value() const;
  /// Calls visit(name, value) for each attribute of the element that begins.
  void visit_attributes(const std::function<void(std::string_view, std::string_view)>& visit);

  /// @throws bsp2::Error for a word that is none; spaces around it are passed over.
  [[nodiscard]] double coordinate(std::string_view word) const;
  [[nodiscard]] std::uint32_t index(std::string_view word) const;
  [[noreturn]] void fail(const std::string& text) const;

 private:
  static int read(void* context, char* buffer, int size);
  static void note_error(void* context, const char* message, xmlParserSeverities severity,
                         xmlTextReaderLocatorPtr locator);

  Read read_;
  std::string text_name_, problem_;
  std::exception_ptr thrown_;
  std::unique_ptr<xmlTextReader, void (*)(xmlTextReader*)> reader_;
  Event event_ = Event::text;
  std::string_view name_;
  bool ends_at_once_ = false;  // <name/>, whose end has not been told of yet
};

}  // namespace bsp2::model
