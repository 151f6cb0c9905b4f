#include "batch/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "batch/board.h"
#include "batch/update.h"
#include "batch/worker.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/random.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;

/// A plan of the climb with other sweeps, whose flights state their frames.
Plan plan_of(const std::string& sweep, const PlanOptions& options = {},
             const Plan* previous = nullptr, const std::vector<std::string>& sets = {}) {
  const fs::path file = fs::path(TERRACAST_SOURCE_DIR) / "configs/swept.toml";
  const core::ConfigInputs inputs{.file = file,
                                  .sets = sets,
                                  .sets_folder = fs::temp_directory_path(),
                                  .texts = {{file.string(), "extends = \"climb.toml\"\n" + sweep}}};
  const core::Log log("test", core::LogLevel::Off);
  return make_plan(Description::load(inputs), options, previous, {.log = log});
}

const std::string kSweep = R"(
[[sweep.product]]
key = "world.seed"
values = [1, 2, 3]
[[sweep.product]]
key = "trajectories.0.num_frames"
values = [1, 5, 24, 240]
)";

TEST(Plan, ShardsCoverEveryFrameAndFormatOnce) {
  for (const double shard_s : {0.0, 0.1, 30.0, 400.0, 1e6}) {
    PlanOptions options;
    options.shard_s = shard_s;
    const Plan plan = plan_of(kSweep, options);
    ASSERT_EQ(plan.runs.size(), 12U);
    EXPECT_EQ(plan.worlds.size(), 3U);
    std::map<std::pair<int, int>, std::vector<int>> frames;  // how often each is rendered
    for (int run = 0; run < 12; ++run)
      frames[{run, 0}].resize(
          static_cast<std::size_t>(plan.runs[static_cast<std::size_t>(run)].num_frames()));
    for (const Shard& shard : plan.of(Stage::Render))
      for (const Piece& piece : shard.pieces) {
        EXPECT_EQ(piece.run, shard.pieces.front().run) << "a shard is of one run";
        for (int frame = piece.first_frame; frame < piece.end_frame; ++frame)
          ++frames.at({piece.run, piece.sequence}).at(static_cast<std::size_t>(frame));
      }
    for (const auto& [sequence, counts] : frames)
      EXPECT_THAT(counts, testing::Each(1)) << "run " << sequence.first << ", " << shard_s << " s";
    for (const Stage stage : {Stage::Export, Stage::Validate}) {
      std::multiset<std::pair<int, int>> formats;
      for (const Shard& shard : plan.of(stage))
        for (const Piece& piece : shard.pieces) formats.insert({piece.run, piece.format});
      EXPECT_EQ(formats.size(), 36U);
      EXPECT_EQ((std::set<std::pair<int, int>>(formats.begin(), formats.end()).size()), 36U);
    }
    std::set<int> tiled;
    for (const Shard& shard : plan.of(Stage::Tile)) tiled.insert(shard.pieces.at(0).run);
    EXPECT_EQ(tiled.size(), 12U);
    EXPECT_EQ(plan.of(Stage::Merge).size(), 1U);
  }
}

TEST(Plan, ShardsOfALongFlightCostAboutTheSame) {
  PlanOptions options;
  options.shard_s = 300.0;
  const Plan plan = plan_of(
      "[[sweep.product]]\nkey = \"trajectories.0.num_frames\"\nvalues = [24000]\n", options);
  const auto& shards = plan.of(Stage::Render);
  ASSERT_GT(shards.size(), 100U);
  for (std::size_t i = 0; i + 1 < shards.size(); ++i) {  // what is left over is the last one's
    EXPECT_LE(shards[i].cost.cpu_s, 300.0) << i;
    EXPECT_GE(shards[i].cost.cpu_s, 285.0) << "a frame costs less than 5 % of a shard";
    EXPECT_EQ(shards[i].pieces.back().end_frame, shards[i + 1].pieces.front().first_frame);
  }
}

