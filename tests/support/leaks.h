// Leaks that are not ours, or meant.
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

namespace mote::test {

/// What is allocated while one lives is none of the leak checker's business.
struct LeakOnPurpose {
#if defined(__SANITIZE_ADDRESS__)
  LeakOnPurpose() { __lsan_disable(); }
  ~LeakOnPurpose() { __lsan_enable(); }
#else
  LeakOnPurpose() {}
  ~LeakOnPurpose() {}
#endif
  LeakOnPurpose(const LeakOnPurpose&) = delete;
  LeakOnPurpose& operator=(const LeakOnPurpose&) = delete;
};

}  // namespace mote::test
