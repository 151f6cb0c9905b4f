#include "core/toml_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Camera {
  std::string model = "pinhole";
  double focal_length_mm = 24.0;
  std::vector<double> offset_mm = {0.0, 0.0, 0.0};
  Path calibration{};

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("model", model, "Camera model.", one_of({"brown_conrady", "pinhole"}));
    visit.key("focal_length_mm", focal_length_mm, "Focal length.", between(1.0, 2000.0));
    Constraint three = size_of(3);
    three.lowest = -1000.0;
    visit.key("offset_mm", offset_mm, "Offset on the rig.", three);
    visit.key("calibration", calibration, "A file of the lens.");
  }
};

struct Rig {
  std::string name = "rig";
  std::vector<Camera> cameras;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("name", name, "What exports call it.");
    visit.list("cameras", cameras, "Its cameras.");
  }
  void validate() const {
    if (cameras.empty()) fail(ErrorKind::Config, "a rig needs a camera");
  }
};

struct Trajectory {
  std::string kind;
  double rate_hz = 10.0;
  std::int64_t num_frames = 24;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("kind", kind, "Kind of path.", required(one_of({"orbit", "waypoints"})));
    visit.key("rate_hz", rate_hz, "Frames a second.", at_least(0.1));
    visit.key("num_frames", num_frames, "How many frames.", between(1, 1e6));
  }
};

struct Job {
  Path data;
  std::string title;
  bool preview = false;
  std::int64_t seed = 1;
  Path dem;
  std::vector<Path> extra;
  Trajectory trajectory{.kind = "orbit"};
  std::vector<Rig> rigs;
  Camera spare;

  template <class Visitor>
  void describe(Visitor& visit) {
    visit.key("data", data, "Folder of the sources.");
    visit.key("title", title, "A title.");
    visit.key("preview", preview, "Draw a preview.");
    visit.key("seed", seed, "Seed.");
    visit.key("dem", dem, "Elevation.");
    visit.key("extra", extra, "More files.");
    visit.section("trajectory", trajectory, "The path.");
    visit.list("rigs", rigs, "The rigs.");
    visit.section("spare", spare, "A spare camera.");
  }
};

Job read_text(std::string_view text, const std::vector<std::string>& sets = {}) {
  Job job;
  TomlDocument::parse(text, "demo.toml", sets).read(job);
  return job;
}

/// The message of the Config error that `work` throws.
template <class Work>
std::string config_error(Work&& work, ErrorKind kind = ErrorKind::Config) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

std::string error_of(std::string_view text, const std::vector<std::string>& sets = {}) {
  return config_error([&] { read_text(text, sets); });
}

