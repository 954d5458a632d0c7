// A build without OpenVDB still knows its files.
#include <gtest/gtest.h>

#include "tests/support/opened_file.h"
#include "tests/support/shared_data.h"

namespace mote {
namespace {

TEST(VdbReader, SaysThatThisBuildLacksOpenVdb) {
  test::expectFileRefused(std::string("\x20\x42\x44\x56\0\0\0\0", 8),
                          {"this build of Mote", "without", "MOTE_OPENVDB"});
  EXPECT_TRUE(isParticleFile(test::sharedFile("smoke1/smoke.vdb")));
  EXPECT_GT(openParticleFile(test::sharedFile("teapot_cloud/teapot_cloud-RENDER-0.85.nvdb"))->count(), 0u);
}

}  // namespace
}  // namespace mote
