#include "host/scene/gltf/gltf_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>

#include "host/core/error.h"
#include "host/scene/missing_file.h"

namespace mote {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little-endian, and are copied");

// Nodes, cameras and names of the largest shots are a few megabytes; buffers belong into a .glb or files beside it.
constexpr std::uint64_t kMaxJsonBytes = std::uint64_t{64} << 20;
constexpr std::string_view kHint = "Blender writes one by File > Export > glTF 2.0";
constexpr std::size_t kGlbStart = 20;                                        // header, and the head of the first chunk
constexpr std::uint32_t kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;  // "JSON", "BIN\0"

std::uint64_t fileBytes(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(path, "", "a glTF file", "a folder");
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  if (error)
    throw InputError(path, "", "a glTF file", "no such file",
                     std::filesystem::exists(path, error) ? "" : nearestNames(path, path));
  return bytes;
}

std::string readBytes(const std::string& path, std::uint64_t offset, std::uint64_t count) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes(count, '\0');
  file.seekg(static_cast<std::streamoff>(offset));
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  if (!file || static_cast<std::uint64_t>(file.gcount()) != count)
    throw InputError(path, "", fmt::format("{} bytes from byte {} on", count, offset), "less, or no permission");
  return bytes;
}

std::uint32_t wordAt(const std::string& bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, sizeof word);
  return word;
}

/// Where the parts of a file are.
struct Chunks {
  std::uint64_t json = 0, jsonBytes = 0, binary = 0, binaryBytes = 0;
};

/// Those of a GLB file of `all` bytes, by its first kGlbStart.
Chunks glbChunks(const std::string& path, const std::string& start, std::uint64_t all) {
  constexpr std::string_view kCut = "the file is cut short; copy or export it again";
  const auto require = [&](bool good, std::string_view expected, std::string_view got, std::string_view hint) {
    if (!good) throw InputError(path, "", expected, got, hint);
  };
  require(start.size() == kGlbStart, fmt::format("a GLB file of {} bytes or more", kGlbStart), fmt::format("{}", all),
          kCut);
  require(wordAt(start, 4) == 2, "GLB version 2", fmt::format("version {}", wordAt(start, 4)), kHint);
  require(wordAt(start, 8) <= all, fmt::format("{} bytes, as its header says", wordAt(start, 8)),
          fmt::format("{}", all), kCut);
  Chunks chunks{.json = kGlbStart, .jsonBytes = wordAt(start, 12)};
  require(wordAt(start, 16) == kJsonChunk && chunks.jsonBytes <= all - chunks.json,
          "a JSON chunk that lies in the file as the first of a GLB",
          fmt::format("a chunk of type 0x{:08x} and {} bytes", wordAt(start, 16), chunks.jsonBytes), kHint);
  const std::uint64_t next = chunks.json + (chunks.jsonBytes + 3) / 4 * 4;
  if (next + 8 > all) return chunks;
  const std::string head = readBytes(path, next, 8);
  if (wordAt(head, 4) != kBinaryChunk) return chunks;
  chunks.binary = next + 8, chunks.binaryBytes = wordAt(head, 0);
  require(chunks.binaryBytes <= all - chunks.binary,
          fmt::format("a binary chunk of {} bytes, as it says", chunks.binaryBytes),
          fmt::format("{}", all - chunks.binary), kCut);
  return chunks;
}

/// What begins so may be a .gltf: an object, behind a byte order mark and blanks.
void requireText(const std::string& path, const std::string& start) {
  const std::size_t first = start.find_first_not_of("\xef\xbb\xbf \t\r\n");
  if (start.empty() || (first != std::string::npos && start[first] != '{'))
    throw InputError(path, "", "a glTF file (.gltf, .glb)", start.empty() ? "an empty file" : "another kind of file",
                     kHint);
}

/// The value of a base64 letter; nothing for others.
std::optional<unsigned> base64Value(char c) {
  if (c >= 'A' && c <= 'Z') return static_cast<unsigned>(c - 'A');
  if (c >= 'a' && c <= 'z') return static_cast<unsigned>(c - 'a') + 26;
  if (c >= '0' && c <= '9') return static_cast<unsigned>(c - '0') + 52;
  if (c == '+') return 62;
  if (c == '/') return 63;
  return std::nullopt;
}