TEST(TomlReaderTest, ReadsEveryType) {
  const Job job = read_text(R"(
data = "/srv/dem"
title = "A \"title\""
preview = true
seed = -9223372036854775808
dem = "${data}/a.tif"
extra = ["x.tif", "${data}/y.tif"]
[trajectory]
kind = "waypoints"
rate_hz = 5
num_frames = 7
[[rigs]]
name = "left"
cameras = [{ focal_length_mm = 20.5, offset_mm = [1, -2.5, 3] }, {}]
)");
  EXPECT_EQ(job.title, "A \"title\"");
  EXPECT_TRUE(job.preview);
  EXPECT_EQ(job.seed, std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(job.dem.written, "${data}/a.tif");
  EXPECT_EQ(job.dem.resolved, "/srv/dem/a.tif");
  ASSERT_EQ(job.extra.size(), 2U);
  EXPECT_EQ(job.extra[0].resolved, "x.tif");
  EXPECT_EQ(job.extra[1].resolved, "/srv/dem/y.tif");
  EXPECT_EQ(job.trajectory.kind, "waypoints");
  EXPECT_EQ(job.trajectory.rate_hz, 5.0);
  EXPECT_EQ(job.trajectory.num_frames, 7);
  ASSERT_EQ(job.rigs.size(), 1U);
  ASSERT_EQ(job.rigs[0].cameras.size(), 2U);
  EXPECT_EQ(job.rigs[0].cameras[0].focal_length_mm, 20.5);
  EXPECT_EQ(job.rigs[0].cameras[0].offset_mm, (std::vector<double>{1.0, -2.5, 3.0}));
  EXPECT_EQ(job.rigs[0].cameras[1].focal_length_mm, 24.0);
}

TEST(TomlReaderTest, AbsentSectionsKeepTheirDefaults) {
  EXPECT_EQ(read_text("").trajectory.kind, "orbit");
}

TEST(TomlReaderTest, GivenListsReplaceDefaultItems) {
  Job job;
  job.rigs = {Rig{.name = "default", .cameras = {Camera{.focal_length_mm = 99.0}}}};
  TomlDocument::parse("[[rigs]]\ncameras = [{}]\n", "demo.toml").read(job);
  ASSERT_EQ(job.rigs.size(), 1U);
  EXPECT_EQ(job.rigs[0].name, "rig");
  EXPECT_EQ(job.rigs[0].cameras[0].focal_length_mm, 24.0);

  Job untouched;
  untouched.rigs = {Rig{.name = "default", .cameras = {}}};
  TomlDocument::parse("", "demo.toml").read(untouched);
  ASSERT_EQ(untouched.rigs.size(), 1U);
  EXPECT_EQ(untouched.rigs[0].name, "default");
}

TEST(TomlReaderTest, RangeErrorsPointAtTheValue) {
  EXPECT_EQ(error_of("[spare]\nfocal_length_mm = 5000\n"),
            "demo.toml:2:19: focal_length_mm = 5000 is outside 1 to 2000");
  EXPECT_EQ(error_of("[trajectory]\n  rate_hz = 0.01\n"),
            "demo.toml:2:13: rate_hz = 0.01 must be at least 0.1");
  EXPECT_EQ(error_of("trajectory.num_frames = 0"),
            "demo.toml:1:25: num_frames = 0 is outside 1 to 1000000");
  EXPECT_EQ(error_of("[spare]\noffset_mm = [0, -5000, 0]"),
            "demo.toml:2:17: offset_mm[1] = -5000 must be at least -1000");
  EXPECT_EQ(error_of("[spare]\noffset_mm = [0]"),
            "demo.toml:2:13: offset_mm has 1 value, but must have 3");
  // A list that is not empty by itself says something else than its default where it is.
  EXPECT_EQ(error_of("[spare]\noffset_mm = []"),
            "demo.toml:2:13: offset_mm has 0 values, but must have 3");
}

TEST(TomlReaderTest, UnknownKeysPointAtTheKeyAndNameTheNearest) {
  EXPECT_EQ(error_of("[trajectory]\nkind = \"orbit\"\n rate_h = 3\n"),
            "demo.toml:3:2: unknown key \"rate_h\" in [trajectory]; nearest: \"rate_hz\"; "
            "known: kind, rate_hz, num_frames");
  EXPECT_EQ(error_of("[trajectory]\nfps = 3\n"),
            "demo.toml:2:1: unknown key \"fps\" in [trajectory]; known: kind, rate_hz, "
            "num_frames");
  EXPECT_THAT(error_of("[[rigs]]\ncameras = [{}]\n[[rigs]]\ncameras = [{focal = 1}]\n"),
              StartsWith("demo.toml:4:13: unknown key \"focal\" in [rigs[1].cameras[0]]; "));
  EXPECT_THAT(error_of("[speare]\n"), AllOf(StartsWith("demo.toml:1:2: unknown key \"speare\" in "
                                                       "the top level; nearest: \"spare\""),
                                            HasSubstr("known: data, title")));
}

TEST(TomlReaderTest, MisspeltRequiredKeysAndFailedChecksTellTheMisspelling) {
  EXPECT_THAT(error_of("[trajectory]\nknd = \"orbit\"\n"), HasSubstr("nearest: \"kind\""));
  EXPECT_THAT(error_of("[[rigs]]\ncamera = [{}]\n"), HasSubstr("nearest: \"cameras\""));
}

TEST(TomlReaderTest, MissingRequiredKeysNameFileAndSection) {
  EXPECT_EQ(error_of("\n[trajectory]\nrate_hz = 3\n"),
            "demo.toml:2:1: [trajectory] lacks the required key kind (Kind of path.)");
}

TEST(TomlReaderTest, WrongTypesSayWhatIsWanted) {
  EXPECT_EQ(error_of("seed = 1.5"),
            "demo.toml:1:8: seed = 1.5 is a number, but must be a whole "
            "number");
  EXPECT_EQ(error_of("preview = 1"),
            "demo.toml:1:11: preview = 1 is a whole number, but must be true or false");
  EXPECT_EQ(error_of("title = 5"),
            "demo.toml:1:9: title = 5 is a whole number, but must be text (in quotes)");
  EXPECT_EQ(error_of("title = [\"a\"]"),
            "demo.toml:1:9: title is a list, but must be text (in quotes)");
  EXPECT_EQ(error_of("extra = \"a\""),
            "demo.toml:1:9: extra = \"a\" is text, but must be a list, such as [a, b]");
  EXPECT_EQ(error_of("trajectory = 5"),
            "demo.toml:1:14: trajectory = 5, but must be a table, or the path of a file that holds "
            "it");
  EXPECT_EQ(error_of("rigs = \"a.toml\""),
            "demo.toml:1:8: rigs = \"a.toml\" is text, but must be a list of tables, or of paths "
            "of files that hold one");
  EXPECT_EQ(error_of("[spare]\nmodel = \"pinhol\""),
            "demo.toml:2:9: model = \"pinhol\" is not one of brown_conrady, pinhole (nearest: "
            "\"pinhole\")");
}

TEST(TomlReaderTest, RefusesNumbersThatAreNotFiniteOrNotExact) {
  for (const char* value : {"nan", "inf", "-inf"})
    EXPECT_THAT(error_of(fmt::format("[trajectory]\nrate_hz = {}", value)),
                HasSubstr("is not a finite number"));
  EXPECT_THAT(error_of("[trajectory]\nrate_hz = 9007199254740993"),
              HasSubstr("more digits than a number can hold"));
}

TEST(TomlReaderTest, FailedValidationNamesTheSection) {
  EXPECT_EQ(error_of("title = \"x\"\n[[rigs]]\nname = \"a\"\n"),
            "demo.toml:2:1: [rigs[0]]: a rig needs a camera");
}

TEST(TomlReaderTest, SyntaxErrorsHavePositions) {
  EXPECT_THAT(error_of("a = 1\nb = \n"), StartsWith("demo.toml:2:5: "));
  EXPECT_THAT(error_of("a = 1\na = 2\n"), StartsWith("demo.toml:2:"));
}

TEST(TomlReaderTest, DatesAreText) {
  EXPECT_EQ(read_text("title = 2024-06-21T10:00:00Z").title, "2024-06-21T10:00:00Z");
  EXPECT_EQ(read_text("", {"title=2024-06-21T10:00Z"}).title, "2024-06-21T10:00Z");
}

TEST(TomlReaderTest, SetsTakeTomlOrBareText) {
  const Job job =
      read_text("[[rigs]]\nname = \"a\"\ncameras = [{}, {}]\n",
                {"title=../x y", "seed=7", "preview=true", "rigs.0.name=left",
                 "rigs.0.cameras.1.focal_length_mm=35", "trajectory.kind=\"waypoints\"",
                 "rigs.0.cameras.0.offset_mm=[1, 2, 3]", "dem=", "seed=8", "spare.model=pinhole"});
  EXPECT_EQ(job.title, "../x y");
  EXPECT_EQ(job.seed, 8);
  EXPECT_TRUE(job.preview);
  EXPECT_EQ(job.rigs[0].name, "left");
  EXPECT_EQ(job.rigs[0].cameras[1].focal_length_mm, 35.0);
  EXPECT_EQ(job.rigs[0].cameras[0].offset_mm[2], 3.0);
  EXPECT_EQ(job.trajectory.kind, "waypoints");
  EXPECT_TRUE(job.dem.empty());
}

TEST(TomlReaderTest, BadSetsAreNamed) {
  EXPECT_EQ(error_of("", {"seed"}),
            "--set seed: must be KEY=VALUE, such as rigs.0.cameras.0.focal_length_mm=35");
  EXPECT_THAT(error_of("", {"=5"}), StartsWith("--set =5: must be KEY=VALUE"));
  EXPECT_THAT(error_of("", {"a..b=5"}), StartsWith("--set a..b=5: \"a..b\" is not a dotted key"));
  EXPECT_THAT(error_of("", {"a b=5"}), HasSubstr("is not a dotted key"));
  EXPECT_EQ(error_of("", {"spare.focal_length_mm=5000"}),
            "--set spare.focal_length_mm=5000: focal_length_mm = 5000 is outside 1 to 2000");
  EXPECT_THAT(error_of("", {"sed=5"}), StartsWith("--set sed=5: unknown key \"sed\" in the top "
                                                  "level; nearest: \"seed\""));
  EXPECT_EQ(error_of("[[rigs]]\ncameras = [{}]", {"rigs.1.name=x"}),
            "--set rigs.1.name=x: rigs.1: the list has 1 items, which are counted from 0");
  EXPECT_EQ(error_of("[[rigs]]\ncameras = [{}]", {"rigs.name=x"}),
            "--set rigs.name=x: rigs.name: a list of 1 items holds no \"name\"; name an item, "
            "counted from 0, as rigs.0.name");
  EXPECT_EQ(
      error_of("[[rigs]]\ncameras = [{}]", {"rigs[0].name=x"}),
      "--set rigs[0].name=x: \"rigs[0].name\" is not a dotted key; an item of a list is named "
      "by its number, as rigs.0.name");
  EXPECT_EQ(error_of("seed = 1", {"seed.a.b=x"}),
            "--set seed.a.b=x: seed is 1 (from demo.toml:1:8), which holds no \"a\"");
  EXPECT_THAT(error_of("", {"seed=1\nextends=\"x\""}), HasSubstr("is text, but must be a whole"));
}

TEST(TomlReaderTest, NamesInTextAreReplaced) {
  const Job job =
      read_text("data = \"${title}/data\"\ntitle = \"T\"\ndem = \"${data}/a${title}.tif\"\n");
  EXPECT_EQ(job.dem.resolved, "T/data/aT.tif");
  EXPECT_EQ(job.dem.written, "${data}/a${title}.tif");
  EXPECT_THAT(error_of("title = \"${titl}\""),
              AllOf(StartsWith("demo.toml:1:9: "), HasSubstr("nearest: \"title\"")));
  EXPECT_THAT(error_of("title = \"${seed}\"\nseed = 4"), HasSubstr("seed is a whole number"));
  EXPECT_THAT(error_of("title = \"${title\""), HasSubstr("closing brace"));
  EXPECT_THAT(error_of("title = \"${dem}\"\ndem = \"${title}\""),
              HasSubstr("hold each other in a loop"));
}

TEST(TomlReaderTest, NamesThatMultiplyAreStopped) {
  std::string text = "title = \"${data}\"\ndata = \"${a0}\"\n";
  for (int i = 0; i < 60; ++i) text += fmt::format("a{} = \"${{a{}}}${{a{}}}\"\n", i, i + 1, i + 1);
  text += "a60 = \"\"\n";
  EXPECT_THAT(error_of(text), HasSubstr("more than 1000 replacements"));
}

class TomlFilesTest : public testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) { write_file(folder_ / name, text); }
  Job read(const std::string& name, const std::vector<std::string>& sets = {}) {
    return read_toml<Job>(folder_ / name, sets);
  }
  std::string error(const std::string& name, const std::vector<std::string>& sets = {},
                    ErrorKind kind = ErrorKind::Config) {
    return config_error([&] { read(name, sets); }, kind);
  }
  std::string path(const std::string& name) { return (folder_ / name).string(); }

  test::ScratchFolder folder_;
};

