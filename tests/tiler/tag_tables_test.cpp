#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/buildings/building_tags.h"
#include "tiler/known_tags.h"
#include "tiler/objects/object_tags.h"
#include "tiler/roads/road_tags.h"
#include "tiler/roads/way_style.h"
#include "tiler/tag_ledger.h"
#include "tiler/water/water_tags.h"

// What layers know of tags. That no code asks for a tag that is not in its table is proved by compilation (TagsOf).
namespace terracast::test {
namespace {

using tiler::FeatureTags;
using tiler::TagRule;
using tiler::TagTable;
using Tags = std::vector<std::pair<std::string, std::string>>;

std::vector<TagTable> all_tables() {
  return {tiler::building_tag_table(), tiler::road_tag_table(), tiler::water_tag_table(),
          tiler::object_tag_table()};
}

std::string sources(const std::vector<std::string>& folders,
                    const std::vector<std::string>& files) {
  std::string all;
  const std::filesystem::path root = std::filesystem::path(TERRACAST_SOURCE_DIR) / "tiler";
  const auto add = [&](const std::filesystem::path& file) {
    std::ifstream in(file);
    EXPECT_TRUE(in.good()) << file;
    all.append(std::istreambuf_iterator<char>(in), {});
  };
  for (const std::string& folder : folders)
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder))
      if (entry.path().extension() == ".cpp" || entry.path().extension() == ".h")
        if (entry.path().filename().string().find("_tags.") == std::string::npos) add(entry.path());
  for (const std::string& file : files) add(root / file);
  return all;
}

void expect_all_are_asked(std::span<const TagRule> rules, const std::string& text,
                          const std::string& of) {
  for (const TagRule& rule : rules)
    EXPECT_NE(text.find("(\"" + std::string(rule.name) + "\""), std::string::npos)
        << of << " knows " << rule.name << ", and asks for it nowhere";
}

TEST(TagTables, HoldNoTagThatIsNeverAsked) {
  expect_all_are_asked(
      tiler::kBuildingTags,
      sources({"buildings"}, {"layers/buildings.cpp", "buildings/building_tags.cpp"}), "buildings");
  expect_all_are_asked(tiler::kRoadTags, sources({"roads"}, {"layers/roads.cpp"}), "roads");
  expect_all_are_asked(tiler::kWaterTags, sources({"water"}, {"layers/water.cpp"}), "water");
  expect_all_are_asked(tiler::kObjectTags, sources({"objects"}, {"layers/objects.cpp"}), "objects");
  expect_all_are_asked(tiler::kSightTags, sources({}, {"out_of_sight.cpp"}), "the rule of sight");
}

// Past TagsOf nothing would be known of what is asked.
TEST(TagTables, AreAskedByTheirTypesAlone) {
  const std::regex raw(R"((\.tags|tags->|_tags)\.?(value|find|has|all)\()");
  const std::string text =
      sources({"buildings", "roads", "water", "objects/rules"},
              {"layers/buildings.cpp", "layers/roads.cpp", "layers/water.cpp", "layers/objects.cpp",
               "objects/rules.cpp", "objects/clear_strips.cpp", "out_of_sight.cpp"});
  std::set<std::string> found;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), raw); at != std::sregex_iterator();
       ++at) {
    const auto line_begin = text.rfind('\n', static_cast<std::size_t>(at->position())) + 1;
    found.insert(text.substr(line_begin, text.find('\n', line_begin) - line_begin));
  }
  // The order of copies needs all tags; whether a width is there at all is asked by its rule.
  std::erase_if(found, [](const std::string& line) {
    return line.find("tags->all()") != std::string::npos ||
           line.find("has(key.rule().name)") != std::string::npos;
  });
  EXPECT_TRUE(found.empty()) << *found.begin();
}

