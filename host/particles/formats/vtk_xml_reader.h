// Reads VTK XML files of points: UnstructuredGrid (.vtu) and PolyData (.vtp), and their parallel files (.pvtu, .pvtp),
// which name others beside them ("VTK XML Formats", Kitware). Numbers as text, as base64 in place, or appended, raw or
// as base64; of both byte orders; not packed, or packed with zlib or LZ4.
//
// Points is Position, each array of numbers of PointData a channel; unsigned bytes of arity 3 or 4 are colours, 255 is
// 1, as VTK itself shows them. Pieces are joined in their order. Cells and their data are stepped over. Short arrays of
// FieldData (TimeValue) are metadata.
#pragma once
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/input_file.h"
#include "host/particles/formats/particle_file.h"
#include "host/particles/formats/vtk_xml_array.h"

namespace mote {

bool beginsAsVtkXml(std::span<const std::byte> start);

class VtkXmlReader : public ParticleFile {
 public:
  /// Reads the tags, and what stands in front of each array. Throws InputError on any breach of the format, on arrays
  /// that the file cannot hold, on other kinds of data (grids have no particles), and where pieces differ in an array's
  /// type. An array that not all pieces have is left out with a warning.
  explicit VtkXmlReader(std::string path);
  ~VtkXmlReader() override;

  /// Cost: that of reading the arrays asked for; numbers in text some 70 MB/s, of zlib some 200.
  void read(std::span<const ChannelRequest> requests) const override;

  struct Part;   ///< a file
  struct Piece;  ///< points of one

 private:
  void joinPieces();
  void checkArrays() const;
  std::unique_ptr<VtkXmlNumbers> open(const Piece& piece, std::size_t channel) const;

  std::vector<std::unique_ptr<Part>> parts_;
  std::vector<Piece> pieces_;
};

}  // namespace mote
