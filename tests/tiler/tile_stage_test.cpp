#include "tiler/tile_stage.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/tiler/raster_files.h"
#include "tiler/preview.h"
#include "tiler/tile_builder.h"
#include "world/lod.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using world::TileId;
using world::TileStore;

/// A small world in closed form: quick to tile.
tiler::WorldOptions bowl() {
  tiler::WorldOptions options = world_of("paraboloid", 8192.0);
  options.elevation[0].curvature_per_m = 2e-5;
  return options;
}

tiler::TilePlan plan_over(const tiler::WorldSurface& surface, double x, double y) {
  tiler::TilePlan plan;
  plan.detail.finest_spacing_m = 8.0;
  plan.sequences.push_back({{.position_world = {x, y, surface.sample(x, y).z_world + 150.0},
                             .pixels_per_radian = 60.0}});
  return plan;
}

TileStore run(const tiler::WorldSurface& surface, const tiler::TilePlan& plan,
              const std::filesystem::path& folder, int num_threads = 0) {
  const core::Log log("tile", core::LogLevel::Off);
  return tiler::run_tile_stage(surface, plan, folder,
                               {.log = log, .num_threads = num_threads, .events_file = {}});
}

std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[std::filesystem::relative(entry.path(), folder).string()] =
          core::read_text_file(entry.path());
  return files;
}

TEST(TileStage, CoversSquareAndApronAndServesItsViewpoints) {
  const ScratchFolder folder;
  const auto surface = prepare(bowl());
  const tiler::TilePlan plan = plan_over(*surface, 500.0, -300.0);
  const TileStore store = run(*surface, plan, folder.path());
  const world::WorldManifest& manifest = store.manifest();
  EXPECT_EQ(manifest.base_level, 5);
  EXPECT_EQ(manifest.finest_level, 3);
  EXPECT_GE(manifest.coarsest_level, 8);
  EXPECT_GT(manifest.apron_radius_m, geo::horizon_distance_m(150.0) + 5792.0);
  // Every place of the square has a base tile, every place of the apron one of the coarsest.
  for (double y = -4090.0; y < 4096.0; y += 511.0)
    for (double x = -4090.0; x < 4096.0; x += 511.0)
      EXPECT_NE(store.find(world::tile_at(manifest.base_level, x, y)), nullptr);
  for (double angle = 0.0; angle < 6.28; angle += 0.1)
    EXPECT_NE(store.find(world::tile_at(manifest.coarsest_level,
                                        manifest.apron_radius_m * std::cos(angle),
                                        manifest.apron_radius_m * std::sin(angle))),
              nullptr);
  // What refinement wants is there: the cut ends at the plan's finest level below the camera.
  const auto cut = world::choose_cut(store, plan.sequences[0], plan.detail);
  EXPECT_TRUE(std::any_of(cut.begin(), cut.end(), [](const auto& t) { return t.id.level == 3; }));
  for (const world::CutTile& tile : cut)
    EXPECT_FALSE(world::wants_refinement(*store.find(tile.id), plan.sequences[0], plan.detail))
        << tile.id.name();
  EXPECT_NO_THROW(world::finest_cut(store));
  // A tile comes with its siblings and its parent.
  for (const world::TileInfo& tile : manifest.tiles) {
    if (tile.id.level == manifest.coarsest_level) continue;
    ASSERT_NE(store.find(tile.id.parent()), nullptr);
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      ASSERT_NE(store.find(tile.id.parent().child(quadrant)), nullptr);
  }
}

