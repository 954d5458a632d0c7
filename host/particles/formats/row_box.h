// The box around the positions of particles as they go by, for writers whose formats keep it.
#pragma once
#include <cstddef>
#include <optional>
#include <span>

#include "host/core/vec.h"
#include "host/particles/formats/channel.h"

namespace mote {

class RowBox {
 public:
  /// Of the channel Position with three numbers, where there is one.
  RowBox(std::span<const Channel> channels, std::span<const std::size_t> offsets, std::size_t rowBytes);

  bool hasPosition() const { return offset_.has_value(); }
  void add(std::span<const std::byte> rows);
  /// Positions that are not numbers count nowhere. Of none: lo is double's greatest, hi its least.
  const dvec3& lo() const { return lo_; }
  const dvec3& hi() const { return hi_; }
  bool empty() const { return lo_.x > hi_.x; }

 private:
  std::optional<std::size_t> offset_;
  std::size_t rowBytes_;
  NumberType type_ = NumberType::F32;
  dvec3 lo_, hi_;
};

}  // namespace mote