TEST(TagTables, CountEveryTagByWhatBecomesOfIt) {
  for (const TagTable& table : all_tables()) {
    Tags tags = {{"shoe_size", "43"}, {"addr:street", "Main Street"}, {"source", "survey"}};
    std::set<std::string> used;
    for (const TagRule& rule : table.rules) used.insert(std::string(rule.name));
    for (const std::string& name : used) tags.emplace_back(name, "no such value of any");
    tiler::VectorFeature feature;
    feature.tags = FeatureTags(tags);
    const core::Ledger ledger = tiler::ledger_of_tags(std::vector{feature, feature}, table);
    EXPECT_EQ(ledger.entries().size(), used.size() + 3) << table.layer;
    for (const auto& [name, entry] : ledger.entries()) {
      EXPECT_EQ(entry.num_used, used.contains(name) ? 2 : 0) << table.layer << " " << name;
      EXPECT_EQ(entry.num_unknown, name == "shoe_size" ? 2 : 0) << table.layer << " " << name;
      EXPECT_EQ(entry.num_ignored, name == "source" || name == "addr:street" ? 2 : 0) << name;
      EXPECT_EQ(entry.why.empty(), entry.num_ignored == 0) << name;
      const TagRule* rule = tiler::find_rule(table.rules, name);
      const bool is_free = rule == nullptr || rule->value == tiler::TagValue::Text ||
                           (rule->value == tiler::TagValue::Word && rule->known.empty() &&
                            rule->is_known == nullptr);
      EXPECT_EQ(entry.num_not_understood(), is_free ? 0 : 2) << table.layer << " " << name;
    }
    for (const core::KnownName& name : table.names) EXPECT_FALSE(name.words.empty()) << name.name;
    EXPECT_EQ(tiler::ledger_of_tags(std::vector{feature}, table, "shoe_size")
                  .entries()
                  .at("shoe_size")
                  .num_used,
              1);
  }
}

TEST(TagTables, ValuesOfTheWildAreUnderstoodOrNamed) {
  const auto not_understood = [](const TagTable& table, const Tags& tags) {
    tiler::VectorFeature feature;
    feature.tags = FeatureTags(tags);
    std::set<std::string> names;
    const core::Ledger ledger = tiler::ledger_of_tags(std::vector{feature}, table);
    for (const auto& [name, entry] : ledger.entries())
      if (entry.num_not_understood() > 0) names.insert(name);
    return names;
  };
  using Names = std::set<std::string>;
  const TagTable buildings = tiler::building_tag_table();
  EXPECT_EQ(not_understood(buildings, {{"building", "yes"},
                                       {"height", "12,5 m"},
                                       {"building:levels", "2;3"},
                                       {"roof:direction", "NNE"},
                                       {"roof:colour", "#AABBCC"},
                                       {"layer", "-1"},
                                       {"roof:height", "0"},
                                       {"min_height", "0"},
                                       {"roof:angle", "30\xC2\xB0"}}),
            Names());
  EXPECT_EQ(not_understood(buildings, {{"building", "synagogue"},
                                       {"height", "0"},
                                       {"building:levels", "-1"},
                                       {"roof:direction", "uphill"},
                                       {"roof:colour", "bluish"},
                                       {"roof:shape", "many"},
                                       {"building:material", "cheese"},
                                       {"min_height", "-3"},
                                       {"covered", "partly"}}),
            (Names{"building", "height", "building:levels", "roof:direction", "roof:colour",
                   "roof:shape", "building:material", "min_height", "covered"}));
  const TagTable roads = tiler::road_tag_table();
  EXPECT_EQ(not_understood(roads, {{"highway", "residential"},
                                   {"bridge", "viaduct"},
                                   {"oneway", "-1"},
                                   {"lanes", "1.5"},
                                   {"maxspeed", "30 mph"},
                                   {"tunnel", "building_passage"},
                                   {"surface", "sett"},
                                   {"ref", "anything"},
                                   {"access", "destination"}}),
            Names());
  EXPECT_EQ(not_understood(roads, {{"highway", "rollerway"},
                                   {"bridge", "maybe"},
                                   {"oneway", "sometimes"},
                                   {"lanes", "many"},
                                   {"maxspeed", "walk"},
                                   {"surface", "cheese"}}),
            (Names{"highway", "bridge", "oneway", "lanes", "maxspeed", "surface"}));
  EXPECT_EQ(not_understood(tiler::water_tag_table(),
                           {{"waterway", "stream"}, {"width", "3-5"}, {"seasonal", "spring"}}),
            Names());
  EXPECT_EQ(
      not_understood(
          tiler::object_tag_table(),
          {{"power", "line"}, {"voltage", "380000;110000"}, {"direction", "SW"}, {"lit", "24/7"}}),
      Names());
  EXPECT_EQ(not_understood(tiler::object_tag_table(),
                           {{"voltage", "high"}, {"direction", "forward"}, {"ship", "submarine"}}),
            (Names{"voltage", "direction", "ship"}));
}

