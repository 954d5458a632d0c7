// The offsets, sizes and strides inside the SPIR-V against those of C++, for every struct of shaders/glsl/layout.
//
// GLSL and C++ read the same text, but `scalar` and `std430` place the same members differently without a word. Only
// what the compiler wrote into the module tells; this test reads it there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "shaders/glsl/layout/node.h"
#include "shaders/glsl/layout/sort.h"
#include "spirv.h"

namespace mote {
namespace {

using Offsets = std::map<std::string, std::uint32_t>;  // member name → byte offset

struct HostStruct {
  std::uint32_t size = 0;
  Offsets offsets;
};

/// The identifiers and numbers of a line without its comment.
std::vector<std::string> wordsOf(std::string line) {
  line.resize(std::min(line.size(), line.find("//")));
  for (char& c : line)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_') c = ' ';
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// What the MOTE_ASSERT_OFFSET and MOTE_ASSERT_SIZE lines of the layout headers say. Those lines are static assertions
/// wherever C++ includes the header, so they are what C++ does.
std::map<std::string, HostStruct> readHostStructs() {
  std::map<std::string, HostStruct> structs;
  const std::filesystem::path root = std::filesystem::path(MOTE_SOURCE_DIR) / "shaders" / "glsl" / "layout";
  for (const auto& entry : std::filesystem::directory_iterator(root)) {
    std::ifstream file(entry.path());
    std::string line;
    while (std::getline(file, line)) {
      const std::vector<std::string> words = wordsOf(line);
      if (words.size() == 4 && words[0] == "MOTE_ASSERT_OFFSET")
        structs[words[1]].offsets[words[2]] = static_cast<std::uint32_t>(std::stoul(words[3]));
      else if (words.size() == 3 && words[0] == "MOTE_ASSERT_SIZE")
        structs[words[1]].size = static_cast<std::uint32_t>(std::stoul(words[2]));
    }
  }
  return structs;
}

const std::map<std::string, HostStruct>& hostStructs() {
  static const std::map<std::string, HostStruct> structs = readHostStructs();
  return structs;
}

// The few instructions of a SPIR-V module that say how memory is laid out (SPIR-V 1.6, §3.32).
class SpirvModule {
 public:
  struct Type {
    std::uint32_t bytes = 0, alignment = 1;  // under `scalar`
    std::vector<std::uint32_t> members;      // type ids of a struct
    std::uint32_t element = 0;               // type id of an array
  };

  explicit SpirvModule(std::span<const std::uint32_t> words) {
    EXPECT_GE(words.size(), 5u);
    EXPECT_EQ(words[0], 0x07230203u);  // SPIR-V's magic number
    for (std::size_t at = 5; at < words.size();) {
      const std::size_t length = words[at] >> 16;
      EXPECT_GT(length, 0u);
      if (length == 0 || at + length > words.size()) return;
      read(static_cast<std::uint16_t>(words[at] & 0xffff), words.subspan(at + 1, length - 1));
      at += length;
    }
  }

  /// Structs with offsets: (name, offsets, size). A struct that only lives in registers has none.
  struct Struct {
    std::string name;
    bool isBlock = false;
    Offsets offsets;
    std::uint32_t size = 0;
    std::vector<std::uint32_t> strides;  // of the arrays of it in buffers
  };
  std::vector<Struct> structs() const {
    std::vector<Struct> found;
    for (const auto& [id, offsets] : memberOffsets_) {
      Struct one{names_.at(id), blocks_.count(id) > 0, {}, 0, {}};
      std::uint32_t alignment = 1;
      for (const auto& [member, offset] : offsets) {
        one.offsets[memberNames_.at(id).at(member)] = offset;
        const Type& type = types_.at(types_.at(id).members.at(member));
        one.size = std::max(one.size, offset + type.bytes);
        alignment = std::max(alignment, type.alignment);
      }
      one.size = (one.size + alignment - 1) / alignment * alignment;
      for (const auto& [array, stride] : strides_)
        if (types_.at(array).element == id) one.strides.push_back(stride);
      found.push_back(one);
    }
    return found;
  }

 private:
  static std::string text(std::span<const std::uint32_t> words) {
    std::string s;
    for (std::uint32_t word : words)
      for (int byte = 0; byte < 4; ++byte, word >>= 8) {
        if ((word & 0xff) == 0) return s;
        s += static_cast<char>(word & 0xff);
      }
    return s;
  }

  void scalar(std::uint32_t id, std::uint32_t bytes) { types_[id] = {bytes, bytes, {}, 0}; }

  void read(std::uint16_t opcode, std::span<const std::uint32_t> w) {
    switch (opcode) {
      case 5: names_[w[0]] = text(w.subspan(1)); break;              // OpName
      case 6: memberNames_[w[0]][w[1]] = text(w.subspan(2)); break;  // OpMemberName
      case 20: scalar(w[0], 4); break;                               // OpTypeBool: never in memory
      case 21:
      case 22: scalar(w[0], w[1] / 8); break;  // OpTypeInt, OpTypeFloat
      case 32: scalar(w[0], 8); break;         // OpTypePointer: a device address
      case 39: scalar(w[0], 8); break;         // OpTypeForwardPointer
      case 23: {                               // OpTypeVector
        const Type component = types_.at(w[1]);
        types_[w[0]] = {component.bytes * w[2], component.alignment, {}, 0};
        break;
      }
      case 28:
      case 29: types_[w[0]] = {0, 1, {}, w[1]}; break;                     // OpTypeArray, OpTypeRuntimeArray
      case 30: types_[w[0]] = {0, 1, {w.begin() + 1, w.end()}, 0}; break;  // OpTypeStruct
      case 71:                                                             // OpDecorate
        if (w[1] == 2) blocks_.insert(w[0]);                               // Block
        if (w[1] == 6) strides_[w[0]] = w[2];                              // ArrayStride
        break;
      case 72:                                              // OpMemberDecorate
        if (w[2] == 35) memberOffsets_[w[0]][w[1]] = w[3];  // Offset
        break;
      default: break;
    }
  }

  std::map<std::uint32_t, std::string> names_;
  std::map<std::uint32_t, std::map<std::uint32_t, std::string>> memberNames_;
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> memberOffsets_;
  std::map<std::uint32_t, std::uint32_t> strides_;
  std::map<std::uint32_t, Type> types_;
  std::set<std::uint32_t> blocks_;
};

/// Names of layout structs that a shader's own text or one of its includes outside layout/ speaks of.
std::set<std::string> structsInShaderText() {
  std::set<std::string> found;
  const std::filesystem::path root = std::filesystem::path(MOTE_SOURCE_DIR) / "shaders" / "glsl";
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    if (!entry.is_regular_file() || entry.path().parent_path().filename() == "layout") continue;
    std::ifstream file(entry.path());
    std::string line;
    while (std::getline(file, line)) {
      for (const std::string& word : wordsOf(line))
        if (hostStructs().count(word)) found.insert(word);
    }
  }
  return found;
}

TEST(ShaderLayout, AssertionsInTheHeadersAreFound) {
  ASSERT_TRUE(hostStructs().count("SortPair"));
  EXPECT_EQ(hostStructs().at("SortPair").size, sizeof(layout::SortPair));
  EXPECT_EQ(hostStructs().at("SortPair").offsets, (Offsets{{"index", 0}, {"key", 4}}));
  EXPECT_EQ(hostStructs().at("Node").offsets.at("skip"), offsetof(layout::Node, skip));
}

TEST(ShaderLayout, EveryStructInEveryShaderIsAsInCpp) {
  ASSERT_FALSE(spirv::all.empty());
  for (const spirv::Shader& shader : spirv::all) {
    for (const SpirvModule::Struct& inShader : SpirvModule(*shader.words).structs()) {
      if (inShader.isBlock) continue;  // the wrappers: buffer references and push constant blocks
      SCOPED_TRACE(std::string(shader.name) + ": struct " + inShader.name);
      const auto host = hostStructs().find(inShader.name);
      ASSERT_NE(host, hostStructs().end())
          << "no MOTE_ASSERT_OFFSET and MOTE_ASSERT_SIZE in a header of shaders/glsl/layout";
      Offsets offsets = inShader.offsets;
      offsets.erase("pad");  // keeps a size, nobody reads it
      EXPECT_EQ(offsets, host->second.offsets) << "a member's offset differs, or it has no MOTE_ASSERT_OFFSET";
      EXPECT_EQ(inShader.size, host->second.size);
      for (std::uint32_t stride : inShader.strides) EXPECT_EQ(stride, host->second.size);
    }
  }
}

TEST(ShaderLayout, EveryStructThatShadersNameIsInTheirMemory) {
  std::set<std::string> seen;
  for (const spirv::Shader& shader : spirv::all)
    for (const SpirvModule::Struct& one : SpirvModule(*shader.words).structs()) seen.insert(one.name);
  const std::set<std::string> named = structsInShaderText();
  EXPECT_TRUE(named.count("SortParams"));  // the search finds what is surely there
  // Comes as texels: eight floats in the order of its members, two fetches (grid_fill.comp, kernelAt).
  const std::string texels = "GridKernel";
  EXPECT_FALSE(seen.count(texels));
  EXPECT_EQ(hostStructs().at(texels).size, 8 * sizeof(float));
  for (const std::string& name : named) EXPECT_TRUE(seen.count(name) || name == texels) << name;
}

}  // namespace
}  // namespace mote
