#include "tiler/told_cover.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/dry_cover.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using tiler::Layer;
using tiler::SurfaceSample;
using tiler::ToldCovers;
using world::Cover;

/// Says one thing of every place.
class OneCover : public Layer {
 public:
  OneCover(std::optional<Cover> cover, double lift_m) : cover_(cover), lift_m_(lift_m) {}
  world::LayerInfo info() const override { return {}; }
  std::string input_hash() const override { return ""; }
  std::optional<Cover> cover(const Vector2d&, const SurfaceSample&) const override {
    return cover_;
  }
  double lift_m(const Vector2d&, const SurfaceSample&) const override { return lift_m_; }

 private:
  std::optional<Cover> cover_;
  double lift_m_;
};
class OneDryCover final : public OneCover, public tiler::DryCover {
 public:
  using OneCover::OneCover;
};

struct Kind {
  std::optional<Cover> cover;
  double lift_m;
};
constexpr Kind kKinds[] = {{std::nullopt, 0.0}, {std::nullopt, 0.5}, {Cover::Grass, 0.0},
                           {Cover::Bare, -1.0}, {Cover::Lake, 0.0},  {Cover::River, -2.0}};

std::vector<std::unique_ptr<Layer>> layers_of(const std::vector<Kind>& kinds) {
  std::vector<std::unique_ptr<Layer>> layers;
  for (const Kind& kind : kinds)
    if (kind.cover && world::is_water(*kind.cover))
      layers.push_back(std::make_unique<OneCover>(kind.cover, kind.lift_m));
    else
      layers.push_back(std::make_unique<OneDryCover>(kind.cover, kind.lift_m));
  return layers;
}

/// Of layers after the last that built in water: the first that knows of water, else the first that knows anything.
std::optional<Cover> defined_cover(const std::vector<Kind>& kinds) {
  std::size_t first = 0;
  bool is_wet = false;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (is_wet && kinds[i].lift_m != 0.0) {
      first = i;
      is_wet = false;
    }
    is_wet = is_wet || (kinds[i].cover && world::is_water(*kinds[i].cover));
  }
  std::optional<Cover> found;
  for (std::size_t i = first; i < kinds.size(); ++i) {
    if (!kinds[i].cover) continue;
    if (world::is_water(*kinds[i].cover)) return kinds[i].cover;
    if (!found) found = kinds[i].cover;
  }
  return found;
}

TEST(ToldCovers, WaterGoesBeforeAllAndWhatIsBuiltInItBeforeWater) {
  for (const Kind& a : kKinds)
    for (const Kind& b : kKinds)
      for (const Kind& c : kKinds) {
        const std::vector<Kind> kinds = {a, b, c};
        const auto layers = layers_of(kinds);
        const ToldCovers covers(layers);
        const auto told = covers.at(Vector2d::Zero(), {});
        const std::optional<Cover> expected = defined_cover(kinds);
        ASSERT_EQ(told.has_value(), expected.has_value());
        if (told) {
          EXPECT_EQ(told->cover, *expected);
          EXPECT_EQ(told->by->cover(Vector2d::Zero(), {}), expected);
        }
        EXPECT_EQ(covers.is_water(Vector2d::Zero(), {}), expected && world::is_water(*expected));
      }
}

// Grass that an earlier layer tells of does not dry a lake that a later one knows.
TEST(ToldCovers, NoBuildingStandsInWaterThatOnlyALaterLayerKnows) {
  const ScratchFolder folder;
  write_vectors(folder / "a.gpkg", "GPKG", {{wkt(0, 0, 12, 9), {{"building", "yes"}}}},
                "EPSG:32631");
  tiler::WorldOptions options = world_of("plane");
  options.elevation[0].height_m = 300.0;
  const auto surface = prepare(options);
  const auto num_standing = [&](const std::vector<Kind>& kinds) {
    const auto earlier = layers_of(kinds);
    const auto layer = made_layer(layer_of(files_key(folder / "a.gpkg")), *surface, 1, earlier);
    for (const auto& [name, count] : layer->info().counts)
      if (name == "buildings") return count;
    return std::int64_t{-1};
  };
  EXPECT_EQ(num_standing({}), 1);
  EXPECT_EQ(num_standing({{Cover::Grass, 0.0}}), 1);
  EXPECT_EQ(num_standing({{Cover::Lake, 0.0}}), 0);
  EXPECT_EQ(num_standing({{Cover::Grass, 0.0}, {Cover::Lake, 0.0}}), 0);
  EXPECT_EQ(num_standing({{Cover::Lake, 0.0}, {std::nullopt, 1.0}}), 1);  // on a dam
}

}  // namespace
}  // namespace terracast::test
