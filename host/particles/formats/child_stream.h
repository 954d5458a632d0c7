// Work that is done in a process of its own, because it may crash: for libraries that damaged files can break.
#pragma once
#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace mote {

/// What the work says, message by message. Moves and copies are not needed: it lives where it is read.
class ChildStream {
 public:
  using Send = std::function<void(std::span<const std::byte>)>;

  /// Forks; `work` runs in the child, which has a copy of everything and must start no thread, and ends with it. Its
  /// standard error is shut, and it may compute for `seconds`. `path` names the file in messages, `library` whose code
  /// it is. Throws MachineError where there can be no child.
  ChildStream(std::string path, std::string library, unsigned seconds, const std::function<void(const Send&)>& work);
  /// Ends the child where it still works.
  ~ChildStream();
  ChildStream(const ChildStream&) = delete;
  ChildStream& operator=(const ChildStream&) = delete;

  /// The next message, in place of what `message` holds; false: the work is done. Throws what the work threw, as
  /// InputError or MachineError, and InputError where it crashed or took too long: the file is damaged.
  bool next(std::vector<std::byte>& message);

 private:
  bool receive(void* to, std::size_t bytes);
  [[noreturn]] void fail();

  std::string path_, library_;
  pid_t child_ = -1;
  int from_ = -1;
};

}  // namespace mote
