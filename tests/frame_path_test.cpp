// Frame numbers in file names, and the flags --frames and --size.
#include "host/scene/frame_path.h"

#include <gtest/gtest.h>

#include "host/core/error.h"
#include "tests/support/contains.h"

namespace mote {
namespace {

using test::contains;

TEST(FramePath, PadsTheFrameNumberToTheRunOfHashes) {
  EXPECT_EQ(framePath("a.####.exr", 12), "a.0012.exr");
  EXPECT_EQ(framePath("a.#.exr", 12), "a.12.exr");
  EXPECT_EQ(framePath("####", 123456), "123456");
  EXPECT_EQ(framePath("a.####.exr", -7), "a.-007.exr");
  EXPECT_EQ(framePath("a.####.exr", 0), "a.0000.exr");
  EXPECT_EQ(framePath("plain.exr", 3), "plain.exr");
  EXPECT_EQ(framePath("C#/shot##/a.##.exr", 3), "C#/shot##/a.03.exr");
  EXPECT_TRUE(hasFramePattern("x/a.#.exr"));
  EXPECT_FALSE(hasFramePattern("x#/a.exr"));
  EXPECT_THROW(framePath("a.##.##.exr", 1), InputError);
}

TEST(FramePath, TakesPercentDAsOtherProgramsWriteIt) {
  EXPECT_EQ(framePath("a.%04d.exr", 12), "a.0012.exr");
  EXPECT_EQ(framePath("a.%04d.exr", -7), "a.-007.exr");
  EXPECT_EQ(framePath("a.%d.exr", 12), "a.12.exr");
  EXPECT_EQ(framePath("a%012d", 7), "a000000000007");
  EXPECT_EQ(framePath("%04d/a.%d", 3), "%04d/a.3");
  EXPECT_TRUE(hasFramePattern("x/a.%03d.exr"));
  // None of these is one.
  for (const char* name : {"a.%4d.exr", "50%", "a%0d", "a.%0123d.exr", "a.%s.exr", "a%-04d", "%00d"}) {
    EXPECT_FALSE(hasFramePattern(name)) << name;
    EXPECT_EQ(framePath(name, 3), name);
  }
  for (const char* name : {"a.%04d.%04d.exr", "a.##.%d.exr", "a.%d#.exr"})
    EXPECT_THROW(framePath(name, 1), InputError) << name;
}

TEST(FramePath, KnowsItsOwnFrames) {
  for (const int frame : {-7, 0, 12, 12345}) {
    EXPECT_TRUE(isFrameOf("x#/a.####.exr", framePath("x#/a.####.exr", frame)));
    EXPECT_TRUE(isFrameOf("a.%d.exr", framePath("a.%d.exr", frame)));
  }
  EXPECT_TRUE(isFrameOf("plain.exr", "plain.exr"));
  for (const char* other : {"a.12.exr", "a.00012.exr", "a.0012.exr.exr", "b.0012.exr", "a.0012x.exr", "a..exr", "a.exr",
                            "a.+012.exr", "a.99999999999.exr", ""})
    EXPECT_FALSE(isFrameOf("a.####.exr", other)) << other;
}

TEST(FrameRange, ReadsASingleFrameARangeAndAStep) {
  const auto is = [](const char* text, int first, int last, int step) {
    const FrameRange range = parseFrameRange(text);
    return range.first == first && range.last == last && range.step == step;
  };
  EXPECT_TRUE(is("7", 7, 7, 1));
  EXPECT_TRUE(is("1-240", 1, 240, 1));
  EXPECT_TRUE(is("1-240x2", 1, 240, 2));
  EXPECT_TRUE(is("-5--2", -5, -2, 1));
  EXPECT_TRUE(is("-5-3x4", -5, 3, 4));
  EXPECT_TRUE(is("0", 0, 0, 1));
}

TEST(FrameRange, RefusesEverythingElseNamingTheFlag) {
  for (const char* text : {"", "a", "1-", "-", "1-2x", "1-2x0", "1-2x-1", "2-1", "1x2", "1-2-3", " 1", "1 ", "1.5",
                           "+1", "99999999999", "10000000", "-2147483648"}) {
    try {
      parseFrameRange(text);
      ADD_FAILURE() << "accepted '" << text << "'";
    } catch (const InputError& error) {
      EXPECT_TRUE(contains(error.what(), "--frames: expected "));
      EXPECT_TRUE(contains(error.what(), "\"" + std::string(text) + "\""));
    }
  }
}

TEST(PictureSize, IsReadFromWxH) {
  EXPECT_EQ(parseSize("1280x720"), ivec2(1280, 720));
  EXPECT_EQ(parseSize("1x16384"), ivec2(1, 16384));
  for (const char* text :
       {"", "1280", "1280x", "x720", "0x5", "5x16385", "-4x4", "4x4x4", "4X4", "4 x4", "99999999999x1"}) {
    try {
      parseSize(text);
      ADD_FAILURE() << "accepted '" << text << "'";
    } catch (const InputError& error) {
      EXPECT_TRUE(contains(error.what(), "--size: expected "));
    }
  }
}

}  // namespace
}  // namespace mote
