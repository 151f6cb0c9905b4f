#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "job/job.h"
#include "tests/support/test_data.h"

namespace terracast::job {
namespace {

// The aircraft crosses the whole world at 22 000 ft, 3.8 to 5.7 km above the elevation model: so says
// the recording's own description.
TEST(RealFlight, CrossesAndorraFromBorderToBorder) {
  TERRACAST_NEEDS_SHARED_DATA("trajectories/andorra_flight_SAVAN14.csv");
  if (!std::filesystem::exists("/usr/share/proj/egm96_15.gtx"))
    GTEST_SKIP() << "egm96_15.gtx is missing: install proj-data";
  const test::ScratchFolder scratch;
  const std::filesystem::path file = scratch / "job.toml";
  const std::string configs = std::string(TERRACAST_SOURCE_DIR) + "/configs/";
  std::ofstream(file) << "extends = \"" << configs << "andorra.toml\"\ndata = \""
                      << test::shared_data().string() << "\"\n[[trajectories]]\nextends = \""
                      << configs << "trajectories/andorra_research_flight.toml\"\n";
  const core::Log log("test", core::LogLevel::Off);
  const Job job = prepare_job(load_run_config(file, {}), {.log = log});
  ASSERT_EQ(job.sequences.size(), 1u);
  const auto& sequence = job.sequences[0];
  EXPECT_EQ(sequence.utc_start.substr(0, 16), "2022-03-29T14:49");
  const geo::WorldFrame& frame = job.ground->frame();
  double least_m = 1e9, most_m = 0.0;
  for (const auto& state : sequence.states) {
    const geo::Geodetic place = frame.geodetic_from_world(state.world_from_body.translation);
    const auto ground_m = job.ground->measured_height_m(place.lat_deg, place.lon_deg);
    ASSERT_TRUE(ground_m);
    least_m = std::min(least_m, place.height_m - *ground_m);
    most_m = std::max(most_m, place.height_m - *ground_m);
  }
  EXPECT_GT(least_m, 3700.0);
  EXPECT_LT(most_m, 5800.0);
  const auto border_m = [](const geo::BodyState& state) {
    return 25600.0 - state.world_from_body.translation.head<2>().cwiseAbs().maxCoeff();
  };
  // A frame a second at 140 m/s.
  EXPECT_LT(border_m(sequence.states.front()), 150.0);
  EXPECT_LT(border_m(sequence.states.back()), 150.0);
}

}  // namespace
}  // namespace terracast::job
