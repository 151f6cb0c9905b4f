// A path that is to keep clear of the world is proved before anything is rendered.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* kJob = R"(name = "job"
world = {{name = "job", origin_lat_deg = 46.0, origin_lon_deg = 7.0, size_m = 512.0, outside = "extend", elevation = [{{kind = "plane", vertical_datum = "ellipsoid", height_m = 500.0}}]}}
detail.finest_spacing_m = 4.0
trajectories = [{{name = "P000", kind = "orbit", centre = {{east_m = 0.0, north_m = 0.0, height_m = 60.0, above = "ground"}}, radius_m = 120.0, speed_mps = 20.0, rate_hz = 1.0, num_frames = 2}}]
clearance = {{min_m = {}, trajectories = [{}]}}
conditions.color_samples = 1

[[rigs]]
name = "eye"
cameras = [{{name = "camera", width_px = 32, height_px = 24, fx_px = 24.0}}]
)";

TEST(MinClearance, IsProvedBeforeAnythingIsRendered) {
  const ScratchFolder scratch;
  const auto run = [&](double min_m, const std::string& trajectories = "") {
    core::write_file(scratch / "job.toml", fmt::format(kJob, min_m, trajectories));
    return run_program(
        {"render", (scratch / "job.toml").string(), "--out", (scratch / "out").string()});
  };
  core::write_file(scratch / "job.toml", fmt::format(kJob, 0.0, ""));
  ASSERT_EQ(run_program({"tile", (scratch / "job.toml").string(), "--out",
                         (scratch / "out").string(), "--quiet"})
                .status,
            0);
  const ProgramResult refused = run(61.0);
  EXPECT_EQ(refused.status, 3) << refused.output;
  EXPECT_THAT(refused.output, HasSubstr("from the ground at t = "));
  EXPECT_THAT(refused.output, HasSubstr("nearer than clearance.min_m = 61"));
  EXPECT_THAT(refused.output, HasSubstr("rendering sequence P000"));
  EXPECT_FALSE(fs::exists(scratch / "out/capture/P000"));
  const ProgramResult unknown = run(61.0, "\"P001\"");
  EXPECT_EQ(unknown.status, 2) << unknown.output;
  EXPECT_THAT(unknown.output, HasSubstr("clearance.trajectories: "));
  const ProgramResult proved = run(59.5, "\"P000\"");
  EXPECT_EQ(proved.status, 0) << proved.output;
  EXPECT_THAT(proved.output, HasSubstr("the whole path stays 59.5 m or more from every surface"));
}

}  // namespace
}  // namespace terracast::test
