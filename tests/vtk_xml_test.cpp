// VTK XML: what the reader accepts and refuses. Files are put together here byte by byte.
#include "host/particles/formats/vtk_xml_reader.h"

#include <gtest/gtest.h>
#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "host/particles/particle_loader.h"
#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

using namespace test;

/// How a file writes its numbers.
struct Mode {
  std::string format = "binary";    // of the arrays
  std::string encoding = "base64";  // of appended ones
  std::string compressor;
  bool big = false, wide = false;  // byte order and header_type
};

std::string base64(const std::string& bytes) {
  constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t k = 0; k < bytes.size(); k += 3) {
    const std::size_t here = std::min<std::size_t>(3, bytes.size() - k);
    unsigned group = 0;
    for (std::size_t c = 0; c < 3; ++c) group = group << 8 | (c < here ? static_cast<unsigned char>(bytes[k + c]) : 0u);
    for (std::size_t c = 0; c < 4; ++c) text += c <= here ? kAlphabet[group >> (18 - 6 * c) & 63] : '=';
  }
  return text;
}

std::string head(const Mode& mode, std::initializer_list<std::uint64_t> sizes) {
  std::string bytes;
  for (const std::uint64_t size : sizes)
    bytes += mode.wide ? rawNumbers<std::uint64_t>({size}, mode.big)
                       : rawNumbers<std::uint32_t>({static_cast<std::uint32_t>(size)}, mode.big);
  return bytes;
}

std::string packed(const Mode& mode, const std::string& block) {
  std::string out(compressBound(block.size()) + 64, '\0');
  if (mode.compressor == "vtkLZ4DataCompressor") {
    out.resize(static_cast<std::size_t>(
        LZ4_compress_default(block.data(), out.data(), static_cast<int>(block.size()), static_cast<int>(out.size()))));
  } else {
    uLongf size = out.size();
    compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(block.data()), block.size());
    out.resize(size);
  }
  return out;
}

/// Numbers as they stand in an array that is not text.
std::string coded(const Mode& mode, const std::string& numbers) {
  const bool text = mode.format == "binary" || mode.encoding == "base64";
  const auto as = [&](const std::string& bytes) { return text ? base64(bytes) : bytes; };
  if (mode.compressor.empty()) return as(head(mode, {numbers.size()}) + numbers);
  constexpr std::size_t kBlock = 16;
  std::string sizes, blocks;
  std::size_t count = 0;
  for (std::size_t k = 0; k < numbers.size(); k += kBlock, ++count) {
    const std::string block = packed(mode, numbers.substr(k, kBlock));
    sizes += head(mode, {block.size()}), blocks += block;
  }
  return as(head(mode, {count, kBlock, numbers.size() % kBlock}) + sizes) + as(blocks);
}

/// Collects a file's arrays.
class Writer {
 public:
  explicit Writer(Mode mode = {}) : mode_(std::move(mode)) {}

  template <class T>
  std::string array(const std::string& attributes, std::initializer_list<T> values) {
    std::string text = "<DataArray " + attributes + " format=\"" + mode_.format + "\"";
    if (mode_.format == "appended") {
      text += " offset=\"" + std::to_string(appended_.size()) + "\"/>";
      appended_ += coded(mode_, rawNumbers<T>(values, mode_.big));
      return text;
    }
    text += ">\n";
    if (mode_.format == "binary") {
      text += coded(mode_, rawNumbers<T>(values, mode_.big));
    } else {
      for (const T value : values) text += (std::is_integral_v<T> ? std::to_string(value) : short_(value)) + " ";
    }
    return text + "\n</DataArray>\n";
  }

  std::string file(const std::string& pieces, const std::string& type = "UnstructuredGrid") const {
    std::string text = "<?xml version=\"1.0\"?>\n<!-- made > by a -- test -->\n<VTKFile type=\"" + type +
                       "\" version=\"1.0\" byte_order=\"" + (mode_.big ? "BigEndian" : "LittleEndian") +
                       "\" header_type=\"" + (mode_.wide ? "UInt64" : "UInt32") + "\"";
    if (!mode_.compressor.empty()) text += " compressor=\"" + mode_.compressor + "\"";
    text += ">\n<" + type + ">\n" + pieces + "</" + type + ">\n";
    if (!appended_.empty()) text += "<AppendedData encoding=\"" + mode_.encoding + "\">\n _" + appended_ + kTail;
    return text + "</VTKFile>\n";
  }

