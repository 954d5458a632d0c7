#include "host/particles/formats/vdb_check.h"

#include <blosc.h>
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "host/core/error.h"
#include "host/particles/formats/input_file.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/vdb_layout.h"

namespace mote {
namespace {

constexpr std::size_t kUpperValues = 32 * 32 * 32, kLowerValues = 16 * 16 * 16, kLeafValues = 8 * 8 * 8;
constexpr std::int32_t kUpperEdge = 4096;
// Coordinates beyond it would overflow 32 bits at the far side of an upper node.
constexpr std::int32_t kMostCoordinate = 1 << 30;
constexpr std::uint32_t kMostText = 1 << 16, kMostAttributes = 1024;
constexpr std::uint64_t kMostRowBytes = std::uint64_t{1} << 30;
// Points: bytes of masks that OpenVDB goes through in all its passes, for a byte of the tree. Sixty attributes of points
// of which each has an upper node to itself come to it.
constexpr std::uint64_t kMostMaskBytes = 64;

struct TreeType {
  std::string_view name;
  std::size_t bytes, halfBytes;  ///< of a value
};
constexpr TreeType kScalars[] = {{"Tree_float_5_4_3", 4, 2}, {"Tree_double_5_4_3", 8, 2}};
constexpr TreeType kVectors[] = {{"Tree_vec3s_5_4_3", 12, 6}};
constexpr TreeType kPoints[] = {{"Tree_ptdataidx32_5_4_3", 4, 4}};

template <std::size_t N>
const TreeType* typeIn(const TreeType (&types)[N], const std::string& name) {
  const auto found =
      std::find_if(std::begin(types), std::end(types), [&](const TreeType& t) { return t.name == name; });
  return found == std::end(types) ? nullptr : found;
}

/// The tree's bytes one after another.
class Cursor {
 public:
  explicit Cursor(const VdbTree& tree) : tree_(tree) {}

  std::size_t left() const { return tree_.bytes.size() - at_; }
  [[noreturn]] void fail(const char* what, const std::string& expected, const std::string& got) const {
    throw InputError(tree_.path, fmt::format("grid {}: {} at byte {}", shown(tree_.grid), what, tree_.begin + at_),
                     expected, got, "the file is damaged");
  }
  const std::byte* take(std::uint64_t count, const char* what) {
    if (count > left())
      throw InputError(tree_.path, fmt::format("grid {}: {}", shown(tree_.grid), what),
                       fmt::format("{} bytes at byte {}", count, tree_.begin + at_), fmt::format("only {}", left()),
                       "the file is cut off or damaged");
    const std::byte* here = tree_.bytes.data() + at_;
    at_ += static_cast<std::size_t>(count);
    return here;
  }
  template <class T>
  T number(const char* what) {
    T value;
    std::memcpy(&value, take(sizeof value, what), sizeof value);
    return value;
  }
  std::string text(const char* what) {
    const auto size = number<std::uint32_t>(what);
    if (size > kMostText) fail(what, fmt::format("at most {} bytes", kMostText), fmt::format("{}", size));
    return {reinterpret_cast<const char*>(take(size, what)), size};
  }

 private:
  const VdbTree& tree_;
  std::size_t at_ = 0;
};

template <std::size_t Bits>
struct Mask {
  std::array<std::uint64_t, Bits / 64> words;

