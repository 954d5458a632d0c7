// Embree's objects, owned, and its errors as ours. Only for the .cpp files of this module.
#pragma once
#include <embree3/rtcore.h>
#include <fmt/format.h>

#include <memory>

#include "host/core/error.h"

namespace mote::embree {

template <auto release>
struct Release {
  template <class T>
  void operator()(T* object) const {
    release(object);
  }
};
template <class Handle, auto release>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, Release<release>>;

using Device = Owned<RTCDevice, &rtcReleaseDevice>;
using Scene = Owned<RTCScene, &rtcReleaseScene>;
using Bvh = Owned<RTCBVH, &rtcReleaseBVH>;
using Geometry = Owned<RTCGeometry, &rtcReleaseGeometry>;

/// Throws what the device has to complain about since it was last asked.
inline void check(RTCDevice device, const char* doing) {
  const RTCError error = rtcGetDeviceError(device);
  if (error != RTC_ERROR_NONE)
    throw MachineError(fmt::format("Embree, {}: {} (error {})", doing,
                                   error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory" : "failed",
                                   static_cast<int>(error)));
}

/// A device whose builds run on the calling thread alone: with more of them, what a tree looks like varies from run to
/// run. Rays may still be cast from any number of threads.
inline Device makeDevice() {
  Device device(rtcNewDevice("threads=1,user_threads=1,set_affinity=0"));
  check(device.get(), "opening");
  return device;
}

}  // namespace mote::embree
