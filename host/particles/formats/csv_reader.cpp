#include "host/particles/formats/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>

#include "host/core/error.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/text_number.h"

namespace mote {
namespace {

constexpr std::size_t kBlockBytes = 1 << 20;
/// A line that is longer is none of a table.
constexpr std::size_t kMostLine = 1 << 16;
constexpr std::size_t kMostColumns = kMostChannels;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::string_view unquoted(std::string_view text) {
  return text.size() >= 2 && text.front() == '"' && text.back() == '"' ? trimmed(text.substr(1, text.size() - 2))
                                                                       : text;
}

char separatorOf(std::string_view line) {
  for (const char c : {',', ';', '\t'})
    if (line.find(c) != line.npos) return c;
  return ' ';
}

/// Calls one(field) for each.
template <class One>
void eachField(std::string_view line, char separator, const One& one) {
  if (separator == ' ') {
    constexpr std::string_view kBlank = " \t";
    for (std::size_t at = line.find_first_not_of(kBlank); at != line.npos;) {
      const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
      one(line.substr(at, end - at));
      at = line.find_first_not_of(kBlank, end);
    }
    return;
  }
  for (std::size_t at = 0;;) {
    const std::size_t end = std::min(line.find(separator, at), line.size());
    one(unquoted(trimmed(line.substr(at, end - at))));
    if (end == line.size()) return;
    at = end + 1;
  }
}

bool leftOut(std::string_view line) { return line.empty() || line.front() == '#'; }

/// Whether all fields are numbers, and how many.
std::pair<bool, std::size_t> numbersIn(std::string_view line) {
  std::size_t count = 0;
  bool all = true;
  eachField(line, separatorOf(line), [&](std::string_view field) { all = all && numberIn(field), ++count; });
  return {all, count};
}

/// A file line by line, through a buffer.
class Lines {
 public:
  explicit Lines(const InputFile& file) : file_(file) { file.seek(0); }

  std::uint64_t number() const { return number_; }  ///< of the last line, from 1
  /// The next line that is not left out, trimmed; it holds until the next call. False at the end.
  bool next(std::string_view& line) {
    while (nextRaw(line)) {
      if (number_ == 1 && line.starts_with("\xef\xbb\xbf")) line.remove_prefix(3);  // what Windows begins UTF-8 with
      line = trimmed(line);
      if (!leftOut(line)) return true;
    }
    return false;
  }

 private:
  bool nextRaw(std::string_view& line) {
    for (;;) {
      const void* end = std::memchr(buffer_.data() + begin_, '\n', buffer_.size() - begin_);
      if (end != nullptr || (ended_ && begin_ < buffer_.size())) {
        const std::size_t size =
            end != nullptr ? static_cast<std::size_t>(static_cast<const char*>(end) - (buffer_.data() + begin_))
                           : buffer_.size() - begin_;
        line = std::string_view(buffer_.data() + begin_, size);
        begin_ = std::min(buffer_.size(), begin_ + size + 1);
        ++number_;
        if (size > kMostLine) tooLong();
        return true;
      }
      if (ended_) return false;
      if (buffer_.size() - begin_ > kMostLine) ++number_, tooLong();
      buffer_.erase(0, begin_), begin_ = 0;
      const std::size_t old = buffer_.size();
      buffer_.resize(old + kBlockBytes);
      buffer_.resize(old + file_.read(reinterpret_cast<std::byte*>(buffer_.data() + old), kBlockBytes));
      ended_ = buffer_.size() == old;
    }
  }
  [[noreturn]] void tooLong() const {
    throw InputError(file_.path(), fmt::format("line {}", number_), fmt::format("at most {} characters", kMostLine),
                     "more", "it is no table of particles");
  }

  const InputFile& file_;
  std::string buffer_;
  std::size_t begin_ = 0;
  std::uint64_t number_ = 0;
  bool ended_ = false;
};

}  // namespace

bool beginsAsTable(std::span<const std::byte> start) {
  std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  for (const char c : text)
    if (static_cast<unsigned char>(c) < 32 && c != '\n' && c != '\r' && c != '\t') return false;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  for (int line = 0; line < 2 && !text.empty();) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view one = trimmed(text.substr(0, end));
    text.remove_prefix(std::min(text.size(), end + 1));
    if (leftOut(one)) continue;
    const auto [numbers, count] = numbersIn(one);
    if (numbers && count >= 3) return true;
    ++line;
  }
  return false;
}

