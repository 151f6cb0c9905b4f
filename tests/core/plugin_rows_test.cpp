#include "core/plugin_rows.h"

#include <gtest/gtest.h>

namespace terracast::core {
namespace {

std::string named_in(std::string_view text) {
  std::string names;
  for (const Plugin* plugin : plugins_named_in(text)) names += plugin->name + " ";
  return names;
}

// Exactly the plug-ins that take part go into hashes and cards.
TEST(PluginRows, ATextNamesAKindByItsWholeName) {
  add_plugin({.name = "dem",
              .version = "1.2",
              .licence = "MIT",
              .file = "/dem.so",
              .content_hash = "0123",
              .kinds = {"dem.laser", "dem.laser2"}},
             {});
  for (const char* text : {"kind = \"dem.laser\"", "kind='dem.laser'", "dem.laser", "dem.laser\n",
                           "+dem.laser)", "sensor dem.laser2 1", "[dem.laser]"})
    EXPECT_EQ(named_in(text), "dem ") << text;
  for (const char* text :
       {"", "dem", "file = \"dem.job\"", "file = \"in/dem.laser\"", "file = \"dem.laser.toml\"",
        "big_dem.laser", "dem.laser3", "dem.laser_", "dem.laser-2", "dem.lase", "my.dem.laser"})
    EXPECT_EQ(named_in(text), "") << text;
  EXPECT_EQ(plugin_marks("\"dem.laser\""), "plugin dem 1.2 0123\n");
  EXPECT_EQ(program_with_plugins(), "terracast --plugin '/dem.so'");
  EXPECT_EQ(bug_of_plugin("dem.laser"), "; this is a bug of plug-in dem");
  EXPECT_EQ(bug_of_plugin("rangefinder"), "");
}

TEST(PluginRows, VersionsAreNumbersOfAnySizeWithDots) {
  for (const char* version : {"1", "1.2", "0.0.9", "20261129.1", "20261129235959"})
    EXPECT_TRUE(is_plugin_version(version)) << version;
  for (const char* version : {"", "1.", ".1", "a", "1.a", "-1", "1 2", "99999999999999999999"})
    EXPECT_FALSE(is_plugin_version(version)) << version;
}

}  // namespace
}  // namespace terracast::core
