#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "tests/tiler/planted_layer.h"
#include "tests/tiler/vector_files.h"
#include "tiler/tile_builder.h"
#include "tiler/vegetation/groves.h"
#include "tiler/vegetation/stands.h"

// How plants are spread: in groups and rows with gaps between, in forests by stands.
namespace terracast::test {
namespace {

using Eigen::Vector2d;
using world::Cover;
using world::Instance;
using world::TileId;

double mean_of(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double variance_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0.0;
  for (const double value : values) sum += (value - mean) * (value - mean);
  return sum / static_cast<double>(values.size());
}

TEST(Stands, AreOfATenthToFiveHectaresAndHeightsVaryByAFactorOfTwo) {
  const tiler::Stands stands(7);
  constexpr double kStep_m = 6.0;
  constexpr int kSide = 400;  // 2.4 km
  struct Seen {
    tiler::Stand stand;
    double area_m2 = 0.0;
    bool is_whole = true;
  };
  std::map<std::uint64_t, Seen> seen;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      const tiler::Stand stand = stands.at({kStep_m * i - 700.0, kStep_m * j - 900.0});
      Seen& one = seen[stand.key];
      one.stand = stand;
      one.area_m2 += kStep_m * kStep_m;
      if (i == 0 || j == 0 || i + 1 == kSide || j + 1 == kSide) one.is_whole = false;
    }
  double whole_m2 = 0.0;
  double stated_m2 = 0.0;
  std::vector<double> heights;
  double clearings_m2 = 0.0;
  for (const auto& [key, one] : seen) {
    if (!one.is_whole) continue;
    whole_m2 += one.area_m2;
    if (one.area_m2 >= 1000.0 && one.area_m2 <= 50000.0) stated_m2 += one.area_m2;
    if (one.stand.is_clearing) clearings_m2 += one.area_m2;
    heights.push_back(one.stand.height);
  }
  ASSERT_GT(heights.size(), 200U);
  EXPECT_GT(stated_m2, 0.85 * whole_m2);
  std::sort(heights.begin(), heights.end());
  const double low = heights[heights.size() / 20];
  const double high = heights[heights.size() - heights.size() / 20];
  // All but a tenth of a uniform spread by 2.06.
  EXPECT_NEAR(high / low, 1.9, 0.12);
  EXPECT_GT(clearings_m2, 0.005 * whole_m2);
  EXPECT_LT(clearings_m2, 0.09 * whole_m2);
}

TEST(Groves, LeaveLandOpenOverHundredsOfMetresAndFillOthers) {
  const tiler::Groves groves(3, world::FieldPattern(3, true));
  // Shares are uneven at every scale up to a kilometre: the variance of means over squares, relative to what
  // independent shares of single places would leave of it, which goes with the area.
  constexpr double kStep_m = 10.0;
  constexpr int kSide = 512;
  std::vector<double> shares;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      shares.push_back(groves.groups({kStep_m * i, kStep_m * j}, 0.05).trees);
  const double mean = mean_of(shares);
  // About as many as meadows had in November 2026: 1802 trees on 4.2 km2, where all places would bear some 160 000.
  EXPECT_GT(mean, 0.005);
  EXPECT_LT(mean, 0.02);
  const auto means_over = [&](int width) {
    std::vector<double> means;
    for (int j = 0; j < kSide; j += width)
      for (int i = 0; i < kSide; i += width) {
        double sum = 0.0;
        for (int y = 0; y < width; ++y)
          for (int x = 0; x < width; ++x)
            sum += shares[static_cast<std::size_t>((j + y) * kSide + i + x)];
        means.push_back(sum / (width * width));
      }
    return means;
  };
  const double alone = variance_of(shares);
  for (const int width : {8, 16, 32})
    EXPECT_GT(variance_of(means_over(width)) * width * width, 8.0 * alone) << width;
  // Of squares of 320 m a good part has nothing at all.
  const std::vector<double> means = means_over(32);
  const auto num_empty = std::count(means.begin(), means.end(), 0.0);
  EXPECT_GT(static_cast<double>(num_empty), 0.25 * static_cast<double>(means.size()));
  EXPECT_LT(static_cast<double>(num_empty), 0.85 * static_cast<double>(means.size()));
}

TEST(Groves, SlopesHaveMoreAndRowsKeepToBordersOfFields) {
  const world::FieldPattern fields(5, false);
  const tiler::Groves groves(5, fields);
  double level = 0.0;
  double steep = 0.0;
  int num_in_rows = 0;
  int num_inside = 0;
  for (int j = 0; j < 700; ++j)
    for (int i = 0; i < 700; ++i) {
      const Vector2d at(7.3 * i - 2500.0, 7.1 * j - 2400.0);
      level += groves.groups(at, 0.02).trees;
      steep += groves.groups(at, 0.6).trees;
      for (const Cover cover : {Cover::Crops, Cover::Grass}) {
        const tiler::Grove row = groves.along_fields(at, cover);
        if (row.trees <= 0.0 && row.bushes <= 0.0) continue;
        ++num_in_rows;
        // Another field is near, asked for round about; what is bent is up to a third farther.
        const double reach_m = cover == Cover::Grass ? 3.2 : 2.5;
        bool is_border = false;
        const std::uint64_t own = fields.at(at, cover).key;
        for (int k = 0; k < 32; ++k) {
          const double angle = k * std::numbers::pi / 16.0;
          const Vector2d out(std::cos(angle), std::sin(angle));
          is_border = is_border || fields.at(at + reach_m * out, cover).key != own;
        }
        if (!is_border) ++num_inside;
      }
    }
  // Squares of 260 m have a copse with a chance of 0.02 + 0.40 f in the level and 0.35 more on slopes, of pi 578 m2 by the
  // mean square of its radius, of which 0.86 counts, at 0.75; and on both a loose group with 0.02 + 0.14 f, of pi 3544 m2,
  // 0.65 of it, at 0.07. The ratio is least, 1.71, where all is full (f = 1), and 2.35 at f = 1/2; 380 squares hold some
  // 130 copses more, whose areas have a standard deviation of 1.2 of their mean: an error of 0.2.
  EXPECT_GT(steep, 1.71 * level);
  EXPECT_GT(num_in_rows, 1000);
  // A border of a region may be nearer than its field's, and have the same on both sides by chance.
  EXPECT_LE(num_inside, num_in_rows / 100);
}

// Seen 2026-11: rows of trees and hedges of meadows stood up to 20 m beside the borders that the ground shows.
TEST(Vegetation, RowsOfMeadowsStandOnTheBordersOfMeadows) {
  const Planted& layer = planted();
  const tiler::WorldOptions& options = layer.surface->options();
  const world::FieldPattern fields(static_cast<std::uint64_t>(options.seed),
                                   world::FieldPattern::grows_vines(options.origin_lat_deg));
  PlantedLand land;
  land.cover_at = [](const Vector2d&) { return Cover::Grass; };
  std::vector<Vector2d> plants;
  for (const TileId& id : {TileId{2, 0, 0}, TileId{2, 1, 1}})
    for (const auto& [number, instance] : layer.shown_on(id, land))
      if (layer.is_tree(instance) || layer.is_a(instance, "bush"))
        plants.push_back(Planted::place_of(instance));
  // How many stand within half a row's width of a border, on the land and by chance.
  const auto share_of = [&](const std::vector<Vector2d>& places, Cover cover) {
    const auto count = std::count_if(places.begin(), places.end(), [&](const Vector2d& at) {
      return fields.at(at, cover).edge_m <= 2.2;
    });
    return static_cast<double>(count) / static_cast<double>(places.size());
  };
  std::vector<Vector2d> anywhere;
  for (int k = 0; k < 40000; ++k)
    anywhere.emplace_back(2048.0 * std::fmod(0.7548776662466927 * k, 1.0),
                          2048.0 * std::fmod(0.5698402909980532 * k, 1.0));
  const double by_chance = share_of(anywhere, Cover::Grass);
  const double on_meadows = share_of(plants, Cover::Grass);
  const double on_crops = share_of(plants, Cover::Crops);
  std::printf("%zu trees and bushes; on borders of meadows %.3f, of fields %.3f, by chance %.3f\n",
              plants.size(), on_meadows, on_crops, by_chance);
  // Copses, loose groups and trees that stand alone are elsewhere.
  EXPECT_GT(on_meadows, 5.0 * by_chance);
  // What is bent by little stands on both.
  EXPECT_GT(on_meadows, 2.5 * on_crops);
}

TEST(Vegetation, TreesOfMeadowsStandInClustersWithGapsBetween) {
  const Planted& layer = planted();
  PlantedLand land;
  land.cover_at = [](const Vector2d&) { return Cover::Grass; };
  constexpr double kCell_m = 102.4;
  std::map<std::pair<int, int>, int> in_cell;
  std::vector<Vector2d> trees;
  const std::vector<TileId> tiles = {{2, 0, 0}, {2, 1, 0}, {2, 0, 1}, {2, 1, 1}};
  for (const TileId& id : tiles)
    for (const auto& [number, instance] : layer.shown_on(id, land)) {
      if (!layer.is_tree(instance)) continue;
      const Vector2d at = Planted::place_of(instance);
      trees.push_back(at);
      ++in_cell[{static_cast<int>(at.x() / kCell_m), static_cast<int>(at.y() / kCell_m)}];
    }
  std::vector<double> counts(400, 0.0);
  for (const auto& [cell, count] : in_cell)
    counts[static_cast<std::size_t>(cell.second * 20 + cell.first)] = count;
  // Thrown at random they would be as 1, spread evenly less; in November 2026 it was 4.4, with 76 empty.
  const double dispersion = variance_of(counts) / mean_of(counts);
  std::printf("%zu trees on 4.2 km2; variance by mean %.1f; %lld of 400 cells empty\n",
              trees.size(), dispersion,
              static_cast<long long>(std::count(counts.begin(), counts.end(), 0.0)));
  EXPECT_GT(dispersion, 10.0);
  EXPECT_GT(std::count(counts.begin(), counts.end(), 0.0), 120);
  // As many as before, within a factor.
  EXPECT_GT(trees.size(), 1000U);
  EXPECT_LT(trees.size(), 5000U);
  // Within clusters places are those of blue noise.
  std::sort(trees.begin(), trees.end(),
            [](const Vector2d& a, const Vector2d& b) { return a.x() < b.x(); });
  double least_m = 1e9;
  for (std::size_t i = 0; i < trees.size(); ++i)
    for (std::size_t k = i + 1; k < trees.size() && trees[k].x() - trees[i].x() < 4.0; ++k)
      least_m = std::min(least_m, (trees[k] - trees[i]).norm());
  EXPECT_GE(least_m, 3.5 - 0.002);  // places are rounded to steps
  EXPECT_LT(least_m, 4.0);
}

TEST(Vegetation, TreesOfAStandAreAlikeAndStandsDiffer) {
  const Planted& layer = planted();
  const PlantedLand land;
  struct Tree {
    Vector2d at;
    double height_m;
    std::string species;
    std::uint8_t variety;
  };
  std::vector<Tree> trees;
  std::map<std::uint16_t, double> heights_m;  // of prototypes, at scale 4096
  for (const TileId id : {TileId{1, 0, 0}, TileId{1, 2, 1}})
    for (const auto& [number, instance] : layer.shown_on(id, land)) {
      if (!layer.is_tree(instance) || layer.is_a(instance, "dead")) continue;
      Instance full = instance;
      full.scale = 4096;
      const auto [entry, is_new] = heights_m.try_emplace(instance.prototype, 0.0);
      if (is_new) entry->second = layer.height_m(full);
      const std::string& name = layer.name_of(instance);
      trees.push_back({Planted::place_of(instance), entry->second * instance.scale / 4096.0,
                       name.substr(0, name.find('_')), instance.variety});
    }
  ASSERT_GT(trees.size(), 5000U);
  // Pairs side by side are of one stand but where its border runs between them; those far apart are not.
  std::vector<double> near;
  std::vector<double> far;
  double num_near_same = 0.0;
  double num_far_same = 0.0;
  double near_light = 0.0;
  double far_light = 0.0;
  const auto add = [&](const Tree& a, const Tree& b, std::vector<double>& to, double& num_same,
                       double& light) {
    to.push_back(std::pow(std::log(a.height_m / b.height_m), 2));
    num_same += a.species == b.species ? 1.0 : 0.0;
    light += std::pow((a.variety & 15) - (b.variety & 15), 2);
  };
  for (std::size_t i = 0; i + 997 < trees.size(); i += 3) {
    double least_m = 1e9;
    std::size_t nearest = i;
    for (std::size_t k = 0; k < trees.size(); ++k) {
      const double apart_m = (trees[k].at - trees[i].at).norm();
      if (k != i && apart_m < least_m) {
        least_m = apart_m;
        nearest = k;
      }
    }
    add(trees[i], trees[nearest], near, num_near_same, near_light);
    const Tree& other = trees[(i * 7919) % trees.size()];
    if ((other.at - trees[i].at).norm() > 260.0) add(trees[i], other, far, num_far_same, far_light);
  }
  ASSERT_GT(far.size(), 500U);
  const double num_near = static_cast<double>(near.size());
  const double num_far = static_cast<double>(far.size());
  std::printf("heights: %.3f beside, %.3f apart; same species %.2f, %.2f; light %.1f, %.1f\n",
              std::sqrt(mean_of(near) / 2.0), std::sqrt(mean_of(far) / 2.0),
              num_near_same / num_near, num_far_same / num_far, near_light / num_near,
              far_light / num_far);
  EXPECT_LT(std::sqrt(mean_of(near) / 2.0), 0.15);
  EXPECT_GT(mean_of(far), 2.0 * mean_of(near));
  EXPECT_GT(num_near_same / num_near, 1.3 * num_far_same / num_far);
  EXPECT_GT(far_light / num_far, 1.5 * near_light / num_near);
  EXPECT_GT(near_light, 0.0);
}

/// Heights of trees within kZone_m of a stretch of a forest's border, and of those farther in beside it.
struct BorderHeights {
  std::vector<double> zone_m;
  std::vector<double> inside_m;
};

/// Forest borders open land along lines that cross the squares of 16 m, from whose corners the edge is told, in all ways
/// alike. Such an edge e rises from 0 to 1 and falls to 0 over the 16 m from the last wooded corner to the first open one,
/// and where among these the border itself is, is evenly spread: each metre of border has
///   (1/2) 16 m (mean of e / 2 = 1/4) = 2 m of forest's width less of its trees' height, of which a half is taken at e = 1;
///   (1/2) 16 m (mean of max(0.12, 0.8 e) = 0.409) in the forest, and (1/2) 16 m (mean of e^2 / 2 = 1/6) outside, of
///   bushes, in the place of 8 m of the forest's own 0.12.
/// Where the border strays from one row of squares to the next, e goes on over more of them: both are the least there is.
TEST(Vegetation, ForestEdgesHaveLowerTreesAndBushes) {
  const Planted& layer = planted();
  constexpr double kPeriod_m = 192.0;
  constexpr double kForest_m = 128.0;
  // The border strays by up to some 10 m, and an edge is one of 16 m: no farther is anything of it.
  constexpr double kZone_m = 26.0;
  constexpr double kStretch_m = 170.0;  // of stands: what is so far apart is of another
  constexpr double kSlant = 0.125;
  const double cosine = 1.0 / std::hypot(1.0, kSlant);
  const auto in_period_m = [&](const Vector2d& at) {
    const double along_m = (at.x() + kSlant * at.y()) * cosine;
    return along_m - kPeriod_m * std::floor(along_m / kPeriod_m);
  };
  PlantedLand land;
  land.cover_at = [&](const Vector2d& at) {
    return in_period_m(at) < kForest_m ? Cover::Forest : Cover::Grass;
  };
  std::map<std::array<int, 3>, BorderHeights> stretches;
  double bushes_in_zone = 0.0;
  double bushes_inside = 0.0;
  for (const TileId id : {TileId{1, 0, 0}, TileId{1, 1, 0}, TileId{1, 0, 1}})
    for (const auto& [number, instance] : layer.shown_on(id, land)) {
      const Vector2d at = Planted::place_of(instance);
      const double place_m = in_period_m(at);
      // Above 0 in the forest.
      const double from_east_m = kForest_m - place_m;
      const double from_west_m =
          place_m < 0.5 * (kPeriod_m + kForest_m) ? place_m : place_m - kPeriod_m;
      const bool is_west = std::abs(from_west_m) < std::abs(from_east_m);
      const double from_border_m = is_west ? from_west_m : from_east_m;
      if (from_border_m < -kZone_m) continue;
      const bool is_inside = from_border_m > kZone_m;
      if (layer.is_a(instance, "bush")) (is_inside ? bushes_inside : bushes_in_zone) += 1.0;
      if (!layer.is_tree(instance) || layer.is_a(instance, "dead")) continue;
      BorderHeights& stretch =
          stretches[{static_cast<int>(std::floor((at.x() + kSlant * at.y()) * cosine / kPeriod_m)),
                     is_west ? 1 : 0, static_cast<int>(std::floor(at.y() / kStretch_m))}];
      (is_inside ? stretch.inside_m : stretch.zone_m).push_back(layer.height_m(instance));
    }

  std::vector<double> logarithms;  // of the zone's mean height over the inside's
  for (const auto& [key, stretch] : stretches)
    if (stretch.zone_m.size() >= 50 && stretch.inside_m.size() >= 50)
      logarithms.push_back(std::log(mean_of(stretch.zone_m) / mean_of(stretch.inside_m)));
  ASSERT_GT(logarithms.size(), 20U);
  const double error =
      std::sqrt(variance_of(logarithms) / static_cast<double>(logarithms.size() - 1));
  const double lower = mean_of(logarithms);
  std::printf("%zu stretches: heights by %.3f +- %.3f; bushes %.0f, %.0f\n", logarithms.size(),
              std::exp(lower), error, bushes_in_zone, bushes_inside);
  EXPECT_LT(lower, std::log(1.0 - 2.0 / kZone_m) + 3.0 * error);
  EXPECT_LT(lower, -3.0 * error) << "which could be chance";
  EXPECT_GT(lower, std::log(0.5));

  ASSERT_GT(bushes_inside, 300.0);
  // Of a border on each side a zone's width, and what lies between.
  const double ratio =
      bushes_in_zone / (2.0 * kZone_m) / (bushes_inside / (kForest_m - 2.0 * kZone_m));
  const double ratio_error = ratio * std::sqrt(1.0 / bushes_in_zone + 1.0 / bushes_inside);
  const double more_m = 8.0 * (0.409 + 1.0 / 6.0 - 0.12);
  // Inside, too, gaps and clearings have some: bushes inside are of as much as 0.16 of the places.
  EXPECT_GT(ratio, 1.0 + more_m / (0.16 * kZone_m) - 3.0 * ratio_error);
}

TEST(Vegetation, NothingButGrassGrowsBetweenRunways) {
  const ScratchFolder folder;
  tiler::WorldOptions options = world_of("plane", 2048.0);
  options.elevation[0].height_m = 400.0;
  const auto bare = prepare(options);
  std::string corners;
  for (const Vector2d& at : {Vector2d(20, 20), Vector2d(480, 20), Vector2d(480, 440),
                             Vector2d(20, 440), Vector2d(20, 20)}) {
    const geo::Geodetic place =
        bare->frame().geodetic_from_world({at.x(), at.y(), bare->sample(at.x(), at.y()).z_world});
    corners += fmt::format("{}[{:.11f},{:.11f}]", corners.empty() ? "" : ",", place.lon_deg,
                           place.lat_deg);
  }
  write_text(folder / "airfield.geojson",
             "{\"type\":\"FeatureCollection\",\"features\":[{\"type\":\"Feature\",\"properties\":"
             "{\"aeroway\":\"aerodrome\"},\"geometry\":{\"type\":\"Polygon\",\"coordinates\":[[" +
                 corners + "]]}}]}");
  // Trees and stones of a tile of 512 m, or the tufts of one of 128 m in its middle.
  const auto count = [&](const std::vector<std::string>& kinds, const TileId& id) {
    tiler::WorldOptions all = options;
    for (const std::string& kind : kinds) {
      tiler::LayerOptions layer;
      core::TomlDocument::parse(
          "kind = \"" + kind + "\"\nfiles = [\"" + (folder / "airfield.geojson").string() + "\"]\n",
          "layer.toml")
          .read(layer);
      all.layers.push_back(layer);
    }
    all.layers.push_back(vegetation_of("seed = 3"));
    const auto surface = prepare(all);
    std::map<std::string, int> counts;
    for (const Instance& instance : tiler::build_tile(*surface, id).objects.instances) {
      const Vector2d at = Planted::place_of(instance);
      if (at.x() < 20.5 || at.y() < 20.5 || at.x() > 479.5 || at.y() > 439.5) continue;
      ++counts[planted().is_a(instance, "grass") ? "grass" : "other"];
    }
    return counts;
  };
  EXPECT_GT(count({}, {1, 0, 0})["other"], 50);
  EXPECT_EQ(count({"objects"}, {1, 0, 0})["other"], 0);
  for (const auto& kinds : {std::vector<std::string>{"roads"}, {"roads", "objects"}}) {
    SCOPED_TRACE(kinds.size());
    EXPECT_EQ(count(kinds, {1, 0, 0})["other"], 0);
    auto counts = count(kinds, {-1, 1, 1});
    EXPECT_EQ(counts["other"], 0);
    EXPECT_GT(counts["grass"], 200);
  }
}

}  // namespace
}  // namespace terracast::test