  static constexpr char kTail[] = "\n</AppendedData>\n";

 private:
  template <class T>
  static std::string short_(T value) {
    return fmt::format("{}", value);
  }

  Mode mode_;
  std::string appended_;
};

const std::string kPoints = "type=\"Float64\" NumberOfComponents=\"3\"";

/// Two pieces, of two points and one.
std::string three(const Mode& mode, const std::string& type = "UnstructuredGrid") {
  Writer writer(mode);
  std::string text = "<FieldData>" +
                     writer.array<double>("type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\"", {0.25}) +
                     "</FieldData>\n<Piece NumberOfPoints=\"2\" NumberOfCells=\"0\"><PointData Scalars=\"a &gt; b\">";
  text += writer.array<float>("type=\"Float32\" Name=\"a &gt; b\"", {0.5, -1.5});
  text += writer.array<std::uint64_t>("type=\"UInt64\" Name=\"id\"", {~0ull, 7});
  text += writer.array<std::uint8_t>("type=\"UInt8\" Name=\"tint\" NumberOfComponents=\"3\"", {255, 0, 51, 0, 255, 0});
  text += "</PointData>\n<Points>" + writer.array<double>(kPoints, {1, 2, 3, 4, 5, 6.1}) + "</Points></Piece>\n";
  text += "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"></Piece>";
  text +=
      "<Piece NumberOfPoints=\"1\"><Points>" + writer.array<double>(kPoints, {7, 8, -1e300}) + "</Points><PointData>";
  text += writer.array<std::uint64_t>("type=\"UInt64\" Name=\"id\"", {1ull << 63});
  text += writer.array<std::uint8_t>("type=\"UInt8\" Name=\"tint\" NumberOfComponents=\"3\"", {0, 0, 0});
  text += writer.array<float>("type=\"Float32\" Name=\"a &gt; b\"", {INFINITY}) + "</PointData></Piece>\n";
  return writer.file(text, type);
}

void expectTheThree(const OpenedFile& opened) {
  EXPECT_EQ(opened.file->count(), 3u);
  EXPECT_EQ(describeChannels(opened.file->channels()),
            "Position (3 × float64), a > b (float32), id (uint64), tint (3 × uint8)");
  EXPECT_EQ(opened.read<dvec3>("Position"), (std::vector<dvec3>{{1, 2, 3}, {4, 5, 6.1}, {7, 8, -1e300}}));
  EXPECT_EQ(opened.read<float>("a > b"), (std::vector<float>{0.5, -1.5, INFINITY}));
  EXPECT_EQ(opened.read<std::uint64_t>("id"), (std::vector<std::uint64_t>{~0ull, 7, 1ull << 63}));
  EXPECT_EQ(opened.read<vec3>("tint"), (std::vector<vec3>{{1, 0, 0.2f}, {0, 1, 0}, {0, 0, 0}}));
  const Metadata* time = opened.file->meta("", "TimeValue");
  ASSERT_NE(time, nullptr);
  EXPECT_EQ(time->bytes, rawNumbers<double>({0.25}));
}

/// A short one, to be damaged in every way: two points with a number each.
std::string two(const Mode& mode) {
  Writer writer(mode);
  std::string text = "<Piece NumberOfPoints=\"2\"><Points>";
  text += writer.array<double>(kPoints, {1, 2, 3, 4, 5, 6}) + "</Points><PointData>";
  return writer.file(text + writer.array<float>("type=\"Float32\" Name=\"m\"", {1, 2}) + "</PointData></Piece>",
                     "PolyData");
}

