#include "batch/dataset/dataset_card.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <sstream>

#include "batch/dataset/licence.h"
#include "batch/dataset/reading.h"
#include "core/json.h"
#include "export/exporter.h"
#include "tests/batch/sample_facts.h"

namespace terracast::batch {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// Cells of a table's line: bars that no backslash stands before.
std::size_t num_cells(const std::string& line) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\\')
      ++i;
    else if (line[i] == '|')
      ++count;
  }
  return count - 1;
}

TEST(DatasetCard, SaysWhatIsThere) {
  const std::string card = dataset_card(sample_facts());
  EXPECT_THAT(card,
              HasSubstr("# Flights through valleys\n\nLow flights.\n\nFor depth and odometry.\n"));
  EXPECT_THAT(card, HasSubstr("| 2 | 3 | 1 200 | 3 600 | 4.502 km | 2 | 16.1 MB |"));
  EXPECT_THAT(
      card,
      HasSubstr(
          "| andorra | 42.5404° N, 1.5796° E | 51.2 km a side | measured | 2 | 800 |\n"
          "| taveuni | 16.8500° S, 179.9700° W | 25.6 km a side | made from a seed | 1 | 400 |\n"));
  EXPECT_THAT(card, HasSubstr("| down | cam0 | pinhole | 720 x 640 px | 720, 719.5 px |\n"
                              "| stereo | left | pinhole | 1241 x 376 px | 718.856 px |\n"
                              "| stereo | right | pinhole | 1241 x 376 px | 718.856 px |\n"));
  EXPECT_THAT(card, HasSubstr("| COLMAP | `colmap/<run>/` | 11 | 8.08 MB | Each"));
  EXPECT_THAT(card, HasSubstr("| [train](splits/train.txt) | 1 | 400 | 1 200 | 33.3 % | 1 |"));
  EXPECT_THAT(card, HasSubstr("1.5 km or more lie between"));
  EXPECT_THAT(card, HasSubstr("up to 3 km from the camera"));
  EXPECT_THAT(card, HasSubstr("The 3 sequences fall into 3 groups."));
  EXPECT_THAT(card, HasSubstr("**Every bound holds.**"));
  EXPECT_THAT(
      card, HasSubstr("| colmap_points | 4 001 | ≥ 2 000 | points (at least) | 2 | colmap/run0 |\n"
                      "| reprojection | 4.18e-05 | ≤ 0.002 | of the depth | 4 | colmap/run1 |\n"));
  EXPECT_THAT(card, HasSubstr("though their format could: colmap_points (1)."));
  EXPECT_THAT(card, HasSubstr("The dataset: CC-BY-4.0."));
  EXPECT_THAT(card, HasSubstr("- ODbL-1.0 (andorra)\n- SRTM, NASA/USGS; public domain (andorra)\n"
                              "- generated; free of rights (taveuni)\n"));
  EXPECT_THAT(card, HasSubstr("![All sequences by split](plots/map.png)"));
  EXPECT_THAT(card, HasSubstr("![Depth of all pixels](plots/depth.png)"));
  EXPECT_THAT(card, HasSubstr("sha256sum -c --quiet SHA256SUMS"));
  EXPECT_THAT(
      card,
      HasSubstr(
          "terracast 0.1.0, config valleys, seeds 1 to 2, 4, 9, draws of the sweep by seed 7."));
  EXPECT_THAT(card,
              HasSubstr("    @misc{valleys,\n      title = {Flights through valleys}\n    }\n"));
}

TEST(DatasetCard, BeginsWithWhatHuggingFaceReads) {
  DatasetFacts facts = sample_facts();
  EXPECT_THAT(
      dataset_card(facts),
      testing::StartsWith("---\npretty_name: \"Flights through valleys\"\nlicense: cc-by-4.0\n"
                          "size_categories:\n- 1K<n<10K\n"));
  facts.publication.licence = "Our \"own\" terms";
  facts.publication.licence_url = "https://example.org/terms";
  EXPECT_THAT(dataset_card(facts),
              HasSubstr("license: other\nlicense_name: \"Our \\\"own\\\" terms\"\n"
                        "license_link: \"https://example.org/terms\"\n"));
  facts.publication.licence = facts.publication.licence_url = "";
  facts.publication.title = "";
  facts.sequences.resize(1);
  facts.sequences[0].num_frames = 333;
  EXPECT_THAT(dataset_card(facts), HasSubstr("pretty_name: \"valleys\"\nlicense: other\n"));
  EXPECT_THAT(dataset_card(facts), HasSubstr("- n<1K\n"));  // 999 images
  facts.sequences[0].num_frames = 1000000;
  EXPECT_THAT(dataset_card(facts), HasSubstr("- 1M<n<10M\n"));
}

