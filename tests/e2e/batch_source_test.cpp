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

/// Batches over heights that do not stand in one plain file, which may change.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr const char* kVrt =
    R"(<VRTDataset rasterXSize="1201" rasterYSize="1201">
  <SRS>EPSG:4326</SRS>
  <GeoTransform>6.999583333333333, 0.0008333333333333334, 0, 47.00041666666667, 0, -0.0008333333333333334</GeoTransform>
  <VRTRasterBand dataType="Int16" band="1">
    <NoDataValue>-32768</NoDataValue>
    <SimpleSource>
      <SourceFilename relativeToVRT="1">N46E007.hgt</SourceFilename>
      <SourceBand>1</SourceBand>
    </SimpleSource>
  </VRTRasterBand>
</VRTDataset>
)";

ProgramResult run(const fs::path& job) {
  return run_program({"batch", "run", job.string(), "-q", "--stage", "tile", "--stage", "render",
                      "--stage", "export"});
}

class BatchSource : public testing::TestWithParam<const char*> {};

TEST_P(BatchSource, AChangeOfWhatASourceIsMadeOfIsTakenUpByAnUpdate) {
  const ScratchFolder scratch;
  write_hills(scratch.path());
  core::write_file(scratch / "hills.vrt", std::string_view(kVrt));
  const std::string source = replaced(GetParam(), "FOLDER", scratch.path().string());
  std::string text = replaced(
      replaced(replaced(hills_job_text(), "finest_spacing_m = 1.0", "finest_spacing_m = 16.0"),
               fmt::format("num_frames = {}", kNumFrames), "num_frames = 3"),
      "N46E007.hgt", source);
  text.resize(text.find("[[sweep.list]]"));
  const fs::path config = write_text(scratch / "hills.toml", text);
  const fs::path job = scratch / "job";
  const auto planned = plan_hills(config, job);
  ASSERT_EQ(planned.status, 0) << planned.output;
  const auto ran = run(job);
  ASSERT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(plan_hills(config, job, true).output, HasSubstr("nothing has changed; revision 1 stays"));

  write_hills(scratch.path(), 30.0, 46.4973, 7.4893);
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

INSTANTIATE_TEST_SUITE_P(OfManyFilesOrAPartOfOne, BatchSource,
                         testing::Values("FOLDER/hills.vrt",
                                         "/vsisubfile/0_2884802,FOLDER/N46E007.hgt"));

}  // namespace
}  // namespace terracast::test
