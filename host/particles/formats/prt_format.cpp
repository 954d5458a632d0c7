#include "host/particles/formats/prt_format.h"

namespace mote {

namespace {

bool isLetter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_'; }

}  // namespace

const PrtChannel* PrtHeader::channel(std::string_view name) const {
  for (const PrtChannel& c : channels)
    if (c.name == name) return &c;
  return nullptr;
}

const Metadata* PrtHeader::meta(std::string_view channel, std::string_view name) const {
  for (const Metadata& m : metadata)
    if (m.channel == channel && m.name == name) return &m;
  return nullptr;
}

bool prtNameIsValid(std::string_view name) {
  if (name.empty() || name.size() > 31 || !isLetter(name[0])) return false;
  for (const char c : name)
    if (!isLetter(c) && !(c >= '0' && c <= '9')) return false;
  return true;
}

}  // namespace mote
