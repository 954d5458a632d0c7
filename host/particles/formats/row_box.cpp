#include "host/particles/formats/row_box.h"

#include <cstring>
#include <limits>

#include "host/particles/formats/number_visit.h"

namespace mote {

RowBox::RowBox(std::span<const Channel> channels, std::span<const std::size_t> offsets, std::size_t rowBytes)
    : rowBytes_(rowBytes), lo_(std::numeric_limits<double>::max()), hi_(-std::numeric_limits<double>::max()) {
  for (std::size_t k = 0; k < channels.size(); ++k)
    if (channels[k].name == "Position" && channels[k].arity == 3) offset_ = offsets[k], type_ = channels[k].type;
}

void RowBox::add(std::span<const std::byte> rows) {
  if (!offset_) return;
  withNumberType(type_, [&]<class T>(T) {
    for (std::size_t at = *offset_; at < rows.size(); at += rowBytes_) {
      T place[3];
      std::memcpy(place, rows.data() + at, sizeof place);
      const dvec3 p(static_cast<double>(place[0]), static_cast<double>(place[1]), static_cast<double>(place[2]));
      lo_ = glm::min(lo_, p), hi_ = glm::max(hi_, p);
    }
  });
}

}  // namespace mote
