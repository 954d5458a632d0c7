#include <ImathBox.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>

#include "host/core/error.h"
#include "host/image/channels.h"
#include "host/image/exr.h"

namespace mote {
namespace {

constexpr std::int64_t kMaxPixels = std::int64_t{16384} * 16384;  // as large as Mote writes; 4 GiB in memory
constexpr std::int64_t kMaxNumbers = 16 * kMaxPixels;

/// Calls body(file) with the opened file and turns everything OpenEXR throws into one InputError.
template <class Body>
auto withFile(const std::string& path, const Body& body) {
  std::FILE* probe = std::fopen(path.c_str(), "rb");  // for the reason in the system's words
  if (!probe) throw InputError(fmt::format("{}: cannot read: {}", path, std::strerror(errno)));
  std::fclose(probe);
  try {
    Imf::InputFile file(path.c_str(), 0);
    return body(file);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: not enough memory to read the picture", path));
  } catch (const std::exception& e) {
    throw InputError(fmt::format("{}: not a readable OpenEXR picture: {}", path, e.what()));
  }
}

struct Window {
  std::int64_t left, top, width, height;
  Window(const Imath::Box2i& box)
      : left(box.min.x),
        top(box.min.y),
        width(std::int64_t{box.max.x} - box.min.x + 1),
        height(std::int64_t{box.max.y} - box.min.y + 1) {}
};

void checkSize(const std::string& path, const char* field, const Window& window) {
  // Each side first: their product could leave 64 bits.
  if (window.width > kMaxPixels || window.height > kMaxPixels || window.width * window.height > kMaxPixels)
    throw InputError(path, field, fmt::format("at most {} pixels", kMaxPixels),
                     fmt::format("{} × {}", window.width, window.height));
}

const char* typeName(Imf::PixelType type) { return type == Imf::HALF ? "half" : type == Imf::FLOAT ? "float" : "uint"; }

/// The file's channels by name, as an Image takes them.
struct Layout {
  std::vector<std::string> names;
  bool grey = false;  ///< a lone Y instead of colours

  Layout(const std::string& path, const Imf::ChannelList& channels) {
    std::string all;
    bool known = false;
    for (auto c = channels.begin(); c != channels.end(); ++c) {
      const std::string name = c.name();
      all += (all.empty() ? "" : ", ") + name;
      known = known || name == "R" || name == "G" || name == "B" || name == "A" || name == "Y" || name == "Z";
      if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
        throw InputError(path, fmt::format("channel {}", name), "a sample for every pixel",
                         fmt::format("one for {} × {} pixels", c.channel().xSampling, c.channel().ySampling));
      names.push_back(name);
    }
    if (!known) throw InputError(path, "channels", "at least one of R, G, B, A, Y, Z", all.empty() ? "none" : all);
    const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
    grey = !has("R") && !has("G") && !has("B") && has("Y");
    if (grey) std::erase(names, "Y");
  }
};

/// A file of a few bytes may claim thousands of channels.
void checkBytes(const std::string& path, const Layout& layout, std::int64_t pixels) {
  const auto channels = static_cast<std::int64_t>(layout.names.size());
  if (channels > kMaxNumbers / pixels)
    throw InputError(path, "channels", fmt::format("at most {} numbers in all", kMaxNumbers),
                     fmt::format("{} channels of {} pixels", channels, pixels));
}

/// Slice of float values; `base` is that of the data window's first pixel.
Imf::Slice sliceOf(float* base, std::size_t xStride, const Window& data, double fill) {
  const std::size_t yStride = xStride * static_cast<std::size_t>(data.width);
  // OpenEXR wants the address of pixel (0, 0), which may lie outside the array: computed as an integer, never read.
  const auto origin = reinterpret_cast<std::uintptr_t>(base) - static_cast<std::uintptr_t>(data.left) * xStride -
                      static_cast<std::uintptr_t>(data.top) * yStride;
  return Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(origin), xStride, yStride, 1, 1, fill);
}

Image readDataWindow(Imf::InputFile& file, const Layout& layout, const Window& data) {
  Image image = imageWith(static_cast<int>(data.width), static_cast<int>(data.height), layout.names);
  Imf::FrameBuffer buffer;
  for (const ChannelView& channel : channelsOf(image)) {
    // A grey picture's Y goes through R, and what it leaves of G and B is filled in below.
    const std::string name = layout.grey && channel.name == "R" ? "Y" : channel.name;
    buffer.insert(name, sliceOf(channel.first, channel.stride * sizeof(float), data, name == "A" ? 1 : channel.empty));
  }
  file.setFrameBuffer(buffer);
  const int top = static_cast<int>(data.top);
  file.readPixels(top, top + image.height - 1);
  if (layout.grey)
    for (vec4& p : image.pixels) p.y = p.z = p.x;
  return image;
}

/// The part of `image`, which stands at `data`, that shows in `display`; nothing elsewhere.
Image place(const Image& image, const Layout& layout, const Window& data, const Window& display) {
  Image out = imageWith(static_cast<int>(display.width), static_cast<int>(display.height), layout.names);
  const std::int64_t dx = data.left - display.left, dy = data.top - display.top;
  const std::vector<ChannelView> sources = channelsOf(image), targets = channelsOf(out);
  for (std::size_t c = 0; c < targets.size(); ++c)
    for (std::int64_t y = std::max<std::int64_t>(0, dy); y < std::min(display.height, dy + data.height); ++y)
      for (std::int64_t x = std::max<std::int64_t>(0, dx); x < std::min(display.width, dx + data.width); ++x)
        targets[c].at(static_cast<std::size_t>(y * display.width + x)) =
            sources[c].at(static_cast<std::size_t>((y - dy) * data.width + (x - dx)));
  return out;
}

}  // namespace

Image readExr(const std::string& path) {
  return withFile(path, [&](Imf::InputFile& file) {
    const Window data(file.header().dataWindow()), display(file.header().displayWindow());
    checkSize(path, "dataWindow", data);
    checkSize(path, "displayWindow", display);
    const Layout layout(path, file.header().channels());
    checkBytes(path, layout, std::max(data.width * data.height, display.width * display.height));
    Image image = readDataWindow(file, layout, data);
    const bool same = data.left == display.left && data.top == display.top && data.width == display.width &&
                      data.height == display.height;
    return same ? image : place(image, layout, data, display);
  });
}

std::map<std::string, std::string> exrStrings(const std::string& path) {
  return withFile(path, [](Imf::InputFile& file) {
    std::map<std::string, std::string> strings;
    for (auto a = file.header().begin(); a != file.header().end(); ++a)
      if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
        strings[a.name()] = text->value();
    return strings;
  });
}

std::vector<ExrChannel> exrChannels(const std::string& path) {
  return withFile(path, [](Imf::InputFile& file) {
    std::vector<ExrChannel> channels;
    const Imf::ChannelList& list = file.header().channels();
    for (auto c = list.begin(); c != list.end(); ++c) channels.push_back({c.name(), typeName(c.channel().type)});
    return channels;
  });
}

}  // namespace mote
