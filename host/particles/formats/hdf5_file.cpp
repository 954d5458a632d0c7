#include "host/particles/formats/hdf5_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <span>

#include "host/core/error.h"
#include "host/particles/formats/child_stream.h"
#include "host/particles/formats/hdf5_library.h"
#include "host/particles/formats/input_file.h"

namespace mote {

const Hdf5Group* Hdf5File::group(const std::string& name) const {
  const auto found = std::find_if(groups_.begin(), groups_.end(), [&](const Hdf5Group& g) { return g.name == name; });
  return found == groups_.end() ? nullptr : &*found;
}

std::size_t hdf5Begin(std::span<const std::byte> start) {
  constexpr char kSignature[] = {'\x89', 'H', 'D', 'F', '\r', '\n', '\x1a', '\n'};
  constexpr std::size_t kFirstUserBlock = 512;  // the signature stands at 0, 512, 1024, 2048 …
  std::size_t at = 0;
  for (; at + sizeof kSignature <= start.size(); at = at == 0 ? kFirstUserBlock : 2 * at)
    if (std::memcmp(start.data() + at, kSignature, sizeof kSignature) == 0) return at;
  return start.size();
}

#ifndef MOTE_HAS_HDF5

bool hasHdf5() { return false; }

Hdf5File::Hdf5File(std::string path) : path_(std::move(path)) {
  throw InputError(path_, "", "a format that this build reads", "HDF5, which it was built without",
                   "build Mote with -DMOTE_HDF5=ON, or make an NPY file of it with Python's h5py and numpy");
}

std::unique_ptr<Hdf5Rows> hdf5Rows(const std::string&, const std::string&, const Hdf5Array&) { return nullptr; }

#else

bool hasHdf5() { return true; }

namespace {

/// How long libhdf5 may compute: ten times what it needs for good files that are not packed hard, and ten seconds.
unsigned secondsFor(const std::string& path) {
  constexpr std::uint64_t kBytesASecond = 2'000'000, kMost = 1'000'000;
  return static_cast<unsigned>(10 + std::min(kMost, InputFile(path).bytes() / kBytesASecond));
}

/// Refuses a file that ends before it says so itself; the superblock's form is that of the HDF5 File Format
/// Specification, II.A. Whatever else is wrong with it libhdf5 finds.
void requireWhole(const std::string& path) {
  const InputFile file(path);
  constexpr std::size_t kMostUserBlock = 1 << 16, kSuperblock = 48;
  const std::vector<std::byte> bytes = file.start(kMostUserBlock + kSuperblock);
  const std::size_t begin = hdf5Begin(bytes);
  const auto cutOff = [&](std::uint64_t expected) {
    throw InputError(path, "HDF5", fmt::format("{} bytes", expected), fmt::format("{}", file.bytes()),
                     "the file is cut off: it was not copied, or not written, to its end");
  };
  if (begin + kSuperblock > bytes.size()) cutOff(begin + kSuperblock);
  const auto byte = [&](std::size_t at) { return std::to_integer<unsigned>(bytes[begin + at]); };
  const auto address = [&](std::size_t at) {
    std::uint64_t value = 0;
    std::memcpy(&value, &bytes[begin + at], sizeof value);
    return value;
  };
  const unsigned version = byte(8), width = byte(version < 2 ? 13 : 9);
  if (version > 3 || width != 8) return;
  const std::size_t base = version == 0 ? 24 : version == 1 ? 28 : 12;
  const std::uint64_t end = address(base + 16);
  constexpr std::uint64_t kUndefined = ~std::uint64_t{0};
  if (begin == 0 && address(base) == 0 && end != kUndefined && end > file.bytes()) cutOff(end);
}

/// Groups as bytes, from one process to the other.
class Packer {
 public:
  std::vector<std::byte> bytes;

  void number(std::uint64_t value) { raw(&value, sizeof value); }
  void text(const std::string& value) {
    number(value.size());
    raw(value.data(), value.size());
  }
  void group(const Hdf5Group& group) {
    text(group.name), number(group.arrays.size());
    for (const Hdf5Array& a : group.arrays) {
      text(a.name), number(static_cast<std::uint64_t>(a.type)), number(a.rows), number(a.arity), number(a.stored);
      number(a.otherFiles.size());
      for (const std::string& file : a.otherFiles) text(file);
    }
    number(group.attributes.size());
    for (const Metadata& m : group.attributes)
      text(m.name), number(static_cast<std::uint64_t>(m.type + 1)), text(m.bytes);  // from kMetadataText on
  }

