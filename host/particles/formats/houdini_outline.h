// What a Houdini geometry file (12 and later, JSON) holds, without its points' numbers: how many points, which numeric
// attributes they have, how their numbers are stored and where.
//
// The file is a list of keys and values, as are most lists in it: "pointcount", N, "attributes", ["pointattributes",
// [[definition, body] …], "globalattributes", […] …]. A body has "values", which say size, storage and one of
//   tuples       [[x, y, z] …], one for each point
//   arrays       [[x …], [y …]], one for each number of a point
//   rawpagedata  [numbers], in pages of "pagesize" points: the numbers are parted as "packing" says ([3, 1]); of each
//                page first the first part of all its points, then the second; once alone where "constantpageflags",
//                a list for each part with a flag for each page, says so, or none where it varies on all of them
// (hgeo.py, which its makers ship with Houdini, and files of versions 13 to 16.5.)
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/particles/formats/channel.h"
#include "host/particles/formats/json_events.h"

namespace mote {

/// Numbers of one attribute.
struct HoudiniValues {
  enum class Order { None, Tuples, Arrays, Pages };
  Order order = Order::None;
  std::uint64_t begin = 0;  ///< of the array of numbers [byte]
  std::int64_t size = 0;    ///< numbers a point
  std::string storage;      ///< "fpreal32", …
  std::int64_t pageSize = 0;
  std::vector<std::int64_t> packing;             ///< empty: one part
  std::vector<std::vector<bool>> constantPages;  ///< by part, by page; empty: none is constant
};

/// A numeric attribute of points, checked.
struct HoudiniAttribute {
  Channel channel;
  HoudiniValues values;
};

class HoudiniOutline : public JsonEvents {
 public:
  /// `path` begins every message.
  explicit HoudiniOutline(std::string path) : path_(std::move(path)) {}

  /// To be called at the file's end. Throws InputError where there is no number of points or nothing that they have,
  /// where an attribute's values do not fit together, and where all numbers would be more than `mostBytes`.
  void finish(std::uint64_t mostBytes);

  const std::string& version() const { return version_; }  ///< "16.5.268"
  std::uint64_t points() const { return static_cast<std::uint64_t>(points_); }
  const std::vector<HoudiniAttribute>& attributes() const { return attributes_; }
  /// Of the file: software, date and the global attributes that are numbers or one text.
  const std::vector<Metadata>& metadata() const { return metadata_; }

  bool beginArray(std::uint64_t begin) override;
  void endArray() override;
  bool beginMap() override;
  void endMap() override { rooms_.pop_back(); }
  void key(const std::string& name) override { rooms_.back().key = shortened(name); }
  void text(const std::string& value) override;
  void integer(std::int64_t value) override;
  void real(double value) override;
  void boolean(bool value) override;
  void null() override { arrive(); }
  void numbers(NumberType type, const std::byte* from, std::size_t count) override;

 private:
  /// Which part of the file a list or map is.
  enum class Room {
    Nowhere,
    Root,
    Info,
    Attributes,
    PointAttributes,
    GlobalAttributes,
    Attribute,
    Definition,
    Body,
    Values,
    Packing,
    Flags,
    FlagsOfPart,
    Numbers,
    Texts
  };
  struct Place {
    Room room;
    bool map;
    std::size_t index = 0;  ///< values so far
    std::string key;        ///< the last text on an even place of a list, or the map's key
  };
  /// An attribute as it is read.
  struct Draft {
    std::string name, type, scope = "public", firstText;
    std::size_t texts = 0;
    HoudiniValues values;
    std::vector<double> numbers;  ///< of a global one
  };

  /// Keys that are known are short: a text that is referred to again and again is not copied whole each time.
  static std::string shortened(const std::string& key);

  void arrive();
  Room roomOf(const Place& parent) const;
  void enterValues(std::uint64_t begin, HoudiniValues::Order order);
  void enough(std::size_t have, std::size_t most, const char* what) const;
  void setText(const Place& place, const std::string& value);
  void setInteger(const Place& place, std::int64_t value);
  void addNumber(double value);
  void keepAttribute();
  void keepGlobal();
  bool hasMetadata(const std::string& name) const;
  /// Its bytes are taken from `mostBytes`.
  HoudiniAttribute checked(const Draft& draft, std::uint64_t& mostBytes) const;

  std::string path_, version_;
  std::int64_t points_ = -1;
  bool ofPoints_ = false;
  std::vector<Place> rooms_;
  Draft draft_;
  std::size_t flags_ = 0;
  std::vector<Draft> drafts_;  ///< of numeric attributes of points
  std::vector<HoudiniAttribute> attributes_;
  std::vector<Metadata> metadata_;
};

}  // namespace mote