/// Every way to write a file.
std::vector<Mode> modes() {
  std::vector<Mode> all{{"ascii", "", "", false, false}};
  for (const char* compressor : {"", "vtkZLibDataCompressor", "vtkLZ4DataCompressor"})
    for (const bool big : {false, true})
      for (const bool wide : {false, true}) {
        all.push_back({"binary", "base64", compressor, big, wide});
        all.push_back({"appended", "base64", compressor, big, wide});
        all.push_back({"appended", "raw", compressor, big, wide});
      }
  return all;
}

TEST(VtkXmlReader, ReadsEveryWayToWriteNumbers) {
  for (const Mode& mode : modes()) {
    SCOPED_TRACE(mode.format + " " + mode.encoding + " " + mode.compressor + (mode.big ? " big" : "") +
                 (mode.wide ? " wide" : ""));
    const OpenedFile grid(three(mode));
    EXPECT_EQ(grid.file->format(), "VTK XML UnstructuredGrid");
    expectTheThree(grid);
    const OpenedFile poly(three(mode, "PolyData"));
    EXPECT_EQ(poly.file->format(), "VTK XML PolyData");
    expectTheThree(poly);
  }
}

TEST(VtkXmlReader, TakesHeadAndNumbersThatAreCodedEachForItself) {
  // Some writers pad the length's base64 before that of the numbers.
  const std::string numbers = rawNumbers<float>({1, 2, 3});
  const std::string file =
      "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"1\"><Points><DataArray "
      "type=\"Float32\" NumberOfComponents=\"3\" format=\"binary\">";
  const std::string end = "</DataArray></Points></Piece></PolyData></VTKFile>";
  for (const char* blank : {"", "\n  "})
    EXPECT_EQ(OpenedFile(file + blank + base64(head({}, {12})) + blank + base64(numbers) + blank + end)
                  .read<vec3>("Position"),
              (std::vector<vec3>{{1, 2, 3}}));
}

TEST(VtkXmlReader, ReadsLongArraysInPieces) {
  // More than any buffer: 100,000 positions as text and as one block of zlib.
  std::string text, raw;
  for (int k = 0; k < 300000; ++k) {
    text += std::to_string(k) + (k % 7 == 0 ? "\n\t" : " ");
    raw += rawNumbers<float>({static_cast<float>(k)});
  }
  Mode zlib;
  zlib.compressor = "vtkZLibDataCompressor";
  const std::string block = packed(zlib, raw);
  const std::string binary = base64(head(zlib, {1, raw.size(), 0, block.size()})) + base64(block);
  for (const bool ascii : {true, false}) {
    const OpenedFile opened(
        "<VTKFile type=\"PolyData\" compressor=\"vtkZLibDataCompressor\"><PolyData><Piece "
        "NumberOfPoints=\"100000\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" "
        "format=\"" +
        std::string(ascii ? "ascii" : "binary") + "\">" + (ascii ? text : binary) +
        "</DataArray></Points></Piece></PolyData></VTKFile>");
    const std::vector<vec3> positions = opened.read<vec3>("Position");
    ASSERT_EQ(positions.size(), 100000u);
    for (std::size_t i = 0; i < positions.size(); ++i)
      ASSERT_EQ(positions[i], vec3(3.0f * static_cast<float>(i)) + vec3(0, 1, 2)) << i;
  }
}

TEST(VtkXmlReader, ReadsFilesOfSimulationsThroughTheLoader) {
  ParticleSource source;
  source.file = sharedFile("sph/cube_8_particles.vtu");
  const ParticleSet cube = loadParticles({source}, 1);
  ASSERT_EQ(cube.size(), 8u);
  EXPECT_EQ(cube.velocity.size(), 8u);
  EXPECT_NEAR(cube.bounds().lo.y, 0.4995095, 1e-7);  // as the legacy file of the same cube has it
  source.file = sharedFile("sph/fluid_250_particles.vtu");
  const ParticleSet fluid = loadParticles({source}, 1);
  ASSERT_EQ(fluid.size(), 250u);  // bounds as its PROVENANCE has them
  EXPECT_NEAR(fluid.bounds().lo.x, 0.11332, 1e-5);
  EXPECT_NEAR(fluid.bounds().hi.x, 5.0708, 1e-4);
  EXPECT_NEAR(fluid.bounds().hi.z, 1.0902, 1e-4);
}

