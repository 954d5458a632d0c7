// Files of other people's programs (../shared/data), for tests.
#pragma once
#include <string>

namespace mote::test {

inline std::string sharedFile(const std::string& name) { return std::string(MOTE_SHARED_DATA) + "/" + name; }

}  // namespace mote::test
