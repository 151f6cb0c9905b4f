#include "cli/run_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "cli/reference.h"
#include "core/schema_writer.h"
#include "core/toml_reader.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
const fs::path kSource = TERRACAST_SOURCE_DIR;

std::string text_of(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

TEST(Configs, EveryJobThatIsShippedReads) {
  int num_jobs = 0;
  for (const auto& entry : fs::directory_iterator(kSource / "configs")) {
    if (entry.path().extension() != ".toml") continue;
    ++num_jobs;
    EXPECT_NO_THROW(load_run_config(entry.path(), {})) << entry.path();
  }
  EXPECT_GE(num_jobs, 3);
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
    EXPECT_EQ(rig.mount_pitch_deg, 30.0);
    EXPECT_GE(rig.cameras.size(), 2u);
  }
}

TEST(Reference, DocumentedKeysAreThoseOfTheProgram) {
  EXPECT_EQ(text_of(kSource / "docs/config.md"), reference_text())
      << "docs/config.md is stale; write it again: terracast docs -o docs/config.md";
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