// Each sequence costs what its own cameras do: together what two jobs cost, each with one vehicle of the one rig.
TEST(Plan, VehiclesCostWhatTheyCarry) {
  const std::string rigs =
      "exports = [{format = \"terracast\"}, {format = \"colmap\", rigs = "
      "[\"wide\"]}]\n";
  const auto rig = [](const char* name, int width_px) {
    return fmt::format(
        "[[rigs]]\nname = \"{}\"\n[[rigs.cameras]]\nname = \"cam\"\nwidth_px = {}\nheight_px = "
        "100\nfx_px = 100.0\nfy_px = 100.0\n",
        name, width_px);
  };
  const auto flight = [](const char* name, int num_frames, const std::string& more) {
    return fmt::format(
        "[[trajectories]]\nname = \"{}\"\nkind = \"orbit\"\nradius_m = 100.0\nspeed_mps = 1.0\n"
        "centre = {{east_m = 0.0, north_m = 0.0, height_m = 50.0}}\nnum_frames = {}\n{}",
        name, num_frames, more);
  };
  const auto plan_of_text = [](const std::string& text) {
    const std::string whole = text + "[[sweep.list]]\nkeys = [\"seed\"]\nrows = [[1]]\n";
    return plan_of(whole);
  };
  const auto cost = [](const Plan& plan, Stage stage) { return plan.cost_of(stage); };
  const Plan fleet =
      plan_of_text(rigs + rig("wide", 1000) + rig("small", 50) +
                   flight("a", 7, "rigs = [\"wide\"]\n") + flight("b", 5, "rigs = [\"small\"]\n"));
  const Plan wide = plan_of_text(rigs + rig("wide", 1000) + flight("a", 7, ""));
  const Plan small = plan_of_text("exports = [{format = \"terracast\"}]\n" + rig("small", 50) +
                                  flight("b", 5, ""));
  const Plan all = plan_of_text(rigs + rig("wide", 1000) + rig("small", 50) + flight("a", 7, "") +
                                flight("b", 5, ""));
  for (const Stage stage : {Stage::Render, Stage::Export, Stage::Validate}) {
    const Cost together = cost(fleet, stage);
    EXPECT_NEAR(together.cpu_s, cost(wide, stage).cpu_s + cost(small, stage).cpu_s,
                1e-9 * together.cpu_s);
    EXPECT_NEAR(together.bytes, cost(wide, stage).bytes + cost(small, stage).bytes,
                1e-9 * together.bytes);
    EXPECT_LT(together.cpu_s, cost(all, stage).cpu_s);
  }
  EXPECT_EQ(fleet.memory_bytes, wide.memory_bytes);
  EXPECT_THROW(plan_of_text("exports = [{format = \"colmap\", rigs = [\"other\"]}]\n" +
                            rig("small", 50) + flight("b", 5, "")),
               core::Error);
}

TEST(Plan, RunsOfOneWorldStandTogether) {
  const Plan plan = plan_of(
      "[[sweep.product]]\nkey = \"conditions.exposure\"\nvalues = [1.0, 2.0]\n"
      "[[sweep.product]]\nkey = \"world.seed\"\nvalues = [1, 2, 3]\n");
  for (const Stage stage : {Stage::Tile, Stage::Render}) {
    std::vector<int> worlds;
    for (const Shard& shard : plan.of(stage)) {
      const int world = plan.runs[static_cast<std::size_t>(shard.pieces.at(0).run)].world;
      if (worlds.empty() || worlds.back() != world) worlds.push_back(world);
    }
    EXPECT_THAT(worlds, testing::UnorderedElementsAre(0, 1, 2)) << "each is left once";
  }
}

TEST(Plan, ItReadsBackAsItWasWritten) {
  const test::ScratchFolder folder;
  const Plan plan = plan_of(kSweep);
  write_plan(plan, folder.path());
  const Plan again = read_plan(folder.path());
  EXPECT_EQ(again.runs, plan.runs);
  EXPECT_EQ(again.worlds, plan.worlds);
  EXPECT_EQ(again.inputs.json().text(), plan.inputs.json().text());
  for (const Stage stage : kStages) {
    ASSERT_EQ(again.of(stage).size(), plan.of(stage).size());
    for (std::size_t i = 0; i < plan.of(stage).size(); ++i) {
      EXPECT_EQ(again.of(stage)[i].id, plan.of(stage)[i].id);
      EXPECT_EQ(again.of(stage)[i].pieces, plan.of(stage)[i].pieces);
      EXPECT_EQ(again.of(stage)[i].cost.cpu_s, plan.of(stage)[i].cost.cpu_s);
    }
  }
  EXPECT_THROW(write_plan(plan, folder.path()), core::Error) << "a revision is written once";
  EXPECT_FALSE(has_newer_plan(folder.path(), 1));
}