 private:
  void raw(const void* from, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(from);
    bytes.insert(bytes.end(), begin, begin + size);
  }
};

/// And back; the other process may have been broken by what it read.
class Unpacker {
 public:
  Unpacker(const std::string& path, std::span<const std::byte> bytes) : path_(path), bytes_(bytes) {}

  Hdf5Group group() {
    Hdf5Group group{text(), {}, {}};
    for (std::uint64_t left = number(); left > 0; --left) {
      Hdf5Array a;
      a.name = text(), a.type = static_cast<NumberType>(number(kNumberTypes - 1)), a.rows = number();
      a.arity = static_cast<std::uint32_t>(number(1 << 16)), a.stored = number(1) == 1;
      if (a.arity == 0) fail();
      for (std::uint64_t files = number(); files > 0; --files) a.otherFiles.push_back(text());
      group.arrays.push_back(std::move(a));
    }
    for (std::uint64_t left = number(); left > 0; --left) {
      Metadata m;
      m.name = text(), m.type = static_cast<std::int32_t>(number(kNumberTypes)) - 1, m.bytes = text();
      group.attributes.push_back(std::move(m));
    }
    return group;
  }

 private:
  [[noreturn]] void fail() const {
    throw InputError(path_, "HDF5", "data that libhdf5 can read", "some that break it", "the file is damaged");
  }
  std::span<const std::byte> take(std::uint64_t size) {
    if (size > bytes_.size()) fail();
    const auto taken = bytes_.first(static_cast<std::size_t>(size));
    bytes_ = bytes_.subspan(taken.size());
    return taken;
  }
  std::uint64_t number(std::uint64_t most = ~std::uint64_t{0}) {
    std::uint64_t value = 0;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    if (value > most) fail();
    return value;
  }
  std::string text() {
    const auto raw = take(number());
    return {reinterpret_cast<const char*>(raw.data()), raw.size()};
  }

  const std::string& path_;
  std::span<const std::byte> bytes_;
};

class ChildRows : public Hdf5Rows {
 public:
  ChildRows(const std::string& path, const std::string& group, const Hdf5Array& array)
      : path_(path),
        array_(array),
        left_(array.rows),
        stream_(path, "libhdf5", secondsFor(path),
                [&](const ChildStream::Send& send) { Hdf5Library(path).rows(group, array, send); }) {}

  std::size_t next(std::vector<std::byte>& rows) override {
    const bool more = stream_.next(rows);
    const std::size_t count = more ? rows.size() / array_.rowBytes() : 0;
    if (count > left_ || (more && (count == 0 || rows.size() % array_.rowBytes() != 0)) || (!more && left_ > 0))
      throw InputError(path_, "HDF5, " + array_.name, fmt::format("{} rows", array_.rows), "others",
                       "the file is damaged");
    left_ -= count;
    return count;
  }

 private:
  const std::string path_;
  const Hdf5Array array_;
  std::uint64_t left_;
  ChildStream stream_;
};

}  // namespace

Hdf5File::Hdf5File(std::string path) : path_(std::move(path)) {
  requireWhole(path_);
  ChildStream stream(path_, "libhdf5", secondsFor(path_), [&](const ChildStream::Send& send) {
    for (const Hdf5Group& found : Hdf5Library(path_).groups()) {
      Packer packer;
      packer.group(found);
      send(packer.bytes);
    }
  });
  std::vector<std::byte> message;
  while (stream.next(message)) groups_.push_back(Unpacker(path_, message).group());
  if (groups_.empty() || !groups_[0].name.empty())
    throw InputError(path_, "HDF5", "a root group", "none", "the file is damaged");
}

std::unique_ptr<Hdf5Rows> hdf5Rows(const std::string& path, const std::string& group, const Hdf5Array& array) {
  return std::make_unique<ChildRows>(path, group, array);
}

#endif

}  // namespace mote
