#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "tests/e2e/batch_job.h"
#include "tests/e2e/hills_job.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "world/tile_store.h"

/// What becomes of a tile that a user edited, which nobody can make again.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

/// A job whose world is tiled, and one of whose tiles is edited; the plan knows. Made once for the suite: `job` is
/// there for one test to change, `edited` for copies, and `unedited` as it was before the edit.
class BatchEdit : public testing::Test {
 protected:
  void SetUp() override {
    if (scratch_ == nullptr) make_jobs();
    ASSERT_TRUE(is_made_) << "the jobs that all tests begin with";
  }
  static void TearDownTestSuite() { scratch_.reset(); }

  static void make_jobs() {
    scratch_ = std::make_unique<ScratchFolder>();
    write_hills(scratch_->path());
    const std::string text =
        replaced(replaced(hills_job_text(), "finest_spacing_m = 1.0", "finest_spacing_m = 16.0"),
                 fmt::format("num_frames = {}", kNumFrames), "num_frames = 3");
    config_ = write_text(folder("flights.toml"), text).string();
    const fs::path job = folder("job");
    expect_well(plan(job));
    expect_well(run(job, {"tile"}));
    ASSERT_FALSE(HasFailure());
    copy_job(job, folder("unedited"));
    const fs::path store = world_of(job, "run0000");
    const world::TileId id = tile_below(store, -820.0, -300.0);
    edit_tile(store, id);
    tile_ = world::tile_path(store.parent_path(), id).lexically_relative(job);
    expect_well(plan(job, {"--update"}));
    copy_job(job, folder("edited"));
    is_made_ = !HasFailure();
  }

  static void expect_well(const ProgramResult& result) {
    EXPECT_EQ(result.status, 0) << result.output;
  }
  static fs::path folder(const char* name) { return *scratch_ / name; }
  static ProgramResult plan(const fs::path& job, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"batch", "plan", config_, "--out", job.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  static ProgramResult run(const fs::path& job,
                           const std::vector<std::string>& stages = {"tile", "render", "export"}) {
    std::vector<std::string> arguments = {"batch",       "run", job.string(), "--retry",
                                          "--max-tries", "1",   "-q"};
    for (const std::string& stage : stages) arguments.insert(arguments.end(), {"--stage", stage});
    return run_program(arguments);
  }
  /// The finest tile of a store at a place.
  static world::TileId tile_below(const fs::path& store_folder, double x_world, double y_world) {
    const auto store = world::TileStore::open(store_folder);
    world::TileId id = world::tile_at(store.manifest().finest_level, x_world, y_world);
    while (store.find(id) == nullptr) id = id.parent();
    return id;
  }
  /// A copy of the edited job.
  static fs::path copied(const char* name) {
    fs::remove_all(folder(name));
    copy_job(folder("edited"), folder(name));
    return folder(name);
  }
  /// The edited job run to its end, once for the suite.
  static fs::path whole() {
    if (!fs::exists(folder("whole"))) expect_well(run(copied("whole")));
    return folder("whole");
  }
  /// The job before the edit run to its end; the second time nothing is left to do.
  static fs::path unedited() {
    expect_well(run(folder("unedited")));
    return folder("unedited");
  }

  static inline std::unique_ptr<ScratchFolder> scratch_;
  static inline bool is_made_ = false;
  static inline std::string config_;
  static inline fs::path tile_;  ///< relative to a job
};

TEST_F(BatchEdit, ATileThatIsLostBeforeOrAfterItIsTiledIsNamedAndNothingIsMadeUntilItIsBack) {
  const fs::path whole = BatchEdit::whole();
  EXPECT_NE(first_difference(whole / "dataset", unedited() / "dataset"), "");
  for (const bool is_tiled : {false, true})
    for (const Damage damage : {Damage::Delete, Damage::Flip}) {
      SCOPED_TRACE(fmt::format("{}, {}", is_tiled, damage_name(damage)));
      const fs::path job = copied("damaged");
      if (is_tiled) expect_well(run(job, {"tile"}));
      const auto edited = core::read_file(job / tile_);
      ASSERT_TRUE(do_damage(job / tile_, damage, 7));
      for (int again = 0; again < 2; ++again) {
        const auto refused = run(job);
        EXPECT_NE(refused.status, 0);
        EXPECT_THAT(refused.output, AllOf(HasSubstr((job / tile_).string()),
                                          HasSubstr("this tile was edited, and is damaged")));
      }
      EXPECT_FALSE(fs::exists(job / "dataset/kitti/run0000"));
      if (is_tiled) {
        const auto verified = run_program({"batch", "verify", job.string(), "--repair"});
        EXPECT_EQ(verified.status, 1);
        EXPECT_THAT(verified.output, HasSubstr((job / tile_).string()));
      }
      core::write_file(job / tile_, edited);
      expect_well(run(job));
      EXPECT_EQ(first_difference(job / "dataset", whole / "dataset"), "");
      fs::remove_all(job);
    }
}

TEST_F(BatchEdit, DamageToWhatTheTilesAreMadeOfTakesNoEditedTileAway) {
  const fs::path job = copied("damaged");
  const fs::path inputs = job / tile_.parent_path().parent_path() / "inputs.json";
  ASSERT_TRUE(do_damage(inputs, Damage::Flip, 7));
  expect_well(run(job));
  EXPECT_EQ(first_difference(job / "dataset", whole() / "dataset"), "");
}

TEST_F(BatchEdit, AnUpdateTakesBackTheEditOfATileThatIsRemoved) {
  const fs::path job = folder("job");
  expect_well(run(job));
  fs::remove(job / tile_);
  const auto updated = plan(job, {"--update"});
  expect_well(updated);
  EXPECT_THAT(updated.output, HasSubstr((job / tile_).string()));
  expect_well(run(job));
  EXPECT_EQ(first_difference(job / "dataset", unedited() / "dataset"), "");
}

}  // namespace
}  // namespace terracast::test
