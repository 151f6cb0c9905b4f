#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <limits>
#include <map>
#include <random>

#include "core/random.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

TEST(Determinism, ThreadsShardsAndLocalBudgetDoNotChangeTheCapture) {
  const ScratchFolder scratch;
  const auto config = write_text(scratch / "job.toml", tiny_job_text()).string();
  const auto out = [&](const char* name) { return (scratch / name).string(); };

  for (const char* threads : {"1", "2"}) {
    const auto run =
        run_program({"run", config, "--out", out(threads), "--threads", threads, "-q"});
    ASSERT_EQ(run.status, 0) << run.output;
  }
  EXPECT_EQ(first_difference(scratch / "1/world", scratch / "2/world"), "");
  EXPECT_EQ(first_difference(scratch / "1/capture", scratch / "2/capture"), "");
  EXPECT_EQ(first_difference(scratch / "1/export", scratch / "2/export"), "");

  const auto world = (scratch / "1/world").string();
  for (const char* shard : {"1/2", "0/2"}) {
    const auto run = run_program(
        {"render", config, "--out", out("halves"), "--world", world, "--shard", shard, "-q"});
    ASSERT_EQ(run.status, 0) << run.output;
  }
  EXPECT_EQ(first_difference(scratch / "1/capture", scratch / "halves/capture"), "");

  const auto small = run_program({"render", config, "--out", out("small"), "--world", world,
                                  "--set", "tracing.memory_bytes=64e6", "-q"});
  ASSERT_EQ(small.status, 0) << small.output;
  EXPECT_EQ(first_difference(scratch / "1/capture", scratch / "small/capture"), "");
}

bool is_temporary(const fs::path& file) {
  return file.filename().string().starts_with(".terracast-tmp-");
}

/// When each frame of a capture was finished. A record that is still being written, or that a kill
/// left so, has a temporary name with the same ending: it is no finished frame.
std::map<std::string, fs::file_time_type> finished_frames(const fs::path& captures) {
  std::map<std::string, fs::file_time_type> times;
  if (!fs::exists(captures)) return times;
  for (const auto& entry : fs::recursive_directory_iterator(captures)) {
    const fs::path& file = entry.path();
    if (file.parent_path().filename() == "frames" && file.extension() == ".json" &&
        !is_temporary(file))
      times[file.string()] = entry.last_write_time();
  }
  return times;
}

// At 20 moments in a recorded run, else at 4.
TEST(Resume, KilledAtRandomMomentsItEndsInTheSameBytesAndRepeatsNoFrame) {
  const ScratchFolder scratch;
  // Coarse ground: tiling is not to take most of the moments.
  const auto config =
      write_text(scratch / "job.toml",
                 replaced(tiny_job_text(), "finest_spacing_m = 4.0", "finest_spacing_m = 16.0"))
          .string();
  // Moments are drawn within the shortest run seen: the machine may have been busy in the first.
  double duration_s = std::numeric_limits<double>::infinity();
  const auto timed_run = [&](const fs::path& out, double kill_after_s) {
    const auto start = std::chrono::steady_clock::now();
    const auto run =
        run_program({"run", config, "--out", out.string(), "-q"}, {.kill_after_s = kill_after_s});
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (run.status == 0) duration_s = std::min(duration_s, elapsed.count());
    return run;
  };
  constexpr double kNever = -1.0;
  const auto reference = timed_run(scratch / "whole", kNever);
  ASSERT_EQ(reference.status, 0) << reference.output;

  constexpr std::uint64_t kSeed = 20;  // give another to reproduce a failure
  const int num_kills = is_recorded_run() ? 20 : 4;
  int num_killed = 0;
  for (int moment = 0; num_killed < num_kills; ++moment) {
    ASSERT_LT(moment, 3 * num_kills) << "most kills came after the end: the test saw nothing";
    const auto out = scratch / ("killed" + std::to_string(moment));
    const double kill_after_s = core::random_between(0.0, duration_s, kSeed, 0, moment);
    const auto killed = timed_run(out, kill_after_s);
    num_killed += killed.status == -SIGKILL ? 1 : 0;
    const auto before = finished_frames(out / "capture");
    const auto resumed = run_program({"run", config, "--out", out.string(), "-q"});
    ASSERT_EQ(resumed.status, 0) << "killed after " << kill_after_s << " s\n" << resumed.output;
    const auto after = finished_frames(out / "capture");
    for (const auto& [frame, time] : before) {
      ASSERT_TRUE(after.contains(frame)) << frame << " is gone after a kill at " << kill_after_s;
      EXPECT_EQ(after.at(frame), time)
          << frame << " was rendered again after a kill at " << kill_after_s << " s";
    }
    for (const char* part : {"world", "capture", "export"})
      EXPECT_EQ(first_difference(scratch / "whole" / part, out / part), "")
          << "killed after " << kill_after_s << " s";
    fs::remove_all(out);
  }
}

int num_temporaries(const fs::path& folder) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    count += is_temporary(entry.path()) ? 1 : 0;
  return count;
}

TEST(Stopping, AskedByASignalARunEndsSoonAndWholeAndGoesOnToTheSameBytes) {
  const ScratchFolder scratch;
  const std::string text =
      replaced(replaced(tiny_job_text(), "finest_spacing_m = 4.0", "finest_spacing_m = 16.0"),
               "num_frames = 4", "num_frames = 20");
  const auto config = write_text(scratch / "job.toml", text).string();
  const auto out = scratch / "stopped";
  std::size_t num_finished = 0;  // when the signal was sent
  const auto is_in_the_middle = [&] {
    num_finished = finished_frames(out / "capture").size();
    return num_finished >= 5;
  };
  const auto stopped = run_program({"run", config, "--out", out.string(), "-q"},
                                   {.terminate_when = is_in_the_middle});
  EXPECT_EQ(stopped.status, 75) << stopped.output;
  EXPECT_EQ(stopped.output, "stopped on request; run the same command again to go on\n");
  const auto before = finished_frames(out / "capture");
  // Two frames may be in work when the signal comes, and some end before it is sent.
  EXPECT_LE(before.size(), num_finished + 6);
  EXPECT_EQ(num_temporaries(out), 0);

  const auto resumed = run_program({"run", config, "--out", out.string(), "-q"});
  ASSERT_EQ(resumed.status, 0) << resumed.output;
  const auto after = finished_frames(out / "capture");
  for (const auto& [frame, time] : before)
    EXPECT_EQ(after.at(frame), time) << frame << " was rendered again";
  const auto whole = run_program({"run", config, "--out", (scratch / "whole").string(), "-q"});
  ASSERT_EQ(whole.status, 0) << whole.output;
  for (const char* part : {"world", "capture", "export"})
    EXPECT_EQ(first_difference(scratch / "whole" / part, out / part), "");
}

}  // namespace
}  // namespace terracast::test
