#include "tiler/land_cover/legend.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <span>
#include <string_view>
#include <utility>

#include "core/error.h"
#include "core/registry.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;
using enum LandClass;

using Codes = std::vector<std::pair<int, LandClass>>;

/// ESA WorldCover 2020 and 2021 (Product User Manual V2.0, table 1). Mangroves are trees; moss and lichen
/// look like poor grass.
const Codes& worldcover() {
  static const Codes codes = {{0, Unknown}, {10, Forest},  {20, Shrubs}, {30, Grass},
                              {40, Crops},  {50, BuiltUp}, {60, Bare},   {70, Snow},
                              {80, Lake},   {90, Wetland}, {95, Forest}, {100, Grass}};
  return codes;
}

/// The 44 classes of CORINE Land Cover (nomenclature of 2019) in the order in which its rasters number
/// them from 1.
constexpr std::array<std::pair<int, LandClass>, 44> kCorine = {{
    {111, BuiltUp},    {112, BuiltUp},    {121, BuiltUp},
    {122, BuiltUp},    {123, BuiltUp},    {124, BuiltUp},  // urban fabric … airports
    {131, Bare},       {132, Bare},       {133, Bare},     // mines, dumps, construction sites
    {141, Grass},      {142, Grass},                       // parks, sports grounds
    {211, Crops},      {212, Crops},      {213, Crops},    // arable land, rice
    {221, Crops},      {222, Crops},      {223, Crops},    // vineyards, orchards, olives
    {231, Grass},                                          // pastures
    {241, Crops},      {242, Crops},      {243, Crops},    // mixed fields
    {244, Grass},                                          // agro-forestry: pasture under trees
    {311, Forest},     {312, Forest},     {313, Forest},   //
    {321, Grass},      {322, Shrubs},     {323, Shrubs},   // grassland, heath, maquis
    {324, Shrubs},                                         // woodland that grows up
    {331, Bare},       {332, Bare},       {333, Bare},     // sands, rock, sparse plants
    {334, Bare},       {335, Snow},                        // burnt ground; glaciers
    {411, Wetland},    {412, Wetland},    {421, Wetland},  // marshes, bogs, salt marshes
    {422, Bare},       {423, Bare},                        // salines, intertidal flats
    {511, OtherWater}, {512, Lake},       {521, Lake},     // courses; bodies, lagoons
    {522, OtherWater}, {523, OtherWater},                  // estuaries, the sea
}};

/// Rasters hold either the codes of the nomenclature, or the numbers of their order; and their own codes
/// for no data and unclassified land.
const Codes& corine() {
  static const Codes codes = [] {
    Codes all(kCorine.begin(), kCorine.end());
    for (std::size_t i = 0; i < kCorine.size(); ++i)
      all.emplace_back(static_cast<int>(i) + 1, kCorine[i].second);
    for (const int code : {0, 48, 49, 50, 255, 990, 995, 999}) all.emplace_back(code, Unknown);
    return all;
  }();
  return codes;
}

/// National Land Cover Database of the USGS, with the classes that only Alaska has. Developed open space
/// (21) is mostly lawn.
const Codes& nlcd() {
  static const Codes codes = {
      {0, Unknown},  {11, Lake},    {12, Snow},   {21, Grass},  {22, BuiltUp}, {23, BuiltUp},
      {24, BuiltUp}, {31, Bare},    {41, Forest}, {42, Forest}, {43, Forest},  {51, Shrubs},
      {52, Shrubs},  {71, Grass},   {72, Grass},  {73, Grass},  {74, Grass},   {81, Grass},
      {82, Crops},   {90, Wetland}, {95, Wetland}};
  return codes;
}

/// The first digit of NLCD's codes: water, developed, barren, forest, shrubland, herbaceous, planted,
/// wetlands, as some extracts number them.
const Codes& nlcd_8() {
  static const Codes codes = {{1, Lake},   {2, BuiltUp}, {3, Bare},  {4, Forest},
                              {5, Shrubs}, {6, Grass},   {7, Crops}, {8, Wetland}};
  return codes;
}

