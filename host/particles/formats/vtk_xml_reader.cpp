#include "host/particles/formats/vtk_xml_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <limits>
#include <new>
#include <optional>
#include <pugixml.hpp>
#include <set>

#include "host/core/error.h"
#include "host/core/log.h"
#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/vtk_xml_markup.h"

namespace mote {
namespace {

using Form = VtkXmlPlace::Form;
using Packing = VtkXmlCoding::Packing;

constexpr std::uint64_t kMostArity = 1 << 16, kMostFieldNumbers = 64;
constexpr std::size_t kBlockBytes = 1 << 19;

std::optional<NumberType> typeNamed(std::string_view name) {
  constexpr std::pair<std::string_view, NumberType> kTypes[] = {
      {"Float32", NumberType::F32}, {"Float64", NumberType::F64}, {"Int8", NumberType::I8},
      {"UInt8", NumberType::U8},    {"Int16", NumberType::I16},   {"UInt16", NumberType::U16},
      {"Int32", NumberType::I32},   {"UInt32", NumberType::U32},  {"Int64", NumberType::I64},
      {"UInt64", NumberType::U64}};
  for (const auto& [known, type] : kTypes)
    if (name == known) return type;
  return std::nullopt;
}

/// What a file says of itself, in its first tag.
class Header {
 public:
  Header(const std::string& path, const pugi::xml_node& root) : path_(path), root_(root) {}

  VtkXmlCoding coding() const {
    VtkXmlCoding coding;
    coding.bigEndian = choice("byte_order", {"LittleEndian", "BigEndian"}) == 1;
    coding.headBytes = choice("header_type", {"UInt32", "UInt64"}) == 1 ? 8 : 4;
    const std::size_t packing = choice("compressor", {"", "vtkZLibDataCompressor", "vtkLZ4DataCompressor"});
    coding.packing = packing == 1 ? Packing::Zlib : packing == 2 ? Packing::Lz4 : Packing::None;
    return coding;
  }

  /// The kind of data without the P of parallel files.
  std::string kind() const {
    const std::string type = root_.attribute("type").value();
    for (const char* known : {"UnstructuredGrid", "PolyData"})
      if (type == known || type == std::string("P") + known) return known;
    const pugi::xml_node listed = root_.find_node([](const pugi::xml_node& n) { return !n.attribute("file").empty(); });
    throw InputError(path_, "VTKFile, type", "UnstructuredGrid or PolyData, whose points are particles", shown(type),
                     listed
                         ? fmt::format("it lists files: give one of them, {}", shown(listed.attribute("file").value()))
                         : "ParaView's filter 'Convert To Point Cloud' makes PolyData of a grid");
  }
  bool parallel() const {
    return std::string_view(root_.attribute("type").value()).starts_with("PU") ||
           std::string_view(root_.attribute("type").value()).starts_with("PP");
  }

 private:
  /// Which of the values it is; the first where the attribute is not there.
  std::size_t choice(const char* name, std::initializer_list<std::string_view> values) const {
    const std::string_view value = root_.attribute(name).value();
    if (value.empty()) return 0;
    const auto found = std::find(values.begin(), values.end(), value);
    if (found != values.end()) return static_cast<std::size_t>(found - values.begin());
    std::string all;
    for (const std::string_view known : values)
      if (!known.empty()) all += (all.empty() ? "" : " or ") + std::string(known);
    throw InputError(
        path_, fmt::format("VTKFile, {}", name), all, shown(value),
        std::string_view(name) == "compressor" ? "ParaView can write it with another compressor, or none" : "");
  }

  const std::string& path_;
  const pugi::xml_node root_;
};

}  // namespace

struct VtkXmlReader::Part {
  InputFile file;
  VtkXmlMarkup markup;
  pugi::xml_document document;
  pugi::xml_node root;
  VtkXmlCoding coding;
  bool appendedBase64 = false;

