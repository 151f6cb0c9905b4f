#include <gtest/gtest.h>

#include "core/log.h"
#include "job/job.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/test_data.h"

/// Over which times states are extended: lines by the time in which they are exposed, what moves also until the next
/// frame where a sensor may look then.
namespace terracast::job {
namespace {

render::SequencePlan plan_of(const std::string& sensor) {
  const test::ScratchFolder scratch;
  const core::Log log("test", core::LogLevel::Off);
  std::string text = test::tiny_job_text(
      "[[moving]]\nname = \"car\"\nthing = \"hatchback\"\nride = \"free\"\nkind = \"orbit\"\n"
      "radius_m = 50.0\nspeed_mps = 5.0\ncentre = {east_m = 0.0, north_m = 0.0, height_m = 100.0}\n");
  text = test::replaced(text, "offset_mm = [0.0, -500.0, 0.0]\n",
                        "offset_mm = [0.0, -500.0, 0.0]\nline_time_us = 1000.0\n" + sensor);
  const auto file = test::write_text(scratch / "job.toml", text);
  return prepare_job(load_run_config(file, {}), {.log = log}).sequences.at(0);
}

TEST(Reach, OfLinesIsTheSameBesideASensor) {
  const render::SequencePlan alone = plan_of("");
  const render::SequencePlan beside =
      plan_of("\n[[rigs.sensors]]\nname = \"laser\"\nkind = \"rangefinder\"\nrate_hz = 20.0\n");
  ASSERT_EQ(alone.states.size(), beside.states.size());
  for (std::size_t i = 0; i < alone.states.size(); ++i) {
    EXPECT_EQ(alone.states[i], beside.states[i]) << i;
    // 120 lines of 1 ms.
    EXPECT_LE(alone.states[i].terms.reach_s, 0.061);
    EXPECT_GT(alone.states[i].terms.reach_s, 0.059);
    EXPECT_EQ(alone.moving.at(0).states[i]->terms.reach_s, alone.states[i].terms.reach_s);
    // At 1 Hz.
    EXPECT_EQ(beside.moving.at(0).states[i]->terms.reach_s, 0.5);
  }
}

}  // namespace
}  // namespace terracast::job
