#include "host/particles/formats/houdini_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "host/core/error.h"
#include "host/particles/formats/number_visit.h"
#include "host/particles/formats/section.h"
#include "host/particles/formats/text_number.h"

namespace mote {
namespace {

using Order = HoudiniValues::Order;

constexpr std::size_t kBlockBytes = 1 << 19;

/// A double would lose what is beyond 2^53.
void storeInteger(std::int64_t value, NumberType type, std::byte* to) {
  withNumberType(type, [&]<class T>(T number) {
    if constexpr (std::is_integral_v<T>) {
      if (std::in_range<T>(value)) number = static_cast<T>(value);
    } else {
      number = static_cast<T>(static_cast<double>(value));
    }
    std::memcpy(to, &number, sizeof number);
  });
}

}  // namespace

HoudiniNumbers::HoudiniNumbers(const std::string& path, const HoudiniAttribute& attribute, std::uint64_t points,
                               const std::vector<ChannelSink*>& sinks)
    : path_(path),
      attribute_(attribute),
      points_(points),
      sinks_(sinks),
      numberBytes_(numberSize(attribute.channel.type)),
      rowBytes_(attribute.channel.bytes()) {
  const HoudiniValues& values = attribute.values;
  if (values.order == Order::Pages) {
    pageSize_ = static_cast<std::uint64_t>(values.pageSize);
    parts_.assign(values.packing.begin(), values.packing.end());
  } else if (values.order == Order::Arrays) {  // one page, whose parts are single numbers
    pageSize_ = std::max<std::uint64_t>(1, points_);
    parts_.assign(attribute.channel.arity, 1);
  } else {
    pageSize_ = std::max<std::size_t>(1, kBlockBytes / rowBytes_);
    parts_ = {attribute.channel.arity};
  }
  if (points_ > 0) beginPart();
}

void HoudiniNumbers::fail(const std::string& expected, const std::string& got) const {
  const std::size_t here = numbers_.size() / (parts_[part_] * numberBytes_);
  throw InputError(path_, fmt::format("point attribute {}, point {}", shown(attribute_.channel.name), firstRow_ + here),
                   expected, got, "the file is cut off or damaged");
}

std::uint64_t HoudiniNumbers::rowsHere() const { return std::min(pageSize_, points_ - firstRow_); }

void HoudiniNumbers::beginPart() {
  const auto& flags = attribute_.values.constantPages;
  constant_ = !flags.empty() && !flags[part_].empty() && flags[part_][page_];
  lacking_ = (constant_ ? 1 : rowsHere()) * parts_[part_];
}

std::byte* HoudiniNumbers::room(std::size_t count) {
  if (lacking_ == 0)
    fail(fmt::format("numbers of {} points", points_), "more of them");  // nothing is begun behind the last one
  const std::size_t old = numbers_.size();
  numbers_.resize(old + count * numberBytes_);
  lacking_ -= count, inTuple_ += count;
  return &numbers_[old];
}

void HoudiniNumbers::endPartIfFull() {
  if (lacking_ > 0) return;
  const std::uint64_t rows = rowsHere();
  const std::size_t partBytes = parts_[part_] * numberBytes_;
  const std::byte* page = numbers_.data();
  if (parts_.size() > 1 || constant_) {
    rows_.resize(rows * rowBytes_);
    for (std::uint64_t i = 0; i < rows; ++i)
      std::memcpy(&rows_[i * rowBytes_ + partOffset_], &numbers_[constant_ ? 0 : i * partBytes], partBytes);
    page = rows_.data();
  }
  partOffset_ += partBytes;
  if (++part_ == parts_.size()) {
    for (ChannelSink* sink : sinks_) sink->append(page, rowBytes_, rows);
    part_ = 0, partOffset_ = 0, ++page_, firstRow_ += rows;
  }
  numbers_.clear();
  if (firstRow_ < points_) beginPart();
}

bool HoudiniNumbers::beginArray(std::uint64_t) {
  ++depth_;
  inTuple_ = 0;
  return true;
}

void HoudiniNumbers::endArray() {
  const Order order = attribute_.values.order;
  if (--depth_ != 1 || order == Order::Pages) return;
  const std::uint64_t expected = order == Order::Tuples ? attribute_.channel.arity : points_;
  if (inTuple_ != expected) fail(fmt::format("lists of {} numbers", expected), fmt::format("{}", inTuple_));
}

void HoudiniNumbers::text(const std::string& value) { fail("numbers", shown(value)); }

void HoudiniNumbers::integer(std::int64_t value) {
  storeInteger(value, attribute_.channel.type, room(1));
  endPartIfFull();
}

void HoudiniNumbers::real(double value) {
  storeNumber(value, attribute_.channel.type, room(1));
  endPartIfFull();
}

void HoudiniNumbers::numbers(NumberType type, const std::byte* from, std::size_t count) {
  const NumberType ours = attribute_.channel.type;
  for (const std::size_t size = numberSize(type); count > 0;) {
    const std::size_t here = std::min<std::uint64_t>(count, std::max<std::uint64_t>(1, lacking_));
    std::byte* to = room(here);
    if (type == ours) {
      std::memcpy(to, from, here * size);
    } else {
      withNumberType(type, [&]<class T>(T value) {
        for (std::size_t k = 0; k < here; ++k) {
          std::memcpy(&value, from + k * size, size);
          if constexpr (std::is_integral_v<T>)
            storeInteger(static_cast<std::int64_t>(value), ours, to + k * numberBytes_);
          else
            storeNumber(static_cast<double>(value), ours, to + k * numberBytes_);
        }
      });
    }
    from += here * size, count -= here;
    endPartIfFull();
  }
}

void HoudiniNumbers::finish() const {
  if (firstRow_ < points_) fail(fmt::format("numbers of {} points", points_), "the array's end");
}

}  // namespace mote
