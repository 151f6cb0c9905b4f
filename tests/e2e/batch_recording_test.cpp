#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "tests/e2e/hills_job.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// Batches whose flights are recorded in files, which may change.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

/// A flight to the east over the hills.
/// north_m   of the world's origin
void write_flight(const fs::path& file, double north_m) {
  std::string text = "time_s,east_m,north_m,up_m\n";
  for (int t = 0; t <= 20; ++t) text += fmt::format("{},{},{},0\n", t, -800 + 80 * t, north_m);
  core::write_file(file, text);
}

std::string recorded_job_text() {
  std::string text =
      replaced(hills_job_text(), "finest_spacing_m = 1.0", "finest_spacing_m = 16.0");
  text.resize(text.find("[[sweep.list]]"));
  const std::size_t begin = text.find("[[trajectories]]");
  return text.replace(begin, text.find("[conditions]") - begin, R"([[trajectories]]
name = "P000"
kind = "recorded"
file = "flight.csv"
format = "csv"
frame = "local"
place_columns = ["east_m", "north_m", "up_m"]
origin = {lat_deg = 46.5, lon_deg = 7.5, height_m = 900.0}
rate_hz = 1.0
num_frames = 3

)");
}

ProgramResult run(const fs::path& job) {
  return run_program({"batch", "run", job.string(), "--retry", "--max-tries", "1", "-q", "--stage",
                      "tile", "--stage", "render", "--stage", "export"});
}

TEST(BatchRecording, AChangedFileIsRefusedByNameAndAnUpdateFliesItAnew) {
  const ScratchFolder scratch;
  write_hills(scratch.path());
  const fs::path config = write_text(scratch / "recorded.toml", recorded_job_text());
  const fs::path flight = scratch / "flight.csv";
  const fs::path job = scratch / "job";
  write_flight(flight, -300.0);
  ASSERT_EQ(plan_hills(config, job).status, 0);

  write_flight(flight, 300.0);  // as many frames
  const auto refused = run(job);
  EXPECT_NE(refused.status, 0);
  EXPECT_THAT(refused.output, AllOf(HasSubstr(flight.string()),
                                    HasSubstr("is not the one that the plan was made with")));
  EXPECT_FALSE(fs::exists(job / "dataset/kitti"));

  write_flight(flight, -300.0);
  const auto ran = run(job);
  ASSERT_EQ(ran.status, 0) << ran.output;
  const auto unchanged = plan_hills(config, job, true);
  EXPECT_THAT(unchanged.output, HasSubstr("nothing has changed; revision 1 stays"));

  write_flight(flight, 300.0);
  const auto updated = plan_hills(config, job, true);
  EXPECT_EQ(updated.status, 0) << updated.output;
  EXPECT_THAT(updated.output, HasSubstr("0 shards stay done"));
  const auto reran = run(job);
  ASSERT_EQ(reran.status, 0) << reran.output;

  const fs::path fresh = scratch / "fresh";
  ASSERT_EQ(plan_hills(config, fresh).status, 0);
  ASSERT_EQ(run(fresh).status, 0);
  EXPECT_EQ(first_difference(job / "dataset", fresh / "dataset"), "");
}

}  // namespace
}  // namespace terracast::test