  explicit Mask(Cursor& cursor, const char* what) {
    std::memcpy(words.data(), cursor.take(sizeof words, what), sizeof words);
  }
  std::size_t count() const {
    std::size_t on = 0;
    for (const std::uint64_t word : words) on += static_cast<std::size_t>(std::popcount(word));
    return on;
  }
  bool overlaps(const Mask& other) const {
    for (std::size_t k = 0; k < words.size(); ++k)
      if ((words[k] & other.words[k]) != 0) return true;
    return false;
  }
};

/// Bytes that a blosc buffer of `size` bytes says it unpacks to; it must fill `size`, and unpack to a plausible number.
std::size_t bloscBytes(const Cursor& cursor, const std::byte* from, std::size_t size) {
  std::size_t unpacked = 0;
  if (size < BLOSC_MIN_HEADER_LENGTH || blosc_cbuffer_validate(from, size, &unpacked) != 0)
    cursor.fail("blosc data", "a valid blosc buffer", "something else");
  if (unpacked > size * kDeflateExpansion)
    cursor.fail("blosc data", fmt::format("what {} bytes can hold", size), fmt::format("{} bytes", unpacked));
  return unpacked;
}

/// The same, and tries it out.
std::size_t triedBloscBytes(const Cursor& cursor, const std::byte* from, std::size_t size,
                            std::vector<std::byte>& scratch) {
  scratch.resize(bloscBytes(cursor, from, size));
  const int bytes = blosc_decompress_ctx(from, scratch.data(), scratch.size(), 1);
  if (bytes < 0 || static_cast<std::size_t>(bytes) != scratch.size())
    cursor.fail("blosc data", fmt::format("what unpacks to {} bytes", scratch.size()), "something else");
  return scratch.size();
}

/// Nodes and their values, for all types.
class TreeCheck {
 public:
  TreeCheck(const VdbTree& tree, const TreeType& type)
      : cursor_(tree),
        valueBytes_(type.bytes),
        storedBytes_(tree.half ? type.halfBytes : type.bytes),
        half_(tree.half && type.halfBytes != type.bytes),
        points_(isVdbPointTree(tree.type)),
        compression_(tree.compression) {}

  Cursor& cursor() { return cursor_; }
  std::size_t leaves() const { return leaves_; }
  /// Masks of nodes' children [bytes], all of which are gone through to find the leaves.
  std::uint64_t childMaskBytes() const { return childMaskBytes_; }

  void topology() {
    if (const auto buffers = cursor_.number<std::uint32_t>("number of buffers"); buffers != 1)
      cursor_.fail("number of buffers", "1", fmt::format("{}", buffers));
    const std::byte* background = cursor_.take(valueBytes_, "background");
    if (points_ && !std::all_of(background, background + valueBytes_, [](std::byte b) { return b == std::byte{0}; }))
      cursor_.fail("background", "0, as points have it", "something else");  // OpenVDB's debug builds abort on it
    const auto tiles = cursor_.number<std::uint32_t>("number of tiles");
    const auto children = cursor_.number<std::uint32_t>("number of nodes");
    std::set<std::array<std::int32_t, 3>> taken;
    for (std::uint32_t t = 0; t < tiles; ++t) {
      place(taken);
      cursor_.take(valueBytes_, "a tile's value");
      if (const auto active = cursor_.number<std::uint8_t>("a tile's state"); active > 1)
        cursor_.fail("a tile's state", "0 or 1", fmt::format("{}", active));
    }
    std::array<std::int32_t, 3> before{};
    for (std::uint32_t c = 0; c < children; ++c) {
      const std::array<std::int32_t, 3> here = place(taken);
      // Their values come in the order of a map, later.
      if (c > 0 && !(before < here)) cursor_.fail("a node's place", "ascending ones", "another");
      before = here;
      node<kUpperValues>([&] { node<kLowerValues>([&] { leafTopology(); }); });
    }
  }
  /// All leaves' values.
  void values() {
    for (std::size_t leaf = 0; leaf < leaves_; ++leaf) {
      const Mask<kLeafValues> active(cursor_, "a leaf's mask");
      compressedValues(active, false);
    }
  }

 private:
  std::array<std::int32_t, 3> place(std::set<std::array<std::int32_t, 3>>& taken) {
    std::array<std::int32_t, 3> here{};
    for (std::int32_t& c : here) {
      c = cursor_.number<std::int32_t>("a node's place");
      if (c < -kMostCoordinate || c >= kMostCoordinate || c % kUpperEdge != 0)
        cursor_.fail("a node's place", "a multiple of 4096 between ∓2³⁰", fmt::format("{}", c));
    }
    if (!taken.insert(here).second) cursor_.fail("a node's place", "one of its own", "that of another");
    return here;
  }
  template <std::size_t Values, class Child>
  void node(const Child& child) {
    const Mask<Values> children(cursor_, "a node's children"), active(cursor_, "a node's mask");
    if (children.overlaps(active)) cursor_.fail("a node's masks", "a tile or a child", "both");
    childMaskBytes_ += sizeof children.words;
    compressedValues(active, true);
    for (std::size_t left = children.count(); left > 0; --left) child();
  }
  void leafTopology() {
    cursor_.take(kLeafValues / 8, "a leaf's mask");
    ++leaves_;
  }