TEST_F(TomlFilesTest, ExtendsMergesTablesAndReplacesTheRest) {
  write("base.toml",
        "title = \"base\"\nseed = 5\nextra = [\"b1\", \"b2\"]\ndem = \"b.tif\"\n"
        "[trajectory]\nkind = \"orbit\"\nrate_hz = 2\n");
  write("sub/middle.toml", "extends = \"../base.toml\"\nseed = 6\nextra = [\"m.tif\"]\n");
  write("sub/top.toml", "extends = \"middle.toml\"\n[trajectory]\nrate_hz = 3\n");
  const Job job = read("sub/top.toml");
  EXPECT_EQ(job.title, "base");
  EXPECT_EQ(job.seed, 6);
  EXPECT_EQ(job.trajectory.kind, "orbit");
  EXPECT_EQ(job.trajectory.rate_hz, 3.0);
  ASSERT_EQ(job.extra.size(), 1U);
  EXPECT_EQ(job.extra[0].resolved, folder_ / "sub/m.tif");
  // A path starts at the file it is written in, not at the one that extends it.
  EXPECT_EQ(std::filesystem::weakly_canonical(job.dem.resolved), folder_ / "b.tif");
}

TEST_F(TomlFilesTest, ErrorsInABaseNameTheBase) {
  write("base.toml", "\nsed = 5\n");
  write("top.toml", "extends = \"base.toml\"\n");
  EXPECT_THAT(error("top.toml"), StartsWith(path("base.toml") + ":2:1: unknown key"));
}