TEST(Plan, ADamagedPlanIsRefusedByTheNameOfItsFile) {
  const test::ScratchFolder folder;
  write_plan(plan_of(kSweep), folder.path());
  for (const char* name : {"plan.json", "config.json", "runs.jsonl", "shards.jsonl"}) {
    const fs::path file = folder / "plan/0001" / name;
    const std::string whole = core::read_text_file(file);
    std::vector<std::string> damaged = {"", "{", "{}\n", whole.substr(0, whole.size() / 2)};
    if (std::string(name).ends_with(".jsonl")) {
      damaged.push_back(whole.substr(0, whole.rfind('\n', whole.size() - 2) + 1));  // a line less
      damaged.push_back(whole + whole.substr(0, whole.find('\n') + 1));             // one twice
    }
    for (const std::string& text : damaged) {
      core::write_file(file, text);
      try {
        read_plan(folder.path());
        ADD_FAILURE() << name << " of " << text.size() << " bytes was read";
      } catch (const core::Error& error) {
        EXPECT_EQ(error.kind(), core::ErrorKind::Input) << error.what();
        EXPECT_THAT(error.what(), testing::HasSubstr(file.string()));
      }
    }
    core::write_file(file, whole);
  }
  EXPECT_NO_THROW(read_plan(folder.path()));
}

TEST(Plan, AShardIsReadyWhenAllThatItsBytesNeedIsDone) {
  PlanOptions options;
  options.shard_s = 40.0;
  const Plan plan = plan_of(
      "[[sweep.product]]\nkey = \"trajectories.0.num_frames\"\nvalues = [5, 24, 60]\n", options);
  const auto runs_of = [](const Shard& shard) {
    std::set<int> runs;
    for (const Piece& piece : shard.pieces) runs.insert(piece.run);
    return runs;
  };
  // By the runs alone: what comes before in each, and everything before the merge.
  const auto is_ready = [&](const Shard& shard, const std::set<std::string>& done) {
    for (const Stage earlier : kStages) {
      if (earlier >= shard.id.stage) break;
      for (const Shard& other : plan.of(earlier)) {
        bool is_needed = shard.id.stage == Stage::Merge;
        for (const int run : runs_of(shard)) is_needed = is_needed || runs_of(other).contains(run);
        if (shard.id.stage == Stage::Validate && earlier == Stage::Export)
          is_needed = other.pieces.at(0) == shard.pieces.at(0);
        if (is_needed && !done.contains(other.id.text())) return false;
      }
    }
    return true;
  };
  for (std::uint64_t round = 0; round < 40; ++round) {
    const test::ScratchFolder folder;
    const Claims claims(folder.path(), {});
    Board board(plan, claims);
    std::set<std::string> done;
    std::uint64_t draw = 0;
    for (const Stage stage : kStages)  // only what is ready is ever done
      for (const Shard& shard : plan.of(stage)) {
        EXPECT_EQ(board.is_ready(shard.id), is_ready(shard, done)) << shard.id.text();
        EXPECT_EQ(board.missing(shard.id).empty(), is_ready(shard, done)) << shard.id.text();
        if (!is_ready(shard, done) || core::random_unit(1, round, draw++) > 0.95) continue;
        board.set_done(shard.id);
        done.insert(shard.id.text());
      }
  }
}

void write_checksums(const JobFolder& job, const PlannedRun& run) {
  for (const PlannedFormat& format : run.formats) {
    core::write_file(job.checksums(run, format.name), "exported " + run.name);
    core::write_file(job.report_checksums(run, format.name), "told of " + run.name);
  }
}

void set_all_done(const Plan& plan, const fs::path& job) {
  Claims claims(JobFolder{job, plan.revision}.state(), {});
  for (const Stage stage : kStages)
    for (const Shard& shard : plan.of(stage))
      claims.set_done(shard.id, core::Json::object().set("shard", shard.id.text()));
}