  /// `unpack`: tries it out. A node in which OpenVDB fails to is one that it loses the memory of.
  template <std::size_t Values>
  void compressedValues(const Mask<Values>& active, bool unpack) {
    // What stands for inactive values: 0 to 2 none; 1, 4, 5 values; 3 to 5 a mask; 6 all are stored.
    const auto kind = cursor_.number<std::uint8_t>("a node's values");
    if (kind > 6) cursor_.fail("a node's values", "a kind of 0 to 6", fmt::format("{}", kind));
    cursor_.take(valueBytes_ * (kind == 5 ? 2 : kind == 2 || kind == 4 ? 1 : 0), "inactive values");
    if (kind >= 3 && kind <= 5) cursor_.take(Values / 8, "mask of inactive values");
    const std::size_t stored = (compression_ & kVdbActiveMask) && kind != 6 ? active.count() : Values;
    if (half_ && stored == 0) return;
    chunk(stored * storedBytes_, unpack);
  }
  /// Numbers that unpack to so many bytes.
  void chunk(std::size_t bytes, bool unpack) {
    if ((compression_ & (kVdbZip | kVdbBlosc)) == 0) {
      cursor_.take(bytes, "values");
      return;
    }
    const auto size = cursor_.number<std::int64_t>("size of values");
    if (size <= 0) {
      if (-static_cast<std::uint64_t>(size) != bytes)
        cursor_.fail("size of values", fmt::format("{} bytes", bytes), fmt::format("{}", size));
      cursor_.take(bytes, "values");
      return;
    }
    const auto packed = static_cast<std::size_t>(size);
    const std::byte* data = cursor_.take(packed, "packed values");
    const bool blosc = (compression_ & kVdbBlosc) != 0;  // zlib stops at the end of either buffer
    std::size_t unpacked = blosc ? bloscBytes(cursor_, data, packed) : bytes;
    if (unpacked == bytes && unpack) {
      unpacked_.resize(bytes);
      unpacked = blosc ? bloscUnpacked(data) : zlibUnpacked(data, packed);
    }
    if (unpacked != bytes) cursor_.fail("packed values", fmt::format("{} bytes", bytes), fmt::format("{}", unpacked));
  }
  /// Bytes that were unpacked into unpacked_; 0: it failed.
  std::size_t bloscUnpacked(const std::byte* from) {
    const int bytes = blosc_decompress_ctx(from, unpacked_.data(), unpacked_.size(), 1);
    return static_cast<std::size_t>(std::max(bytes, 0));
  }
  std::size_t zlibUnpacked(const std::byte* from, std::size_t size) {
    uLongf bytes = unpacked_.size();
    const int status =
        uncompress(reinterpret_cast<Bytef*>(unpacked_.data()), &bytes, reinterpret_cast<const Bytef*>(from), size);
    return status == Z_OK ? bytes : 0;
  }

  Cursor cursor_;
  std::size_t valueBytes_, storedBytes_;
  bool half_, points_;
  std::uint32_t compression_;
  std::size_t leaves_ = 0;
  std::uint64_t childMaskBytes_ = 0;
  std::vector<std::byte> unpacked_;
};

// ---- points ----

/// Bytes of an attribute's stored element: OpenVDB's points/AttributeArray.h and openvdb.cc, initialize().
std::optional<std::size_t> elementBytes(const std::string& type, const std::string& codec) {
  static const std::map<std::string_view, std::size_t> plain{
      {"bool", 1},   {"int8", 1},   {"uint8", 1},   {"int16", 2},  {"uint16", 2}, {"int32", 4},
      {"uint32", 4}, {"int64", 8},  {"uint64", 8},  {"half", 2},   {"float", 4},  {"double", 8},
      {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24},  {"vec4s", 16}, {"vec4d", 32}, {"mat3s", 36},
      {"mat3d", 72}, {"mat4s", 64}, {"mat4d", 128}, {"quats", 16}, {"quatd", 32}};
  static const std::map<std::string_view, std::size_t> packed{
      {"float trnc", 2},    {"vec3s trnc", 6},    {"double trnc", 4},  {"vec3d trnc", 12},  {"float fxpt8", 1},
      {"vec3s fxpt8", 3},   {"float ufxpt8", 1},  {"vec3s ufxpt8", 3}, {"float fxpt16", 2}, {"vec3s fxpt16", 6},
      {"float ufxpt16", 2}, {"vec3s ufxpt16", 6}, {"vec3s uvec", 2},   {"uint8 grp", 1},    {"uint32 str", 4}};
  const auto& table = codec == "null" ? plain : packed;
  const auto found = table.find(codec == "null" ? type : type + " " + codec);
  return found == table.end() ? std::nullopt : std::optional(found->second);
}

/// One attribute's array in one leaf.
struct Array {
  std::uint64_t payload;  ///< bytes of it: in pages what they unpack to, else as they stand
  std::uint64_t bytes;    ///< what it holds
  bool uniform, paged;
};

/// What is packed is tried out: where OpenVDB fails in it, it loses memory of all arrays (their page handles).
class PointCheck {
 public:
  PointCheck(const VdbTree& tree, TreeCheck& nodes) : tree_(tree), nodes_(nodes), cursor_(nodes.cursor()) {}

