#include "job/run_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "core/json.h"
#include "core/log.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"
#include "job/job.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"

namespace terracast::job {
namespace {

namespace fs = std::filesystem;
const fs::path kSource = TERRACAST_SOURCE_DIR;

TEST(Configs, EveryJobThatIsShippedReads) {
  int num_jobs = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "configs")) {
    // Beside jobs there is the table of classes.
    if (entry.path().extension() != ".toml" || entry.path().stem() == "classes") continue;
    ++num_jobs;
    EXPECT_NO_THROW(load_run_config(entry.path(), {})) << entry.path();
  }
  EXPECT_GE(num_jobs, 3);
}

TEST(Configs, EveryShippedWorldStatesLicenceAndAccuracyOfAllItsSources) {
  const test::ScratchFolder folder;
  int num_sources = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "configs/worlds")) {
    const fs::path job = folder / "job.toml";
    std::ofstream(job) << "extends = " << kSource / "configs/all_formats.toml"
                       << "\ndata = \"data\"\nworld = " << entry.path() << "\n";
    const RunConfig config = load_run_config(job, {});
    for (const tiler::ElevationOptions& source : config.world.elevation) {
      ++num_sources;
      EXPECT_NE(source.licence, "") << entry.path() << " " << source.kind;
      EXPECT_NE(source.accuracy, "") << entry.path() << " " << source.kind;
    }
    for (const tiler::LayerOptions& layer : config.world.layers) {
      ++num_sources;
      EXPECT_NE(layer.licence, "") << entry.path() << " " << layer.kind;
      EXPECT_NE(layer.accuracy, "") << entry.path() << " " << layer.kind;
    }
  }
  EXPECT_GT(num_sources, 50);
}

TEST(Configs, AResolvedJobReadsBackToItself) {
  for (const char* name : {"demo.toml", "andorra.toml", "andorra_small.toml"}) {
    const std::string text = core::toml_text(load_run_config(kSource / "configs" / name, {}));
    RunConfig again;
    core::TomlDocument::parse(text, "resolved.toml").read(again);
    EXPECT_EQ(core::toml_text(again), text) << name;
  }
}

TEST(Configs, TheCommandLineReachesIntoFilesThatAConfigNames) {
  const RunConfig config =
      load_run_config(kSource / "configs/andorra.toml",
                      {"world.seed=77", "data=/somewhere", "trajectories.0.name=P042"});
  EXPECT_EQ(config.world.seed, 77);
  EXPECT_EQ(config.trajectories.at(0).name, "P042");
  EXPECT_EQ(config.world.elevation.at(0).files.at(0).resolved.string().rfind("/somewhere/", 0), 0u);
}

TEST(Configs, AMountIsLaidOverARigFile) {
  const RunConfig config = load_run_config(kSource / "configs/demo.toml", {});
  ASSERT_EQ(config.rigs.size(), 2u);
  for (const auto& rig : config.rigs) {
    EXPECT_EQ(rig.mount_pitch_deg, 45.0);
    EXPECT_GE(rig.cameras.size(), 2u);
  }
}

TEST(Configs, WhatALaterStageWouldRefuseIsRefusedOnReading) {
  const auto refusal_of = [](const std::vector<std::string>& sets) -> std::string {
    try {
      load_run_config(kSource / "configs/demo.toml", sets);
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Config);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal_of({}), "");
  EXPECT_THAT(refusal_of({"rigs.0.name=frames"}), testing::HasSubstr("rig name \"frames\""));
  EXPECT_THAT(refusal_of({"trajectories.0.name=" + std::string(65, 'a')}),
              testing::HasSubstr("becomes a folder"));
  EXPECT_THAT(refusal_of({"labels=[{kind = \"volume\", voxel_m = 0.5, truncation_m = 0.4}]"}),
              testing::AllOf(testing::HasSubstr("truncation_m = 0.4"),
                             testing::HasSubstr("between voxels")));
  EXPECT_EQ(refusal_of({"labels=[{kind = \"volume\", voxel_m = 0.5, truncation_m = 0.5}]"}), "");
  EXPECT_EQ(refusal_of({"labels=[{kind = \"volume\", voxel_m = 0.5, truncation_m = 0.0}]"}), "");
}

TEST(Configs, FormatsAreRefusedWithoutTheFlagsThatTheyNeed) {
  const auto read = [](const std::string& format, const std::string& flags) {
    load_run_config(kSource / "configs/demo.toml",
                    {"exports=[{" + format + "}]", "facts.flags=[" + flags + "]"});
  };
  const auto refuses = [&](const std::string& format, const std::string& flags,
                           const std::string& missing) {
    test::expect_error(core::ErrorKind::Config, {"facts.flags", "\"" + missing + "\""},
                       [&] { read(format, flags); });
  };
  const std::string colmap = R"(format = "colmap", rigs = ["mcs4"])";
  EXPECT_NO_THROW(read(colmap, R"("edge")"));
  refuses(colmap, R"("next", "previous", "cameras")", "edge");
  const std::string terracast = R"(format = "terracast")";
  EXPECT_NO_THROW(read(terracast, R"("edge", "next", "previous")"));
  refuses(terracast, R"("edge", "previous")", "next");
  refuses(terracast, R"("edge", "next")", "previous");
  EXPECT_NO_THROW(read(terracast + R"(, modalities = ["range"])", R"("edge")"));
  const std::string v1 = R"(format = "tartanair_v1", rig = "mcs4", left = "cam0", right = "cam1")";
  refuses(v1, R"("edge", "previous")", "next");
  const std::string tartanair =
      R"(format = "tartanair", rig = "mcs4", left = "cam0", right = "cam1")";
  refuses(tartanair, R"("edge", "next")", "previous");
  EXPECT_NO_THROW(read(tartanair + R"(, flow = "png")", R"("edge", "next")"));
  test::expect_error(core::ErrorKind::Config, {"facts.flags", "edges"},
                     [&] { read(colmap, R"("edges")"); });
}