TEST(Update, WhatDidNotChangeStaysDoneUnderItsName) {
  const test::ScratchFolder folder;
  PlanOptions options;
  options.shard_s = 1000.0;
  const Plan before = plan_of(kSweep, options);
  write_plan(before, folder.path());
  set_all_done(before, folder.path());
  for (const PlannedRun& run : before.runs) write_checksums({folder.path(), 1}, run);

  // One value goes, one comes, first in the list; the exposure of all stays.
  const std::string swept = R"(
[[sweep.product]]
key = "world.seed"
values = [4, 1, 3]
[[sweep.product]]
key = "trajectories.0.num_frames"
values = [1, 5, 24, 240]
)";
  const Plan after = plan_of(swept, {}, &before);
  EXPECT_EQ(after.revision, 2);
  std::map<std::string, std::string> changes_before;
  std::set<std::string> new_names;
  for (const PlannedRun& run : before.runs) changes_before[run.name] = run.changes;
  for (const PlannedRun& run : after.runs) {
    if (run.changes.starts_with("world.seed = 4,")) {
      EXPECT_FALSE(changes_before.contains(run.name)) << run.name;
    } else {
      EXPECT_EQ(changes_before[run.name], run.changes);
    }
    new_names.insert(run.name);
  }
  EXPECT_EQ(new_names.size(), 12U);

  const Update expected = compare(before, after, folder.path());
  EXPECT_FALSE(fs::exists(JobFolder{folder.path(), 2}.state())) << "nothing is written";
  const Update update = carry_over(before, after, folder.path());
  EXPECT_EQ(expected.num_kept, update.num_kept);
  EXPECT_EQ(expected.num_open, update.num_open);
  std::int64_t num_new = 1;  // the merge
  const Claims claims(JobFolder{folder.path(), 2}.state(), {});
  for (const Stage stage : kStages)
    for (const Shard& shard : after.of(stage)) {
      if (shard.pieces.empty()) continue;
      const PlannedRun& run = after.runs[static_cast<std::size_t>(shard.pieces.at(0).run)];
      const bool is_new = run.changes.starts_with("world.seed = 4,");
      EXPECT_EQ(claims.is_done(shard.id), !is_new) << shard.id.text() << " of " << run.changes;
      num_new += is_new ? 1 : 0;
      if (is_new) continue;
      const JobFolder job{folder.path(), 2};
      const auto format = run.formats[static_cast<std::size_t>(shard.pieces.at(0).format)].name;
      if (stage == Stage::Export) {
        EXPECT_EQ(core::read_text_file(job.checksums(run, format)), "exported " + run.name);
      } else if (stage == Stage::Validate) {
        EXPECT_EQ(core::read_text_file(job.report_checksums(run, format)), "told of " + run.name);
      }
    }
  EXPECT_EQ(update.num_open, num_new);
  EXPECT_FALSE(claims.is_done({Stage::Merge, 0}));
}

TEST(Update, WithoutAChangeThePlanIsTheSameAsItStandsInItsFolder) {
  const test::ScratchFolder folder;
  PlanOptions options;
  options.shard_s = 1000.0;
  write_plan(plan_of(kSweep, options), folder.path());
  const Plan before = read_plan(folder.path());
  const auto updated = [&](const PlanOptions& with, const std::string& sweep,
                           const std::vector<std::string>& sets = {}) {
    return plan_of(sweep, with, &before, sets);
  };
  EXPECT_TRUE(is_same_but_for_revision(before, updated({}, kSweep)));
  PlanOptions others;
  others.claims.max_tries = 7;
  EXPECT_FALSE(is_same_but_for_revision(before, updated(others, kSweep)));
  others = {};
  others.shard_s = 500.0;
  EXPECT_FALSE(is_same_but_for_revision(before, updated(others, kSweep)));
  others = {};
  others.edits.of_worlds[before.worlds[1]] = "0/0/0 0123456789abcdef\n";
  others.edits.of_runs[before.runs[4].name] = "0/0/0 0123456789abcdef\n";
  EXPECT_FALSE(is_same_but_for_revision(before, updated(others, kSweep)));
  EXPECT_FALSE(
      is_same_but_for_revision(before, updated({}, kSweep, {"conditions.visibility_km=30"})));
  // A comment changes no run, but what the job says it was made of.
  EXPECT_FALSE(is_same_but_for_revision(before, updated({}, kSweep + "# for the record\n")));
}