TEST(VtkXmlReader, LeavesOutWhatNotEveryPieceHas) {
  Writer writer;
  const std::string points = "<Points>" + writer.array<double>(kPoints, {1, 2, 3}) + "</Points>";
  const std::string data = "<PointData>" + writer.array<float>("type=\"Float32\" Name=\"mass\"", {1}) + "</PointData>";
  std::vector<std::string> warnings;
  const WarningsKept kept(warnings);
  const OpenedFile opened(writer.file("<Piece NumberOfPoints=\"1\">" + points + data +
                                      "</Piece><Piece NumberOfPoints=\"1\">" + points + "</Piece>"));
  EXPECT_EQ(describeChannels(opened.file->channels()), "Position (3 × float64)");
  EXPECT_EQ(opened.read<vec3>("Position").size(), 2u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("'mass': Piece 1 of"), std::string::npos) << warnings[0];
}

/// A file of one point, at x.
std::string one(double x) {
  Writer writer;
  return writer.file("<Piece NumberOfPoints=\"1\"><Points>" + writer.array<double>(kPoints, {x, 2, 3}) +
                     "</Points></Piece>");
}

std::string parallel(const std::vector<std::string>& sources) {
  std::string text =
      "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid GhostLevel=\"0\"><PPoints><PDataArray "
      "type=\"Float64\" NumberOfComponents=\"3\"/></PPoints>";
  for (const std::string& source : sources) text += "<Piece Source=\"" + source + "\"/>";
  return text + "</PUnstructuredGrid></VTKFile>";
}

