// What is tried where a device fails in the middle of a frame: smaller parts, a device opened anew, the host.
#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "engine/vulkan/gpu.h"

namespace mote {

/// One run's device. Warnings (logWarning) name the step, what happened and what was done, one for each step that did
/// not go as it should.
class Recovery {
 public:
  /// `gpu` must outlive it.
  explicit Recovery(Gpu& gpu) : gpu_(gpu), limit_(gpu.device().budget().limit()) {}

  /// Runs `work`, which uses the device, from its beginning until it comes to its end:
  ///   out of device memory   again with at most half of what it had held (but kLeastLimit), up to kMostHalvings times;
  ///                          that step of later frames keeps the limit, the others have their own
  ///   device lost            again with the device opened anew, once
  /// `work` must leave nothing on the device when it throws. True: done. False, where `mayLeave`: it cannot be done,
  /// the caller takes the host from here on. Else throws MachineError that says what was tried; the next step begins as
  /// if nothing had been. `step`: "lighting". What `work` throws that is no DeviceError passes through.
  bool onDevice(int frame, const std::string& step, bool mayLeave, const std::function<void()>& work);

  static constexpr int kMostHalvings = 4;
  /// Enough for a part of anything but large pictures and solids [bytes].
  static constexpr std::uint64_t kLeastLimit = 8u << 20;

 private:
  Gpu& gpu_;
  std::uint64_t limit_;                           // that the user set
  std::map<std::string, std::uint64_t> lowered_;  // by step
};

}  // namespace mote
