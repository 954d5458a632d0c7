// Scalars of a table that are one vector by their names.
#pragma once
#include <cstddef>
#include <vector>

#include "host/particles/formats/channel.h"

namespace mote {

/// A channel, and where its first number stands in a row of a table.
struct PlacedChannel {
  Channel channel;
  std::size_t offset = 0;  ///< [bytes]

  PlacedChannel() = default;
  PlacedChannel(std::string name, NumberType type, std::uint32_t arity, std::size_t place)
      : channel{std::move(name), type, arity}, offset(place) {}
};

/// Three scalars side by side, of one type, named as components become one channel of arity 3:
///   x y z, px py pz, X Y Z           Position
///   vx vy vz                         Velocity
///   nx ny nz                         Normal
///   r g b, red green blue            Color; of 8 or 16 bits it is a share of their greatest number
///   NAME_x NAME_y NAME_z, NAME.x …   NAME
/// So do NAME[0] NAME[1] …, as many as there are (two or more), which become NAME. Everything else stays as it is.
std::vector<PlacedChannel> withVectors(const std::vector<PlacedChannel>& columns);

/// The columns of a table that says no names: Position (3), Position and Density (4), Position and Velocity (6), else
/// Position, Column3, Column4 … Throws InputError (place: `path`) where there are fewer than three.
std::vector<PlacedChannel> plainColumns(const std::string& path, std::size_t width, NumberType type);

}  // namespace mote
