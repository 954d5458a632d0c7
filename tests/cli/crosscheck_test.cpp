// The demo scene, whole: CPU and compute agree on every particle, on the order and on the picture.
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/cli/mote_program.h"

namespace mote::test {
namespace {

/// Runs crosscheck with validation on the scene of the demo and returns its report.
nlohmann::json crosscheckPlume(const TempFolder& folder, const std::string& cutoff) {
  const std::string report = folder.file("report.json");
  const ProcessResult result = mote({"crosscheck", std::string(MOTE_SOURCE_DIR) + "/scenes/plume.json", "--set",
                                     "/lighting/cutoff=" + cutoff, "--validate", "--report", report},
                                    kOnLavapipe);
  EXPECT_EQ(result.exitCode, 0) << result.out << result.err;
  std::ifstream file(report);
  return nlohmann::json::parse(file);
}

void expectAgreement(const nlohmann::json& report, double limit) {
  EXPECT_EQ(report["particles"], 350000);
  ASSERT_GE(report["lights"].size(), 2u);
  for (const auto& light : report["lights"])
    EXPECT_LE(light["worst_delta_transmittance"].get<double>(), limit) << light;
  EXPECT_EQ(report["sort_identical"], true);
  EXPECT_GE(report["picture"]["within"].get<double>(), 0.999);
  EXPECT_LE(report["picture"]["rmse"].get<double>(), 1e-3);
  std::printf("%s\n", report.dump(1).c_str());
}

TEST(Crosscheck, PlumeAgreesWithinTheCutoff) {
  const TempFolder folder;
  expectAgreement(crosscheckPlume(folder, "1e-4"), 1e-4);
}

TEST(Crosscheck, PlumeAgreesToRoundingWithoutCutoff) {
  const TempFolder folder;
  expectAgreement(crosscheckPlume(folder, "0"), 2e-5);
}

}  // namespace
}  // namespace mote::test
