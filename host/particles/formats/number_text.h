// Numbers as text, for writers of tables.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "host/particles/formats/channel.h"

namespace mote {

/// A line of text for each row, its numbers in order and parted by `separator`: the shortest digits that are read back
/// as the same number (std::to_chars), nan, inf, -inf; of a NaN only the sign is kept. In parallel; one string a block
/// of rows.
std::vector<std::string> rowsAsText(std::span<const std::byte> rows, std::size_t rowBytes,
                                    std::span<const Channel> channels, char separator);

}  // namespace mote
