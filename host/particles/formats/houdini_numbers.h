// The numbers of one attribute of a Houdini geometry file, as they come out of its JSON, put in order for its sinks.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "host/particles/formats/channel_sink.h"
#include "host/particles/formats/houdini_outline.h"

namespace mote {

class HoudiniNumbers : public JsonEvents {
 public:
  /// `points` is what the file says; the sinks get rows of them, as the numbers come. All must outlive it.
  HoudiniNumbers(const std::string& path, const HoudiniAttribute& attribute, std::uint64_t points,
                 const std::vector<ChannelSink*>& sinks);

  /// To be called at the array's end: throws InputError where there were too few numbers.
  void finish() const;

  /// Each throws InputError where there are too many, where tuples are of another length, or where anything else stands
  /// between numbers.
  bool beginArray(std::uint64_t begin) override;
  void endArray() override;
  bool beginMap() override { fail("numbers", "a map"); }
  void endMap() override {}
  void key(const std::string&) override {}
  void text(const std::string& value) override;
  void integer(std::int64_t value) override;
  void real(double value) override;
  void boolean(bool value) override { integer(value ? 1 : 0); }
  void null() override { fail("numbers", "null"); }
  void numbers(NumberType type, const std::byte* from, std::size_t count) override;

 private:
  [[noreturn]] void fail(const std::string& expected, const std::string& got) const;
  std::uint64_t rowsHere() const;
  void beginPart();
  /// Room for so many numbers more, at most as many as the part still lacks.
  std::byte* room(std::size_t count);
  void endPartIfFull();

  const std::string& path_;
  const HoudiniAttribute& attribute_;
  std::uint64_t points_;
  const std::vector<ChannelSink*>& sinks_;
  std::size_t numberBytes_, rowBytes_;

  std::vector<std::size_t> parts_;  ///< numbers of each
  std::uint64_t pageSize_;
  std::uint64_t page_ = 0, firstRow_ = 0;  ///< of the page that is read
  std::size_t part_ = 0, partOffset_ = 0;  ///< which is read, and its place in a row [bytes]
  bool constant_ = false;
  std::uint64_t lacking_ = 0;       ///< numbers of the part
  std::vector<std::byte> numbers_;  ///< of the part
  std::vector<std::byte> rows_;     ///< of the page, where it has several parts
  int depth_ = 0;
  std::uint64_t inTuple_ = 0;
};

}  // namespace mote
