// Labels by the program: `run` makes what formats need; stage by stage the same bytes come out.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

/// The tiny job low over trees, in COCO.
std::string wooded_job() {
  std::string text = replaced(tiny_job_text(), "height_m = 250.0", "height_m = 150.0");
  text = replaced(text, "format = \"colmap\"", "format = \"coco\"\ncategories = \"own\"");
  return replaced(
      text, "[detail]\n",
      "[[world.layer]]\nname = \"cover\"\nkind = \"land_cover\"\nsource = \"derived\"\n\n"
      "[[world.layer]]\nname = \"trees\"\nkind = \"vegetation\"\n\n[detail]\n");
}

TEST(Labels, StageByStageTheyAreThoseOfRun) {
  const ScratchFolder folder;
  const std::string job = write_text(folder / "job.toml", wooded_job()).string();
  const std::string out = (folder / "out").string(), again = (folder / "again").string();
  const ProgramResult run = run_program({"run", job, "--out", out});
  ASSERT_EQ(run.status, 0) << run.output;
  EXPECT_THAT(run.output, testing::HasSubstr("label"));
  EXPECT_TRUE(fs::exists(folder / "out/capture/P000/labels/objects/objects.json"));

  const std::string world = (folder / "out/world").string();
  ASSERT_EQ(run_program({"render", job, "--out", again, "--world", world}).status, 0);
  // Before they are labelled objects have no boxes.
  const ProgramResult unlabelled = run_program({"export", job, "--out", again});
  EXPECT_EQ(unlabelled.status, 3) << unlabelled.output;
  EXPECT_THAT(unlabelled.output, testing::HasSubstr("terracast label"));
  const ProgramResult label =
      run_program({"label", job, "--out", again, "--world", world, "--threads", "1"});
  ASSERT_EQ(label.status, 0) << label.output;
  ASSERT_EQ(run_program({"export", job, "--out", again}).status, 0);
  for (const char* part : {"capture", "export"})
    EXPECT_EQ(first_difference(folder / "out" / part, folder / "again" / part), "") << part;
}

TEST(Labels, WhatIsNotAskedForIsNotMade) {
  const ScratchFolder folder;
  const std::string job = write_text(folder / "job.toml", tiny_job_text()).string();
  const ProgramResult nothing = run_program({"label", job, "--out", (folder / "out").string()});
  EXPECT_EQ(nothing.status, 2) << nothing.output;
  EXPECT_THAT(nothing.output, testing::HasSubstr("--what"));
  const ProgramResult unknown =
      run_program({"label", job, "--out", (folder / "out").string(), "--what", "cloudz"});
  EXPECT_EQ(unknown.status, 2) << unknown.output;
}

}  // namespace
}  // namespace terracast::test
