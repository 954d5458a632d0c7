// The zlib stream of a PRT 1.x file as a source of bytes.
#pragma once
#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/particles/formats/input_file.h"

namespace mote {

class PrtInflater {
 public:
  /// From where the file is; it must outlive this, and nobody else may move it meanwhile.
  explicit PrtInflater(const InputFile& file);
  ~PrtInflater() { inflateEnd(&stream_); }
  PrtInflater(const PrtInflater&) = delete;
  PrtInflater& operator=(const PrtInflater&) = delete;

  bool ended() const { return ended_; }      ///< the stream did, its checksum is right
  bool starved() const { return starved_; }  ///< the file ended before the stream did
  bool damaged() const { return !damage_.empty(); }
  /// What zlib has to say about the damage.
  const std::string& damage() const { return damage_; }
  std::uint64_t bytesIn() const { return bytesRead_ - stream_.avail_in; }

  /// Fills `out` as far as the data go; less than asked for only once ended(), starved() or damaged(). Throws
  /// MachineError where the machine refuses.
  std::size_t fill(std::byte* out, std::size_t wanted);
  /// After the last particle: reads on to the stream's checksum. True if more data come first.
  bool hasMore() {
    std::byte extra;
    return fill(&extra, 1) > 0;
  }

 private:
  const char* why() const { return stream_.msg ? stream_.msg : "no reason given"; }
  bool refill();
  void step();

  const InputFile& file_;
  std::vector<std::byte> input_;
  z_stream stream_{};
  std::uint64_t bytesRead_ = 0;
  bool ended_ = false, starved_ = false;
  std::string damage_;
};

}  // namespace mote
