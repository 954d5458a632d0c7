// What Mote reads of a particle file, for scripts that compare it with other programs' readers:
//   dump_particles FILE FOLDER
// writes FOLDER/K.raw, the little-endian numbers of channel K, and prints a line "TYPE ARITY COUNT NAME" for each.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <fstream>
#include <string>
#include <vector>

#include "host/particles/formats/particle_file.h"

int main(int count, char** arguments) try {
  if (count != 3) {
    fmt::print(stderr, "usage: dump_particles FILE FOLDER\n");
    return 2;
  }
  const auto file = mote::openParticleFile(arguments[1]);
  std::size_t index = 0;
  for (const mote::Channel& channel : file->channels()) {
    std::vector<std::byte> numbers;
    const mote::ChannelRequest request{channel.name, &numbers};
    file->read({&request, 1});
    std::ofstream out(fmt::format("{}/{}.raw", arguments[2], index++), std::ios::binary);
    out.write(reinterpret_cast<const char*>(numbers.data()), static_cast<std::streamsize>(numbers.size()));
    if (!out.flush()) throw std::runtime_error("cannot write into " + std::string(arguments[2]));
    fmt::print("{} {} {} {}\n", mote::numberName(channel.type), channel.arity, file->count(), channel.name);
  }
  return 0;
} catch (const std::exception& error) {
  fmt::print(stderr, "{}\n", error.what());
  return 1;
}