/// RFC 4648; nothing where a byte is no letter of it.
std::optional<std::string> fromBase64(std::string_view text) {
  while (text.ends_with('=')) text.remove_suffix(1);
  std::string bytes;
  bytes.reserve(text.size() * 3 / 4);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const auto value = base64Value(c);
    if (!value) return std::nullopt;
    bits = bits << 6 | *value, count += 6;
    if (count >= 8) count -= 8, bytes += static_cast<char>(bits >> count & 0xff);
  }
  return bytes;
}

/// "%20" as a blank; other text as it is.
std::string fromPercent(std::string_view uri) {
  const auto digit = [](char c) {
    const std::size_t value = std::string_view("0123456789abcdef").find(c >= 'A' && c <= 'F' ? c + 32 : c);
    return value == std::string_view::npos ? -1 : static_cast<int>(value);
  };
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const int high = uri[i] == '%' && i + 2 < uri.size() ? digit(uri[i + 1]) : -1;
    const int low = high >= 0 ? digit(uri[i + 2]) : -1;
    if (low < 0) {
      text += uri[i];
    } else {
      text += static_cast<char>(high * 16 + low), i += 2;
    }
  }
  return text;
}

bool isData(std::string_view uri) { return uri.starts_with("data:"); }

std::string besideOf(const std::string& gltf, const std::string& uri) {
  return (std::filesystem::path(gltf).parent_path() / fromPercent(uri)).string();
}

struct Component {
  std::size_t bytes;
  double greatest;  // what is 1 where it is normalised; 0: a float
};

std::optional<Component> componentOf(std::uint64_t type) {
  switch (type) {
    case 5120: return Component{1, 127};
    case 5121: return Component{1, 255};
    case 5122: return Component{2, 32767};
    case 5123: return Component{2, 65535};
    case 5126: return Component{4, 0};
    default: return std::nullopt;
  }
}

template <class T>
double numberAt(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value);
}

double componentAt(const char* at, std::uint64_t type) {
  switch (type) {
    case 5120: return numberAt<std::int8_t>(at);
    case 5121: return numberAt<std::uint8_t>(at);
    case 5122: return numberAt<std::int16_t>(at);
    case 5123: return numberAt<std::uint16_t>(at);
    default: return numberAt<float>(at);
  }
}

std::string_view typeOf(std::size_t width) { return width == 1 ? "SCALAR" : width == 3 ? "VEC3" : "VEC4"; }

}  // namespace

GltfFile::Text GltfFile::readText(const std::string& path) {
  const std::uint64_t all = fileBytes(path);
  const std::string start = readBytes(path, 0, std::min<std::uint64_t>(all, kGlbStart));
  if (!start.starts_with("glTF")) requireText(path, start);
  const Chunks chunks = start.starts_with("glTF") ? glbChunks(path, start, all) : Chunks{.jsonBytes = all};
  if (chunks.jsonBytes > kMaxJsonBytes)
    throw InputError(path, "", fmt::format("at most {} bytes of JSON", kMaxJsonBytes),
                     fmt::format("{}", chunks.jsonBytes), "a .glb keeps buffers out of the JSON");
  std::string json = readBytes(path, chunks.json, chunks.jsonBytes);
  // JSON chunks end in blanks; some writers pad with zeros instead.
  json.resize(json.find_last_not_of(std::string_view("\0 ", 2)) + 1);
  if (json.empty()) throw InputError(path, "", "a glTF file (.gltf, .glb)", "one without its JSON", kHint);
  return {std::move(json), chunks.binary, chunks.binaryBytes};
}

GltfFile::GltfFile(const std::string& path) : GltfFile(path, readText(path)) {}

GltfFile::GltfFile(const std::string& path, Text text)
    : path_(path), document_(path, text.json), binary_(text.binary), binaryBytes_(text.binaryBytes) {
  const GltfValue version = root().member("asset").member("version");
  if (!version.text().starts_with("2."))
    version.refuse("glTF 2.0", version ? quotedForMessage(version.text()) : "none", kHint);
}

