#include "host/particles/formats/houdini_outline.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "host/core/error.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/text_number.h"

namespace mote {
namespace {

constexpr std::size_t kMostAttributes = kMostChannels, kMostNumbers = 1024;
constexpr std::size_t kMostFlags = 1 << 26;     ///< pages of 1024 points, of all attributes
constexpr std::size_t kMostGlobalNumbers = 64;  ///< kept as metadata
constexpr std::size_t kMostDepth = 64;          ///< of the lists that are looked into; Houdini needs ten
constexpr std::size_t kMostName = 1024, kMostMetadataText = 1 << 12;
constexpr std::uint64_t kMostPageBytes = 1 << 24;  ///< Houdini's have 1024 points

std::optional<NumberType> storageNamed(const std::string& name) {
  constexpr struct {
    const char* name;
    NumberType type;
  } kStorages[] = {{"fpreal16", NumberType::F16}, {"fpreal32", NumberType::F32}, {"fpreal64", NumberType::F64},
                   {"int8", NumberType::I8},      {"int16", NumberType::I16},    {"int32", NumberType::I32},
                   {"int64", NumberType::I64},    {"uint8", NumberType::U8},     {"bool", NumberType::U8}};
  for (const auto& storage : kStorages)
    if (name == storage.name) return storage.type;
  return std::nullopt;
}

}  // namespace

std::string HoudiniOutline::shortened(const std::string& key) { return key.substr(0, kMostName); }

/// A value begins: in a list it is a key's, or none's.
void HoudiniOutline::arrive() {
  if (rooms_.empty()) return;
  Place& place = rooms_.back();
  if (!place.map && place.index % 2 == 0) place.key.clear();
  ++place.index;
}

HoudiniOutline::Room HoudiniOutline::roomOf(const Place& parent) const {
  const std::string& key = parent.key;
  switch (parent.room) {
    case Room::Root: return key == "attributes" ? Room::Attributes : Room::Nowhere;
    case Room::Attributes:
      return key == "pointattributes"    ? Room::PointAttributes
             : key == "globalattributes" ? Room::GlobalAttributes
                                         : Room::Nowhere;
    case Room::PointAttributes:
    case Room::GlobalAttributes: return Room::Attribute;
    case Room::Attribute: return parent.index == 1 ? Room::Definition : parent.index == 2 ? Room::Body : Room::Nowhere;
    case Room::Body:
      return key == "values" ? Room::Values : key == "strings" && !ofPoints_ ? Room::Texts : Room::Nowhere;
    case Room::Values:
      return key == "packing"             ? Room::Packing
             : key == "constantpageflags" ? Room::Flags
             : ofPoints_                  ? Room::Nowhere
                                          : Room::Numbers;
    case Room::Flags: return Room::FlagsOfPart;
    case Room::Numbers: return Room::Numbers;
    default: return Room::Nowhere;
  }
}

void HoudiniOutline::enough(std::size_t have, std::size_t most, const char* what) const {
  if (have >= most)
    throw InputError(path_, fmt::format("attribute {}", shown(draft_.name)), fmt::format("at most {} {}", most, what),
                     "more");
}

void HoudiniOutline::enterValues(std::uint64_t begin, HoudiniValues::Order order) {
  if (draft_.values.order != HoudiniValues::Order::None)
    throw InputError(path_, fmt::format("attribute {}", shown(draft_.name)), "its numbers once", "twice");
  draft_.values.begin = begin, draft_.values.order = order;
}

bool HoudiniOutline::beginArray(std::uint64_t begin) {
  arrive();
  if (rooms_.empty()) {
    rooms_.push_back({Room::Root, false, 0, ""});
    return true;
  }
  const Place& parent = rooms_.back();
  if (parent.room == Room::Values) {
    if (parent.key == "tuples") enterValues(begin, HoudiniValues::Order::Tuples);
    if (parent.key == "arrays") enterValues(begin, HoudiniValues::Order::Arrays);
    if (parent.key == "rawpagedata") enterValues(begin, HoudiniValues::Order::Pages);
  }
  const Room room = roomOf(parent);
  if (room == Room::Nowhere) return false;
  if (rooms_.size() >= kMostDepth)
    throw InputError(path_, fmt::format("attribute {}", shown(draft_.name)),
                     fmt::format("arrays in arrays, {} deep at most", kMostDepth), "deeper ones");
  if (room == Room::PointAttributes || room == Room::GlobalAttributes) ofPoints_ = room == Room::PointAttributes;
  if (room == Room::Attribute) draft_ = Draft();
  if (room == Room::Flags) draft_.values.constantPages.clear();
  if (room == Room::FlagsOfPart) {
    enough(draft_.values.constantPages.size(), kMostNumbers, "lists of constant pages");
    draft_.values.constantPages.emplace_back();
  }
  rooms_.push_back({room, false, 0, ""});
  return true;
}

bool HoudiniOutline::beginMap() {
  arrive();
  const bool root = rooms_.empty();
  const bool info = !root && rooms_.back().room == Room::Root && rooms_.back().key == "info";
  if (root || info) rooms_.push_back({root ? Room::Root : Room::Info, true, 0, ""});
  return root || info;
}

void HoudiniOutline::endArray() {
  if (rooms_.back().room == Room::Attribute) ofPoints_ ? keepAttribute() : keepGlobal();
  rooms_.pop_back();
}

void HoudiniOutline::text(const std::string& value) {
  arrive();
  if (rooms_.empty()) return;
  Place& place = rooms_.back();
  if (place.room == Room::Texts) {
    if (draft_.texts++ == 0) draft_.firstText = value.substr(0, kMostMetadataText);
  } else if (!place.map && place.index % 2 == 1) {  // a key, as this is the first, third …
    place.key = shortened(value);
  } else {
    setText(place, value);
  }
}

void HoudiniOutline::setText(const Place& place, const std::string& value) {
  const std::string& key = place.key;
  if (place.room == Room::Root && key == "fileversion") version_ = value.substr(0, kMostName);
  if (place.room == Room::Info && (key == "software" || key == "date") && !hasMetadata(key))
    metadata_.push_back(Metadata::text("", key, value.substr(0, kMostMetadataText)));
  if (place.room == Room::Definition && key == "name") draft_.name = value.substr(0, kMostName);
  if (place.room == Room::Definition && key == "type") draft_.type = value.substr(0, kMostName);
  if (place.room == Room::Definition && key == "scope") draft_.scope = value.substr(0, kMostName);
  if ((place.room == Room::Body || place.room == Room::Values) && key == "storage")
    draft_.values.storage = value.substr(0, kMostName);
}

void HoudiniOutline::integer(std::int64_t value) {
  arrive();
  if (!rooms_.empty()) setInteger(rooms_.back(), value);
}

void HoudiniOutline::setInteger(const Place& place, std::int64_t value) {
  const std::string& key = place.key;
  HoudiniValues& values = draft_.values;
  switch (place.room) {
    case Room::Root:
      if (key == "pointcount") points_ = value;
      return;
    case Room::Body:
    case Room::Values:
      if (key == "size") values.size = value;
      if (key == "pagesize") values.pageSize = value;
      return;
    case Room::Packing: enough(values.packing.size(), kMostNumbers, "parts"); return values.packing.push_back(value);
    case Room::FlagsOfPart:
      enough(flags_++, kMostFlags, "flags of constant pages");
      return values.constantPages.back().push_back(value != 0);
    case Room::Numbers: return addNumber(static_cast<double>(value));
    default: return;
  }
}

void HoudiniOutline::real(double value) {
  arrive();
  if (!rooms_.empty() && rooms_.back().room == Room::Numbers) addNumber(value);
}

void HoudiniOutline::boolean(bool value) { integer(value ? 1 : 0); }

void HoudiniOutline::numbers(NumberType type, const std::byte* from, std::size_t count) {
  withNumberType(type, [&]<class T>(T value) {
    for (std::size_t k = 0; k < count; ++k) {
      std::memcpy(&value, from + k * sizeof value, sizeof value);
      if constexpr (std::is_integral_v<T>)
        integer(static_cast<std::int64_t>(value));
      else
        real(static_cast<double>(value));
    }
  });
}

void HoudiniOutline::addNumber(double value) {
  if (draft_.numbers.size() <= kMostGlobalNumbers) draft_.numbers.push_back(value);  // one more: it is too long
}

void HoudiniOutline::keepAttribute() {
  // Texts, dictionaries and what belongs to Houdini alone are no channels.
  if (draft_.type != "numeric" || draft_.scope != "public") return;
  enough(drafts_.size(), kMostAttributes, "attributes");
  drafts_.push_back(std::move(draft_));
}

bool HoudiniOutline::hasMetadata(const std::string& name) const {
  return std::any_of(metadata_.begin(), metadata_.end(), [&](const Metadata& m) { return m.name == name; });
}

void HoudiniOutline::keepGlobal() {
  const std::string& name = draft_.name;
  if (name.empty() || hasMetadata(name) || draft_.scope != "public" || metadata_.size() >= kMostAttributes) return;
  const std::optional<NumberType> type = storageNamed(draft_.values.storage);
  if (draft_.type == "string" && draft_.texts == 1) metadata_.push_back(Metadata::text("", name, draft_.firstText));
  if (draft_.type != "numeric" || !type || draft_.numbers.empty() || draft_.numbers.size() > kMostGlobalNumbers) return;
  std::string bytes(draft_.numbers.size() * numberSize(*type), '\0');
  for (std::size_t k = 0; k < draft_.numbers.size(); ++k)
    storeNumber(draft_.numbers[k], *type, reinterpret_cast<std::byte*>(&bytes[k * numberSize(*type)]));
  metadata_.push_back({"", name, static_cast<std::int32_t>(*type), std::move(bytes)});
}

HoudiniAttribute HoudiniOutline::checked(const Draft& draft, std::uint64_t& mostBytes) const {
  const auto need = [&](bool holds, const char* what, const std::string& expected, const std::string& got) {
    if (!holds)
      throw InputError(path_, fmt::format("point attribute {}: {}", shown(draft.name), what), expected, got,
                       "the file is damaged, or of a kind that Mote does not know");
  };
  HoudiniValues values = draft.values;
  need(!draft.name.empty(), "name", "one", "none");
  const std::optional<NumberType> type = storageNamed(values.storage);
  need(type.has_value(), "storage", "fpreal16, 32 or 64, int8, 16, 32 or 64, or bool", shown(values.storage));
  need(values.size >= 1 && values.size <= static_cast<std::int64_t>(kMostNumbers), "size",
       fmt::format("1 to {} numbers a point", kMostNumbers), fmt::format("{}", values.size));
  need(values.order != HoudiniValues::Order::None, "values", "tuples, arrays or rawpagedata", "none of them");
  const Channel channel{draft.name, *type, static_cast<std::uint32_t>(values.size)};
  need(points() <= mostBytes / channel.bytes(), "values",
       fmt::format("{} bytes at most, for what is left of a file of this size", mostBytes),
       fmt::format("{} points of {} bytes", points_, channel.bytes()));
  mostBytes -= points() * channel.bytes();
  if (values.order != HoudiniValues::Order::Pages) {
    values.packing.clear(), values.constantPages.clear();
    return {channel, std::move(values)};
  }
  const std::uint64_t mostPage = kMostPageBytes / channel.bytes();
  need(values.pageSize >= 1 && static_cast<std::uint64_t>(values.pageSize) <= mostPage, "pagesize",
       fmt::format("1 to {} points", mostPage), fmt::format("{}", values.pageSize));
  if (values.packing.empty()) values.packing = {values.size};
  std::int64_t sum = 0;
  for (const std::int64_t part : values.packing) {
    need(part >= 1 && part <= values.size, "packing", fmt::format("parts of 1 to {} numbers", values.size),
         fmt::format("{}", part));
    sum += part;
  }
  need(sum == values.size, "packing", fmt::format("{} numbers in all", values.size), fmt::format("{}", sum));
  need(values.constantPages.empty() || values.constantPages.size() == values.packing.size(), "constantpageflags",
       fmt::format("{} lists, one for each part", values.packing.size()),
       fmt::format("{}", values.constantPages.size()));
  const auto pageSize = static_cast<std::uint64_t>(values.pageSize);
  const std::uint64_t pages = points() / pageSize + (points() % pageSize != 0);
  for (const std::vector<bool>& flags : values.constantPages)
    need(flags.empty() || flags.size() == pages, "constantpageflags", fmt::format("{}, one for each page", pages),
         fmt::format("{}", flags.size()));
  return {channel, std::move(values)};
}

void HoudiniOutline::finish(std::uint64_t mostBytes) {
  if (points_ < 0)
    throw InputError(path_, "pointcount", "a number ≥ 0", points_ == -1 ? "none" : fmt::format("{}", points_),
                     "this is JSON, but no Houdini geometry");
  // Where nothing is held against it, the file may say any number.
  if (points_ > 0 && drafts_.empty())
    throw InputError(path_, "pointattributes", fmt::format("numbers of {} points", points_), "none",
                     "P is missing, which all geometry has");
  for (const Draft& draft : drafts_) {
    for (const HoudiniAttribute& other : attributes_)
      if (other.channel.name == draft.name)
        throw InputError(path_, "point attributes", "different names", fmt::format("{} twice", shown(draft.name)));
    attributes_.push_back(checked(draft, mostBytes));
  }
  drafts_.clear();
}

}  // namespace mote
