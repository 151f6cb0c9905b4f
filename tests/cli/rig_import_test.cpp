#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "core/atomic_file.h"
#include "core/log.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kChain =
    "cam0:\n  camera_model: pinhole\n  distortion_model: none\n  resolution: [64, 48]\n"
    "  intrinsics: [30.0, 30.0, 31.5, 23.5]\n  timeshift_cam_imu: 0.0342\n  serial: 17\n";

struct Said {
  int status;
  std::string out, err;
};

Said run(const std::vector<std::string>& words) {
  std::vector<const char*> command = {"terracast"};
  for (const std::string& word : words) command.push_back(word.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int status = run_command_line(static_cast<int>(command.size()), command.data());
  Said said{status, testing::internal::GetCapturedStdout(), ""};
  said.err = testing::internal::GetCapturedStderr();
  return said;
}

fs::path folder_of_test(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / ("rig_import_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

TEST(RigImport, TellsWhatItDoesNotUse) {
  const fs::path file = folder_of_test("tells") / "chain.yaml";
  core::write_file(file, kChain);
  const Said said = run({"rig", "import", file.string()});
  EXPECT_EQ(said.status, 0);
  EXPECT_THAT(said.out, HasSubstr("fx_px = 30"));
  EXPECT_THAT(said.out, Not(HasSubstr("timeshift")));
  EXPECT_THAT(said.err, HasSubstr("camN.serial is not known"));
  EXPECT_THAT(said.err, HasSubstr("not used: camN.timeshift_cam_imu"));
}

TEST(RigImport, ShowsALedgerInsteadOfTheRig) {
  const fs::path file = folder_of_test("ledger") / "chain.yaml";
  core::write_file(file, kChain);
  const fs::path rig = file.parent_path() / "rig.toml";
  const Said said = run({"rig", "import", file.string(), "--ledger", "-o", rig.string()});
  EXPECT_EQ(said.status, 0);
  for (const char* name : {"camN.intrinsics", "camN.serial", "camN.timeshift_cam_imu", "unknown"})
    EXPECT_THAT(said.out, HasSubstr(name));
  EXPECT_THAT(said.out, Not(HasSubstr("fx_px")));
  EXPECT_TRUE(fs::exists(rig));
}

TEST(RigImport, AFormatThatIsOnlyReadIsNotWritten) {
  const fs::path rig = fs::path(TERRACAST_SOURCE_DIR) / "configs/rigs/mcs4.toml";
  const fs::path out = folder_of_test("written") / "out.yaml";
  const Said said = run({"rig", "export", rig.string(), "--format", "ros", "-o", out.string()});
  EXPECT_EQ(said.status, 2);
  EXPECT_THAT(said.err, HasSubstr("only read"));
  EXPECT_THAT(said.err, HasSubstr("kalibr"));
  EXPECT_FALSE(fs::exists(out));
}

}  // namespace
}  // namespace terracast::cli