  explicit Part(std::string path) : file(std::move(path)), markup(readVtkXmlMarkup(file)) {
    const pugi::xml_parse_result result = document.load_buffer(markup.xml.data(), markup.xml.size());
    root = document.child("VTKFile");
    if (!result || !root)
      throw InputError(file.path(), "VTK", "well-formed XML with a tag VTKFile", result ? "none" : result.description(),
                       "the file is cut off or damaged");
    coding = Header(file.path(), root).coding();
    const std::string_view encoding = root.child("AppendedData").attribute("encoding").value();
    if (encoding != "" && encoding != "raw" && encoding != "base64")
      fail("AppendedData, encoding", "raw or base64", shown(encoding));
    appendedBase64 = encoding != "raw";
  }

  [[noreturn]] void fail(std::string_view what, std::string_view expected, const std::string& got) const {
    throw InputError(file.path(), what, expected, got.empty() ? "nothing" : got, "the file is cut off or damaged");
  }

  std::uint64_t number(const pugi::xml_node& node, const char* name, const std::string& what) const {
    const std::string_view text = node.attribute(name).value();
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.empty() || error != std::errc() || end != text.data() + text.size())
      fail(what + ", " + name, "a whole number", text.empty() ? "none" : shown(text));
    return value;
  }

  std::uint64_t arity(const pugi::xml_node& node, const std::string& what) const {
    if (node.attribute("NumberOfComponents").empty()) return 1;
    const std::uint64_t value = number(node, "NumberOfComponents", what);
    if (value == 0 || value > kMostArity)
      fail(what + ", NumberOfComponents", fmt::format("1 to {}", kMostArity), fmt::format("{}", value));
    return value;
  }

  VtkXmlPlace place(const pugi::xml_node& node, const std::string& what) const {
    VtkXmlPlace place;
    const std::string_view format = node.attribute("format").value();
    if (format == "appended" || (format == "" && !node.attribute("offset").empty())) {
      const std::uint64_t offset = number(node, "offset", what);
      if (markup.appended == 0) fail(what, "AppendedData, where its numbers stand", "none in the file");
      if (offset > file.bytes() - std::min(file.bytes(), markup.appended))
        fail(what + ", offset", "a place within the file", fmt::format("{}", offset));
      return {appendedBase64 ? Form::Base64 : Form::Raw, markup.appended + offset, file.bytes()};
    }
    if (format != "ascii" && format != "binary" && format != "")
      fail(what + ", format", "ascii, binary or appended", shown(format));
    place.form = format == "binary" ? Form::Base64 : Form::Text;
    for (const pugi::xml_node& child : node.children())
      if (child.type() == pugi::node_pcdata) {  // "BEGIN END", see VtkXmlMarkup
        const std::string_view text = child.value();
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), place.begin);
        if (error == std::errc() && end != text.data() + text.size())
          std::from_chars(end + 1, text.data() + text.size(), place.end);
        break;
      }
    return place;
  }
};

struct VtkXmlReader::Piece {
  const Part* part;
  std::uint64_t points;
  std::string what;  ///< "Piece 3", for messages
  std::vector<Channel> channels;
  std::vector<VtkXmlPlace> places;

  Piece(const Part& owner, const pugi::xml_node& node, std::string name)
      : part(&owner), points(owner.number(node, "NumberOfPoints", name)), what(std::move(name)) {
    const pugi::xml_node array = node.child("Points").child("DataArray");
    if (!array && points > 0) part->fail(what, "Points with a DataArray", "none");
    if (array) add(array, "Position");
    if (channels.empty() && points > 0) part->fail(what + ", Points", "numbers", array.attribute("type").value());
    if (!channels.empty() && channels[0].arity != 3)
      part->fail(what + ", Points", "3 components", fmt::format("{}", channels[0].arity));
    for (const pugi::xml_node& own : node.child("PointData").children("DataArray")) {
      const std::string own_name = own.attribute("Name").value();
      if (own_name == "Position")
        logWarning(fmt::format("{}: left out an array 'Position' of the PointData: Points are it", part->file.path()));
      else
        add(own, own_name.empty() ? fmt::format("Array{}", channels.size()) : own_name);
    }
  }

  bool has(std::string_view name) const { return find(name) < channels.size(); }
  std::size_t find(std::string_view name) const {
    const auto found = std::find_if(channels.begin(), channels.end(), [&](const Channel& c) { return c.name == name; });
    return static_cast<std::size_t>(found - channels.begin());
  }