  /// Behind the topology: passes over all leaves.
  void passes() {
    const auto passes = cursor_.number<std::uint16_t>("number of passes");
    if (passes * nodes_.childMaskBytes() > tree_.bytes.size() * kMostMaskBytes)
      cursor_.fail("number of passes", fmt::format("few over nodes as empty as these ({} bytes of masks)",
                                                   nodes_.childMaskBytes()),
                   fmt::format("{}", passes));
    if (nodes_.leaves() == 0) return;
    if (passes < 4 || passes % 2 != 0 || passes > 4 + 2 * kMostAttributes)
      cursor_.fail("number of passes", fmt::format("4 to {}, even", 4 + 2 * kMostAttributes),
                   fmt::format("{}", passes));
    cursor_.take(nodes_.leaves() * sizeof(std::uint16_t), "sizes of voxels' places");
    descriptor(static_cast<std::size_t>(passes - 4) / 2);
    for (std::size_t leaf = 0; leaf < nodes_.leaves(); ++leaf) leafArrays();
    pages_.resize(elements_.size());
    for (std::size_t a = 0; a < elements_.size(); ++a) pageSizes(a);
    for (std::size_t leaf = 0; leaf < nodes_.leaves(); ++leaf) voxelPlaces();
    for (std::size_t a = 0; a < elements_.size(); ++a) data(a);
  }

 private:
  void descriptor(std::size_t attributes) {
    if (const auto header = cursor_.number<std::uint8_t>("attributes"); header != 1)
      cursor_.fail("attributes", "one list of them for all leaves (1)", fmt::format("{}", header));
    if (const auto count = cursor_.number<std::uint64_t>("number of attributes"); count != attributes)
      cursor_.fail("number of attributes", fmt::format("{}, as there are passes", attributes),
                   fmt::format("{}", count));
    for (std::size_t a = 0; a < attributes; ++a) {
      const std::string type = cursor_.text("an attribute's type"), codec = cursor_.text("an attribute's codec");
      const std::optional<std::size_t> bytes = elementBytes(type, codec);
      if (!bytes) cursor_.fail("an attribute's type", "one that OpenVDB 10 has", shown(type + " " + codec));
      elements_.push_back(*bytes);
    }
    std::vector<bool> named(attributes);
    for (std::size_t a = 0; a < attributes; ++a) {
      if (cursor_.text("an attribute's name").empty()) cursor_.fail("an attribute's name", "one", "none");
      const auto index = cursor_.number<std::uint64_t>("an attribute's index");
      if (index >= attributes || named[static_cast<std::size_t>(index)])
        cursor_.fail("an attribute's index", "one of its own", fmt::format("{}", index));
      named[static_cast<std::size_t>(index)] = true;
    }
    const auto groups = cursor_.number<std::uint64_t>("number of groups");
    for (std::uint64_t g = 0; g < groups; ++g) {  // each takes 12 bytes at least
      cursor_.text("a group's name");
      cursor_.number<std::uint64_t>("a group's index");
    }
    metadata();
  }
  /// As OpenVDB reads them: those of types that it knows without regard to their size.
  void metadata() {
    static const std::map<std::string_view, std::uint32_t> sizes{
        {"bool", 1},   {"int32", 4},  {"int64", 8},  {"float", 4},  {"double", 8}, {"half", 2},
        {"vec2i", 8},  {"vec2s", 8},  {"vec2d", 16}, {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24},
        {"vec4i", 16}, {"vec4s", 16}, {"vec4d", 32}, {"mat4s", 64}, {"mat4d", 128}};
    const auto count = cursor_.number<std::uint32_t>("number of metadata");
    for (std::uint32_t k = 0; k < count; ++k) {
      cursor_.text("a metadatum's name");
      const std::string type = cursor_.text("a metadatum's type");
      const auto size = cursor_.number<std::uint32_t>("a metadatum's size");
      const auto known = sizes.find(type);
      if ((known != sizes.end() && known->second != size) || type.starts_with("__"))
        cursor_.fail("a metadatum of the attributes", "a type and its size",
                     fmt::format("{} bytes of {}", size, shown(type)));
      const std::byte* value = cursor_.take(size, "a metadatum's value");
      if (type == "bool" && *value > std::byte{1}) cursor_.fail("a metadatum", "0 or 1", "something else");
    }
  }

