// Plug-ins that are built outside the tree against the installed headers (tests/plugins/outside), by the installed
// program: what a user does.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <thread>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/program.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kTerracast = std::string(TERRACAST_INSTALLED) + "/bin/terracast";

std::string plugin(const std::string& name) {
  return std::string(TERRACAST_PLUGINS) + "/" + name + ".so";
}

ProgramResult terracast(const std::vector<std::string>& arguments) {
  return run_command(kTerracast, arguments);
}

TEST(Plugins, OneOfEachKindKeepsEveryLaw) {
  const ScratchFolder folder;
  core::write_file(folder / "around.toml", "width_px = 96\nheight_px = 64\nfx_px = 40.0\n");
  const std::string keys = "sample.stereographic=" + (folder / "around.toml").string();
  const ProgramResult checked =
      terracast({"plugin", "check", plugin("sample"), "--verbose", "--keys", keys});
  EXPECT_EQ(checked.status, 0) << checked.output;
  EXPECT_THAT(checked.output, HasSubstr("the camera of its keys is read"));
  for (const char* kind : {"sensor    sample.altimeter: keeps",
                           "camera    sample.stereographic: keeps", "layer     sample.dunes: keeps",
                           "exporter  sample.places: keeps", "medium    sample.smoke_layer: keeps",
                           "check     sample.turn_rate: keeps", "sample.so: every law holds"})
    EXPECT_THAT(checked.output, HasSubstr(kind));
}

TEST(Plugins, WhatIsWrongIsNamedAndTheOthersAreTriedAllTheSame) {
  const ProgramResult checked = terracast({"plugin", "check", plugin("broken"), "--limit", "20"});
  EXPECT_EQ(checked.status, 1) << checked.output;
  for (const char* words : {"sensor    broken.throwing: REFUSED",
                            "out of plug-in broken 0.1",
                            "sensor    broken.hanging: REFUSED",
                            "hangs: it was not done after 20 s",
                            "sensor    broken.nan: REFUSED",
                            "is NaN",
                            "sensor    broken.counting: REFUSED",
                            "by itself, and else",
                            "sensor    broken.crashing: REFUSED",
                            "error: plug-in broken 0.1",
                            "crashed: SEGV",
                            "sensor    broken.leaving: REFUSED",
                            "called _Exit()",
                            "sensor    broken.nameless: REFUSED",
                            "it has a channel \"height, m\n            \"; a name is of a to z",
                            "sensor    broken.shadowing: REFUSED",
                            "the key \"rate_hz\" of the top level is described twice",
                            "sensor    broken.uncopied: REFUSED",
                            "broken.uncopied: its clone() returned nothing; this is a bug of",
                            "camera    broken.shifted: REFUSED",
                            "comes back 0.001 px away",
                            "layer     broken.counting: REFUSED",
                            "exporter  broken.dated: REFUSED",
                            "has other bytes",
                            "medium    broken.brightening: REFUSED",
                            "medium    broken.absent: REFUSED",
                            "its make() returned nothing; this is a bug of plug-in broken",
                            "check     broken.strict: REFUSED",
                            "broken.strict is 2",
                            "broken.so: refused for"})
    EXPECT_THAT(checked.output, HasSubstr(words));
}

TEST(Plugins, NothingOfAnotherBuildIsRun) {
  const ProgramResult refused = terracast({"--plugin", plugin("other_build"), "list", "sensors"});
  EXPECT_EQ(refused.status, 3);
  EXPECT_THAT(refused.output,
              AllOf(HasSubstr("other_build.so: was built for another terracast"),
                    HasSubstr("terracast 0.0.9 (this program: terracast "),
                    HasSubstr("compiler gcc 4 (this program: compiler "),
                    HasSubstr("build it again"), Not(HasSubstr("code of another build was run"))));
}