TEST(Update, RunsAreLeftOutByTheirNamesAndTheRestStaysAsItWas) {
  const test::ScratchFolder folder;
  PlanOptions options;
  options.shard_s = 1000.0;
  const Plan before = plan_of(kSweep, options);
  write_plan(before, folder.path());
  set_all_done(before, folder.path());
  const std::vector<std::string> without = {R"(sweep.leave_out=["run0002","run0011"])"};
  const Plan after = plan_of(kSweep, {}, &before, without);
  std::vector<std::string> names;
  for (const PlannedRun& run : after.runs) names.push_back(run.name);
  EXPECT_THAT(names, testing::ElementsAre("run0000", "run0001", "run0003", "run0004", "run0005",
                                          "run0006", "run0007", "run0008", "run0009", "run0010"));
  EXPECT_EQ(compare(before, after, folder.path()).num_open, 1) << "the merge alone";
  // A name stays with its run, left out or not, when the sweep grows and others take its place.
  std::string grown = kSweep;
  grown.replace(grown.find("24, 240"), 7, "24, 48, 240");
  const Plan larger = plan_of(grown, {}, &after, without);
  EXPECT_EQ(larger.left_out, after.left_out);
  ASSERT_EQ(larger.runs.size(), 13U);
  std::map<std::string, std::string> names_of;
  for (const PlannedRun& run : before.runs) names_of[run.identity] = run.name;
  for (const PlannedRun& run : larger.runs) {
    if (names_of.contains(run.identity)) {
      EXPECT_EQ(run.name, names_of[run.identity]);
    }
  }
  write_plan(larger, folder / "larger");
  EXPECT_EQ(read_plan(folder / "larger").left_out, after.left_out);
  EXPECT_THAT(describe_plan(larger), testing::HasSubstr("left out: run0011\n"));
  const Plan fresh = plan_of(kSweep, options, nullptr, without);
  ASSERT_EQ(fresh.runs.size(), 10U);
  EXPECT_EQ(fresh.runs[2].name, "run0003");
  EXPECT_EQ(fresh.runs[2].key, before.runs[3].key);

  const auto error_of = [&](const std::string& names_left_out) -> std::string {
    try {
      plan_of("[[sweep.product]]\nkey = \"world.seed\"\nvalues = [1, 2]\n", {}, nullptr,
              {"sweep.leave_out=" + names_left_out});
      return "";
    } catch (const core::Error& error) {
      return error.what();
    }
  };
  EXPECT_THAT(error_of(R"(["run0001", "run0007"])"),
              testing::HasSubstr("names run0007, and no run is called so"));
  EXPECT_THAT(error_of(R"(["run0000", "run0001"])"), testing::HasSubstr("nothing is left to make"));
}

// As a run refuses them, although no flight is laid out where all say how many frames they have.
TEST(Plan, RefusesPairsThatCannotBe) {
  const auto plan_with = [](const std::string& pairs) {
    plan_of("[[sweep.product]]\nkey = \"trajectories.0.num_frames\"\nvalues = [2, 5]\n", {},
            nullptr, {"labels=[{kind = \"pairs\", " + pairs + "}]"});
  };
  EXPECT_NO_THROW(plan_with("frames_apart = [1]"));
  const auto refuses = [&](const std::string& pairs, const std::vector<std::string>& words) {
    test::expect_error(core::ErrorKind::Config, words, [&] { plan_with(pairs); });
  };
  refuses("frames_apart = [4]", {"frames_apart = 4", "has 2 frames"});
  refuses("cameras = [\"mcs4/cam0 mcs4/cam9\"]", {"mcs4/cam9", "labels pairs"});
  refuses("cameras = [\"P000/mcs4/cam0 P009/mcs4/cam0\"]", {"P009", "P000"});
}

/// Ground that is opened at once, for flights that have to be laid out.
const std::string kRamp = R"(world.elevation=[{kind = "ramp", vertical_datum = "ellipsoid"}])";

TEST(Plan, AWorldIsOfTheContentOfItsAridityRaster) {
  const fs::path file = fs::temp_directory_path() / fmt::format("aridity_{}.tif", ::getpid());
  const auto worlds_with = [&](const std::string& content) {
    std::ofstream(file) << content;
    return plan_of(kSweep, {}, nullptr,
                   {kRamp, fmt::format("world.aridity_raster=\"{}\"", file.string())})
        .worlds;
  };
  const auto dry = worlds_with("dry");
  EXPECT_EQ(worlds_with("dry"), dry);
  EXPECT_NE(worlds_with("wet"), dry);
  fs::remove(file);
}

