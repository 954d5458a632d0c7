// Where the numbers of a channel go: checked against what was asked for, and converted. For readers of files.
#pragma once
#include <span>
#include <string>

#include "host/particles/formats/channel.h"

namespace mote {

class ChannelSink {
 public:
  /// Throws InputError where none of the file's channels has the name, or its arity does not fit the target.
  ChannelSink(const std::string& path, std::span<const Channel> channels, const ChannelRequest& request);

  /// Which of the channels it takes.
  std::size_t index() const { return index_; }
  /// Clears the target and makes room for so many particles.
  void reserve(std::uint64_t particles);
  /// Takes `count` particles: `from` is the channel's first number of the first, which need not be aligned; the next
  /// particle's is `stride` bytes on. `bigEndian`: bytes are swapped.
  void append(const std::byte* from, std::size_t stride, std::size_t count, bool bigEndian = false);

 private:
  decltype(ChannelRequest::target) target_;
  std::size_t index_ = 0;
  Channel channel_;
};

}  // namespace mote
