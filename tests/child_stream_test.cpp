// Work in a process of its own: what comes out of it, and what is said of one that crashes.
#include "host/particles/formats/child_stream.h"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <numeric>

#include "host/core/error.h"

namespace mote {
namespace {

using Send = ChildStream::Send;

/// What is thrown where the messages of `work` are read to their end.
template <class Error>
std::string thrownBy(const std::function<void(const Send&)>& work, unsigned seconds = 60) {
  try {
    ChildStream stream("a.file", "libexample", seconds, work);
    std::vector<std::byte> message;
    while (stream.next(message)) continue;
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

TEST(ChildStream, HandsOverMessagesOfAnySizeInOrder) {
  std::vector<std::uint32_t> numbers(1 << 20);  // 4 MiB: more than a pipe holds
  std::iota(numbers.begin(), numbers.end(), 0u);
  ChildStream stream("a.file", "libexample", 60, [&](const Send& send) {
    send({});
    send(std::as_bytes(std::span(numbers)));
    send(std::as_bytes(std::span(numbers).first(1)));
  });
  std::vector<std::byte> message{std::byte{1}};
  ASSERT_TRUE(stream.next(message));
  EXPECT_TRUE(message.empty());
  ASSERT_TRUE(stream.next(message));
  const auto sent = std::as_bytes(std::span(numbers));
  EXPECT_TRUE(std::equal(message.begin(), message.end(), sent.begin(), sent.end()));
  ASSERT_TRUE(stream.next(message));
  EXPECT_EQ(message.size(), sizeof(std::uint32_t));
  EXPECT_FALSE(stream.next(message));
}

TEST(ChildStream, ThrowsWhatTheWorkThrows) {
  EXPECT_EQ(thrownBy<InputError>([](const Send&) { throw InputError("a.file", "field", "this", "that"); }),
            "a.file: field: expected this, got that");
  EXPECT_EQ(thrownBy<MachineError>([](const Send&) { throw MachineError("no disk"); }), "no disk");
  EXPECT_EQ(thrownBy<MachineError>([](const Send&) { throw std::bad_alloc(); }), "not enough memory");
}

TEST(ChildStream, TakesACrashForADamagedFile) {
  for (const int signal : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS})
    EXPECT_EQ(thrownBy<InputError>([&](const Send& send) {
                send({});
                std::raise(signal);
              }),
              "a.file: libexample: expected data that it can read, got some that make it crash (the file is damaged)");
  EXPECT_NE(thrownBy<InputError>([](const Send&) { std::_Exit(3); }).find("make it crash"), std::string::npos);
}

TEST(ChildStream, EndsWorkThatComputesForEver) {
  EXPECT_NE(thrownBy<InputError>(
                [](const Send&) {
                  volatile bool forEver = true;
                  while (forEver) continue;
                },
                1)
                .find("takes for ever"),
            std::string::npos);
}

TEST(ChildStream, SaysThatSomebodyEndedIt) {
  EXPECT_NE(thrownBy<MachineError>([](const Send&) { std::raise(SIGKILL); }).find("was ended"), std::string::npos);
}

TEST(ChildStream, EndsTheWorkWhereNobodyReadsOn) {
  ChildStream stream("a.file", "libexample", 60, [](const Send& send) {
    for (;;) send({});
  });
  std::vector<std::byte> message;
  EXPECT_TRUE(stream.next(message));
}  // and the destructor returns

}  // namespace
}  // namespace mote
