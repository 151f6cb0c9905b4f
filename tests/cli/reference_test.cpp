#include "cli/reference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "cli/sources_page.h"
#include "core/toml_reader.h"
#include "export/exporter.h"
#include "geo/camera_model.h"
#include "labels/label.h"
#include "rigs/rig.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
const fs::path kSource = TERRACAST_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(Reference, DocumentedKeysAreThoseOfTheProgram) {
  EXPECT_EQ(text_of(kSource / "docs/config.md"), reference_text())
      << "docs/config.md is stale; write it again: terracast docs -o docs/config.md";
}

// Keys of a kind stand with their kind, not among those that all items of a list have.
TEST(Reference, KeysOfAKindAreNotSaidToBeEverybodys) {
  const std::string text = reference_text();
  const std::string common = text.substr(0, text.find("\n## layers of kind"));
  EXPECT_EQ(common.find("`world.layer[].least_height_m`"), std::string::npos);
  EXPECT_EQ(common.find("`trajectories[].waypoints[].lat_deg`"), std::string::npos);
  EXPECT_NE(common.find("`world.layer[].licence`"), std::string::npos);
  EXPECT_NE(text.find("`world.layer[].least_height_m`"), std::string::npos);
}

TEST(Reference, DocumentedClassesAreThoseOfTheProgram) {
  EXPECT_EQ(text_of(kSource / "docs/classes.md"), classes_page())
      << "docs/classes.md is stale; write it again: terracast docs classes -o docs/classes.md";
}

TEST(Reference, DocumentedSourcesAreThoseOfTheProgram) {
  EXPECT_EQ(text_of(kSource / "docs/sources.md"), sources_page())
      << "docs/sources.md is stale; write it again: terracast docs sources -o docs/sources.md";
}

TEST(Reference, EachClassIsListedOnALine) {
  const std::string text = list_text("classes");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 56);  // and the head
  EXPECT_TRUE(std::regex_search(
      text, std::regex("\nvan +33 #2a2ab8 +vehicle +thing +26 +103 +3 +33  Vans\\.\n")))
      << text;
}

/// The exports of a config alone.
struct ExportsOnly {
  std::vector<exporters::ExportOptions> exports;
  void describe(core::SchemaVisitor& visit) { visit.list("exports", exports, "Formats."); }
};

TEST(Reference, TheExampleOfTheExportPageReads) {
  std::istringstream page(text_of(kSource / "docs/export.md"));
  std::string toml, line;
  while (std::getline(page, line))
    if (line.starts_with("    [[exports]]") || (!toml.empty() && line.starts_with("    ")))
      toml += line + "\n";
    else if (!toml.empty())
      break;
  ExportsOnly config;
  core::TomlDocument::parse(toml, "docs/export.md").read(config);
  ASSERT_EQ(config.exports.size(), 1u) << toml;
  EXPECT_EQ(config.exports[0].format, "kitti");
}

TEST(Reference, ExplainsHowAnItemOfAListIsSet) {
  EXPECT_NE(explain_text("num_frames").find("--set trajectories.0.num_frames=4"),
            std::string::npos);
  EXPECT_EQ(explain_text("size_m").find("--set"), std::string::npos);
  // Keys that only some recordings have; things that move have them too.
  EXPECT_NE(explain_text("x_heading_deg").find("frame = local"), std::string::npos);
  EXPECT_NE(explain_text("x_heading_deg").find("[[moving]]"), std::string::npos);
  EXPECT_NE(explain_text("local").find("origin.east_m"), std::string::npos);
  // A kind's name explains all that it takes.
  EXPECT_NE(explain_text("survey").find("sidelap"), std::string::npos);
}

// What the requirements list, by the names under which it is chosen; in one order with docs/labels.md's table.
TEST(Reference, EveryGroundTruthIsChosenByANameThatThePageHas) {
  const std::vector<std::pair<std::string, std::string>> kinds = {
      {"range along the ray", "range"},
      {"range to the bottom below water", "bottom"},
      {"depth along the optical axis", "depth"},
      {"world point", "points"},
      {"normal, world", "normals"},
      {"normal, camera", "normals"},
      {"flow to the next and the previous frame", "flow"},
      {"flow to any frame or camera (correspondence)", "pairs"},
      {"occlusion", "flow"},
      {"occluder", "flow"},
      {"out of view", "flow"},
      {"scene flow", "scene_flow"},
      {"disparity", "disparity"},
      {"semantic", "semantic"},
      {"instance", "instance"},
      {"panoptic", "panoptic"},
      {"boxes in the image, visible and amodal", "objects"},
      {"occlusion and truncation of objects", "objects"},
      {"boxes in space", "objects"},
      {"albedo", "albedo"},
      {"point tracks, of what stands and moves", "tracks"},
      {"co-visibility", "covisibility"},
      {"cloud of points", "cloud"},
      {"occupancy, TSDF", "volume"},
  };
  const std::string page = text_of(kSource / "docs/labels.md");
  const std::string listed = list_text("labels");
  for (const auto& [ground_truth, kind] : kinds) {
    SCOPED_TRACE(ground_truth);
    EXPECT_NO_THROW(labels::LabelOptions{kind});
    EXPECT_TRUE(std::regex_search(listed, std::regex("(^|\n)" + kind + " ")));
    const std::size_t row = page.find("\n| " + ground_truth + " | labels `");
    ASSERT_NE(row, std::string::npos);
    const std::string chosen_by = page.substr(row, page.find('\n', row + 1) - row);
    EXPECT_NE(chosen_by.find("`" + kind + "`"), std::string::npos) << chosen_by;
  }
  for (const labels::LabelInfo& info : labels::labels())
    EXPECT_NE(page.find(fmt::format("\n| `{}` | ", info.name)), std::string::npos) << info.name;
}