std::vector<std::string> GltfFile::bufferFiles() const {
  std::vector<std::string> files;
  const GltfValue buffers = list("buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    const std::string uri = buffers.item(i).member("uri").text();
    if (!uri.empty() && !isData(uri)) files.push_back(besideOf(path_, uri));
  }
  return files;
}

std::string GltfFile::bytes(std::size_t index, std::uint64_t offset, std::uint64_t count) const {
  const GltfValue buffer = list("buffers").item(index), uri = buffer.member("uri");
  const auto require = [&](std::uint64_t there) {
    if (offset > there || count > there - offset)
      buffer.refuse(fmt::format("{} bytes from byte {} on", count, offset), fmt::format("a buffer of {}", there));
  };
  if (!uri) {
    require(index == 0 ? binaryBytes_ : 0);
    return readBytes(path_, binary_ + offset, count);
  }
  const std::string text = uri.text();
  if (!isData(text)) {
    if (text.find("://") != std::string::npos) uri.refuse("a file beside this one", quotedForMessage(text));
    const std::string file = besideOf(path_, text);
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error))
      uri.refuse("a file beside this one", quotedForMessage(file) + ", which is not there",
                 "copy the .bin with the .gltf, or export a .glb");
    require(fileBytes(file));
    return readBytes(file, offset, count);
  }
  const auto [known, isNew] = decoded_.try_emplace(index);
  if (isNew) {
    const std::size_t comma = text.find(";base64,");
    auto decoded = comma == std::string::npos ? std::nullopt : fromBase64(std::string_view(text).substr(comma + 8));
    if (!decoded) uri.refuse("data in base64", quotedForMessage(text));
    known->second = std::move(*decoded);
  }
  require(known->second.size());
  return known->second.substr(offset, count);
}

std::vector<float> GltfFile::numbers(std::size_t index, std::size_t width) const {
  const GltfValue accessor = list("accessors").item(index), view = accessor.member("bufferView");
  if (accessor.member("type").text() != typeOf(width))
    accessor.member("type").refuse(typeOf(width), quotedForMessage(accessor.member("type").text()));
  if (accessor.member("sparse") || !view)
    accessor.refuse("numbers in a bufferView", view ? "a sparse accessor" : "none", "export without sparse accessors");
  const std::uint64_t type = accessor.member("componentType").size64(0), count = accessor.member("count").size64(0);
  const auto component = componentOf(type);
  const bool normalized = accessor.member("normalized").boolean(false);
  if (!component || (component->greatest > 0 && !normalized))
    accessor.member("componentType").refuse("floats (5126) or normalised integers", fmt::format("{}", type));

  const GltfValue views = list("bufferViews"), from = views.item(view.index(views.size(), "bufferViews"));
  const std::size_t buffer = from.member("buffer").index(list("buffers").size(), "buffers");
  const std::uint64_t viewStart = from.member("byteOffset").size64(0), viewBytes = from.member("byteLength").size64(0);
  const std::uint64_t start = accessor.member("byteOffset").size64(0), element = width * component->bytes;
  const std::uint64_t stride = from.member("byteStride").size64(element);
  // Elements that do not overlap: `count` cannot be more than there are bytes.
  if (stride < element || stride > 252)
    from.member("byteStride").refuse(fmt::format("a stride from {} to 252", element), fmt::format("{}", stride));
  if (start > viewBytes || count > (viewBytes - start + stride - element) / stride)
    accessor.refuse(
        fmt::format("{} elements of {} bytes, a stride of {}, from byte {} on", count, element, stride, start),
        fmt::format("a bufferView of {} bytes", viewBytes));
  if (count == 0) return {};

  const std::string raw = bytes(buffer, viewStart + start, (count - 1) * stride + element);
  std::vector<float> values;
  values.reserve(count * width);
  for (std::uint64_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < width; ++k) {
      double value = componentAt(raw.data() + i * stride + k * component->bytes, type);
      if (component->greatest > 0) value = std::max(value / component->greatest, -1.0);
      if (!std::isfinite(value)) accessor.refuse("finite numbers", fmt::format("{} in element {}", value, i));
      values.push_back(static_cast<float>(value));
    }
  return values;
}

}  // namespace mote