TEST(VtkXmlReader, JoinsThePiecesOfAParallelFile) {
  TempFolder folder;
  std::filesystem::create_directory(folder.file("parts"));
  writeBytes(folder.file("parts/0.vtu"), one(1));
  writeBytes(folder.file("parts/1.vtu"), one(5));
  writeBytes(folder.file("all.pvtu"), parallel({"parts/0.vtu", "parts/1.vtu"}));
  const auto file = openParticleFile(folder.file("all.pvtu"));
  EXPECT_EQ(file->format(), "VTK XML PUnstructuredGrid");
  std::vector<vec3> positions;
  const ChannelRequest request{"Position", &positions};
  file->read({&request, 1});
  EXPECT_EQ(positions, (std::vector<vec3>{{1, 2, 3}, {5, 2, 3}}));

  const auto refused = [&](const std::vector<std::string>& sources, const std::string& word) {
    writeBytes(folder.file("all.pvtu"), parallel(sources));
    try {
      openParticleFile(folder.file("all.pvtu"));
      ADD_FAILURE() << word;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  };
  refused({"parts/0.vtu", "parts/2.vtu"}, "parts/2.vtu");
  refused({"parts/0.vtu", "parts/../parts/0.vtu"}, "another file's name");
  refused({"all.pvtu"}, "as " + folder.file("all.pvtu") + " says");
  refused({""}, "another file's name");
  refused({}, "a Piece with points");
}

/// One of each form and of each packing.
std::vector<Mode> someModes() {
  return {{"ascii", "", "", false, false},
          {"binary", "base64", "", false, true},
          {"binary", "base64", "vtkZLibDataCompressor", false, false},
          {"appended", "raw", "", true, false},
          {"appended", "raw", "vtkZLibDataCompressor", true, true},
          {"appended", "base64", "vtkLZ4DataCompressor", false, false}};
}

TEST(VtkXmlReader, RefusesTruncationAtEveryByte) {
  for (const Mode& mode : someModes()) {
    const std::string whole = two(mode);
    // Behind its last number a file with appended data is whole: what closes the tags is not needed, nor is padding.
    const bool appended = mode.format == "appended";
    std::size_t needed = appended ? whole.rfind(Writer::kTail) : whole.size() - 2;
    while (appended && mode.encoding == "base64" && whole[needed - 1] == '=') --needed;
    for (std::size_t size = 0; size < needed; ++size) {
      SCOPED_TRACE(mode.format + mode.encoding + mode.compressor + " " + std::to_string(size));
      expectFileRefused(whole.substr(0, size), {"particles"});
    }
  }
}

TEST(VtkXmlReader, SurvivesAFlippedBitInEveryByte) {
  for (const Mode& mode : someModes()) expectEveryFlippedBitSurvived(two(mode), 100, 9);
}

std::string piece(const std::string& points, const std::string& array) {
  return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"" + points + "\"><Points>" + array +
         "</Points></Piece></PolyData></VTKFile>";
}

TEST(VtkXmlReader, RefusesHostileSizesWithoutAllocating) {
  const std::string begin = "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"";
  const std::string text = begin + "ascii\">1 2 3</DataArray>";
  for (const char* points :
       {"2", "18446744073709551615", "6148914691236517206", "99999999999999999999", "-1", "1e3", ""})
    expectFileRefused(piece(points, text), {"particles", "Piece 0"});
  for (const std::uint64_t length : {std::uint64_t{11}, std::uint64_t{13}, std::uint64_t{0xffffffff}})
    expectFileRefused(
        piece("1", begin + "binary\">" + base64(head({}, {length}) + rawNumbers<float>({1, 2, 3})) + "</DataArray>"),
        {"12 bytes", std::to_string(length)});
  expectFileRefused(piece("300000000", begin + "binary\">" + base64(head({}, {3600000000}) + "abc") + "</DataArray>"),
                    {"cut off"});

  const auto zlib = [&](const std::string& points, std::initializer_list<std::uint64_t> sizes,
                        const std::string& data) {
    std::string file = piece(points, begin + "binary\">" + base64(head({}, sizes)) + base64(data) + "</DataArray>");
    return file.replace(0, 8, "<VTKFile compressor=\"vtkZLibDataCompressor\"");
  };
  Mode mode;
  mode.compressor = "vtkZLibDataCompressor";
  const std::string good = packed(mode, rawNumbers<float>({1, 2, 3}));
  EXPECT_EQ(OpenedFile(zlib("1", {1, 12, 0, good.size()}, good)).read<vec3>("Position").size(), 1u);
  EXPECT_EQ(OpenedFile(zlib("1", {1, 32768, 12, good.size()}, good)).read<vec3>("Position").size(), 1u);
  expectFileRefused(zlib("1", {0xffffffff, 12, 0, good.size()}, good), {"4294967295 blocks"});
  expectFileRefused(zlib("1", {2, 0xfffffffc, 16, 4, 4}, good), {"12 bytes", "4294967308"});
  expectFileRefused(zlib("1", {1, 12, 0, 0xffffffff}, good), {"cut off"});
  expectFileRefused(zlib("100000", {1, 1200000, 0, good.size()}, good), {"1032 times"});
  expectFileRefused(zlib("2", {1, 24, 0, good.size()}, good), {"block 0 of 1", "its end before all numbers"});
  const std::string longer = packed(mode, rawNumbers<float>({1, 2, 3, 4}));
  expectFileRefused(zlib("1", {1, 12, 0, longer.size()}, longer), {"block 0 of 1", "more than its size"});
  std::string wrong = good;
  wrong.back() = static_cast<char>(wrong.back() ^ 1);
  expectFileRefused(zlib("1", {1, 12, 0, wrong.size()}, wrong), {"block 0 of 1", "incorrect data check"});
}

TEST(VtkXmlReader, RefusesPiecesThatShareTheirNumbers) {
  // 1000 pieces of the same 12000 bytes would be 1000 times the particles that the file has.
  std::string pieces;
  for (int k = 0; k < 1000; ++k)
    pieces +=
        "<Piece NumberOfPoints=\"1000\"><Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" "
        "format=\"appended\" offset=\"0\"/></Points></Piece>";
  expectFileRefused("<VTKFile type=\"PolyData\"><PolyData>" + pieces + "</PolyData><AppendedData encoding=\"raw\">_" +
                        head({}, {12000}) + std::string(12000, '\0') + "</AppendedData></VTKFile>",
                    {"numbers of its own", "those of others again"});
}

TEST(VtkXmlReader, RefusesPointsThatAreNoNumbers) {
  // Or nobody would have held their number against the file.
  for (const char* type : {"String", "Bit"})
    expectFileRefused(piece("1000000000000", std::string("<DataArray type=\"") + type + "\"/>"),
                      {"Piece 0, Points", "numbers", type});
}

TEST(VtkXmlReader, TakesDeepAndManyTagsWithoutHarm) {
  std::string deep = "<VTKFile type=\"PolyData\">";
  for (int k = 0; k < 200000; ++k) deep += "<a>";
  expectFileRefused(deep, {"particles"});
  std::string many = "<VTKFile type=\"PolyData\">";
  for (int k = 0; k < 3000000; ++k) many += "<a/>";
  expectFileRefused(many, {"bytes of tags"});
  std::string arrays = "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"0\"><PointData>";
  for (int k = 0; k < 5000; ++k) arrays += fmt::format("<DataArray type=\"Int8\" Name=\"a{}\"/>", k);
  expectFileRefused(arrays + "</PointData></Piece></PolyData></VTKFile>", {"channels", "at most 1024"});
}

TEST(VtkXmlReader, SaysWhatItDoesNotRead) {
  expectFileRefused("<VTKFile type=\"ImageData\"><ImageData/></VTKFile>",
                    {"UnstructuredGrid or PolyData", "'ImageData'", "Convert To Point Cloud"});
  expectFileRefused("<VTKFile type=\"PStructuredGrid\"></VTKFile>", {"'PStructuredGrid'"});
  expectFileRefused(
      "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"a_0.vtu\"/></Collection>"
      "</VTKFile>",
      {"'Collection'", "give one of them, 'a_0.vtu'"});
  expectFileRefused("<VTKFile type=\"PolyData\" compressor=\"vtkLZMADataCompressor\"></VTKFile>",
                    {"vtkZLibDataCompressor or vtkLZ4DataCompressor", "'vtkLZMADataCompressor'", "ParaView"});
  expectFileRefused("<VTKFile type=\"PolyData\" byte_order=\"Middle\"></VTKFile>", {"LittleEndian", "'Middle'"});
  expectFileRefused("<VTKFile type=\"PolyData\" header_type=\"UInt16\"></VTKFile>", {"UInt32 or UInt64", "'UInt16'"});
  expectFileRefused("<VTKFile type=\"PolyData\"><PolyData></VTKFile>", {"well-formed XML"});
  expectFileRefused("<VTKFile type=\"PolyData\"><PolyData/></VTKFile>", {"a Piece with points"});
  expectFileRefused("<VTKFile type=\"PolyData\"><AppendedData encoding=\"raw\">abc", {"'_' before the data"});
  expectFileRefused(piece("1", ""), {"Points with a DataArray"});
  expectFileRefused(piece("1", "<DataArray type=\"Float32\" NumberOfComponents=\"2\">1 2</DataArray>"),
                    {"3 components", "2"});
  expectFileRefused(piece("1", "<DataArray type=\"Half\" NumberOfComponents=\"3\">1 2 3</DataArray>"),
                    {"'Position'", "Float32", "'Half'"});
  expectFileRefused(piece("1", "<DataArray type=\"Float32\" NumberOfComponents=\"3\">1 two 3</DataArray>"),
                    {"'Position'", "'two' as number 1"});
  expectFileRefused(piece("1", "<DataArray type=\"Float32\" NumberOfComponents=\"3\">1 2.5   </DataArray>"),
                    {"3 numbers", "got 2"});
  expectFileRefused(
      piece("1", "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"appended\" offset=\"0\"/>"),
      {"AppendedData", "none in the file"});
  expectFileRefused(piece("1", "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"hex\">1 2 3</DataArray>"),
                    {"ascii, binary or appended", "'hex'"});
}

}  // namespace
}  // namespace mote