  /// Sizes of all attributes' arrays in a leaf.
  void leafArrays() {
    enum : std::uint8_t { kConstantStride = 8, kMostFlags = 0x1f };
    enum : std::uint8_t { kStrided = 1, kUniform = 2, kPaged = 8 };
    std::optional<std::uint32_t> points;
    for (const std::size_t element : elements_) {
      constexpr std::uint64_t kHead = 6;  // flags and size, which are counted
      const auto bytes = cursor_.number<std::uint64_t>("an attribute's bytes");
      const auto flags = cursor_.number<std::uint8_t>("an attribute's flags");
      const auto stored = cursor_.number<std::uint8_t>("an attribute's storage");
      const auto size = cursor_.number<std::uint32_t>("an attribute's size");
      if (flags > kMostFlags || (flags & kConstantStride) == 0)
        cursor_.fail("an attribute's flags", "a constant stride", fmt::format("{:#x}", flags));
      if (stored & ~(kStrided | kUniform | kPaged))
        cursor_.fail("an attribute's storage", "strided, uniform or in pages", fmt::format("{:#x}", stored));
      const auto stride = stored & kStrided ? cursor_.number<std::uint32_t>("an attribute's stride") : 1;
      if (size == 0 || (points && *points != size))
        cursor_.fail("an attribute's size", points ? fmt::format("{} points, as others", *points) : "1 or more",
                     fmt::format("{}", size));
      points = size;
      Array array{bytes - kHead, element, (stored & kUniform) != 0, (stored & kPaged) != 0};
      if (!array.uniform) {
        if (stride == 0 || std::uint64_t{size} * stride > kMostRowBytes / element)
          cursor_.fail("an attribute's stride", "1 or more, and less than a gigabyte in a leaf",
                       fmt::format("{} × {}", size, stride));
        array.bytes *= std::uint64_t{size} * stride;
      }
      const bool exact = array.paged || array.uniform;
      if (bytes < kHead || array.payload > kMostRowBytes || (exact && array.payload != array.bytes))
        cursor_.fail("an attribute's bytes", fmt::format("{}", array.bytes + kHead), fmt::format("{}", bytes));
      arrays_.push_back(array);
    }
    points_ += points.value_or(0);
    // Where all arrays are uniform, nothing in the file would stand against a leaf of 2³² points.
    if (points_ > tree_.bytes.size() * kDeflateExpansion)
      cursor_.fail("an attribute's size", fmt::format("what {} bytes can hold", tree_.bytes.size()),
                   fmt::format("{} points", points_));
  }
  const Array& array(std::size_t leaf, std::size_t attribute) const {
    return arrays_[leaf * elements_.size() + attribute];
  }

