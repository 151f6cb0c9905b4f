#include <cstdlib>

#include "core/environment.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/tiler/hostile_inputs.h"
#include "tests/tiler/raster_files.h"
#include "tiler/tile_stage.h"

// The same files give the same world, whatever variables whoever starts the program has set.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInputs = "TERRACAST_TEST_INPUTS";
constexpr const char* kOutput = "TERRACAST_TEST_OUTPUT";
constexpr const char* kUnsettled = "TERRACAST_TEST_UNSETTLED";

/// Not a test of its own: what the process does that others of this file start.
TEST(HostileEnvironment, DISABLED_TilesForTheOthers) {
  if (std::getenv(kInputs) == nullptr) GTEST_SKIP() << "is for the other tests of this file";
  const fs::path inputs = std::getenv(kInputs);
  const fs::path output = std::getenv(kOutput);
  if (std::getenv(kUnsettled) == nullptr) core::settle_environment();
  tiler::WorldOptions options =
      world_of_rasters({inputs / "point.tif", inputs / "grid.asc"}, 2048.0);
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  const core::Log log("tile", core::LogLevel::Off);
  tiler::TilePlan plan;
  plan.detail.finest_spacing_m = 16.0;
  tiler::run_tile_stage(*surface, plan, output, {.log = log, .num_threads = 1, .events_file = {}});
}

/// Runs this program once more, which tiles.
ProgramResult tile_in_another(const fs::path& inputs, const fs::path& output,
                              std::vector<std::string> variables) {
  variables.push_back(std::string(kInputs) + "=" + inputs.string());
  variables.push_back(std::string(kOutput) + "=" + output.string());
  variables.push_back(fs::read_symlink("/proc/self/exe").string());
  variables.push_back("--gtest_also_run_disabled_tests");
  variables.push_back("--gtest_filter=HostileEnvironment.DISABLED_TilesForTheOthers");
  return run_command("/usr/bin/env", variables);
}

TEST(HostileEnvironment, VariablesDoNotChangeTheWorld) {
  const ScratchFolder folder;
  fs::create_directories(folder / "inputs");
  write_inputs(folder / "inputs");
  const auto plain = tile_in_another(folder / "inputs", folder / "plain", {});
  ASSERT_EQ(plain.status, 0) << plain.output;
  const std::vector<std::string> variables = hostile_variables(folder / "home");
  const auto hostile = tile_in_another(folder / "inputs", folder / "hostile", variables);
  ASSERT_EQ(hostile.status, 0) << hostile.output;
  EXPECT_EQ(first_difference(folder / "plain", folder / "hostile"), "");

  // They would have spoilt it.
  std::vector<std::string> unsettled = variables;
  unsettled.push_back(std::string(kUnsettled) + "=1");
  EXPECT_NE(tile_in_another(folder / "inputs", folder / "unsettled", unsettled).status, 0);
}

}  // namespace
}  // namespace terracast::test