TEST_F(TomlFilesTest, SectionsAndItemsMayBeFiles) {
  write("job.toml",
        "data = \"store\"\ntrajectory = \"parts/path.toml\"\n"
        "rigs = [\"parts/rig.toml\", { name = \"b\", cameras = [{}] }]\n");
  write("parts/path.toml", "kind = \"waypoints\"\n");
  write("parts/rig.toml", "name = \"a\"\ncameras = [\"camera.toml\"]\n");
  write("parts/camera.toml", "focal_length_mm = 50\ncalibration = \"${data}/lens.json\"\n");
  const Job job = read("job.toml", {"rigs.0.cameras.0.model=brown_conrady"});
  EXPECT_EQ(job.trajectory.kind, "waypoints");
  ASSERT_EQ(job.rigs.size(), 2U);
  EXPECT_EQ(job.rigs[0].name, "a");
  EXPECT_EQ(job.rigs[0].cameras[0].focal_length_mm, 50.0);
  EXPECT_EQ(job.rigs[0].cameras[0].model, "brown_conrady");
  // data was written in job.toml, so it is found from there.
  EXPECT_EQ(job.rigs[0].cameras[0].calibration.resolved, folder_ / "store/lens.json");
  EXPECT_EQ(job.rigs[0].cameras[0].calibration.written, "${data}/lens.json");
  EXPECT_EQ(job.rigs[1].name, "b");
}

