// How images were made stands beside a dataset whose cameras are more than pinholes that see an instant.

#include "export/imaging_record.h"

#include "core/json.h"
#include "tests/export/exported.h"

namespace terracast::test {
namespace {

using core::Json;

TEST(ImagingRecord, SaysHowEachCameraWasExposedAndMadeItsImages) {
  const ScratchFolder scratch;
  TinyCaptureOptions options;
  options.num_frames = 3;
  options.has_tartan2 = false;
  write_tiny_capture(scratch / "plain", options);
  run_export(scratch / "plain", "format = \"colmap\"", scratch / "plain_out");
  for (const auto& [file, hash] : file_hashes(scratch / "plain_out"))
    EXPECT_EQ(file.find("imaging"), std::string::npos) << file;

  options.has_imaging = true;
  write_tiny_capture(scratch / "capture", options);
  run_export(scratch / "capture", "format = \"colmap\"", scratch / "out");
  const Json file = Json::read(scratch / "out/colmap/valley/imaging.json");
  const Json& cameras = file.at("cameras");
  ASSERT_EQ(cameras.size(), 4u);
  EXPECT_EQ(cameras.at(std::size_t{0}).at("name").string(), "mcs4/cam0");
  EXPECT_EQ(cameras.at(std::size_t{0}).at("exposure_s").number(), 0.008);
  EXPECT_FALSE(cameras.at(std::size_t{0}).has("settings"));
  EXPECT_EQ(cameras.at(std::size_t{1}).at("exposure_s").number(), 0.0);
  EXPECT_EQ(cameras.at(std::size_t{1}).at("settings").string(), "[color]\nsaturation = 1.25\n");
  EXPECT_EQ(cameras.at(std::size_t{1}).at("exposure_ev").numbers(),
            (std::vector<double>{0.0, 0.25, 0.5}));
  const Json dataset = Json::read(scratch / "out/colmap/dataset.json");
  EXPECT_NE(dataset.at("additions").text().find("imaging.json"), std::string::npos);
  EXPECT_TRUE(dataset.at("files").has("valley/imaging.json"));
}

}  // namespace
}  // namespace terracast::test