// What the key's text says.
TEST(TileStage, FinestSpacingAboveThatOfTheHeightsCoarsensTheCutAndNotTheTiles) {
  const ScratchFolder folder;
  const auto surface = prepare(bowl());  // of samples 32 m apart
  tiler::TilePlan plan = plan_over(*surface, 500.0, -300.0);
  std::map<std::string, std::string> files;
  for (const double spacing_m : {32.0, 128.0, 1024.0}) {
    SCOPED_TRACE(spacing_m);
    plan.detail.finest_spacing_m = spacing_m;
    const auto own = folder / fmt::format("{}", spacing_m);
    const TileStore store = run(*surface, plan, own);
    EXPECT_EQ(store.manifest().finest_level, 5);
    if (files.empty()) files = files_of(own);
    EXPECT_EQ(files_of(own), files);
    int finest_level = 20;
    for (const world::CutTile& tile : world::choose_cut(store, plan.sequences[0], plan.detail))
      finest_level = std::min(finest_level, tile.id.level);
    EXPECT_EQ(std::exp2(finest_level),
              std::min(spacing_m, std::exp2(store.manifest().coarsest_level)));
  }
  plan.detail.finest_spacing_m = 16.0;
  EXPECT_EQ(run(*surface, plan, folder / "16").manifest().finest_level, 4);
}

TEST(TileStage, TheSquareIsTiledAtTheSpacingOfItsFirstRasterThatIsNoInset) {
  const ScratchFolder folder;
  const auto raster_of = [&](double spacing_m) {
    const auto file = folder / fmt::format("{}.tif", spacing_m);
    RasterSpec spec = utm_spec(8192.0, spacing_m);
    spec.value = [](double, double) { return 500.0; };
    write_raster(file, spec);
    return file;
  };
  const auto world_of_spacings = [&](const std::vector<double>& spacings_m) {
    std::vector<std::filesystem::path> files;
    for (const double spacing_m : spacings_m) files.push_back(raster_of(spacing_m));
    return world_of_rasters(files, 8192.0);
  };
  EXPECT_EQ(prepare(world_of_spacings({30.0}))->base_level(), 4);
  EXPECT_EQ(prepare(world_of_spacings({64.0}))->base_level(), 6);
  EXPECT_EQ(prepare(world_of_spacings({64.0, 30.0}))->base_level(), 6);
  EXPECT_EQ(prepare(world_of_spacings({500.0}))->base_level(), 7);
  tiler::WorldOptions options = world_of_spacings({64.0});
  options.outside = "procedural";
  EXPECT_EQ(prepare(options)->base_level(), 4);  // whose samples are 16 m apart in squares of 32 km
  options = world_of_spacings({64.0});
  options.elevation.insert(options.elevation.begin(), world_of_spacings({30.0}).elevation[0]);
  options.elevation[0].blend_m = 500.0;
  EXPECT_EQ(prepare(options)->base_level(), 6);
}

TEST(TileStage, ThreadsAndOrderDoNotChangeAByte) {
  const ScratchFolder folder;
  const tiler::WorldOptions options = bowl();
  const auto one = prepare(options, 1);
  const auto two = prepare(options, 2);
  run(*one, plan_over(*one, 500.0, -300.0), folder / "one", 1);
  run(*two, plan_over(*two, 500.0, -300.0), folder / "two", 2);
  EXPECT_EQ(files_of(folder / "one"), files_of(folder / "two"));
}

