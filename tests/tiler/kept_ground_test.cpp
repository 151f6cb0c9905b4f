#include "tiler/kept_ground.h"

#include <fstream>

#include "core/atomic_file.h"
#include "core/parallel.h"
#include "tests/tiler/raster_files.h"
#include "tiler/geodesy_cells.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using tiler::WorldSurface;

constexpr double kSize_m = 4096.0;

/// A coast with a lake above a geoid, so that nothing is 0 in its heights.
tiler::WorldOptions coast() {
  tiler::WorldOptions options = world_of("procedural", kSize_m);
  options.elevation[0].vertical_datum = "egm96";
  options.elevation[0].relief_m = 600.0;
  options.elevation[0].lakes = 1;
  options.seed = 5;
  return options;
}

std::shared_ptr<const WorldSurface> ground_of(const tiler::WorldOptions& options,
                                              const fs::path& store = {}) {
  const core::Log log("tile", core::LogLevel::Off);
  return WorldSurface::prepare_ground(options, {.log = log}, store);
}

/// Measured heights at places of the square, its border and beyond.
std::vector<std::optional<double>> heights_on(const WorldSurface& surface) {
  std::vector<std::optional<double>> heights;
  for (const Eigen::Vector2d& place : scattered_places(1.1 * kSize_m, 400)) {
    const geo::Geodetic at = surface.frame().geodetic_from_world({place.x(), place.y(), 100.0});
    heights.push_back(surface.measured_height_m(at.lat_deg, at.lon_deg));
  }
  return heights;
}

void expect_same(const WorldSurface& kept, const WorldSurface& made) {
  EXPECT_EQ(kept.input_hash(), made.input_hash());
  EXPECT_EQ(kept.lowest_m(), made.lowest_m());
  EXPECT_EQ(kept.highest_m(), made.highest_m());
  EXPECT_EQ(kept.base_level(), made.base_level());
  EXPECT_EQ(kept.measured_level(), made.measured_level());
  EXPECT_EQ(heights_on(kept), heights_on(made));
  for (const Eigen::Vector2d& place : scattered_places(1.4 * kSize_m)) {
    const tiler::SurfaceSample a = kept.sample(place.x(), place.y());
    const tiler::SurfaceSample b = made.sample(place.x(), place.y());
    EXPECT_EQ(a.z_world, b.z_world);
    EXPECT_EQ(a.cover, b.cover);
    EXPECT_EQ(a.moisture, b.moisture);
    EXPECT_EQ(a.source, b.source);
    EXPECT_EQ(a.water_depth_m, b.water_depth_m);
  }
  // Nor do heights change once samples were taken.
  EXPECT_EQ(heights_on(kept), heights_on(made));
}

TEST(KeptGround, HeightsAreTheSameBitForBitWithAndWithoutIt) {
  const ScratchFolder folder;
  write_raster(folder / "ground.tif", [] {
    RasterSpec spec = utm_spec(kSize_m, 30.0);
    spec.value = [](double u, double v) {
      return 300.0 + 80.0 * std::sin(u / 410.0) * std::cos(v / 530.0);
    };
    return spec;
  }());
  tiler::WorldOptions mixed = world_of_rasters({folder / "ground.tif"}, 3.0 * kSize_m);
  mixed.outside = "procedural";
  int number = 0;
  for (const tiler::WorldOptions& options :
       {coast(), world_of_rasters({folder / "ground.tif"}, kSize_m), mixed}) {
    const fs::path store = folder / std::to_string(number++);
    const auto made = ground_of(options);
    made->keep_ground(store);
    ASSERT_TRUE(fs::exists(store / "ground.bin"));
    expect_same(*ground_of(options, store), *made);
  }
}

TEST(KeptGround, LandThatIsKeptIsNotMadeAgain) {
  const ScratchFolder folder;
  const core::Log log("tile", core::LogLevel::Off);
  const auto made = ground_of(coast());
  made->keep_ground(folder.path());
  tiler::KeptGround kept = tiler::read_kept_ground(folder.path(), log).value();
  ASSERT_EQ(kept.lands.size(), 1u);
  for (float& height_m : kept.lands[0].heights_m.values) height_m += 256.0F;
  tiler::write_kept_ground(folder.path(), kept);
  const auto raised = heights_on(*ground_of(coast(), folder.path()));
  const auto heights = heights_on(*made);
  int num_raised = 0;
  for (std::size_t i = 0; i < heights.size(); ++i)
    if (heights[i]) num_raised += *raised[i] > *heights[i] + 50.0 ? 1 : 0;
  // Some 330 of the places lie in the square, and some of them in deep sea. Only a file's land can be that high.
  EXPECT_GT(num_raised, 200);
}

