#include "cli/reference.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "core/toml_reader.h"
#include "export/exporter.h"

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

TEST(Reference, DocumentedClassesAreThoseOfTheProgram) {
  EXPECT_EQ(text_of(kSource / "docs/classes.md"), classes_page())
      << "docs/classes.md is stale; write it again: terracast docs classes -o docs/classes.md";
}

TEST(Reference, EachClassIsListedOnALine) {
  const std::string text = list_text("classes");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 55);  // and the head
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
  // A kind's name explains all that it takes.
  EXPECT_NE(explain_text("survey").find("sidelap"), std::string::npos);
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