CsvReader::CsvReader(std::string path) : ParticleFile(path), file_(std::move(path)) {
  Lines lines(file_);
  std::string_view line;
  if (!lines.next(line)) throw InputError(path_, "", "a table of particles", "no lines");
  setColumns(std::string(line));
  if (!hasHeader_) ++count_;
  while (lines.next(line)) ++count_;
  format_ = hasHeader_ ? "CSV with a header" : "CSV";
}

void CsvReader::setColumns(const std::string& first) {
  separator_ = separatorOf(first);
  const auto [numbers, width] = numbersIn(first);
  if (width > kMostColumns)
    throw InputError(path_, "columns", fmt::format("at most {}", kMostColumns), fmt::format("{}", width));
  hasHeader_ = !numbers;
  if (!hasHeader_) {
    placed_ = plainColumns(path_, width, NumberType::F64);
    for (std::size_t k = 0; k < width; ++k) columns_.emplace_back("", NumberType::F64, 1, k * sizeof(double));
    rowBytes_ = width * sizeof(double);
  } else {
    std::vector<PlacedChannel> merged;
    eachField(first, separator_, [&](std::string_view field) {
      NumberType type = NumberType::F64;
      const std::size_t blank = field.find(' ');
      if (blank != field.npos)
        if (const std::optional<NumberType> named = numberNamed(field.substr(0, blank)))
          type = *named, field = trimmed(field.substr(blank));
      const std::string name(field);
      if (name.empty())
        throw InputError(path_, fmt::format("header, column {}", columns_.size() + 1), "a name", "nothing");
      columns_.emplace_back(name, type, 1, rowBytes_);
      const bool goesOn = !merged.empty() && merged.back().channel.name == name;
      if (goesOn && merged.back().channel.type == type)
        ++merged.back().channel.arity;
      else if (std::any_of(merged.begin(), merged.end(), [&](const auto& c) { return c.channel.name == name; }))
        throw InputError(path_, fmt::format("header, column {}", columns_.size()),
                         "columns of one name side by side and of one type", fmt::format("'{}' again", name));
      else
        merged.push_back(columns_.back());
      rowBytes_ += numberSize(type);
    });
    placed_ = withVectors(merged);
  }
  for (const PlacedChannel& placed : placed_) channels_.push_back(placed.channel);
}

void CsvReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<ChannelSink> sinks;
  for (const ChannelRequest& request : requests) sinks.emplace_back(path_, channels_, request);
  const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / rowBytes_);
  std::vector<std::byte> rows(perBlock * rowBytes_);
  std::size_t here = 0;
  const auto flush = [&] {
    for (ChannelSink& sink : sinks) sink.append(rows.data() + placed_[sink.index()].offset, rowBytes_, here);
    here = 0;
  };
  try {
    for (ChannelSink& sink : sinks) sink.reserve(count_);
    Lines lines(file_);
    std::string_view line;
    if (hasHeader_) lines.next(line);
    while (lines.next(line)) {
      std::size_t k = 0;
      eachField(line, separator_, [&](std::string_view field) {
        if (k >= columns_.size()) return void(++k);
        const PlacedChannel& column = columns_[k++];
        if (!storeNumberIn(field, column.channel.type, &rows[here * rowBytes_ + column.offset]))
          throw InputError(path_,
                           fmt::format("line {}, column {}{}", lines.number(), k,
                                       column.channel.name.empty() ? "" : " (" + column.channel.name + ")"),
                           "a number", fmt::format("'{}'", field.substr(0, 40)));
      });
      if (k != columns_.size())
        throw InputError(path_, fmt::format("line {}", lines.number()), fmt::format("{} columns", columns_.size()),
                         fmt::format("{}", k), "the file is cut off or damaged");
      if (++here == perBlock) flush();
    }
    flush();
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} particles of {} bytes", path_, count_, rowBytes_));
  }
}

}  // namespace mote
