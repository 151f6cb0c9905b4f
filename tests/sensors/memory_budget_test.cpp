#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::sensors {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;
constexpr double kBudget_bytes = 128.0 * kMiB;

double rolling_hills_m(double x, double y) {
  return 90.0 * std::sin(x * 0.004) * std::cos(y * 0.005) + 12.0 * std::sin(x * 0.05 + y * 0.03);
}

/// What terracast_memory_probe printed.
struct Probe {
  test::ProgramResult run;
  double num_tiles = 0.0;
  double num_loaded = 0.0;
  double peak_tile_bytes = 0.0;
  std::string hashes;
};

Probe probe(const std::filesystem::path& world, double budget_bytes) {
  Probe probe;
  probe.run =
      test::run_command(TERRACAST_MEMORY_PROBE, {world.string(), std::to_string(budget_bytes)});
  std::istringstream text(probe.run.output);
  std::string word;
  text >> word >> probe.num_tiles >> word >> probe.num_loaded >> word >> probe.peak_tile_bytes;
  std::getline(text, probe.hashes, '\0');
  return probe;
}

TEST(MemoryBudget, AFrameOfFourTimesTheBudgetHasTheSameBytesWithinIt) {
  const test::ScratchFolder folder;
  test::TinyWorldOptions fine;
  fine.coarsest_level = 0;
  fine.num_roots = 26;  // 6.7 km x 6.7 km of 1 m
  test::make_tiny_world(folder / "fine", rolling_hills_m, fine);
  test::TinyWorldOptions coarse;
  coarse.finest_level = 5;
  coarse.coarsest_level = 5;
  test::make_tiny_world(folder / "empty", rolling_hills_m, coarse);

  const Probe all = probe(folder / "fine", 8e9);
  ASSERT_EQ(all.run.status, 0) << all.run.output;
  const Probe within = probe(folder / "fine", kBudget_bytes);
  ASSERT_EQ(within.run.status, 0) << within.run.output;
  const Probe empty = probe(folder / "empty", 8e9);
  ASSERT_EQ(empty.run.status, 0) << empty.run.output;

  EXPECT_GT(all.peak_tile_bytes / all.num_loaded * all.num_tiles, 1024.0 * kMiB);
  EXPECT_GT(all.peak_tile_bytes, 512.0 * kMiB);
  EXPECT_EQ(within.hashes, all.hashes);
  EXPECT_LE(within.peak_tile_bytes, kBudget_bytes);
  EXPECT_GT(within.num_loaded, all.num_loaded);
  EXPECT_LE(within.run.peak_rss_bytes, 1.2 * kBudget_bytes + empty.run.peak_rss_bytes);
}

}  // namespace
}  // namespace terracast::sensors