TEST(Plugins, FilesThatAreNoneAreRefused) {
  const ScratchFolder folder;
  core::write_file(folder / "text.so", "no shared object");
  core::write_file(
      folder / "truncated.so",
      core::read_text_file(plugin("sample")).substr(0, fs::file_size(plugin("sample")) / 2));
  fs::create_directory(folder / "folder.so");
  const auto refuse = [&](const std::string& file, int status, const std::string& words) {
    const ProgramResult refused = terracast({"list", "sensors", "--plugin", file});
    EXPECT_EQ(refused.status, status) << refused.output;
    EXPECT_THAT(refused.output, AllOf(HasSubstr(file), HasSubstr(words)));
  };
  refuse((folder / "text.so").string(), 3, "is not a terracast plug-in");
  refuse((folder / "missing.so").string(), 4, "missing.so");
  refuse(plugin("no_table"), 3, "terracast_plugin_v1");
  refuse(plugin("wrong_names"), 3, "names of its kinds are wrong.NAME");
  const ProgramResult truncated =
      terracast({"list", "sensors", "--plugin", (folder / "truncated.so").string()});
  EXPECT_EQ(truncated.status, 3) << truncated.output;
  for (int tenth = 1; tenth < 10; ++tenth) {
    const std::string whole = core::read_text_file(plugin("sample"));
    core::write_file(folder / "part.so", whole.substr(0, whole.size() * tenth / 10));
    const ProgramResult part =
        terracast({"list", "sensors", "--plugin", (folder / "part.so").string()});
    // Only tables that nothing is loaded of lie at the end.
    EXPECT_TRUE(part.status == 3 || (part.status == 0 && tenth > 4)) << tenth << part.output;
  }
  EXPECT_NE(terracast({"list", "sensors", "--plugin", (folder / "folder.so").string()}).status, 0);
  EXPECT_EQ(terracast({"list", "sensors", "--plugin"}).status, 2);
}

TEST(Plugins, AreFoundOnThePathBelowTheirVersion) {
  const ScratchFolder folder;
  fs::create_directories(folder / TERRACAST_MAJOR_MINOR);
  fs::copy(plugin("sample"), folder / TERRACAST_MAJOR_MINOR / "sample.so");
  fs::create_directories(folder / "0.0");
  fs::copy(plugin("other_build"), folder / "0.0" / "other_build.so");
  setenv("TERRACAST_PLUGIN_PATH", folder.path().c_str(), 1);
  const ProgramResult listed = terracast({"plugin", "list"});
  const ProgramResult cameras = terracast({"list", "cameras"});
  setenv("TERRACAST_PLUGIN_PATH", (folder / "nowhere").c_str(), 1);
  const ProgramResult missing = terracast({"plugin", "list"});
  unsetenv("TERRACAST_PLUGIN_PATH");
  EXPECT_EQ(listed.status, 0) << listed.output;
  EXPECT_THAT(listed.output, AllOf(HasSubstr("sample 1.2 (MIT)"), HasSubstr("sample.places")));
  EXPECT_THAT(cameras.output, AllOf(HasSubstr("sample.stereographic"), HasSubstr("pinhole")));
  // A command that needs none of them goes on.
  EXPECT_EQ(missing.status, 0);
  EXPECT_THAT(missing.output, AllOf(HasSubstr("warning:"), HasSubstr("nowhere is no folder")));
}

constexpr const char* kJob = R"(name = "plugged"
{requires}
[world]
name = "plugged"
origin_lat_deg = 46.0
origin_lon_deg = 7.0
size_m = 2048.0
outside = "extend"

[[world.elevation]]
kind = "fractal"
vertical_datum = "ellipsoid"
relief_m = 40.0

[[world.layer]]
kind = "sample.dunes"
spacing_m = 60.0

[detail]
cell_px = 8.0
finest_spacing_m = 1.0

[[rigs]]
name = "r"
[[rigs.cameras]]
name = "around"
model = "sample.stereographic"
width_px = 48
height_px = 32
fx_px = 20.0
euler_deg = [0.0, 60.0, 0.0]
[[rigs]]
name = "flat"
[[rigs.cameras]]
name = "down"
width_px = 48
height_px = 32
fx_px = 40.0
euler_deg = [0.0, 60.0, 0.0]
[[rigs.sensors]]
name = "baro"
kind = "sample.altimeter"
rate_hz = 10.0

[[trajectories]]
name = "P000"
kind = "waypoints"
rate_hz = 2.0
num_frames = 2
speed_mps = 6.0
waypoints = [
  {east_m = -100.0, north_m = -9.0, height_m = 60.0, above = "ground"},
  {east_m = 20.0, north_m = -8.0, height_m = 60.0, above = "ground"},
]

[conditions]
color_samples = 1
[[conditions.media]]
kind = "sample.smoke_layer"
bottom_m = 10.0
top_m = 30.0

[[exports]]
format = "sample.places"
[[exports]]
format = "terracast"
rigs = ["flat"]
)";

std::string job_text(const std::string& required) {
  std::string text = kJob;
  text.replace(text.find("{requires}"), 10, required);
  return text;
}