TEST(TileStage, ResumesAfterTilesAndTheManifestAreLostOrDamaged) {
  const ScratchFolder folder;
  const auto surface = prepare(bowl());
  const tiler::TilePlan plan = plan_over(*surface, 500.0, -300.0);
  const TileStore store = run(*surface, plan, folder.path());
  const auto whole = files_of(folder.path());
  const auto path_of = [&](std::size_t k) {
    return world::tile_path(folder.path(), store.manifest().tiles[k].id);
  };
  // A killed job: no manifest yet, a tile missing, one cut short, one with a flipped bit, a
  // temporary left.
  std::filesystem::remove(folder / "manifest.json");
  std::filesystem::remove(path_of(0));
  std::filesystem::resize_file(path_of(3), std::filesystem::file_size(path_of(3)) / 2);
  {
    std::fstream file(path_of(5), std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(2000);
    const char byte = static_cast<char>(file.get() ^ 4);
    file.seekp(2000);
    file.put(byte);
  }
  const auto untouched = std::filesystem::last_write_time(path_of(7));
  run(*surface, plan, folder.path());
  EXPECT_EQ(files_of(folder.path()), whole);
  EXPECT_EQ(std::filesystem::last_write_time(path_of(7)), untouched);

  // With its manifest, too: a damaged tile is made again.
  std::filesystem::remove(path_of(2));
  run(*surface, plan, folder.path());
  EXPECT_EQ(files_of(folder.path()), whole);
}

TEST(TileStage, ALaterRunAddsTilesAndKeepsThoseOfOtherSequences) {
  const ScratchFolder folder;
  const auto surface = prepare(bowl());
  const tiler::TilePlan east = plan_over(*surface, 2500.0, 0.0);
  const tiler::TilePlan west = plan_over(*surface, -2500.0, 500.0);
  tiler::TilePlan both = east;
  both.sequences.push_back(west.sequences[0]);
  run(*surface, both, folder / "both");
  const std::size_t num_east = run(*surface, east, folder / "parts").manifest().tiles.size();
  const TileStore grown = run(*surface, west, folder / "parts");
  EXPECT_GT(grown.manifest().tiles.size(), num_east);
  EXPECT_EQ(files_of(folder / "parts"), files_of(folder / "both"));
}

TEST(TileStage, RefusesAFolderOfOtherInputsBeforeItWrites) {
  const ScratchFolder folder;
  tiler::WorldOptions options = bowl();
  const auto surface = prepare(options);
  run(*surface, plan_over(*surface, 0.0, 0.0), folder.path());
  const auto before = files_of(folder.path());
  options.elevation[0].height_m = 1.0;
  const auto other = prepare(options);
  expect_error(ErrorKind::Config,
               {folder.path().string(), "other inputs", surface->input_hash(), other->input_hash()},
               [&] { run(*other, plan_over(*other, 0.0, 0.0), folder.path()); });
  EXPECT_EQ(files_of(folder.path()), before);
}

TEST(TileStage, TilesOfTheLargestSquareHoldTheEarthsCurve) {
  // Its apron once had tiles of 262 km, over which the ground drops by more than a tile holds.
  const auto surface = prepare(world_of("plane", 200000.0));
  const int coarsest_level = std::max(surface->base_level() + 1, 8);
  EXPECT_NO_THROW(tiler::build_tile(*surface, world::tile_at(coarsest_level, 495e3, 495e3)));
}

TEST(TileStage, NamesTheHorizonOfACameraThatIsTooHigh) {
  const ScratchFolder folder;
  const auto surface = prepare(bowl());
  tiler::TilePlan plan;
  plan.sequences.push_back({{.position_world = {0.0, 0.0, 60000.0}, .pixels_per_radian = 60.0}});
  // The bowl's bottom lies on the ellipsoid.
  const std::string horizon =
      fmt::format("a horizon {:.0f} km away", geo::horizon_distance_m(60000.0) / 1000.0);
  expect_error(ErrorKind::Input, {"60000 m", horizon}, [&] { run(*surface, plan, folder.path()); });
}

TEST(TileStage, SaysWhyItCannotWrite) {
  const auto surface = prepare(bowl());
  try {
    run(*surface, plan_over(*surface, 0.0, 0.0), "/proc/terracast");
    FAIL() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(static_cast<int>(error.kind()), static_cast<int>(ErrorKind::Io)) << error.what();
    EXPECT_NE(std::string(error.what()).find("/proc/terracast"), std::string::npos);
  }
}

TEST(Preview, DrawsLandSeaPathsAndTellsTheWorld) {
  const ScratchFolder folder;
  tiler::WorldOptions options = world_of("procedural", 8192.0);
  options.name = "coastland";
  const auto surface = prepare(options);
  tiler::TilePlan plan = plan_over(*surface, 0.0, 0.0);
  plan.detail.finest_spacing_m = 16.0;
  const TileStore store = run(*surface, plan, folder.path());
  tiler::PreviewPath path{.name = "P000", .positions_world = {}};
  for (double x = -3000.0; x <= 3000.0; x += 100.0)
    path.positions_world.push_back({x, 0.0, 1000.0});
  const core::Image8 map = tiler::render_preview(store, {path}, 400);
  EXPECT_EQ(map.height(), 400);
  EXPECT_EQ(map.channels(), 3);
  // The path runs through the middle; its first colour is red.
  const int middle = map.width() / 2;
  EXPECT_GT(map(middle, middle, 0), 180);
  EXPECT_LT(map(middle, middle, 1), 90);
  // Hill shading: neighbouring pixels of rugged land differ.
  std::set<int> greens;
  for (int i = 20; i < map.width() - 20; ++i) greens.insert(map(i, middle / 2, 1));
  EXPECT_GT(greens.size(), 20U);

  // The relief alone is the map's, away from what is drawn over it.
  const double side_m = 8192.0 * 1.06;  // the map's margin is 3 % on each side
  const int side_px = map.width();
  Eigen::Affine2d world_from_pixel = Eigen::Affine2d::Identity();
  world_from_pixel.translation() = Eigen::Vector2d(-0.5 * side_m, 0.5 * side_m);
  world_from_pixel.linear() << side_m / side_px, 0.0, 0.0, -side_m / side_px;
  const core::Image8 relief = tiler::render_relief(store, world_from_pixel, side_px, side_px);
  int num_equal = 0;
  int num_compared = 0;
  // Above the path and below the north arrow.
  for (int y = side_px / 5; y < side_px / 2 - 20; ++y)
    for (int x = 20; x < side_px - 20; ++x) {
      ++num_compared;
      num_equal += map(x, y, 0) == relief(x, y, 0) && map(x, y, 1) == relief(x, y, 1);
    }
  // Heights between samples may round to the next level of a colour.
  EXPECT_GT(num_equal, num_compared * 99 / 100);
  Eigen::Affine2d turned = world_from_pixel;
  turned.linear() << 0.0, side_m / side_px, -side_m / side_px, 0.0;
  const core::Image8 quarter = tiler::render_relief(store, turned, 64, 100);
  EXPECT_EQ(quarter.width(), 64);
  EXPECT_EQ(quarter.height(), 100);
  EXPECT_THROW(tiler::render_relief(store, world_from_pixel, 0, 10), core::Error);

  const std::string text = tiler::describe_world(store);
  for (const char* word :
       {"coastland", "42.5000000", "8.192 km", "procedural", "ellipsoid", "level"})
    EXPECT_NE(text.find(word), std::string::npos) << word << "\n" << text;
  EXPECT_NE(text.find(store.manifest().input_hash), std::string::npos);

  // A tile's source codes are no business of the map: it once ended in an index out of range.
  world::WorldManifest manifest = store.manifest();
  manifest.sources.resize(1);
  world::write_manifest(folder.path(), std::move(manifest));
  EXPECT_NO_THROW(tiler::render_preview(TileStore::open(folder.path()), {path}, 400));
}

TEST(Preview, HatchesWhatWasFilled) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(8192.0, 60.0);
  spec.width /= 2;
  spec.value = [](double u, double) { return 500.0 + 1e-3 * u; };
  write_raster(folder / "half.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "half.tif"}, 8192.0);
  options.outside = "extend";
  const auto surface = prepare(options);
  const TileStore store = run(*surface, plan_over(*surface, 0.0, 0.0), folder / "world");
  const core::Image8 map = tiler::render_preview(store, {}, 400);
  const auto share_hatched = [&](double first, double last) {
    const int side_px = map.width();
    int num_hatched = 0, num_pixels = 0;
    for (int y = side_px / 5; y < side_px * 4 / 5; ++y)
      for (int x = static_cast<int>(first * side_px); x < static_cast<int>(last * side_px); ++x) {
        ++num_pixels;
        num_hatched += map(x, y, 0) == 150 && map(x, y, 1) == 70 && map(x, y, 2) == 60 ? 1 : 0;
      }
    return static_cast<double>(num_hatched) / num_pixels;
  };
  EXPECT_EQ(share_hatched(0.06, 0.48), 0.0);
  EXPECT_NEAR(share_hatched(0.52, 0.94), 0.1, 0.005);
  EXPECT_NE(tiler::describe_world(store).find("filled from their surroundings"), std::string::npos);
}

}  // namespace
}  // namespace terracast::test
