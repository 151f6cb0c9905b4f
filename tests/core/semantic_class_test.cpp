#include "core/semantic_class.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "core/toml_reader.h"

namespace terracast::core {
namespace {

/// configs/classes.toml as any reader of TOML sees it; the build reads it by CMake alone.
struct Row {
  std::int64_t id = -1, cityscapes = -1, ade20k = -1, coco = -1;
  std::string name, color, parent, kind, meaning;
  void describe(SchemaVisitor& visit) {
    visit.key("id", id, "");
    visit.key("name", name, "");
    visit.key("color", color, "");
    visit.key("parent", parent, "");
    visit.key("kind", kind, "");
    visit.key("cityscapes", cityscapes, "");
    visit.key("ade20k", ade20k, "");
    visit.key("coco", coco, "");
    visit.key("meaning", meaning, "");
  }
};
struct Table {
  std::vector<Row> rows;
  void describe(SchemaVisitor& visit) { visit.list("class", rows, ""); }
};

TEST(SemanticClasses, TableIsThatOfTheConfigFile) {
  Table table;
  TomlDocument::load(std::string(TERRACAST_SOURCE_DIR) + "/configs/classes.toml").read(table);
  ASSERT_EQ(semantic_classes().size(), table.rows.size());
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    const Row& row = table.rows[i];
    const SemanticClassInfo& info = semantic_classes()[i];
    EXPECT_EQ(row.id, static_cast<std::int64_t>(i));
    EXPECT_EQ(static_cast<std::size_t>(info.id), i);
    EXPECT_EQ(info.name, row.name);
    EXPECT_EQ(semantic_class_names()[i], row.name);
    EXPECT_EQ(info.meaning, row.meaning);
    EXPECT_EQ(fmt::format("#{:02x}", fmt::join(info.color_srgb, "")), row.color);
    EXPECT_EQ(info.parent, row.parent);
    EXPECT_EQ(info.is_thing ? "thing" : "stuff", row.kind);
    EXPECT_EQ(info.cityscapes_id, row.cityscapes);
    EXPECT_EQ(info.ade20k_id, row.ade20k);
    EXPECT_EQ(info.coco_id, row.coco);
  }
}

// Numbers stand in files that were written long ago: whoever changes one breaks them.
TEST(SemanticClasses, NumbersInFilesKeepTheirMeaning) {
  EXPECT_EQ(static_cast<int>(SemanticClass::Sky), 0);
  EXPECT_EQ(static_cast<int>(SemanticClass::Sea), 2);
  EXPECT_EQ(static_cast<int>(SemanticClass::ForestFloor), 9);
  EXPECT_EQ(static_cast<int>(SemanticClass::BuiltUp), 13);
  EXPECT_EQ(static_cast<int>(SemanticClass::Seabed), 16);
  EXPECT_EQ(static_cast<int>(SemanticClass::RoadMarking), 18);
  EXPECT_EQ(static_cast<int>(SemanticClass::Building), 25);
  EXPECT_EQ(static_cast<int>(SemanticClass::Tree), 28);
  EXPECT_EQ(static_cast<int>(SemanticClass::WindTurbine), 47);
  EXPECT_EQ(static_cast<int>(SemanticClass::Cloud), 50);
  EXPECT_EQ(static_cast<int>(SemanticClass::Nothing), 51);
}

TEST(SemanticClasses, ColorsAndNamesAreEachTheirOwn) {
  std::set<std::array<std::uint8_t, 3>> colors;
  std::set<std::string_view> names;
  for (const SemanticClassInfo& info : semantic_classes()) {
    EXPECT_TRUE(colors.insert(info.color_srgb).second) << info.name;
    EXPECT_TRUE(names.insert(info.name).second) << info.name;
  }
}

// What the sets themselves say of a few of their numbers, copied by hand from their files.
TEST(SemanticClasses, NumbersOfOtherSetsAreTheirs) {
  const auto info = [](SemanticClass id) {
    return semantic_classes()[static_cast<std::size_t>(id)];
  };
  EXPECT_EQ(info(SemanticClass::Sky).cityscapes_id, 23);
  EXPECT_EQ(info(SemanticClass::Tree).cityscapes_id, 21);   // vegetation
  EXPECT_EQ(info(SemanticClass::Grass).cityscapes_id, 22);  // terrain
  EXPECT_EQ(info(SemanticClass::Building).ade20k_id, 2);    // building, edifice
  EXPECT_EQ(info(SemanticClass::Lake).ade20k_id, 129);      // lake
  EXPECT_EQ(info(SemanticClass::Runway).ade20k_id, 55);     // runway
  EXPECT_EQ(info(SemanticClass::Building).coco_id, 197);    // building-other-merged
  EXPECT_EQ(info(SemanticClass::Aircraft).coco_id, 5);      // airplane
  EXPECT_EQ(info(SemanticClass::Railway).coco_id, 147);     // railroad
  EXPECT_EQ(info(SemanticClass::Snow).coco_id, 159);        // snow
}

}  // namespace
}  // namespace terracast::core