TEST(Configs, LookForTheFlagsThatExportsNeedUnlessTheySay) {
  const auto flags = [](const std::vector<std::string>& sets) {
    return load_run_config(kSource / "configs/demo.toml", sets).facts.flags;
  };
  using Flags = std::vector<std::string>;
  EXPECT_EQ(flags({"exports=[]"}), Flags());
  EXPECT_EQ(flags({R"(exports=[{format = "colmap"}])"}), Flags({"edge"}));
  EXPECT_EQ(flags({R"(exports=[{format = "colmap"}, {format = "terracast"}])"}),
            Flags({"edge", "next", "previous"}));
  EXPECT_EQ(flags({"exports=[]", R"(facts.flags=["cameras", "needed"])"}), Flags({"cameras"}));
  EXPECT_EQ(flags({R"(exports=[{format = "colmap"}])", R"(facts.flags=["cameras", "needed"])"}),
            Flags({"edge", "cameras"}));
  EXPECT_EQ(flags({R"(exports=[{format = "colmap"}])", R"(facts.flags=["cameras", "edge"])"}),
            Flags({"cameras", "edge"}));
}

TEST(Configs, GoOnWithTheFlagsOfACaptureThatHoldsMore) {
  const test::ScratchFolder folder;
  const auto read = [](const std::vector<std::string>& sets) {
    return load_run_config(kSource / "configs/demo.toml", sets);
  };
  const std::string few = R"(exports=[{format = "colmap"}])";
  const RunConfig captured = read({R"(facts.flags=["edge", "next", "cameras"])", few});
  core::Json sequence = core::Json::object();
  sequence.set("config_toml", toml_of_sequence(captured, captured.trajectories[0]));
  sequence.write(folder / (captured.trajectories[0].name + "/sequence.json"));
  const auto kept = [&](const std::vector<std::string>& sets) {
    RunConfig config = read(sets);
    keep_captured_flags(config, folder.path());
    return config.facts.flags;
  };
  using Flags = std::vector<std::string>;
  EXPECT_EQ(kept({few}), captured.facts.flags);
  EXPECT_EQ(kept({R"(exports=[{format = "terracast"}])"}), Flags({"edge", "next", "previous"}))
      << "the capture lacks \"previous\"";
  EXPECT_EQ(kept({few, R"(facts.flags=["edge"])"}), Flags({"edge"})) << "the config says";
  EXPECT_EQ(kept({few, "seed=77"}), Flags({"edge"})) << "a capture of another config";
}

// Nothing is tiled by prepare_job(). A model is held to 50 points an image, 2000 at most.
TEST(Configs, TooFewTrackPointsForAColmapModelAreRefusedBeforeTiling) {
  const core::Log log("job", core::LogLevel::Off);
  const auto prepare = [&](int num_frames, int num_points) {
    prepare_job(load_run_config(kSource / "configs/demo.toml",
                                {"exports=[{format = \"colmap\", rigs = [\"mcs4\"]}]",
                                 "trajectories.0.num_frames=" + std::to_string(num_frames),
                                 "tracks.num_points=" + std::to_string(num_points)}),
                {.log = log});
  };
  const auto refuses = [&](int num_frames, int num_points, const std::string& least) {
    test::expect_error(core::ErrorKind::Config, {"tracks.num_points", least},
                       [&] { prepare(num_frames, num_points); });
  };
  EXPECT_NO_THROW(prepare(2, 50 * 2 * 4));
  refuses(2, 50 * 2 * 4 - 1, "400 points");
  EXPECT_NO_THROW(prepare(24, 2000));
  refuses(24, 1999, "2000 points");
}

// Nothing is tiled by prepare_job().
TEST(Configs, WhatRenderingAndLabellingWouldRefuseIsRefusedBeforeTiling) {
  const core::Log log("job", core::LogLevel::Off);
  const auto prepare = [&](const std::vector<std::string>& sets) {
    prepare_job(load_run_config(kSource / "configs/every_camera.toml", sets), {.log = log});
  };
  const std::vector<std::string> base = {"exports=[]", "trajectories.0.rate_hz=8.0"};
  const auto refuses = [&](const std::string& set, const std::vector<std::string>& words) {
    test::expect_error(core::ErrorKind::Config, words, [&] { prepare({base[0], base[1], set}); });
  };
  EXPECT_NO_THROW(prepare(base));
  refuses("rigs.0.cameras.0.exposure_ms=900.0", {"lenses/pinhole", "takes 900 ms"});
  refuses("rigs.0.imaging={exposure = {mode = \"automatic\", time_constant_s = 10.0}}",
          {"time_constant_s = 10", "255 frames"});
  refuses("labels=[{kind = \"pairs\", cameras = [\"lenses/pinhole lenses/pinhale\"]}]",
          {"lenses/pinhale", "nearest: \"lenses/pinhole\"", "labels pairs"});
  refuses("labels=[{kind = \"bottom\"}]", {"conditions.bottom_range = true"});
  refuses("labels=[{kind = \"pairs\", frames_apart = [1000]}]", {"frames_apart = 1000", "longest"});
}

}  // namespace
}  // namespace terracast::job