// Captures are of these configs alike; their flights are laid out once, where they state no frames.
TEST(Plan, EveryRunOfASweepOverLabelsAndExportsIsLookedInto) {
  const auto refuses = [](const std::string& sweep, const std::vector<std::string>& words) {
    for (const char* num_frames : {"0", "24"})
      test::expect_error(core::ErrorKind::Config, words, [&] {
        plan_of("[[sweep.product]]\n" + sweep, {}, nullptr,
                {std::string("trajectories.0.num_frames=") + num_frames, "tracks.num_points=100",
                 kRamp, "exports=[{format = \"terracast\"}]"});
      });
  };
  refuses(R"(key = "labels"
values = [[{kind = "pairs", frames_apart = [1]}], [{kind = "pairs", frames_apart = [1000]}]])",
          {"planning run0001", "labels pairs", "frames_apart = 1000"});
  refuses(R"(key = "exports"
values = [[{format = "terracast"}], [{format = "colmap", rigs = ["mcs4"]}]])",
          {"planning run0001", "tracks.num_points = 100", "colmap", "2000 points"});
}

// Cameras that the config says to be rectified are turned against each other.
TEST(Plan, HoldsRigsWithTheirErrorsAgainstLabelsAndFormats) {
  const auto plan_with = [](const std::vector<std::string>& outputs, const char* num_frames,
                            double error_deg) {
    std::vector<std::string> sets = {fmt::format("trajectories.0.num_frames={}", num_frames),
                                     kRamp};
    for (const int rig : {0, 1})
      sets.push_back(fmt::format("rigs.{}.errors.azimuth_sd_deg={}", rig, error_deg));
    sets.insert(sets.end(), outputs.begin(), outputs.end());
    plan_of("[[sweep.product]]\nkey = \"seed\"\nvalues = [1]\n", {}, nullptr, sets);
  };
  const std::vector<std::string> labels = {R"(exports=[{format = "terracast"}])",
                                           R"(labels=[{kind = "disparity"}])"};
  const std::vector<std::string> formats = {
      R"(exports=[{format = "kitti", rig = "mcs4", left = "cam0", right = "cam3"}])"};
  for (const char* num_frames : {"0", "24"}) {
    EXPECT_NO_THROW(plan_with(labels, num_frames, 0.0));
    EXPECT_NO_THROW(plan_with(formats, num_frames, 0.0));
    test::expect_error(core::ErrorKind::Config,
                       {"planning run0000", "labels disparity", "rectified", "errors"},
                       [&] { plan_with(labels, num_frames, 0.1); });
    test::expect_error(core::ErrorKind::Config,
                       {"planning run0000", "kitti", "errors", "sequence P000"},
                       [&] { plan_with(formats, num_frames, 0.1); });
  }
}

TEST(Update, EachKindOfKeyOpensTheStagesThatDependOnIt) {
  const std::string sweep = "[[sweep.product]]\nkey = \"world.seed\"\nvalues = [1]\n";
  PlanOptions options;
  options.shard_s = 1000.0;
  const Plan before = plan_of(sweep, options);
  const auto open_stages = [&](const std::string& set) {
    const test::ScratchFolder folder;
    write_plan(before, folder.path());
    set_all_done(before, folder.path());
    for (const PlannedRun& run : before.runs) write_checksums({folder.path(), 1}, run);
    const Plan after = plan_of(sweep, {}, &before, {set});
    carry_over(before, after, folder.path());
    const Claims claims(JobFolder{folder.path(), 2}.state(), {});
    std::vector<std::string> open;
    for (const Stage stage : kStages)
      if (claims.done(stage).size() < after.of(stage).size()) open.emplace_back(stage_name(stage));
    return open;
  };
  using testing::ElementsAre;
  EXPECT_THAT(open_stages("tracing.memory_bytes=1e9"), ElementsAre("merge"));
  EXPECT_THAT(open_stages("validate.seed=5"), ElementsAre("validate", "merge"));
  EXPECT_THAT(open_stages("exports.2.depth=false"), ElementsAre("export", "validate", "merge"));
  EXPECT_THAT(open_stages("labels=[{kind = \"cloud\"}]"),
              ElementsAre("export", "validate", "merge"));
  EXPECT_THAT(open_stages("conditions.visibility_km=30"),
              ElementsAre("tile", "render", "export", "validate", "merge"));
}