// What stands in a world besides buildings, ways and plants: the classes that `terracast list things` names.
TEST(Reference, ThingsAreOfAllKindsThatAreAskedFor) {
  std::istringstream lines(list_text("things"));
  std::vector<std::string> classes, names;
  std::string line, name, semantic_class;
  std::getline(lines, line);  // the heading
  while (std::getline(lines, line)) {
    std::istringstream(line) >> name >> semantic_class;
    names.push_back(name);
    classes.push_back(semantic_class);
  }
  EXPECT_THAT(classes,
              testing::IsSupersetOf({"car",         "van",    "truck", "bus",   "aircraft",
                                     "helicopter",  "ship",   "boat",  "pier",  "container",
                                     "warehouse",   "hangar", "crane", "pylon", "wind_turbine",
                                     "street_lamp", "person", "drone", "bush",  "wall",
                                     "train"}));
  EXPECT_THAT(names, testing::IsSupersetOf({"airliner", "light_aircraft", "container_ship", "ferry",
                                            "lighthouse", "control_tower", "water_tower", "chimney",
                                            "storage_tank", "silo", "radio_mast", "gantry_crane"}));
}

/// The indented lines after a heading of a page.
std::string example_of(const std::string& page, const std::string& heading) {
  std::istringstream lines(page.substr(page.find(heading)));
  std::string line, example;
  std::getline(lines, line);
  while (std::getline(lines, line) && !line.starts_with("#"))
    if (line.starts_with("    ")) example += line.substr(4) + "\n";
  return example;
}

TEST(Reference, EachCameraModelHasAPageWhoseExampleReads) {
  const std::string index = text_of(kSource / "docs/cameras.md");
  for (const geo::CameraModelInfo& model : geo::camera_models()) {
    SCOPED_TRACE(model.name);
    const std::string name(model.name);
    EXPECT_NE(index.find(fmt::format("[`{0}`](cameras/{0}.md)", name)), std::string::npos);
    EXPECT_TRUE(fs::exists(kSource / "docs/cameras" / (name + ".png")));
    const std::string page = text_of(kSource / "docs/cameras" / (name + ".md"));
    EXPECT_TRUE(page.starts_with("# `" + name + "`\n"));
    const bool is_from_file = model.read != nullptr;  // its parameters are no keys
    for (const geo::CameraParameter& parameter : model.parameters) {
      if (is_from_file) continue;
      const std::regex key(fmt::format("\\| `[^|]*\\b{}\\b[^|]*` \\|", parameter.name));
      EXPECT_TRUE(std::regex_search(page, key)) << parameter.name;
    }
    const std::string example = example_of(page, "## In a rig");
    EXPECT_NE(example.find("model = \"" + name + "\""), std::string::npos);
    if (is_from_file) continue;
    rigs::RigOptions rig;
    core::TomlDocument::parse(
        "name = \"rig\"\n" +
            std::regex_replace(example, std::regex(R"(\[\[rigs\.cameras)"), "[[cameras"),
        name)
        .read(rig);
    EXPECT_EQ(rigs::build_cameras({rig}).at(0).intrinsics.model, name);
  }
}

TEST(Reference, PagesOfTheReadmeExist) {
  const std::string text = text_of(kSource / "README.md");
  const std::regex link(R"(\]\(([^)#:]+)\))");
  int num_links = 0;
  for (auto match = std::sregex_iterator(text.begin(), text.end(), link);
       match != std::sregex_iterator(); ++match) {
    ++num_links;
    EXPECT_TRUE(fs::exists(kSource / (*match)[1].str())) << (*match)[1].str();
  }
  EXPECT_GE(num_links, 10);
}

}  // namespace
}  // namespace terracast::cli
