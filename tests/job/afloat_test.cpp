#include "job/afloat.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/error.h"
#include "job/stages.h"
#include "tests/support/expect_error.h"
#include "tests/support/street_job.h"
#include "tests/support/test_data.h"

namespace terracast::job {
namespace {

/// The job over streets with a lake north of them, from x 200 m to 500 m and y 550 m to 800 m, and a ship that goes
/// from one place to another.
class Afloat : public testing::Test {
 protected:
  Job job_with(const std::string& from, const std::string& to, const std::string& keys = "",
               const std::string& more_water = "") {
    std::ofstream(folder / "lake.geojson") << R"({"type":"FeatureCollection","features":[)"
                                           << water(200, 550, 500, 800) << more_water << "]}";
    std::ofstream(folder / "job.toml") << test::street_job_text(
        folder.path(), 4, "[[world.layer]]\nkind = \"water\"\nfiles = [\"lake.geojson\"]\n",
        fmt::format("[[rigs]]\nname = \"one\"\n[[rigs.cameras]]\nname = \"cam\"\nwidth_px = 64\n"
                    "height_px = 48\nfx_px = 48.0\n\n[[moving]]\nname = \"ship\"\n"
                    "thing = \"ferry\"\nkind = \"waypoints\"\nspeed_mps = 40.0\n"
                    "waypoints = [{{{}}}, {{{}}}]\n{}",
                    from, to, keys));
    return prepare_job(load_run_config(folder / "job.toml", {}), context);
  }
  /// A feature from one corner to the other.
  static std::string water(double west, double south, double east, double north) {
    const auto place = [](double x, double y) {
      return fmt::format("[{:.9f},{:.9f}]", 7.0 + x / 77464.0, 46.0 + y / 111147.0);
    };
    return R"({"type":"Feature","properties":{"natural":"water"},)"
           R"("geometry":{"type":"Polygon","coordinates":[[)" +
           place(west, south) + "," + place(east, south) + "," + place(east, north) + "," +
           place(west, north) + "," + place(west, south) + "]]}}";
  }
  static void check(const Job& job, const core::Context& context) {
    check_afloat(job.sequences.at(0).moving, *lay_out_world(job, context));
  }

  const test::ScratchFolder folder;
  const core::Log log{"test", core::LogLevel::Off};
  const core::Context context{.log = log};
};

TEST_F(Afloat, WhatIsFarFromWaterIsRefusedBeforeTiling) {
  const std::string on_lake = "east_m = 350.0, north_m = 700.0";
  const std::string ashore = "east_m = 350.0, north_m = 430.0";  // 120 m from the lake
  const std::string inland = "east_m = 350.0, north_m = 370.0";  // 180 m
  check(job_with(on_lake, "east_m = 352.0, north_m = 600.0"), context);
  check(job_with(ashore, on_lake), context);
  check(job_with(inland, on_lake, "ride = \"ground\"\n"), context);
  // At 20 m a frame it would be too far after its 15th; it has 4.
  check(job_with(on_lake, inland), context);
  const Job job = job_with(inland, on_lake);
  test::expect_error(core::ErrorKind::Input,
                     {"ship at frame 0", "x 350.", "y 370.", "160 m", "sequence P000"},
                     [&] { tile(job, folder / "world", context); });
  EXPECT_FALSE(std::filesystem::exists(folder / "world"));
}

/// Seen in November 2026: a canal between the rings of places that were looked at was no water.
TEST_F(Afloat, ACanalOfTenMetresIsWater) {
  const std::string inland = "east_m = 350.0, north_m = 370.0";  // 180 m from the lake
  const std::string on = "east_m = 352.0, north_m = 370.0";
  EXPECT_THROW(check(job_with(inland, on), context), core::Error);
  for (const double away_m : {22.0, 62.0, 142.0}) {
    SCOPED_TRACE(away_m);
    check(
        job_with(inland, on, "", "," + water(200.0, 370.0 - away_m - 10.0, 500.0, 370.0 - away_m)),
        context);
  }
}

}  // namespace
}  // namespace terracast::job
