#include "host/particles/formats/vtk_xml_markup.h"

#include <fmt/format.h>

#include "host/core/error.h"
#include "host/particles/formats/byte_stream.h"

namespace mote {
namespace {

/// Some 40,000 arrays. The XML library takes 16 bytes for each of these at worst.
constexpr std::size_t kMostMarkup = 8 << 20;
constexpr std::string_view kComment = "<!--", kAppended = "<AppendedData";

class MarkupScanner {
 public:
  explicit MarkupScanner(const InputFile& file) : path_(file.path()), bytes_(file, 0) {}

  VtkXmlMarkup markup;

  void scan() {
    if (bytes_.peek() == 0xef) bytes_.skipTo('<');  // a byte order mark
    for (;;) {
      text();
      if (bytes_.peek() < 0) return;
      const std::size_t begin = markup.xml.size();
      tag();
      if (isAppended(std::string_view(markup.xml).substr(begin))) return appended();
    }
  }

 private:
  void text() {
    while (ByteStream::isSpace(bytes_.peek())) bytes_.next();
    if (bytes_.peek() < 0 || bytes_.peek() == '<') return;
    const std::uint64_t begin = bytes_.position();
    bytes_.skipTo('<');
    add(fmt::format("{} {}", begin, bytes_.position()));
  }

  /// From '<' to '>', which inside of quotes does not end it.
  void tag() {
    const std::uint64_t at = bytes_.position();
    const std::size_t begin = markup.xml.size();
    for (int quote = 0;;) {
      const int c = bytes_.next();
      if (c < 0)
        throw InputError(path_, fmt::format("VTK, tag at byte {}", at), "'>'", "the file's end", "the file is cut off");
      markup.xml += static_cast<char>(c);
      if (markup.xml.size() - begin == kComment.size() && markup.xml.ends_with(kComment)) {
        markup.xml.resize(begin);
        return comment(at);
      }
      if (quote == 0 && c == '>') break;
      if (quote == 0 && (c == '"' || c == '\''))
        quote = c;
      else if (c == quote)
        quote = 0;
      if (markup.xml.size() > kMostMarkup) add("");
    }
  }

  void comment(std::uint64_t at) {
    int dashes = 0;
    for (int c = bytes_.next(); c != '>' || dashes < 2; c = bytes_.next()) {
      if (c < 0)
        throw InputError(path_, fmt::format("VTK, comment at byte {}", at), "'-->'", "the file's end",
                         "the file is cut off");
      dashes = c == '-' ? dashes + 1 : 0;
    }
  }

  static bool isAppended(std::string_view tag) {
    return tag.starts_with(kAppended) && !tag.ends_with("/>") && tag.size() > kAppended.size() &&
           (ByteStream::isSpace(tag[kAppended.size()]) || tag[kAppended.size()] == '>');
  }

  void appended() {
    while (ByteStream::isSpace(bytes_.peek())) bytes_.next();
    const int c = bytes_.next();
    if (c != '_')
      throw InputError(path_, fmt::format("VTK, AppendedData at byte {}", bytes_.position()), "'_' before the data",
                       c < 0 ? "the file's end" : "something else", c < 0 ? "the file is cut off" : "");
    markup.appended = bytes_.position();
    add("</AppendedData></VTKFile>");
  }

  void add(const std::string& more) {
    markup.xml += more;
    if (markup.xml.size() > kMostMarkup)
      throw InputError(path_, "VTK", fmt::format("at most {} bytes of tags", kMostMarkup), "more",
                       "the file is damaged, or has far more arrays than particles need");
  }

  const std::string& path_;
  ByteStream bytes_;
};

}  // namespace

VtkXmlMarkup readVtkXmlMarkup(const InputFile& file) {
  MarkupScanner scanner(file);
  scanner.scan();
  return std::move(scanner.markup);
}

}  // namespace mote