 private:
  void add(const pugi::xml_node& node, const std::string& name) {
    const std::string array = fmt::format("{}, array {}", what, shown(name));
    const std::string_view type = node.attribute("type").value();
    if (type == "String" || type == "Bit") return;
    const std::optional<NumberType> known = typeNamed(type);
    if (!known) part->fail(array + ", type", "one like Float32 or UInt8", shown(type));
    if (has(name)) part->fail(array, "arrays of different names", "it twice");
    requireFewChannels(part->file.path(), channels.size() + 1);
    Channel channel{name, *known, static_cast<std::uint32_t>(part->arity(node, array))};
    if (channel.type == NumberType::U8 && (channel.arity == 3 || channel.arity == 4)) channel.scale = 1.0 / 255;
    places.push_back(part->place(node, array));
    channels.push_back(std::move(channel));
  }
};

namespace {

/// Short arrays of the whole file.
std::vector<Metadata> fieldData(const VtkXmlReader::Part& part, const pugi::xml_node& data) {
  std::vector<Metadata> found;
  for (const pugi::xml_node& node : data.child("FieldData").children("DataArray")) {
    const std::string name = node.attribute("Name").value(), what = fmt::format("FieldData, array {}", shown(name));
    const std::optional<NumberType> type = typeNamed(node.attribute("type").value());
    if (!type || name.empty() || node.attribute("NumberOfTuples").empty()) continue;
    const std::uint64_t tuples = part.number(node, "NumberOfTuples", what), arity = part.arity(node, what);
    if (tuples == 0 || tuples > kMostFieldNumbers / arity) continue;
    if (std::any_of(found.begin(), found.end(), [&](const Metadata& m) { return m.name == name; })) continue;
    const auto numbers = openVtkXmlNumbers(part.file, part.coding, part.place(node, what), *type, tuples * arity, what);
    const std::size_t size = numberSize(*type);
    std::string bytes(static_cast<std::size_t>(tuples * arity) * size, '\0');
    numbers->read(reinterpret_cast<std::byte*>(bytes.data()), static_cast<std::size_t>(tuples * arity));
    if (numbers->bigEndian())
      for (std::size_t k = 0; k < bytes.size(); k += size)
        std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(k),
                     bytes.begin() + static_cast<std::ptrdiff_t>(k + size));
    found.push_back({"", name, static_cast<std::int32_t>(*type), std::move(bytes)});
  }
  return found;
}

}  // namespace

bool beginsAsVtkXml(std::span<const std::byte> start) {
  std::string_view text(reinterpret_cast<const char*>(start.data()), start.size());
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '<' && text.find("<VTKFile") != std::string_view::npos;
}

VtkXmlReader::VtkXmlReader(std::string path) : ParticleFile(std::move(path)) {
  parts_.push_back(std::make_unique<Part>(path_));
  const Part& top = *parts_[0];
  const Header header(path_, top.root);
  const std::string kind = header.kind();
  const auto take = [&](const Part& part, const pugi::xml_node& data) {
    std::size_t index = 0;
    for (const pugi::xml_node& node : data.children("Piece"))
      pieces_.emplace_back(part, node, fmt::format("Piece {}", index++));
    if (metadata_.empty()) metadata_ = fieldData(part, data);
  };
  if (!header.parallel()) {
    take(top, top.root.child(kind.c_str()));
  } else {
    std::set<std::string> sources;  // each once, or a short file could stand for endless particles
    const std::string parallel = "P" + kind;
    for (const pugi::xml_node& node : top.root.child(parallel.c_str()).children("Piece")) {
      const std::string source = node.attribute("Source").value();
      const auto name = (std::filesystem::path(path_).parent_path() / source).lexically_normal().string();
      if (source.empty() || !sources.insert(name).second)
        top.fail(fmt::format("Piece {}, Source", sources.size()), "another file's name", shown(source));
      parts_.push_back(std::make_unique<Part>(name));
      const Part& part = *parts_.back();
      const Header own(name, part.root);
      if (own.kind() != kind || own.parallel())
        part.fail("VTKFile, type", fmt::format("{}, as {} says", kind, path_),
                  shown(part.root.attribute("type").value()));
      take(part, part.root.child(kind.c_str()));
    }
  }
  if (pieces_.empty()) top.fail("VTK", "a Piece with points", "none");
  format_ = fmt::format("VTK XML {}{}", header.parallel() ? "P" : "", kind);
  joinPieces();
  checkArrays();
  for (const auto& part : parts_) part->document.reset(), std::string().swap(part->markup.xml);
}

