// Small disks and read-only folders, seen by this process and its children alone: a mount namespace of its own, which
// ends with it.
#pragma once
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>

namespace mote::test {

namespace detail {

/// Empty, or what refused.
inline std::string enterMountNamespace() {
  const auto failed = [](const char* call) { return std::string(call) + ": " + std::strerror(errno); };
  const uid_t user = ::geteuid();
  const gid_t group = ::getegid();
  // Without root a user namespace in which this user is root is the way, where the machine allows those.
  if (::unshare(user == 0 ? CLONE_NEWNS : CLONE_NEWUSER | CLONE_NEWNS) != 0) return failed("unshare");
  if (user != 0) {
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
    std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
  }
  if (::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return failed("mount");
  return "";
}

}  // namespace detail

/// Why this process cannot mount anything; empty: it can. Call before the process starts threads.
inline const std::string& mountsRefused() {
  static const std::string why = detail::enterMountNamespace();
  return why;
}

/// Something mounted on a folder for as long as this lives.
class Mount {
 public:
  /// A disk of `bytes` (whole pages).
  static Mount disk(const std::string& folder, std::size_t bytes) {
    return Mount(folder, ::mount("tmpfs", folder.c_str(), "tmpfs", 0, ("size=" + std::to_string(bytes)).c_str()) == 0);
  }
  /// The folder as it is, but not to be written.
  static Mount readOnly(const std::string& folder) {
    const char* const path = folder.c_str();
    return Mount(folder, ::mount(path, path, nullptr, MS_BIND, nullptr) == 0 &&
                             ::mount(nullptr, path, nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY, nullptr) == 0);
  }
  ~Mount() { ::umount2(folder_.c_str(), MNT_DETACH); }
  Mount(const Mount&) = delete;
  Mount& operator=(const Mount&) = delete;

 private:
  Mount(std::string folder, bool mounted) : folder_(std::move(folder)) {
    EXPECT_TRUE(mounted) << folder_ << ": " << std::strerror(errno);
  }
  std::string folder_;
};

}  // namespace mote::test