// One job with a kind of each table, from its config to a verdict.
TEST(Plugins, KindsOfOneServeAWholeJob) {
  const ScratchFolder folder;
  core::write_file(folder / "job.toml", job_text("requires = [\"sample >= 1.1\"]"));
  const std::string config = (folder / "job.toml").string();
  const std::string out = (folder / "out").string();
  const ProgramResult ran = terracast({"run", config, "--out", out, "--plugin", plugin("sample")});
  ASSERT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(ran.output, HasSubstr("no reader knows the format sample.places"));
  EXPECT_THAT(core::read_text_file(out + "/report/report.json"),
              HasSubstr("terracast/turn_rate\""));
  EXPECT_EQ(core::Json::read(out + "/report/terracast/report.json")
                .at("plugins")
                .at(0)
                .at("name")
                .string(),
            "sample");
  // The sensor measures, and dataset.json names the plug-in.
  const std::string heights =
      core::read_text_file(out + "/export/terracast/P000/sensors/flat/baro.csv");
  EXPECT_THAT(heights, HasSubstr("time_s,height_m"));
  for (const char* format : {"terracast", "sample.places"}) {
    const core::Json record =
        core::Json::read(out + "/export/" + format + "/dataset.json").at("plugins").at(0);
    EXPECT_EQ(record.at("name").string(), "sample");
    EXPECT_EQ(record.at("version").string(), "1.2");
    EXPECT_EQ(record.at("xxh3_128").string().size(), 32U);
  }
  EXPECT_THAT(core::Json::read(out + "/capture/P000/sequence.json").at("config_toml").string(),
              HasSubstr("# plugin sample 1.2 "));
}

/// The job with nothing of a plug-in but a format.
std::string job_with_format_of_plugin() {
  std::string text = job_text("");
  const auto put = [&](const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
  };
  put("kind = \"sample.dunes\"\nspacing_m = 60.0", "kind = \"land_cover\"\nsource = \"derived\"");
  put("model = \"sample.stereographic\"\n", "");
  put("kind = \"sample.altimeter\"", "kind = \"rangefinder\"");
  put("[[conditions.media]]\nkind = \"sample.smoke_layer\"\nbottom_m = 10.0\ntop_m = 30.0\n", "");
  return text;
}

// Bytes after the end of a shared object do not count for the loader: the same code, another file.
TEST(Plugins, ABatchTakesUpAChangedOneAndKeepsTheRest) {
  const ScratchFolder folder;
  core::write_file(folder / "batch.toml",
                   job_with_format_of_plugin() +
                       "[sweep]\nseed = 1\n[[sweep.product]]\nkey = \"seed\"\nvalues = [3]\n");
  const std::string config = (folder / "batch.toml").string();
  const std::string out = (folder / "out").string();
  const std::string edited = (folder / "edited.so").string();
  core::write_file(edited, core::read_text_file(plugin("sample")) + "edited");
  const auto batch = [&](std::vector<std::string> arguments, const std::string& file) {
    arguments.insert(arguments.begin(), "batch");
    arguments.insert(arguments.end(), {"--plugin", file});
    return terracast(arguments);
  };
  const auto written = [&] {
    std::map<std::string, fs::file_time_type> times;
    for (const auto& entry : fs::recursive_directory_iterator(out))
      if (entry.is_regular_file() && entry.path().extension() == ".exr")
        times[entry.path().string()] = fs::last_write_time(entry.path());
    return times;
  };
  const ProgramResult planned = batch({"plan", config, "--out", out}, plugin("sample"));
  ASSERT_EQ(planned.status, 0) << planned.output;
  const ProgramResult ran = batch({"run", out}, plugin("sample"));
  ASSERT_EQ(ran.status, 0) << ran.output;
  EXPECT_THAT(core::read_text_file(out + "/dataset/README.md"),
              HasSubstr("with the plug-in sample 1.2 (MIT)"));
  const auto captures = written();
  EXPECT_FALSE(captures.empty());
  const ProgramResult updated = batch({"plan", config, "--out", out, "--update"}, edited);
  ASSERT_EQ(updated.status, 0) << updated.output;
  const ProgramResult refused = batch({"run", out}, plugin("sample"));
  EXPECT_NE(refused.status, 0) << refused.output;
  EXPECT_THAT(refused.output, HasSubstr("is not the one that its plan was made with"));
  const ProgramResult again = batch({"run", out, "--retry"}, edited);
  EXPECT_EQ(again.status, 0) << again.output;
  EXPECT_EQ(written(), captures);
}

