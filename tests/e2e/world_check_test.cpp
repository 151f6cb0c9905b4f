#include <gtest/gtest.h>

#include "tests/e2e/tiny_job.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// The worlds that terracast ships, whole, with fine tiles about their middle: `world check` finds nothing in them.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;

struct Shipped {
  std::string name;
  std::string data;  ///< that it needs, below the folder of data; "": none
};

class WorldCheckFull : public testing::TestWithParam<Shipped> {};

/// Two kilometres about the origin from above.
std::string job_text(const std::string& world) {
  return "name = \"check\"\ndata = \"" + shared_data().string() + "\"\nworld = \"" +
         std::string(TERRACAST_SOURCE_DIR) + "/configs/worlds/" + world + ".toml\"\n" + R"(
[[rigs]]
name = "one"
mount_pitch_deg = 90.0

[[rigs.cameras]]
name = "down"
width_px = 640
height_px = 480
fx_px = 600.0
fy_px = 600.0

[[trajectories]]
name = "P000"
kind = "orbit"
centre = {east_m = 0.0, north_m = 0.0, height_m = 400.0, above = "ground"}
radius_m = 1000.0
speed_mps = 60.0
rate_hz = 0.2
num_frames = 16
)";
}

TEST_P(WorldCheckFull, FindsNothing) {
  TERRACAST_NEEDS_FULL();
  if (!GetParam().data.empty()) TERRACAST_NEEDS_SHARED_DATA(GetParam().data);
  const ScratchFolder folder;
  const fs::path config = write_text(folder / "job.toml", job_text(GetParam().name));
  const auto tiled = run_program(
      {"tile", config.string(), "--out", (folder / "out").string(), "-q"}, {.timeout_s = 7200.0});
  ASSERT_EQ(tiled.status, 0) << tiled.output;
  const auto checked = run_program({"world", "check", (folder / "out/world").string(), "-q"});
  EXPECT_EQ(checked.status, 0) << checked.output;
  record("world_check", GetParam().name, "```\n" + checked.output + "```\n");
}

INSTANTIATE_TEST_SUITE_P(Worlds, WorldCheckFull,
                         testing::Values(Shipped{"archipelago", ""}, Shipped{"alpine", ""},
                                         Shipped{"plains", ""},
                                         Shipped{"andorra_settled", "andorra/andorra.osm.pbf"},
                                         Shipped{"monaco_settled", "monaco/monaco.osm.pbf"},
                                         Shipped{"bilbao_settled", "bilbao/bilbao_CDSM.tif"}),
                         [](const auto& world) { return world.param.name; });

}  // namespace
}  // namespace terracast::test