TEST(KeptGround, ThatOfOtherInputsIsNotTaken) {
  const ScratchFolder folder;
  ground_of(coast())->keep_ground(folder.path());
  tiler::WorldOptions other = coast();
  other.seed = 6;
  expect_same(*ground_of(other, folder.path()), *ground_of(other));
  // The same land under another name: its heights are taken, bounds and nodes are not.
  other = coast();
  other.name = "elsewhere";
  other.origin_lat_deg = 12.0;
  expect_same(*ground_of(other, folder.path()), *ground_of(other));
  // Whoever tiles next has the folder keep the ground of the tiles.
  ground_of(other)->keep_ground(folder.path());
  expect_same(*ground_of(other, folder.path()), *ground_of(other));
}

TEST(KeptGround, ADamagedFileIsLeftAsideAndMadeAgain) {
  const ScratchFolder folder;
  const fs::path file = folder / "ground.bin";
  const auto made = ground_of(coast());
  made->keep_ground(folder.path());
  const std::string whole = core::read_text_file(file);
  const auto expect_made_again = [&](const std::string& bytes) {
    core::write_file(file, std::string_view(bytes));
    const core::Log log("tile", core::LogLevel::Warn);
    testing::internal::CaptureStderr();
    const auto ground = WorldSurface::prepare_ground(coast(), {.log = log}, folder.path());
    EXPECT_NE(testing::internal::GetCapturedStderr().find("ground.bin"), std::string::npos);
    EXPECT_EQ(heights_on(*ground), heights_on(*made));
  };
  expect_made_again("");
  expect_made_again(whole.substr(0, whole.size() / 2));
  for (const std::size_t at :
       {std::size_t{3}, std::size_t{6}, std::size_t{20}, whole.size() / 3, whole.size() - 1}) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    expect_made_again(damaged);
  }
  made->keep_ground(folder.path());
  EXPECT_EQ(core::read_text_file(file), whole);
}

TEST(GeodesyCells, OnDemandAreThoseOfTheWholeGrid) {
  const auto surface = ground_of(world_of("plane", 51200.0));
  class Feet : public tiler::MapProjection {
   public:
    explicit Feet(const geo::WorldFrame& frame) : frame_(frame) {}
    void map_from_geodetic(std::span<const geo::Geodetic> places,
                           std::span<Eigen::Vector2d> map) const override {
      for (std::size_t i = 0; i < places.size(); ++i)
        map[i] = frame_.world_from_geodetic({places[i].lat_deg, places[i].lon_deg, 0.0}).head<2>();
    }
    double metres_per_map_unit() const override { return 1.0; }

   private:
    const geo::WorldFrame frame_;
  };
  const Feet feet(surface->frame());
  const auto geoid = geo::Geoid::egm96();
  constexpr double kHalf_m = 25600.0;
  const tiler::GeodesyCells whole(surface->frame(), feet, geoid.get(), kHalf_m, -100.0, 900.0);
  const auto few = tiler::GeodesyCells::on_demand(surface->frame(), feet, geoid.get(), kHalf_m,
                                                  -100.0, 900.0, whole.node_spacing_m());
  std::vector<Eigen::Vector2d> places = scattered_places(2.0 * kHalf_m, 300);
  for (const double x : {-kHalf_m, 0.0, kHalf_m})
    for (const double y : {-kHalf_m, 0.0, kHalf_m}) places.emplace_back(x, y);
  core::parallel_for(static_cast<std::int64_t>(places.size()), [&](std::int64_t i) {
    const Eigen::Vector2d& at = places[static_cast<std::size_t>(i)];
    for (const double height_m : {-100.0, 333.0, 900.0}) {
      const tiler::ColumnPoint a = few->column(at.x(), at.y()).at(height_m);
      const tiler::ColumnPoint b = whole.column(at.x(), at.y()).at(height_m);
      EXPECT_EQ(a.z_world, b.z_world);
      EXPECT_EQ(a.map, b.map);
      EXPECT_EQ(a.undulation_m, b.undulation_m);
    }
  });
}

}  // namespace
}  // namespace terracast::test