struct LegendInfo {
  std::string_view name;
  const Codes& (*codes)();
};
const Codes& no_codes() {
  static const Codes codes;
  return codes;
}
constexpr LegendInfo kLegends[] = {{"worldcover", worldcover},
                                   {"corine", corine},
                                   {"nlcd", nlcd},
                                   {"nlcd_8", nlcd_8},
                                   {"none", no_codes}};

constexpr std::pair<std::string_view, LandClass> kClassNames[] = {{"unknown", Unknown},
                                                                  {"forest", Forest},
                                                                  {"shrubs", Shrubs},
                                                                  {"grass", Grass},
                                                                  {"crops", Crops},
                                                                  {"built_up", BuiltUp},
                                                                  {"bare", Bare},
                                                                  {"snow", Snow},
                                                                  {"wetland", Wetland},
                                                                  {"lake", Lake},
                                                                  {"other_water", OtherWater}};

std::string_view trimmed(std::string_view text) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

LandClass class_from_name(std::string_view name, const std::string& pair) {
  std::vector<std::string> known;
  for (const auto& [word, land_class] : kClassNames) {
    if (word == name) return land_class;
    known.emplace_back(word);
  }
  fail(ErrorKind::Config, "classes: \"{}\": {}", pair,
       core::unknown_name_message("class", std::string(name), known));
}

std::pair<int, LandClass> class_from_text(const std::string& pair) {
  const std::string_view text = pair;
  const auto equals = text.find('=');
  int code = -1;
  if (equals != std::string_view::npos) {
    const std::string_view digits = trimmed(text.substr(0, equals));
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), code);
    if (error != std::errc() || end != digits.data() + digits.size()) code = -1;
  }
  if (code < 0 || code > 65535)
    fail(
        ErrorKind::Config,
        "classes: \"{}\" is not of the form \"CODE = CLASS\", as \"10 = forest\", with a code from "
        "0 to 65535",
        pair);
  return {code, class_from_name(trimmed(text.substr(equals + 1)), pair)};
}

}  // namespace

std::optional<world::Cover> cover_of(LandClass land_class) {
  switch (land_class) {
    case Forest:
      return world::Cover::Forest;
    case Shrubs:
      return world::Cover::Shrubs;
    case Grass:
      return world::Cover::Grass;
    case Crops:
      return world::Cover::Crops;
    case BuiltUp:
      return world::Cover::BuiltUp;
    case Bare:
      return world::Cover::Bare;
    case Snow:
      return world::Cover::Snow;
    case Wetland:
      return world::Cover::Wetland;
    case Unknown:
    case Lake:
    case OtherWater:
      return std::nullopt;
  }
  return std::nullopt;
}

std::vector<std::string> legend_names() {
  std::vector<std::string> names;
  for (const LegendInfo& info : kLegends) names.emplace_back(info.name);
  return names;
}

Legend make_legend(const std::string& name, const std::vector<std::string>& classes) {
  Legend legend{.name = name, .classes = {}};
  const LegendInfo& info =
      core::find_registered(std::span<const LegendInfo>(kLegends), "legend", name);
  legend.classes.insert(info.codes().begin(), info.codes().end());
  std::map<int, LandClass> own;
  for (const std::string& text : classes) {
    const auto pair = class_from_text(text);
    if (!own.insert(pair).second)
      fail(ErrorKind::Config, "classes: code {} is given twice", pair.first);
  }
  for (const auto& [code, land_class] : own) legend.classes[code] = land_class;
  if (legend.classes.empty())
    fail(ErrorKind::Config,
         "the raster's codes stand for nothing: name its legend ({}), or list classes = [\"10 = "
         "forest\", …]",
         fmt::join(legend_names(), ", "));
  return legend;
}

}  // namespace terracast::tiler