TEST(Plugins, AKindThatMakesNothingIsNamed) {
  const ScratchFolder folder;
  std::string text = job_with_format_of_plugin();
  text.replace(text.find("rangefinder"), 11, "nothing.laser");
  core::write_file(folder / "job.toml", text);
  const ProgramResult read =
      terracast({"config", "resolve", (folder / "job.toml").string(), "--plugin",
                 plugin("nothing_made"), "--plugin", plugin("sample")});
  EXPECT_EQ(read.status, 70) << read.output;
  EXPECT_THAT(read.output, HasSubstr("sensor nothing.laser: its make() returned nothing; this is a "
                                     "bug of plug-in nothing"));
  const ProgramResult checked = terracast({"plugin", "check", plugin("nothing_made")});
  EXPECT_EQ(checked.status, 1) << checked.output;
  EXPECT_THAT(checked.output, HasSubstr("sensor    nothing.laser: REFUSED"));
}

TEST(Plugins, AConfigSaysWhichItNeeds) {
  const ScratchFolder folder;
  const auto resolve = [&](const std::string& required, const std::vector<std::string>& more) {
    core::write_file(folder / "job.toml", job_text(required));
    std::vector<std::string> arguments = {"config", "resolve", (folder / "job.toml").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return terracast(arguments);
  };
  const std::vector<std::string> loaded = {"--plugin=" + plugin("sample")};
  EXPECT_EQ(resolve("requires = [\"sample\"]", loaded).status, 0);
  const ProgramResult none = resolve("", {});
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.output, AllOf(HasSubstr("job.toml"), HasSubstr("plug-in sample is not loaded"),
                                 HasSubstr("--plugin FILE")));
  const ProgramResult older = resolve("requires = [\"sample >= 1.10\"]", loaded);
  EXPECT_EQ(older.status, 2);
  EXPECT_THAT(older.output, HasSubstr("sample 1.2"));
  std::string newer = job_text("requires = [\"sample >= 1.10\"]");
  newer.replace(newer.find("sample.altimeter"), 16, "sample.sonar");
  core::write_file(folder / "newer.toml", newer);
  const ProgramResult lacking =
      terracast({"config", "resolve", (folder / "newer.toml").string(), loaded[0]});
  EXPECT_EQ(lacking.status, 2);
  EXPECT_THAT(lacking.output, AllOf(HasSubstr("newer.toml"), HasSubstr("sample 1.2"),
                                    HasSubstr("is older than the config requires")));
  const ProgramResult other = resolve("requires = [\"other\"]", loaded);
  EXPECT_EQ(other.status, 2);
  EXPECT_THAT(other.output, HasSubstr("plug-in other is not loaded"));
  const ProgramResult malformed = resolve("requires = [\"sample > 1\"]", loaded);
  EXPECT_EQ(malformed.status, 2);
  EXPECT_THAT(malformed.output, HasSubstr("NAME >= VERSION"));
}

// A kind that throws or crashes in the midst of a job ends it with its plug-in's name.
TEST(Plugins, WhatFailsInAJobNamesItsPlugin) {
  const ScratchFolder folder;
  std::string text = job_with_format_of_plugin();
  const std::string format = "[[exports]]\nformat = \"sample.places\"\n";
  text.replace(text.find(format), format.size(), "");
  const auto run_with = [&](const std::string& sensor) {
    std::string job = text;
    job.replace(job.find("rangefinder"), 11, sensor);
    core::write_file(folder / "job.toml", job);
    const std::string out = (folder / sensor).string();
    return terracast({"run", (folder / "job.toml").string(), "--out", out, "--plugin",
                      plugin("broken"), "--quiet"});
  };
  const ProgramResult throwing = run_with("broken.throwing");
  EXPECT_EQ(throwing.status, 70) << throwing.output;
  EXPECT_THAT(throwing.output, HasSubstr("a bug of plug-in broken 0.1"));
  const ProgramResult crashing = run_with("broken.crashing");
  EXPECT_EQ(crashing.status, 70) << crashing.output;
  EXPECT_THAT(crashing.output, AllOf(HasSubstr("plug-in broken 0.1"), HasSubstr("crashed: SEGV")));
  const ProgramResult exiting = run_with("broken.exiting");
  EXPECT_EQ(exiting.status, 70) << exiting.output;
  EXPECT_THAT(exiting.output,
              AllOf(HasSubstr("plug-in broken 0.1"), HasSubstr("called quick_exit()")));
  const ProgramResult leaving = run_with("broken.leaving");
  EXPECT_EQ(leaving.status, 70) << leaving.output;
  EXPECT_THAT(leaving.output, AllOf(HasSubstr("plug-in broken 0.1"), HasSubstr("called _Exit()")));
  // These would write wrong files silently.
  const ProgramResult nameless = run_with("broken.nameless");
  EXPECT_EQ(nameless.status, 70) << nameless.output;
  EXPECT_THAT(nameless.output, AllOf(HasSubstr("has a channel \"height, m\\x0a\""),
                                     HasSubstr("this is a bug of plug-in broken")));
  const ProgramResult nan = run_with("broken.nan");
  EXPECT_EQ(nan.status, 70) << nan.output;
  EXPECT_THAT(nan.output, AllOf(HasSubstr("value at "), HasSubstr(" s is NaN; this is a bug of "
                                                                  "plug-in broken")));
}