VtkXmlReader::~VtkXmlReader() = default;

void VtkXmlReader::joinPieces() {
  const Piece empty = pieces_[0];  // what a file without points has
  std::erase_if(pieces_, [](const Piece& piece) { return piece.points == 0; });
  if (pieces_.empty()) {
    channels_ = empty.channels;
    return;
  }
  for (const Piece& piece : pieces_) {
    if (piece.points > std::numeric_limits<std::uint64_t>::max() - count_)
      piece.part->fail(piece.what + ", NumberOfPoints", "fewer", fmt::format("{}", piece.points));
    count_ += piece.points;
  }
  for (const Channel& channel : pieces_[0].channels) {
    bool everywhere = true;
    for (const Piece& piece : pieces_) {
      const std::size_t own = piece.find(channel.name);
      if (own == piece.channels.size()) {
        logWarning(fmt::format("{}: left out array {}: {} of {} has none", path_, shown(channel.name), piece.what,
                               piece.part->file.path()));
        everywhere = false;
        break;
      }
      const Channel& other = piece.channels[own];
      if (other.type != channel.type || other.arity != channel.arity)
        piece.part->fail(piece.what, describeChannels({&channel, 1}) + " as the first piece has it",
                         describeChannels({&other, 1}));
    }
    if (everywhere) channels_.push_back(channel);
  }
  for (Piece& piece : pieces_) {  // the same order in all of them
    std::vector<VtkXmlPlace> places;
    for (const Channel& channel : channels_) places.push_back(piece.places[piece.find(channel.name)]);
    piece.places = std::move(places);
  }
}

std::unique_ptr<VtkXmlNumbers> VtkXmlReader::open(const Piece& piece, std::size_t channel) const {
  const Channel& array = channels_[channel];
  const std::string what = fmt::format("{}, array {}", piece.what, shown(array.name));
  if (piece.points > std::numeric_limits<std::uint64_t>::max() / array.arity)
    piece.part->fail(piece.what + ", NumberOfPoints", "fewer", fmt::format("{}", piece.points));
  return openVtkXmlNumbers(piece.part->file, piece.part->coding, piece.places[channel], array.type,
                           piece.points * array.arity, what);
}

/// Pieces that share their numbers would make endless particles of a short file, and arrays that do cost endless time.
void VtkXmlReader::checkArrays() const {
  constexpr std::uint64_t kMostSharing = 16;  // no writer shares any
  std::uint64_t most = 0, all = 0;
  for (const auto& part : parts_) most += part->file.bytes();
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    std::uint64_t bytes = 0;
    for (const Piece& piece : pieces_) {
      const std::uint64_t here = open(piece, k)->bytesInFile();
      bytes += here, all += here;
      if (bytes > most || all / kMostSharing > most)
        throw InputError(path_, fmt::format("{}, array {}", piece.what, shown(channels_[k].name)),
                         fmt::format("numbers of its own in a file of {} bytes", most), "those of others again",
                         "the file is damaged");
    }
  }
}

void VtkXmlReader::read(std::span<const ChannelRequest> requests) const {
  std::vector<std::byte> rows;
  try {
    for (const ChannelRequest& request : requests) {
      ChannelSink sink(path_, channels_, request);
      sink.reserve(std::min<std::uint64_t>(count_, parts_.back()->file.bytes()));
      const Channel& array = channels_[sink.index()];
      const std::size_t perBlock = std::max<std::size_t>(1, kBlockBytes / array.bytes());
      for (const Piece& piece : pieces_) {
        const auto numbers = open(piece, sink.index());
        for (std::uint64_t first = 0; first < piece.points; first += perBlock) {
          const auto here = static_cast<std::size_t>(std::min<std::uint64_t>(perBlock, piece.points - first));
          rows.resize(here * array.bytes());
          numbers->read(rows.data(), here * array.arity);
          sink.append(rows.data(), array.bytes(), here, numbers->bigEndian());
        }
      }
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory for {} points", path_, count_));
  }
}

}  // namespace mote