TEST(DatasetCard, NamesBoundsThatDoNotHold) {
  DatasetFacts facts = sample_facts();
  facts.checks[0].num_failed = 2;
  facts.checks[0].value = 1e300;  // as report.json writes what is no number
  const std::string card = dataset_card(facts);
  EXPECT_THAT(card, Not(HasSubstr("Every bound holds")));
  EXPECT_THAT(
      card, HasSubstr("**Bounds that do not hold, and in how many datasets: reprojection (2).**"));
  EXPECT_THAT(card, HasSubstr("| reprojection | no number |"));
}

TEST(DatasetCard, OfAnyDistanceSaysSo) {
  DatasetFacts facts = sample_facts();
  facts.within_m = std::numeric_limits<double>::infinity();
  EXPECT_THAT(dataset_card(facts),
              HasSubstr("Ground counts as seen at any distance from the camera."));
}

TEST(DatasetCard, DoesNotDependOnTheOrderOfItsFacts) {
  const DatasetFacts facts = sample_facts();
  DatasetFacts turned = facts;
  std::reverse(turned.runs.begin(), turned.runs.end());
  std::reverse(turned.sequences.begin(), turned.sequences.end());
  std::reverse(turned.places.begin(), turned.places.end());
  std::reverse(turned.cameras.begin(), turned.cameras.end());
  std::reverse(turned.checks.begin(), turned.checks.end());
  std::reverse(turned.files.begin(), turned.files.end());
  std::reverse(turned.making.seeds.begin(), turned.making.seeds.end());
  EXPECT_EQ(dataset_card(turned), dataset_card(facts));
}

TEST(DatasetCard, ShowsHostileNamesAsTheyAre) {
  const std::string hostile = "| x |\n---\n# [a](http://b) <img src=x> `c` \\";
  DatasetFacts facts = sample_facts();
  const std::vector<std::string> honest = lines_of(dataset_card(facts));
  facts.publication.title = facts.publication.description = facts.publication.licence = hostile;
  facts.publication.cite_as = "@misc\n```\n# no heading";
  for (PlaceFacts& place : facts.places) {
    for (SequenceFacts& sequence : facts.sequences)
      if (sequence.world == place.world) sequence.world += hostile;
    place.world += hostile;
    place.licences = {hostile};
  }
  for (CameraFacts& camera : facts.cameras) camera.rig = camera.camera = camera.model = hostile;
  for (CheckFacts& check : facts.checks) check.name = check.unit = check.run = hostile;
  facts.split_words = facts.making.program_version = hostile;
  facts.making.configs = {hostile};
  for (PlotFacts& plot : facts.plots) plot.title = hostile;
  const std::string card = dataset_card(facts);

  // Each table has as many cells a line as its head, each heading is ours, no mark is bare.
  std::vector<std::string> headings;
  std::size_t cells = 0;
  for (const std::string& line : lines_of(card.substr(card.find("\n---\n") + 5))) {
    if (line.starts_with("    ")) continue;  // code
    if (line.starts_with("#")) headings.push_back(line);
    if (line.starts_with("|")) {
      if (cells == 0) cells = num_cells(line);
      EXPECT_EQ(num_cells(line), cells) << line;
    } else {
      cells = 0;
    }
    EXPECT_THAT(line, Not(ContainsRegex("[^\\\\]<img")));
    EXPECT_THAT(line, Not(ContainsRegex("[^\\\\]\\]\\(http")));
  }
  std::vector<std::string> honest_headings;
  for (const std::string& line : honest)
    if (line.starts_with("#")) honest_headings.push_back(line);
  ASSERT_EQ(headings.size(), honest_headings.size());
  EXPECT_TRUE(std::equal(headings.begin() + 1, headings.end(), honest_headings.begin() + 1));
  // The front matter is what it was, its texts in quotes that JSON reads back.
  const std::vector<std::string> lines = lines_of(card);
  ASSERT_TRUE(lines[1].starts_with("pretty_name: "));
  EXPECT_THAT(core::Json::parse(lines[1].substr(13), "title").string(), HasSubstr("\\x0a---\\x0a"));
  EXPECT_EQ(std::count(lines.begin(), lines.end(), "---"), 2);
}

TEST(DatasetCard, HasASentenceForEveryFormat) {
  for (const exporters::ExporterInfo& exporter : exporters::exporters()) {
    EXPECT_NE(reading_of(exporter.name).title, exporter.name)
        << "add it to batch/dataset/reading.cpp";
    EXPECT_FALSE(reading_of(exporter.name).tags.empty());
    EXPECT_EQ(reading_of(exporter.name).words.find('|'), std::string_view::npos);
  }
  EXPECT_EQ(reading_of("other").title, "other");
}

TEST(Licences, AreFoundByTheirIdentifier) {
  EXPECT_EQ(licence_names("CC-BY-4.0").hugging_face, "cc-by-4.0");
  EXPECT_EQ(licence_names("cc-by-4.0").url, "https://spdx.org/licenses/CC-BY-4.0.html");
  EXPECT_EQ(licence_names("odbl-1.0").hugging_face, "odbl");
  EXPECT_EQ(licence_names("CC-BY-4").hugging_face, "other");
  EXPECT_EQ(licence_names("").url, "");
}

}  // namespace
}  // namespace terracast::batch