TEST(TagTables, AreGivenOutForTheDocumentation) {
  std::set<std::string_view> readers;
  for (const core::KnownTable& table : tiler::known_tag_tables()) {
    readers.insert(table.reader);
    EXPECT_EQ(core::find_known(table.names, "name:de") != nullptr, true) << table.reader;
    EXPECT_EQ(core::find_known(table.names, "shoe_size"), nullptr) << table.reader;
  }
  EXPECT_EQ(readers, (std::set<std::string_view>{"buildings", "objects", "roads", "water"}));
}

// A right file with a tag more than the layer knows.
TEST(TagTables, LayersTellWhatTheyDidNotKnow) {
  const ScratchFolder folder;
  write_vectors(folder / "a.gpkg", "GPKG",
                {{wkt(0, 0, 12, 9),
                  {{"building", "yes"}, {"height", "tall"}, {"shoe_size", "43"}, {"name", "A"}}},
                 {wkt(40, 0, 12, 9), {{"building", "yes"}, {"height", "9"}, {"shoe_size", ""}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  const core::Ledger ledger = built.layer->info().ledger;
  const auto& entries = ledger.entries();
  ASSERT_TRUE(entries.contains("shoe_size"));
  EXPECT_EQ(entries.at("shoe_size").num_unknown, 1);  // an empty field is no tag
  EXPECT_EQ(entries.at("building").num_used, 2);
  EXPECT_EQ(entries.at("height").num_used, 2);
  EXPECT_EQ(entries.at("height").not_understood,
            (std::map<std::string, std::int64_t>{{"tall", 1}}));
  EXPECT_EQ(entries.at("name").num_ignored, 1);
  EXPECT_EQ(built.count("heights from height"), 1);
  EXPECT_EQ(built.count("heights guessed"), 1);
}

// As a file of OpenStreetMap's writes them, from the file to the finished walls.
TEST(TagTables, BuildingsAreAsHighAsTheirTagsSayInAnyUnit) {
  const std::vector<std::pair<std::string, double>> heights = {
      {"12 m", 12.0},    {"40'", 40 * 0.3048}, {"40'6\"", 40.5 * 0.3048},
      {"12,5", 12.5},    {"1250 cm", 12.5},    {"40 ft 6 in", 40.5 * 0.3048},
      {"11-12.5", 12.5}, {"~12", 12.0},        {"0.0125 km", 12.5}};
  const ScratchFolder folder;
  std::vector<VectorSpec> specs;
  for (std::size_t i = 0; i < heights.size(); ++i)
    specs.push_back({wkt(40.0 * static_cast<double>(i), 0, 12, 9),
                     {{"building", "yes"}, {"height", heights[i].first}, {"roof:shape", "flat"}}});
  write_vectors(folder / "a.gpkg", "GPKG", specs, "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("heights from height"), static_cast<std::int64_t>(heights.size()));
  std::size_t num_seen = 0;
  for (const auto& [id, solid] : built.all({})) {
    const auto row = static_cast<std::size_t>(solid.place_m.x() / 40);
    ASSERT_LT(row, heights.size());
    int top = 0;
    for (const auto& vertex : world::shape_at(solid.levels, 2)->vertices_steps)
      top = std::max(top, vertex.z());
    // Rounded to steps, and a step where the place's vertical leans.
    EXPECT_NEAR(top * world::kHeightStep_m, heights[row].second, 2 * world::kHeightStep_m)
        << heights[row].first;
    ++num_seen;
  }
  EXPECT_EQ(num_seen, heights.size());
}

TEST(FeatureTags, EmptyFieldsAreNoTags) {
  const FeatureTags tags(Tags{{"b", " x "}, {"a", ""}, {"c", "  "}, {"b", "second"}});
  EXPECT_EQ(tags.all(), (Tags{{"b", "x"}}));
  EXPECT_FALSE(tags.has("a"));
  // So is one that comes first.
  EXPECT_EQ(FeatureTags(Tags{{"b", ""}, {"b", "second"}}).value("b"), "second");
}

std::optional<tiler::WayStyle> style_of(Tags tags) {
  std::int64_t num_repaired = 0;
  tags.emplace_back("highway", "residential");
  return tiler::way_style(FeatureTags(std::move(tags)), num_repaired);
}

TEST(WayStyles, FlagsMayBeSpeltInAnyWay) {
  const auto plain = style_of({});
  for (const char* no : {"no", "F", "f", "false", "FALSE", "N", "n", "0", "off", ""}) {
    EXPECT_EQ(style_of({{"bridge", no},
                        {"tunnel", no},
                        {"covered", no},
                        {"oneway", no},
                        {"area", no},
                        {"indoor", no}}),
              plain)
        << no;
  }
  for (const char* yes : {"yes", "T", "t", "true", "TRUE", "Y", "y", "1", "on"}) {
    EXPECT_TRUE(style_of({{"bridge", yes}})->is_bridge) << yes;
    EXPECT_TRUE(style_of({{"tunnel", yes}})->is_tunnel) << yes;
    EXPECT_TRUE(style_of({{"covered", yes}})->is_tunnel) << yes;
    EXPECT_TRUE(style_of({{"oneway", yes}})->is_oneway) << yes;
    EXPECT_FALSE(style_of({{"area", yes}}).has_value()) << yes;
    EXPECT_FALSE(style_of({{"indoor", yes}}).has_value()) << yes;
  }
  // What is not understood is as if it were not there.
  EXPECT_EQ(
      style_of({{"bridge", "maybe"}, {"tunnel", "?"}, {"oneway", "sometimes"}, {"lanes", "many"}}),
      plain);
  EXPECT_TRUE(style_of({{"oneway", "reverse"}})->is_against);
  EXPECT_TRUE(style_of({{"bridge", "viaduct"}})->is_bridge);
}

TEST(WayStyles, NumbersAreReadWhole) {
  EXPECT_EQ(style_of({{"width", "24 ft"}})->half_width_m, 0.5 * 24 * 0.3048);
  EXPECT_EQ(style_of({{"width", "6,5"}})->half_width_m, 3.25);
  EXPECT_EQ(style_of({{"width", "650 cm"}})->half_width_m, 3.25);
  EXPECT_EQ(style_of({{"width", "5-7"}})->half_width_m, 3.0);
  EXPECT_EQ(style_of({{"width", "6 lanes"}}), style_of({}));
  EXPECT_EQ(style_of({{"maxspeed", "30 mph"}})->max_speed_kmph, 48);
  EXPECT_EQ(style_of({{"maxspeed", "30;50"}})->max_speed_kmph, 0);
  // A lane and a half: one is painted, as wide as both.
  const auto half = style_of({{"lanes", "1.5"}});
  EXPECT_EQ(half->num_lanes, 1);
  EXPECT_GT(half->half_width_m, 2.0);
  const auto between = style_of({{"lanes", "2;3"}});
  EXPECT_EQ(between->num_lanes, 2);
  EXPECT_GT(between->half_width_m, style_of({{"lanes", "2"}})->half_width_m);
  EXPECT_LT(between->half_width_m, style_of({{"lanes", "3"}})->half_width_m);
}

}  // namespace
}  // namespace terracast::test