TEST_F(TomlFilesTest, SetPathsStartAtTheWorkingDirectory) {
  write("job.toml", "dem = \"${data}/a.tif\"\ndata = \"here\"\n");
  EXPECT_EQ(read("job.toml").dem.resolved, folder_ / "here/a.tif");
  EXPECT_EQ(read("job.toml", {"data=../shared"}).dem.resolved, "../shared/a.tif");
  EXPECT_EQ(read("job.toml", {"data=/abs"}).dem.resolved, "/abs/a.tif");
  EXPECT_EQ(read("job.toml", {"dem=x.tif"}).dem.resolved, "x.tif");
}

TEST_F(TomlFilesTest, SetsReachIntoFilesWhosePathNeedsAnotherSet) {
  write("job.toml", "trajectory = \"${data}/path.toml\"\n");
  write("store/path.toml", "kind = \"waypoints\"\n");
  const Job job = read("job.toml", {"trajectory.rate_hz=4", "data=" + path("store")});
  EXPECT_EQ(job.trajectory.kind, "waypoints");
  EXPECT_EQ(job.trajectory.rate_hz, 4.0);
}

TEST_F(TomlFilesTest, LoopsListTheFiles) {
  write("a.toml", "extends = \"b.toml\"\n");
  write("b.toml", "extends = \"sub/../a.toml\"\n");
  write("sub/keep", "");
  EXPECT_THAT(error("a.toml"), HasSubstr("include each other in a loop: " + path("a.toml") +
                                         " -> " + path("b.toml") + " -> " + path("sub/../a.toml")));
  write("self.toml", "extends = \"self.toml\"\n");
  EXPECT_THAT(error("self.toml"), HasSubstr(path("self.toml") + " -> " + path("self.toml")));
  write("section.toml", "trajectory = \"middle.toml\"\n");
  write("middle.toml", "extends = \"section.toml\"\n");
  EXPECT_THAT(error("section.toml"), HasSubstr(path("section.toml") + " -> " + path("middle.toml") +
                                               " -> " + path("section.toml")));
  write("rigs.toml", "rigs = [\"rigs.toml\"]\n");
  EXPECT_THAT(error("rigs.toml"), HasSubstr("include each other in a loop"));
  EXPECT_THAT(error("job2.toml", {}, ErrorKind::Io), HasSubstr(path("job2.toml")));
}

