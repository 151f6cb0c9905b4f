// The laws that plug-ins are tried by, over the program's own kinds: a law that our own kinds break is none.

#include <gtest/gtest.h>

#include "core/toml_reader.h"
#include "plugins/law_ground.h"
#include "tests/support/made_once.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

using plugins::LawGround;
using plugins::LawReport;

LawGround ground() {
  return {made_once("law_ground", "",
                    [](const std::filesystem::path& folder) { plugins::make_law_ground(folder); })};
}

/// Keys of kinds that have some without a default.
std::string keys_of(std::string_view kind) {
  if (kind == "events") return "width_px = 24\nheight_px = 16\nfx_px = 30.0\n";
  if (kind == "kitti_object") return "camera = \"left\"\n";
  if (kind == "kitti" || kind == "kitti_raw")
    return "rig = \"pair\"\nleft = \"left\"\nright = \"right\"\n";
  return "";
}

struct SensorChoice : core::Choice<sensors::SensorInfo> {
  void describe(core::SchemaVisitor& visit) {
    Choice::describe(visit, "kind", "sensor", "", sensors::sensors());
  }
};

TEST(OwnLaws, SensorsKeepTheirs) {
  plugins::in_law_scene(ground(), [](const plugins::LawScene& scene) {
    for (const sensors::SensorInfo& info : sensors::sensors()) {
      SCOPED_TRACE(info.name);
      SensorChoice sensor;
      core::TomlDocument::parse(fmt::format("kind = \"{}\"\n{}", info.name, keys_of(info.name)),
                                "test")
          .read(sensor);
      LawReport report;
      plugins::try_sensor(sensor, scene, report);
      EXPECT_EQ(report.text(), "");
      EXPECT_GE(report.laws().size(), 7U);
    }
  });
}

TEST(OwnLaws, MediaKeepTheirs) {
  plugins::in_law_scene(ground(), [](const plugins::LawScene& scene) {
    for (const scene::MediumInfo& info : scene::media()) {
      if (info.is_always) continue;
      SCOPED_TRACE(info.name);
      scene::MediumChoice medium;
      core::TomlDocument::parse(fmt::format("kind = \"{}\"", info.name), "test").read(medium);
      LawReport report;
      plugins::try_medium(medium, scene, report);
      EXPECT_EQ(report.text(), "");
      EXPECT_GE(report.laws().size(), 7U);
    }
  });
}

TEST(OwnLaws, ExportersKeepTheirs) {
  const ScratchFolder folder;
  for (const char* name : {"colmap", "kitti", "terracast"}) {
    SCOPED_TRACE(name);
    exporters::ExportOptions options;
    core::TomlDocument::parse(fmt::format("format = \"{}\"\n{}", name, keys_of(name)), "test")
        .read(options);
    LawReport report;
    plugins::try_exporter(options, ground().captures(), folder / name, report);
    EXPECT_EQ(report.text(), "");
    EXPECT_GE(report.laws().size(), 8U);
  }
}

TEST(OwnLaws, ChecksKeepTheirs) {
  for (const validate::CheckInfo& info : validate::checks()) {
    SCOPED_TRACE(info.name);
    LawReport report;
    plugins::try_check(info, ground().datasets(), report);
    EXPECT_EQ(report.text(), "");
  }
}

TEST(OwnLaws, LayersKeepTheirs) {
  const ScratchFolder folder;
  tiler::LayerOptions layer;
  core::TomlDocument::parse("kind = \"land_cover\"\nsource = \"derived\"", "test").read(layer);
  LawReport report;
  plugins::try_layer(layer, folder.path(), report);
  EXPECT_EQ(report.text(), "");
  EXPECT_EQ(report.laws().size(), 4U);
}

}  // namespace
}  // namespace terracast::test