  struct Page {
    std::int32_t stored;    ///< bytes in the file; negative: as they are
    std::int32_t unpacked;  ///< bytes
  };
  /// Heads of an attribute's pages, which together are its arrays of all leaves, none of which is in two.
  void pageSizes(std::size_t attribute) {
    std::uint64_t used = 0, whole = 0;
    for (std::size_t leaf = 0; leaf < nodes_.leaves(); ++leaf) {
      const Array& here = array(leaf, attribute);
      if (!here.paged) continue;
      if (used == whole) {
        Page page{};
        page.stored = cursor_.number<std::int32_t>("a page's size");
        if (page.stored == 0 || page.stored == std::numeric_limits<std::int32_t>::min())
          cursor_.fail("a page's size", "some bytes", fmt::format("{}", page.stored));
        page.unpacked = page.stored > 0 ? cursor_.number<std::int32_t>("a page's size") : -page.stored;
        if (page.unpacked <= 0) cursor_.fail("a page's size", "some bytes", fmt::format("{}", page.unpacked));
        pages_[attribute].push_back(page);
        used = 0, whole = static_cast<std::uint64_t>(page.unpacked);
      }
      used += here.payload;
      if (used > whole) cursor_.fail("a page's size", fmt::format("at least {} bytes", used), fmt::format("{}", whole));
    }
    if (used != whole) cursor_.fail("a page's size", fmt::format("{} bytes", used), fmt::format("{}", whole));
  }
  /// Where the points of each of a leaf's voxels end.
  void voxelPlaces() {
    constexpr std::uint64_t kBytes = kLeafValues * sizeof(std::uint32_t);
    constexpr std::uint16_t kPlain = std::numeric_limits<std::uint16_t>::max();
    cursor_.take(kLeafValues / 8, "a leaf's mask");
    const auto size = cursor_.number<std::uint16_t>("size of voxels' places");
    const std::byte* data = cursor_.take(size == kPlain ? kBytes : size, "voxels' places");
    if (size == kPlain) return;
    if (const std::size_t unpacked = triedBloscBytes(cursor_, data, size, scratch_); unpacked != kBytes)
      cursor_.fail("voxels' places", fmt::format("{} bytes", kBytes), fmt::format("{}", unpacked));
  }
  void data(std::size_t attribute) {
    std::size_t page = 0;
    std::uint64_t left = 0;
    for (std::size_t leaf = 0; leaf < nodes_.leaves(); ++leaf) {
      const Array& here = array(leaf, attribute);
      if (!here.paged) {
        plainData(here);
        continue;
      }
      if (left == 0) {
        const Page& next = pages_[attribute][page++];
        left = static_cast<std::uint64_t>(next.unpacked);
        const auto stored = static_cast<std::uint64_t>(next.stored > 0 ? next.stored : -next.stored);
        const std::byte* packed = cursor_.take(stored, "a page");
        // Short ones are padded before they are packed.
        if (next.stored > 0 && triedBloscBytes(cursor_, packed, static_cast<std::size_t>(stored), scratch_) < left)
          cursor_.fail("a page", fmt::format("{} bytes", left), "fewer");
      }
      left -= here.payload;
    }
  }
  void plainData(const Array& array) {
    const bool packed = !array.uniform && cursor_.number<std::uint8_t>("an attribute's packing") == 1;
    const std::byte* data = cursor_.take(array.payload, "an attribute's data");
    const std::uint64_t bytes =
        packed ? triedBloscBytes(cursor_, data, static_cast<std::size_t>(array.payload), scratch_) : array.payload;
    if (bytes < array.bytes)
      cursor_.fail("an attribute's data", fmt::format("{} bytes", array.bytes), fmt::format("{}", bytes));
  }

  const VdbTree& tree_;
  TreeCheck& nodes_;
  Cursor& cursor_;
  std::vector<std::size_t> elements_;     ///< bytes of one, by attribute
  std::vector<Array> arrays_;             ///< by leaf, then attribute
  std::vector<std::vector<Page>> pages_;  ///< by attribute
  std::uint64_t points_ = 0;
  std::vector<std::byte> scratch_;
};

}  // namespace

bool isVdbScalarTree(const std::string& type) { return typeIn(kScalars, type) != nullptr; }
bool isVdbVectorTree(const std::string& type) { return typeIn(kVectors, type) != nullptr; }
bool isVdbPointTree(const std::string& type) { return typeIn(kPoints, type) != nullptr; }

void checkVdbTree(const VdbTree& tree) {
  const TreeType* points = typeIn(kPoints, tree.type);
  const TreeType* scalars = typeIn(kScalars, tree.type);
  TreeCheck nodes(tree, points ? *points : scalars ? *scalars : kVectors[0]);
  nodes.topology();
  if (points) {
    PointCheck(tree, nodes).passes();
  } else {
    nodes.values();
  }
}

}  // namespace mote
