#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <random>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/reading_apart.h"
#include "core/stop.h"
#include "tests/support/expect_error.h"
#include "tests/support/record.h"
#include "tests/support/test_data.h"
#include "world/vdb/vdb_file.h"

/// Volumes whose bytes are wrong here and there, which OpenVDB believes: the process that reads them may end as it will.
namespace terracast::test {
namespace {

using core::ErrorKind;

world::Volume ball() {
  constexpr int kSide = 24;
  world::Volume volume;
  volume.name = "density";
  volume.size = {kSide, kSide, kSide};
  volume.voxel_m = 2.0;
  volume.density.resize(kSide * kSide * kSide);
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) {
        const double r = (Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(11.5)).norm();
        volume.density[volume.index(x, y, z)] =
            static_cast<std::uint8_t>(std::max(0.0, 255.0 - 20.0 * r));
      }
  return volume;
}

// With one byte wrong, or a stretch of them, a file is read, or refused with its name. Here, in this process, some of
// these end it: OpenVDB writes beyond its blocks.
TEST(HostileVolumes, AreReadOrRefusedByName) {
  const ScratchFolder folder;
  const world::Volume volume = ball();
  const world::VdbGrid grid{.name = "density", .volume = &volume};
  const std::vector<std::byte> right = world::encode_vdb({&grid, 1});
  std::mt19937 random(20261130);
  const int num_files = is_recorded_run() ? 2000 : 60;
  int num_refused = 0;
  for (int i = 0; i < num_files; ++i) {
    std::vector<std::byte> bytes = right;
    const std::size_t at = random() % bytes.size();
    const std::size_t length = i % 3 == 0 ? 1 + random() % 16 : 1;
    for (std::size_t k = at; k < std::min(at + length, bytes.size()); ++k)
      bytes[k] = static_cast<std::byte>(random());
    if (i % 10 == 9) bytes.resize(at);
    const auto file = folder / fmt::format("{}.vdb", i);
    core::write_file(file, bytes);
    try {
      const world::Volume read = world::read_vdb(file, {});
      EXPECT_EQ(read.density.size(), static_cast<std::size_t>(read.size.prod()));
    } catch (const core::Error& error) {
      ++num_refused;
      EXPECT_TRUE(error.kind() == ErrorKind::Input) << i << ": " << error.what();
      EXPECT_NE(std::string(error.what()).find(file.filename().string()), std::string::npos)
          << error.what();
    }
    std::filesystem::remove(file);
  }
  EXPECT_GT(num_refused, num_files / 10);
}

TEST(ReadingApart, EndsWithinMomentsWhereAStopIsAsked) {
  const ScratchFolder folder;
  const std::string pipe = folder / "pipe.vdb";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const core::Json request = core::Json::object()
                                 .set("file", core::path_for_request(pipe))
                                 .set("grid", "")
                                 .set("unit_m", 1.0)
                                 .set("voxel_m", 0.0)
                                 .set("full", 0.0)
                                 .set("is_upward_y", false);
  // The public function takes regular files alone.
  expect_error(ErrorKind::Io, {"pipe.vdb"}, [&] { world::read_vdb(pipe, {}); });
  // Nobody writes into the pipe: its reader waits for ever.
  using Clock = std::chrono::steady_clock;
  Clock::time_point asked;
  std::thread asker([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(700));
    asked = Clock::now();
    core::ask_to_stop();
  });
  expect_error(ErrorKind::Interrupted, {}, [&] { core::read_apart("vdb", request, pipe); });
  asker.join();
  core::forget_stop();
  EXPECT_LT(std::chrono::duration<double>(Clock::now() - asked).count(), 2.0);
}

TEST(ReadingApart, TellsWhatItCannotRead) {
  expect_error(ErrorKind::Internal, {"reads no tea leaves"},
               [&] { core::read_apart("tea leaves", core::Json::object(), "cup"); });
  // What a reader throws comes back as it was.
  expect_error(ErrorKind::Input, {"grid"},
               [&] { core::read_apart("vdb", core::Json::object().set("file", "x"), "x"); });
}

}  // namespace
}  // namespace terracast::test
