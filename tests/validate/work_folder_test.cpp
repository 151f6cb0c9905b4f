#include "validate/colmap/work_folder.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "core/atomic_file.h"
#include "tests/support/test_data.h"

namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using test::ScratchFolder;

struct Cut : std::runtime_error {
  Cut() : std::runtime_error("cut off") {}
};

TEST(WorkFolder, AStepIsMadeOnceForEachKey) {
  const ScratchFolder scratch;
  int num_made = 0;
  const auto make = [&](const fs::path& folder) {
    core::write_file(folder / "result", std::to_string(++num_made));
  };
  for (int turn = 0; turn < 2; ++turn) {
    const fs::path made = WorkFolder(scratch / "work").made("step", "from a", make);
    EXPECT_EQ(core::read_text_file(made / "result"), "1");
  }
  const fs::path again = WorkFolder(scratch / "work").made("step", "from b", make);
  EXPECT_EQ(core::read_text_file(again / "result"), "2");
}

TEST(WorkFolder, AStepThatWasCutOffIsMadeAnewFromNothing) {
  const ScratchFolder scratch;
  const WorkFolder work(scratch / "work");
  EXPECT_THROW(work.made("step", "key",
                         [](const fs::path& folder) {
                           core::write_file(folder / "half", "half");
                           throw Cut();
                         }),
               Cut);
  EXPECT_FALSE(fs::exists(work.path() / "step"));
  const fs::path made = work.made("step", "key", [](const fs::path& folder) {
    EXPECT_TRUE(fs::is_empty(folder));
    core::write_file(folder / "whole", "whole");
  });
  EXPECT_TRUE(fs::exists(made / "whole"));
  EXPECT_FALSE(fs::exists(made / "half"));
}

struct Chain : testing::Test {
  ScratchFolder scratch;
  std::string calls;
  int cut_at = -1;

  fs::path grow(const std::vector<std::string>& keys) {
    std::vector<WorkFolder::Step> steps;
    for (std::size_t i = 0; i < keys.size(); ++i)
      steps.push_back({.key = keys[i], .grow = [this, i, &keys](const fs::path& folder) {
                         const fs::path file = folder / "all";
                         const std::string before =
                             fs::exists(file) ? core::read_text_file(file) : "";
                         calls += keys[i];
                         core::write_file(file, before + keys[i]);
                         if (static_cast<int>(i) == cut_at) throw Cut();
                       }});
    return WorkFolder(scratch / "work").grown("chain", steps);
  }
};

TEST_F(Chain, EachStepStartsFromWhatTheOneBeforeLeftAndOnlyTheNewestIsKept) {
  EXPECT_EQ(core::read_text_file(grow({"a", "b", "c"}) / "all"), "abc");
  EXPECT_EQ(calls, "abc");
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch / "work"), fs::directory_iterator()), 1);
  grow({"a", "b", "c"});
  EXPECT_EQ(calls, "abc");
}

TEST_F(Chain, GoesOnWithTheStepThatWasCut) {
  cut_at = 2;
  EXPECT_THROW(grow({"a", "b", "c", "d"}), Cut);
  EXPECT_EQ(calls, "abc");
  cut_at = -1;
  EXPECT_EQ(core::read_text_file(grow({"a", "b", "c", "d"}) / "all"), "abcd");
  EXPECT_EQ(calls, "abccd");
}

TEST_F(Chain, IsGrownAnewWhenAnEarlierStepIsAnother) {
  grow({"a", "b", "c"});
  EXPECT_EQ(core::read_text_file(grow({"x", "b", "c"}) / "all"), "xbc");
  EXPECT_EQ(calls, "abcxbc");
}

TEST_F(Chain, OfALongerOneNothingIsLeft) {
  grow({"a", "b", "c", "d"});
  const auto newest = grow({"x", "y"});
  EXPECT_EQ(core::read_text_file(newest / "all"), "xy");
  int num_folders = 0;
  for ([[maybe_unused]] const auto& entry :
       std::filesystem::directory_iterator(newest.parent_path()))
    ++num_folders;
  EXPECT_EQ(num_folders, 1);
}

}  // namespace
}  // namespace terracast::validate