TEST(Plugins, WhatFailsWhileItIsLoadedIsNamed) {
  const std::string file = plugin("at_load");
  const auto load = [&](const char* does) {
    setenv("TERRACAST_AT_LOAD", does, 1);
    const ProgramResult result = terracast({"--plugin", file, "list", "sensors"});
    unsetenv("TERRACAST_AT_LOAD");
    return result;
  };
  EXPECT_EQ(load("nothing").status, 0);
  const std::pair<const char*, const char*> cases[] = {{"throw", "no licence server"},
                                                       {"crash", "crashed: ABRT"},
                                                       {"exit", "called exit()"},
                                                       {"leave", "called _exit()"}};
  for (const auto& [does, words] : cases) {
    const ProgramResult result = load(does);
    EXPECT_EQ(result.status, 70) << result.output;
    EXPECT_THAT(result.output, AllOf(HasSubstr("plug-in " + file), HasSubstr(words)));
  }
  // Code compiled with -ffast-math changes how the processor rounds, for the whole program.
  setenv("TERRACAST_AT_LOAD", "flush", 1);
  const ProgramResult checked = terracast({"plugin", "check", file});
  unsetenv("TERRACAST_AT_LOAD");
  EXPECT_EQ(checked.status, 0) << checked.output;
}

TEST(Plugins, OneThatHangsWhileItIsLoadedCanBeEnded) {
  const ScratchFolder folder;
  setenv("TERRACAST_AT_LOAD", "hang", 1);
  const std::string log = (folder / "log").string();
  core::RunningProgram running(kTerracast, {"--plugin", plugin("at_load"), "list", "sensors"},
                               {.log_file = log});
  unsetenv("TERRACAST_AT_LOAD");
  const auto is_hanging = [&] {
    return fs::exists(log) && core::read_text_file(log).find("hanging") != std::string::npos;
  };
  const auto wait_until = [](const auto& holds) {
    const auto limit = std::chrono::steady_clock::now() + std::chrono::minutes(2);
    while (!holds()) {
      ASSERT_LT(std::chrono::steady_clock::now(), limit);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  };
  std::optional<core::ProgramEnd> end;
  wait_until([&] { return is_hanging() || (end = running.end()); });
  ASSERT_FALSE(end) << end->text();
  running.send(SIGTERM);
  wait_until([&] { return static_cast<bool>(end = running.end()); });
  ASSERT_TRUE(end);
  EXPECT_EQ(end->kind, core::ProgramEnd::Kind::Killed);
  EXPECT_EQ(end->status, SIGTERM);
}

// Mistakes in the keys that a user gives are not the plug-in's fault.
TEST(Plugins, KeysThatDoNotFitAreTheirFilesMistake) {
  const ScratchFolder folder;
  const auto check = [&](const std::string& keys, const std::string& text) {
    core::write_file(folder / "keys.toml", text);
    return terracast({"plugin", "check", plugin("sample"), "--keys",
                      keys + "=" + (folder / "keys.toml").string()});
  };
  const ProgramResult unknown = check("sample.altimeter", "\nmost_rnge_m = 1.0\n");
  EXPECT_EQ(unknown.status, 2) << unknown.output;
  EXPECT_THAT(unknown.output, AllOf(HasSubstr("keys of sample.altimeter: "),
                                    HasSubstr("keys.toml:2:1: unknown key \"most_rnge_m\"")));
  const ProgramResult broken = check("sample.altimeter", "a = = 1\n");
  EXPECT_EQ(broken.status, 2) << broken.output;
  EXPECT_THAT(broken.output, HasSubstr("keys.toml:1:"));
  const ProgramResult nobodys = check("sample.altimetre", "");
  EXPECT_EQ(nobodys.status, 2) << nobodys.output;
  EXPECT_THAT(nobodys.output, HasSubstr("plug-in sample has no kind sample.altimetre"));
  EXPECT_EQ(terracast({"plugin", "check", plugin("sample"), "--limit", "nan"}).status, 2);
  EXPECT_EQ(terracast({"plugin", "list", "--plugin="}).status, 2);
}

}  // namespace
}  // namespace terracast::test
