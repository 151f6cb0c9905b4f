#include "core/packet_code.h"

#include <gtest/gtest.h>

#include "tests/support/frame_hashes.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::render {
namespace {

// The same program but for the instruction set of its packet code: another build, run beside this
// one.
TEST(PacketCode, IsTheSameToTheLastBitWithAndWithoutAvx2) {
  if (!__builtin_cpu_supports("avx2"))
    GTEST_SKIP() << "SKIPPED: this processor has no AVX2: both would run the baseline code";
  const test::ScratchFolder folder;
  const std::string with_avx2 = test::frame_hashes(folder / "with");
  const test::ProgramResult baseline =
      test::run_command(TERRACAST_BASELINE_PROGRAM, {(folder / "without").string()});
  ASSERT_EQ(baseline.status, 0) << baseline.output;
  EXPECT_EQ(baseline.output, with_avx2);
}

}  // namespace
}  // namespace terracast::render