TEST(Board, SeesThatAShardIsOpenAgain) {
  const test::ScratchFolder folder;
  const Plan plan = plan_of("[[sweep.product]]\nkey = \"world.seed\"\nvalues = [1, 2]\n");
  Claims claims(folder.path(), {});
  for (const Stage stage : kStages)
    for (const Shard& shard : plan.of(stage)) claims.set_done(shard.id, core::Json::object());
  Board board(plan, claims);
  board.refresh();
  const ShardId merge{Stage::Merge, 0};
  ASSERT_TRUE(board.is_ready(merge));
  EXPECT_FALSE(board.find_reopened());
  claims.reopen({Stage::Export, 1});
  claims.reopen(merge);
  EXPECT_TRUE(board.find_reopened());
  EXPECT_FALSE(board.is_ready(merge));
  EXPECT_THAT(board.missing(merge), testing::SizeIs(1));
  EXPECT_FALSE(board.find_reopened()) << "it is known by now";
}

TEST(Worker, ThatFindsAllDoneTellsOfTheChecksThatFailedBefore) {
  const test::ScratchFolder folder;
  const Plan plan = plan_of("[[sweep.product]]\nkey = \"world.seed\"\nvalues = [1, 2]\n");
  write_plan(plan, folder.path());
  const JobFolder job{folder.path(), 1};
  {
    Claims claims(job.state(), {});
    for (const Stage stage : kStages)
      for (const Shard& shard : plan.of(stage)) {
        const int num_failed = stage == Stage::Validate ? 1 + shard.id.index : 0;
        claims.set_done(shard.id, core::Json::object().set("checks_failed", num_failed));
      }
  }
  const auto num_reports = static_cast<int>(plan.of(Stage::Validate).size());
  ASSERT_GE(num_reports, 2);
  const core::Log log("test", core::LogLevel::Off);
  const auto outcome = run_worker(plan, job, {}, {.log = log, .num_threads = 1});
  EXPECT_EQ(outcome.num_done, 0);
  EXPECT_EQ(outcome.num_left, 0);
  EXPECT_EQ(outcome.num_checks_failed, num_reports * (num_reports + 1) / 2);
}

TEST(Update, OneProcessAtATimeMayBringANewerPlan) {
  const test::ScratchFolder folder;
  fs::create_directories(folder / "plan");
  {
    const UpdateRight right(folder.path());
    try {
      const UpdateRight another(folder.path());
      ADD_FAILURE() << "two at once";
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Usage);
      EXPECT_THAT(error.what(), testing::HasSubstr((folder / "plan/.update").string()));
    }
  }
  const UpdateRight again(folder.path());
}

TEST(Update, TheRightOfAProcessThatDiedIsFree) {
  const test::ScratchFolder folder;
  fs::create_directories(folder / "plan");
  const pid_t child = ::fork();
  if (child == 0) {
    const UpdateRight right(folder.path());
    ::_exit(0);  // without a destructor, as when it is killed
  }
  ::waitpid(child, nullptr, 0);
  ASSERT_TRUE(fs::exists(folder / "plan/.update"));
  const UpdateRight right(folder.path());
}

TEST(Update, ExportsAndReportsThatNoPlanHasAreRemovedAndNothingElse) {
  const test::ScratchFolder folder;
  const Plan plan = plan_of("[[sweep.product]]\nkey = \"world.seed\"\nvalues = [1]\n");
  const JobFolder job{folder.path(), 1};
  ASSERT_EQ(plan.runs.size(), 1U);
  const PlannedRun& run = plan.runs[0];
  const std::string& format = run.formats[0].name;
  PlannedRun gone = run;
  gone.name = "run0777";
  for (const PlannedRun& each : {run, gone}) {
    core::write_file(job.dataset() / JobFolder::exported(each, format) / "file", "");
    core::write_file(job.report(each, format) / "report.json", "");
  }
  const fs::path own = job.dataset() / format / "notes/of/mine.txt";
  core::write_file(own, "");
  remove_unplanned(plan, job);
  EXPECT_TRUE(fs::exists(job.dataset() / JobFolder::exported(run, format) / "file"));
  EXPECT_TRUE(fs::exists(job.report(run, format) / "report.json"));
  EXPECT_FALSE(fs::exists(job.dataset() / JobFolder::exported(gone, format)));
  EXPECT_FALSE(fs::exists(job.report(gone, format)));
  EXPECT_TRUE(fs::exists(own));
}

}  // namespace
}  // namespace terracast::batch
