#include "core/packet_code.h"

#include <gtest/gtest.h>

#include "tests/support/frame_hashes.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

// The same program but for the instruction set of its packet code: other builds, run beside this one, whose own code is
// that of the widest set the processor has.
class PacketCode : public testing::Test {
 protected:
  void SetUp() override {
    if (!__builtin_cpu_supports("avx2"))
      GTEST_SKIP() << "SKIPPED: this processor has no AVX2: all would run the baseline code";
  }
  std::string hashes_by(const char* program) {
    const test::ProgramResult result = test::run_command(program, {(folder_ / "world").string()});
    EXPECT_EQ(result.status, 0) << result.output;
    return result.output;
  }
  const test::ScratchFolder folder_;
};

TEST_F(PacketCode, IsTheSameToTheLastBitForAllInstructionSets) {
  const std::string baseline = hashes_by(TERRACAST_BASELINE_PROGRAM);
  EXPECT_EQ(baseline, test::frame_hashes(folder_ / "own")) << "the processor's own";
  if (!test::is_recorded_run())
    return;  // scripts/check builds the program for AVX2 in a recorded run only
  std::filesystem::remove_all(folder_ / "world");
  EXPECT_EQ(baseline, hashes_by(TERRACAST_AVX2_PROGRAM)) << "AVX2";
}

}  // namespace
}  // namespace terracast::sensors