TEST_F(TomlFilesTest, OneFileMayBeUsedTwice) {
  write("job.toml", "rigs = [\"rig.toml\", \"rig.toml\"]\n");
  write("rig.toml", "cameras = [{}]\n");
  EXPECT_EQ(read("job.toml").rigs.size(), 2U);
}

TEST_F(TomlFilesTest, MissingFilesNameWhoWantsThem) {
  write("job.toml", "\ntrajectory = \"gone.toml\"\n");
  EXPECT_THAT(error("job.toml", {}, ErrorKind::Io),
              AllOf(StartsWith(path("gone.toml") + ": cannot be read: No such file"),
                    HasSubstr("while reading trajectory (" + path("job.toml") + ":2:14)")));
  write("top.toml", "extends = \"gone.toml\"\n");
  EXPECT_THAT(error("top.toml", {}, ErrorKind::Io), HasSubstr(path("top.toml") + ":1:11"));
  write("bad.toml", "extends = 5\n");
  EXPECT_THAT(error("bad.toml"), HasSubstr("bad.toml:1:11: extends = 5, but must be the path"));
}

TEST(TomlHostileTest, DeepOrHugeTextIsRefused) {
  const auto refused = [](const std::string& text) {
    EXPECT_THROW(TomlDocument::parse(text, "bad.toml"), Error) << text.substr(0, 40);
  };
  const std::size_t count = 200000;
  refused("a = " + std::string(count, '['));
  std::string braces = "a = ";
  for (std::size_t i = 0; i < count; ++i) braces += "{a=";
  refused(braces);
  std::string dots = "a";
  for (std::size_t i = 0; i < count; ++i) dots += ".a";
  refused(dots + " = 1");
  refused("[" + dots + "]");
  std::string quoted = "\"x,\"";
  for (std::size_t i = 0; i < count; ++i) quoted += " . 'x\"'";
  refused(quoted + " = 1");
  std::string escaped = "\"\\\",\"";
  for (std::size_t i = 0; i < count; ++i) escaped += ".\"\\\"=\"";
  refused("[[" + escaped + "]]");
  refused("a = {" + dots + " = 1}");
  refused(std::string((std::size_t{16} << 20) + 1, '\n'));
  refused(std::string("a = \"\0\"", 7));
  refused("a = \"\xff\"");
  refused("\"");
  refused("a = '''");
  refused("a = \"\\");
  // 32 parts in each of many nested values: deeper than what is read, far from the stack's end.
  std::string part = "a";
  for (int i = 0; i < 31; ++i) part += ".a";
  std::string nested = "";
  for (int i = 0; i < 200; ++i) nested += part + " = {";
  refused(nested + std::string(200, '}'));
}

TEST(TomlHostileTest, DotsInTextAndNumbersAreNoKeys) {
  std::string dots;
  for (int i = 0; i < 1000; ++i) dots += "a.";
  std::string numbers;
  for (int i = 0; i < 1000; ++i) numbers += "1.5, ";
  const Job job = read_text("# " + dots + "\ntitle = \"\"\"" + dots + "\n" + dots +
                            "\"\"\"\ndem = '" + dots + "'\n");
  EXPECT_EQ(job.dem.written, dots);
  EXPECT_THAT(error_of("[spare]\noffset_mm = [" + numbers + "]"), HasSubstr("has 1000 values"));
}

TEST(TomlHostileTest, DamagedTextNeverCrashes) {
  const std::string good =
      "title = \"t\"\nextra = [\"a\", 'b']\n[trajectory]\nkind = \"orbit\"\nrate_hz = 1.5e1\n"
      "[[rigs]]\ncameras = [{focal_length_mm = 20, offset_mm = [1,2,3]}]\n";
  std::uint32_t state = 1;
  const auto random = [&state](std::size_t limit) {
    state = state * 1664525U + 1013904223U;
    return (state >> 8) % limit;
  };
  const std::string letters = "\"'[]{}.=,\n #\\a1-$\xc3";
  for (int round = 0; round < 3000; ++round) {
    std::string text = good;
    for (std::size_t i = 0; i <= random(4); ++i)
      text[random(text.size())] = letters[random(letters.size())];
    if (random(4) == 0) text.resize(random(text.size()));
    try {
      read_text(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Config);
    }
  }
}

}  // namespace
}  // namespace terracast::core
