#include <gdal_priv.h>

#include <fstream>
#include <set>
#include <sstream>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/image_io.h"
#include "core/stop.h"
#include "export/world/model_textures.h"
#include "tests/support/expect_error.h"
#include "tests/support/folder_compare.h"
#include "tests/world_export/export_world.h"
#include "tests/world_export/glb_file.h"

namespace terracast::world_export {
namespace {

using core::Json;

TEST_F(WorldExport, GltfHoldsTheGroundAndEachObjectOnceWhereTheyAre) {
  const Region region = around(240.0, 60.0, 60.0);
  write("gltf", region, folder_ / "a.glb");
  int num_ground = 0;
  int num_building = 0;
  for (const test::GlbTriangle& triangle : test::read_glb(folder_ / "a.glb")) {
    for (const Eigen::Vector3d& corner : triangle.corners) {
      const Eigen::Vector3d at = world_from_glb(corner, region.center());
      if (triangle.mesh.starts_with("building")) {
        const Eigen::Vector3d in_box = at - Eigen::Vector3d(kSolidX, kSolidY, 400.0);
        const double along = in_box.sum();
        EXPECT_TRUE(std::abs(along) < 1e-3 || std::abs(along - 12.0) < 1e-3) << in_box.transpose();
      } else {
        EXPECT_NEAR(at.z(), hills_m(at.x(), at.y()), kRounded_m);
      }
    }
    // Seen from above the ground turns anticlockwise.
    const Eigen::Vector3d normal = (triangle.corners[1] - triangle.corners[0])
                                       .cross(triangle.corners[2] - triangle.corners[0]);
    if (triangle.mesh.starts_with("building")) {
      ++num_building;
    } else {
      EXPECT_GT(normal.y(), 0.0);
      ++num_ground;
    }
  }
  EXPECT_EQ(num_building, 4);
  // Two triangles a square metre, 120 m x 120 m; a row more or less.
  EXPECT_NEAR(num_ground, 2 * 120 * 120, 2 * 2 * 121);
}

TEST_F(WorldExport, InstancesStandTurnedAndScaledAboutTheirOwnUp) {
  const Region region = around(kTreeX, kTreeY, 20.0);
  write("gltf", region, folder_ / "a.glb");
  // A tetrahedron of 8 m, turned by a quarter: its x axis points north, its y axis west.
  const Eigen::Vector3d foot(kTreeX, kTreeY, 410.0);
  const Eigen::Matrix3d enu = frame_->world_from_enu(foot);
  const std::vector<Eigen::Vector3d> expected = {foot, foot + 8.0 * enu.col(1),
                                                 foot - 8.0 * enu.col(0), foot + 8.0 * enu.col(2)};
  int num_tree = 0;
  for (const test::GlbTriangle& triangle : test::read_glb(folder_ / "a.glb")) {
    if (!triangle.mesh.starts_with("tree")) continue;
    ++num_tree;
    for (const Eigen::Vector3d& corner : triangle.corners) {
      const Eigen::Vector3d at = world_from_glb(corner, region.center());
      double nearest_m = 1e9;
      for (const Eigen::Vector3d& known : expected)
        nearest_m = std::min(nearest_m, (at - known).norm());
      EXPECT_LT(nearest_m, kFloat_m);
    }
  }
  EXPECT_EQ(num_tree, 4);
}

TEST_F(WorldExport, ObjHoldsTheSameTrianglesWithZUp) {
  const Region region = around(240.0, 60.0, 30.0);
  write("gltf", region, folder_ / "a.glb");
  write("obj", region, folder_ / "a.obj");
  std::vector<Eigen::Vector3d> places;
  std::size_t num_faces = 0;
  std::ifstream in(folder_ / "a.obj");
  std::string materials;
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      Eigen::Vector3d place;
      words >> place.x() >> place.y() >> place.z();
      places.push_back(place);
    } else if (word == "f") {
      ++num_faces;
    } else if (word == "mtllib") {
      words >> materials;
    }
  }
  EXPECT_EQ(num_faces, test::read_glb(folder_ / "a.glb").size());
  EXPECT_EQ(materials, "a.mtl");
  EXPECT_TRUE(fs::exists(folder_ / "a.mtl"));
  const Eigen::Vector3d center = frame_->world_from_geodetic(region.center());
  const Eigen::Matrix3d enu = frame_->world_from_enu(center);
  int num_on_ground = 0;
  for (const Eigen::Vector3d& place : places) {
    const Eigen::Vector3d at = center + enu * place;
    // Written with six digits: 30 m about 400 m to a millimetre.
    num_on_ground += std::abs(at.z() - hills_m(at.x(), at.y())) < 2e-3 ? 1 : 0;
  }
  EXPECT_GT(num_on_ground, 3600);
}

/// Seen in November 2026: a region of the whole Earth had its origin at 0 N, 0 E, floats 0.5 m apart, and the apron in it.
TEST_F(WorldExport, ARegionThatReachesBeyondTheSquareIsWhatLiesInIt) {
  shrink_square(512.0);
  for (const Region& region : {Region{-90.0, -180.0, 90.0, 180.0}, around(0.0, 0.0, 400.0)}) {
    write("gltf", region, folder_ / "a.glb", 2.0, 2, 0.0);
    const geo::Geodetic about = test::place_of_glb(folder_ / "a.glb");
    EXPECT_NEAR(about.lat_deg, 46.0, 1e-6);
    EXPECT_NEAR(about.lon_deg, 8.0, 1e-6);
    int num_ground = 0;
    double farthest_m = 0.0;
    double worst_m = 0.0;
    for (const test::GlbTriangle& triangle : test::read_glb(folder_ / "a.glb")) {
      if (!triangle.mesh.starts_with("land")) continue;
      ++num_ground;
      for (const Eigen::Vector3d& corner : triangle.corners) {
        const Eigen::Vector3d at = world_from_glb(corner, about);
        farthest_m = std::max(farthest_m, at.head<2>().cwiseAbs().maxCoeff());
        worst_m = std::max(worst_m, std::abs(at.z() - hills_m(at.x(), at.y())));
      }
    }
    EXPECT_NEAR(farthest_m, 256.0, kFloat_m);
    EXPECT_LT(worst_m, kRounded_m);
    EXPECT_EQ(num_ground, 2 * 256 * 256);  // all of it: two triangles each 2 m x 2 m
  }
}

/// The sides of a large square are no parallels and meridians: in its corners these reach 90 m beyond it.
TEST_F(WorldExport, NothingOfALargeSquaresApronIsWritten) {
  fs::remove_all(folder_ / "world");
  store_.emplace(test::make_tiny_world(folder_ / "world", [](double, double) { return 300.0; },
                                       {.finest_level = 6, .coarsest_level = 6, .num_roots = 4}));
  shrink_square(32000.0);  // its border lies within tiles
  const Region region{-90.0, -180.0, 90.0, 180.0};
  write("gltf", region, folder_ / "a.glb", 64.0, 2, 0.0);
  const geo::Geodetic about = test::place_of_glb(folder_ / "a.glb");
  double farthest_m = 0.0;
  const auto triangles = test::read_glb(folder_ / "a.glb");
  for (const test::GlbTriangle& triangle : triangles)
    for (const Eigen::Vector3d& corner : triangle.corners)
      farthest_m =
          std::max(farthest_m, world_from_glb(corner, about).head<2>().cwiseAbs().maxCoeff());
  EXPECT_NEAR(farthest_m, 16000.0, 2e-3);  // floats 16 km away are 1 mm apart
  EXPECT_EQ(triangles.size(), 2U * 500U * 500U);

  write("geotiff", region, folder_ / "a.tif", 64.0, 2, 0.0);
  GDALAllRegister();
  const std::unique_ptr<GDALDataset, decltype(&GDALClose)> dataset(
      GDALDataset::Open((folder_ / "a.tif").c_str()), &GDALClose);
  ASSERT_NE(dataset, nullptr);
  const auto width = static_cast<std::size_t>(dataset->GetRasterXSize());
  const auto height = static_cast<std::size_t>(dataset->GetRasterYSize());
  std::vector<float> heights_m(width * height);
  ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(
                GF_Read, 0, 0, static_cast<int>(width), static_cast<int>(height), heights_m.data(),
                static_cast<int>(width), static_cast<int>(height), GDT_Float32, 0, 0),
            CE_None);
  double transform[6];
  dataset->GetGeoTransform(transform);
  OGRSpatialReference wgs84;
  wgs84.SetWellKnownGeogCS("WGS84");
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> wgs84_from_utm(
      OGRCreateCoordinateTransformation(dataset->GetSpatialRef(), &wgs84));
  farthest_m = 0.0;
  for (std::size_t k = 0; k < heights_m.size(); ++k) {
    if (heights_m[k] == -9999.0F) continue;
    double lon = transform[0] + (static_cast<double>(k % width) + 0.5) * transform[1];
    double lat = transform[3] + (static_cast<double>(k / width) + 0.5) * transform[5];
    ASSERT_TRUE(wgs84_from_utm->Transform(1, &lon, &lat));
    const Eigen::Vector3d at = frame_->world_from_geodetic(
        {.lat_deg = lat, .lon_deg = lon, .height_m = static_cast<double>(heights_m[k])});
    farthest_m = std::max(farthest_m, at.head<2>().cwiseAbs().maxCoeff());
  }
  EXPECT_LT(farthest_m, 16000.0 + 1e-3);  // heights are floats
  EXPECT_GT(farthest_m, 16000.0 - 64.0);

  // 3D Tiles have whole tiles: the four of the square.
  write("3dtiles", region, folder_ / "t", 64.0, 2, 0.0);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "t" / "tiles"), {}), 4);
}

TEST_F(WorldExport, TellsWhatOfARegionIsLeftOut) {
  const auto told = [&](const Region& region) {
    const core::Log log("test", core::LogLevel::Warn);
    testing::internal::CaptureStderr();
    export_region(core::find_registered(world_formats(), "format", "gltf"),
                  {.store = *store_,
                   .region = region,
                   .finest_spacing_m = 2.0,
                   .texel_m = 0.0,
                   .destination = folder_ / "a.glb",
                   .context = {.log = log, .num_threads = 1, .events_file = {}}});
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(told(around(0.0, 0.0, 100.0)), "");
  // 512 m along the meridian, whose radius there is 6 368 750 m, and along the parallel: 6 389 200 m cos 46.
  EXPECT_THAT(told({46.0, 0.0, 50.0, 10.0}), testing::HasSubstr("latitudes 46.0000000 to 46.0046"));
  EXPECT_THAT(told({46.0, 0.0, 50.0, 10.0}), testing::HasSubstr("longitudes 7.9933"));
}

TEST_F(WorldExport, ARegionInTheApronIsRefusedByEveryFormat) {
  shrink_square(512.0);
  for (const WorldFormatInfo& format : world_formats()) {
    test::expect_error(core::ErrorKind::Input, {"outside the world's square", "1 km"}, [&] {
      write(format.name, around(400.0, 400.0, 50.0), folder_ / "elsewhere");
    });
    EXPECT_FALSE(fs::exists(folder_ / "elsewhere")) << format.name;
  }
}

TEST_F(WorldExport, FilesSayWhereTheirFrameIs) {
  const Region region = around(240.0, 60.0, 20.0);
  write("gltf", region, folder_ / "a.glb");
  EXPECT_EQ(test::place_of_glb(folder_ / "a.glb"), region.center());
  const Json json = test::read_glb_json(folder_ / "a.glb");
  EXPECT_THAT(json.at("asset").at("extras").at("terracast_frame").string(),
              testing::StartsWith("x east, y up, z south, m, at latitude 46.0"));
  EXPECT_EQ(json.at("asset").at("version").string(), "2.0");
  write("obj", region, folder_ / "a.obj");
  std::ifstream in(folder_ / "a.obj");
  std::string line;
  std::getline(in, line);
  EXPECT_THAT(line, testing::StartsWith("# terracast_frame x east, y north, z up, m, at latitude"));
  geo::Geodetic place{.lat_deg = 1.0, .lon_deg = 1.0, .height_m = 1.0};
  for (const auto& [name, value] :
       {std::pair("latitude_deg", &place.lat_deg), std::pair("longitude_deg", &place.lon_deg),
        std::pair("height_m", &place.height_m)}) {
    std::string sharp, word;
    in >> sharp >> word >> *value;
    EXPECT_EQ(sharp, "#");
    EXPECT_EQ(word, name);
  }
  EXPECT_EQ(place, region.center());
}

/// Seen in November 2026: KHR_materials_volume and FB_ngon_encoding, which nothing had.
TEST_F(WorldExport, GltfNamesNoExtensionThatNothingUses) {
  write("gltf", around(kSquareX, kSquareY, 30.0), folder_ / "a.glb");
  std::set<std::string> used;
  const auto visit = [&](const auto& self, const Json& value) -> void {
    if (value.is_array())
      for (std::size_t i = 0; i < value.size(); ++i) self(self, value.at(i));
    if (!value.is_object()) return;
    for (const auto& [name, member] : value.members()) {
      if (name == "extensions")
        for (const auto& [extension, unused] : member.members()) used.insert(extension);
      self(self, member);
    }
  };
  const Json json = test::read_glb_json(folder_ / "a.glb");
  visit(visit, json);
  std::set<std::string> named;
  if (json.has("extensionsUsed"))
    for (const std::string& name : json.at("extensionsUsed").strings()) named.insert(name);
  EXPECT_EQ(named, used);
}

/// Seen in November 2026: refused after all tiles had been read.
TEST_F(WorldExport, StopsAtTheTileThatHoldsMoreThanAFileDoes) {
  const std::vector<world::CutTile> cut = cut_of_region(*store_, around(0.0, 0.0, 500.0), 1.0);
  ASSERT_GT(cut.size(), 2U);
  // 40 000 triangles a thousand times, and the ground's.
  world::WorldManifest manifest = store_->manifest();
  world::Prototype much{
      .name = "much",
      .levels = {{.coarsest_level = 1, .shape = tetrahedron(4.0, core::SemanticClass::Tree)}}};
  std::vector<world::Shape::Triangle>& triangles = much.levels[0].shape.triangles;
  for (int k = 4; k < 40000; ++k) triangles.push_back(triangles[static_cast<std::size_t>(k % 4)]);
  manifest.prototypes.push_back(world::write_prototype(folder_ / "world", 1, much));
  world::Tile tile = store_->load(cut.front().id);
  const Eigen::Vector2d middle = cut.front().id.center_world();
  for (int k = 0; k < 1000; ++k) {
    world::Instance instance;
    instance.provenance.instance_id = 100 + static_cast<std::uint32_t>(k);
    instance.prototype = 1;
    instance.place_steps = steps_of({middle.x(), middle.y(), 400.0});
    tile.objects.instances.push_back(instance);
  }
  for (world::TileInfo& info : manifest.tiles)
    if (info.id == tile.id) info = world::write_tile(folder_ / "world", tile);
  world::write_manifest(folder_ / "world", manifest);
  store_.emplace(world::TileStore::open(folder_ / "world"));
  // Whoever reads on finds that there is no such tile.
  fs::remove(world::tile_path(folder_ / "world", cut.back().id));
  for (const char* format : {"gltf", "obj"})
    test::expect_error(
        core::ErrorKind::Input, {"more than 40000000 triangles", "--region", "a.out"},
        [&] { write(format, around(0.0, 0.0, 500.0), folder_ / "a.out", 1.0, 1, 0.0); });
}

TEST_F(WorldExport, GeotiffHoldsHeightsAtItsPixelsCentres) {
  const Region region = around(200.0, 80.0, 70.0);
  write("geotiff", region, folder_ / "a.tif");
  GDALAllRegister();
  const std::unique_ptr<GDALDataset, decltype(&GDALClose)> dataset(
      GDALDataset::Open((folder_ / "a.tif").c_str()), &GDALClose);
  ASSERT_NE(dataset, nullptr);
  EXPECT_STREQ(dataset->GetSpatialRef()->GetAuthorityCode(nullptr), "32632");
  double transform[6];
  dataset->GetGeoTransform(transform);
  const int width = dataset->GetRasterXSize();
  const int height = dataset->GetRasterYSize();
  std::vector<float> heights_m(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, heights_m.data(),
                                                width, height, GDT_Float32, 0, 0),
            CE_None);
  const std::unique_ptr<GDALDataset, decltype(&GDALClose)> cover_dataset(
      GDALDataset::Open((folder_ / "a_cover.tif").c_str()), &GDALClose);
  ASSERT_NE(cover_dataset, nullptr);
  std::vector<std::uint8_t> covers(heights_m.size());
  ASSERT_EQ(cover_dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, covers.data(),
                                                      width, height, GDT_Byte, 0, 0),
            CE_None);
  const int road_code = 100 + static_cast<int>(core::SemanticClass::Road);
  EXPECT_STREQ(cover_dataset->GetMetadataItem(fmt::format("COVER_{}", road_code).c_str()),
               "painted_road");
  OGRSpatialReference ecef;
  ecef.importFromEPSG(4978);
  OGRSpatialReference utm3d;  // with heights above the ellipsoid
  utm3d.SetWellKnownGeogCS("WGS84");
  utm3d.SetUTM(32, 1);
  utm3d.PromoteTo3D(nullptr);
  const std::unique_ptr<OGRCoordinateTransformation> ecef_from_utm(
      OGRCreateCoordinateTransformation(&utm3d, &ecef));
  int num_heights = 0;
  int num_on_road = 0;
  for (int j = 0; j < height; j += 7)
    for (int i = 0; i < width; i += 7) {
      const float height_m = heights_m[static_cast<std::size_t>(j * width + i)];
      if (height_m == -9999.0F) continue;
      ++num_heights;
      double x = transform[0] + (i + 0.5) * transform[1];
      double y = transform[3] + (j + 0.5) * transform[5];
      double z = static_cast<double>(height_m);
      ASSERT_TRUE(ecef_from_utm->Transform(1, &x, &y, &z));
      const Eigen::Vector3d at = frame_->ecef_from_world().inverse() * Eigen::Vector3d(x, y, z);
      // Between samples a metre apart the triangles lie off the hills by an eighth of their curvature.
      EXPECT_NEAR(at.z(), hills_m(at.x(), at.y()), 30.0 / 70.0 / 70.0 / 4.0 + kRounded_m);
      const bool is_road = std::abs(at.x() - kRoadX) < kRoadHalfWidth_m;
      EXPECT_EQ(covers[static_cast<std::size_t>(j * width + i)], is_road ? road_code : 0);
      num_on_road += is_road ? 1 : 0;
    }
  EXPECT_GT(num_heights, 300);
  EXPECT_GT(num_on_road, 20);
  EXPECT_TRUE(fs::exists(folder_ / "a_cover.tif"));
  EXPECT_TRUE(fs::exists(folder_ / "a_albedo.tif"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}),
            4);  // with the world: nothing beside
}

TEST_F(WorldExport, TilesetsPlaceEveryTileOnTheEarth) {
  const Region region = around(256.0, 0.0, 270.0);
  write("3dtiles", region, folder_ / "t");
  const Json tileset = Json::read(folder_ / "t" / "tileset.json");
  EXPECT_EQ(tileset.at("asset").at("version").string(), "1.1");
  int num_tiles = 0;
  const auto visit = [&](const auto& self, const Json& tile,
                         const Eigen::Matrix4d& ecef_from_parent, double parent_error_m) -> void {
    EXPECT_LE(tile.at("geometricError").number(), parent_error_m);
    Eigen::Matrix4d ecef_from_tile = ecef_from_parent;
    if (tile.has("transform")) {
      const std::vector<double> columns = tile.at("transform").numbers();
      ecef_from_tile *= Eigen::Map<const Eigen::Matrix4d>(columns.data());
    }
    if (tile.has("content")) {
      ++num_tiles;
      // To where its transform puts its origin: doubles of 6.4e6 m.
      const fs::path file = folder_ / "t" / tile.at("content").at("uri").string();
      EXPECT_LT((geo::ecef_from_geodetic(test::place_of_glb(file)) -
                 ecef_from_tile.topRightCorner<3, 1>())
                    .norm(),
                1e-7);
      const std::vector<double> bounds = tile.at("boundingVolume").at("region").numbers();
      const std::vector<test::GlbTriangle> triangles = test::read_glb(file);
      // Every one of the objects, which come last or are few, and some of the ground.
      for (std::size_t k = 0; k < triangles.size();
           k += triangles[k].mesh.starts_with("land") ? 101 : 1) {
        const test::GlbTriangle& triangle = triangles[k];
        for (const Eigen::Vector3d& corner : triangle.corners) {
          // glTF's y up becomes z up.
          const Eigen::Vector4d local(corner.x(), -corner.z(), corner.y(), 1.0);
          const Eigen::Vector3d ecef = (ecef_from_tile * local).head<3>();
          const geo::Geodetic place = geo::geodetic_from_ecef(ecef);
          EXPECT_GE(place.lon_deg * kPi / 180.0, bounds[0] - 1e-9);
          EXPECT_LE(place.lon_deg * kPi / 180.0, bounds[2] + 1e-9);
          EXPECT_GE(place.lat_deg * kPi / 180.0, bounds[1] - 1e-9);
          EXPECT_LE(place.lat_deg * kPi / 180.0, bounds[3] + 1e-9);
          EXPECT_GE(place.height_m, bounds[4] - 1e-3);
          EXPECT_LE(place.height_m, bounds[5] + 1e-3);
          const Eigen::Vector3d at = frame_->ecef_from_world().inverse() * ecef;
          if (triangle.mesh.starts_with("land")) {
            // On the ground, or at the skirt's foot.
            EXPECT_LT(at.z(), hills_m(at.x(), at.y()) + kRounded_m);
            EXPECT_GT(at.z(), hills_m(at.x(), at.y()) - 4.0 - kRounded_m);
          }
        }
      }
    }
    if (!tile.has("children")) return;
    for (std::size_t i = 0; i < tile.at("children").size(); ++i)
      self(self, tile.at("children").at(i), ecef_from_tile, tile.at("geometricError").number());
  };
  visit(visit, tileset.at("root"), Eigen::Matrix4d::Identity(),
        tileset.at("geometricError").number());
  EXPECT_GE(num_tiles, 8);  // fine ones and those above them
}

/// Seen in November 2026: tiles of a region that was exported into the folder before stayed there.
TEST_F(WorldExport, ATilesetsFolderHoldsNoTileOfAnEarlierOne) {
  const Region region = around(400.0, 300.0, 60.0);
  write("3dtiles", region, folder_ / "fresh");
  write("3dtiles", around(-300.0, 0.0, 60.0), folder_ / "t");
  write("3dtiles", region, folder_ / "t");
  EXPECT_EQ(test::first_difference(folder_ / "fresh", folder_ / "t"), "");

  // One that ended half way: its last tile is damaged.
  const auto cut = cut_of_region(*store_, around(-300.0, 0.0, 60.0), 1.0);
  const fs::path last = world::tile_path(folder_ / "world", cut.back().id);
  const std::string whole = core::read_text_file(last);
  core::write_file(last, std::string_view("damaged"));
  test::expect_error(core::ErrorKind::Input, {}, [&] {
    write("3dtiles", around(-300.0, 0.0, 60.0), folder_ / "t", 1.0, 1, 0.0);
  });
  core::write_file(last, std::string_view(whole));
  EXPECT_FALSE(fs::exists(folder_ / "t" / "tileset.json"));
  EXPECT_NE(test::first_difference(folder_ / "fresh" / "tiles", folder_ / "t" / "tiles"), "");
  // What no export of ours names stays.
  core::write_file(folder_ / "t" / "tiles" / "0_99_99.glb", std::string_view("mine"));
  write("3dtiles", region, folder_ / "t");
  EXPECT_TRUE(fs::remove(folder_ / "t" / "tiles" / "0_99_99.glb"));
  EXPECT_EQ(test::first_difference(folder_ / "fresh", folder_ / "t"), "");
}

TEST_F(WorldExport, LeavesATilesetOfSomebodyElseAlone) {
  const std::string mark =
      R"("asset": {"version": "1.1", "extras": {"terracast_export": "3dtiles"}})";
  const auto leaves = [&](const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text.substr(0, 200));
    core::write_file(folder_ / "t" / "tileset.json", text);
    core::write_file(folder_ / "t" / "tiles" / "3_0_0.glb", "theirs");
    test::expect_error(core::ErrorKind::Input, words,
                       [&] { write("3dtiles", around(200.0, 0.0, 50.0), folder_ / "t"); });
    EXPECT_EQ(core::read_text_file(folder_ / "t" / "tileset.json"), text);
    EXPECT_EQ(core::read_text_file(folder_ / "t" / "tiles" / "3_0_0.glb"), "theirs");
  };
  const std::string none = "is none that this version of terracast has written";
  leaves(R"({"asset": {"version": "1.1"}, "root": {"content": {"uri": "tiles/3_0_0.glb"}}})",
         {"tileset.json", none, "another folder"});
  leaves(R"({"root": {"contents": [{"uri": "a.glb"}]}})", {"tileset.json", none});
  leaves(R"({"asset": {"extras": {"terracast_export": "obj"}}, "root": {}})", {none});
  // Ours, and meddled with.
  leaves(
      "{" + mark + R"(, "root": {"children": [{"content": {"uri": "../world/manifest.json"}}]}})",
      {"../world/manifest.json", "tileset.json", "another folder"});
  leaves("{" + mark + R"(, "root": {"content": {"uri": "tiles/)" + std::string(200'000, '1') +
             R"(_0_0.glb"}}})",
         {"no tile of an export"});
  std::string deep = "{}";
  for (int k = 0; k < 80; ++k) deep = R"({"children": [)" + deep + "]}";
  leaves("{" + mark + R"(, "root": )" + deep + "}", {"deeper than 64"});
  EXPECT_TRUE(fs::exists(folder_ / "world" / "manifest.json"));
  // Nothing is removed through a link.
  fs::create_directories(folder_ / "elsewhere");
  fs::create_directories(folder_ / "linked");
  fs::create_directory_symlink(folder_ / "elsewhere", folder_ / "linked" / "tiles");
  test::expect_error(core::ErrorKind::Input, {"is a link"},
                     [&] { write("3dtiles", around(200.0, 0.0, 50.0), folder_ / "linked"); });
}

/// Seen in November 2026: it said that the same command goes on.
TEST_F(WorldExport, ThatIsStoppedSaysThatItBeginsAnew) {
  core::ask_to_stop();
  for (const char* format : {"gltf", "3dtiles", "geotiff"})
    test::expect_error(core::ErrorKind::Interrupted, {"begins the export anew"},
                       [&] { write(format, around(200.0, 0.0, 50.0), folder_ / "stopped"); });
  core::forget_stop();
}

TEST_F(WorldExport, IsTheSameFromOneThreadAndTwo) {
  const Region region = around(200.0, 0.0, 100.0);
  write("3dtiles", region, folder_ / "one", 1.0, 1);
  write("3dtiles", region, folder_ / "two", 1.0, 2);
  EXPECT_EQ(test::first_difference(folder_ / "one", folder_ / "two"), "");
  write("geotiff", region, folder_ / "one" / "a.tif", 1.0, 1);
  write("geotiff", region, folder_ / "two" / "a.tif", 1.0, 2);
  write("gltf", region, folder_ / "one" / "a.glb", 1.0, 1);
  write("gltf", region, folder_ / "two" / "a.glb", 1.0, 2);
  EXPECT_EQ(test::first_difference(folder_ / "one", folder_ / "two"), "");
}

TEST_F(WorldExport, SaysWhatCannotBeWritten) {
  const Region elsewhere{10.0, 20.0, 10.1, 20.1};
  test::expect_error(core::ErrorKind::Input, {"outside the world's square"},
                     [&] { write("gltf", elsewhere, folder_ / "a.glb"); });
  EXPECT_FALSE(fs::exists(folder_ / "a.glb"));
  // 256 m at 5 cm a pixel are more than 4096 of them.
  test::expect_error(core::ErrorKind::Input, {"8192", "4096", "--texel 0.0625"}, [&] {
    write("gltf", around(200.0, 0.0, 50.0), folder_ / "a.glb", 1.0, 2, 0.05);
  });
  EXPECT_FALSE(fs::exists(folder_ / "a.glb"));
  for (const char* text : {"", "1,2,3", "1,2,3,x", "2,1,1,2", "1,2,3,4,5", "nan,1,2,3", "1;2;3;4"})
    test::expect_error(core::ErrorKind::Usage, {"--region"}, [&] { region_from_text(text); });
  const Region read = region_from_text("42.5,1.51,42.52,1.54");
  EXPECT_EQ(read.south_deg, 42.5);
  EXPECT_EQ(read.east_deg, 1.54);
}

/// Its finishes' colours multiply it (until 2026-11 each had a picture of its own).
TEST_F(WorldExport, TexturesAreOnePictureWhateverTheirFinishesColours) {
  world::WorldManifest manifest = store_->manifest();
  core::Image8 opaque(3, 2, 3);
  core::Image8 opaque_with_alpha(3, 2, 4, 255);
  for (int k = 0; k < 18; ++k) {
    opaque(k / 3 % 3, k / 9, k % 3) = static_cast<std::uint8_t>(13 * k);
    opaque_with_alpha(k / 3 % 3, k / 9, k % 3) = static_cast<std::uint8_t>(13 * k);
  }
  manifest.textures.push_back(
      world::write_texture(folder_ / "world", 1, {.name = "opaque", .image = opaque}));
  manifest.textures.push_back(
      world::write_texture(folder_ / "world", 2, {.name = "alpha", .image = opaque_with_alpha}));
  world::write_manifest(folder_ / "world", manifest);
  const world::TileStore store = world::TileStore::open(folder_ / "world");
  const std::array<Code, 2> colors = {{{0, 0, 255}, {250, 20, 30}}};
  ModelTextures textures(store);
  std::array<std::array<int, 2>, 3> rows{};
  for (std::size_t color : {0, 1, 0})
    for (std::size_t texture : {0, 1, 2})
      rows[texture][color] = textures.of({.material = world::Material::Textured,
                                          .color_srgb = colors[color],
                                          .pattern = static_cast<std::uint16_t>(texture)});
  EXPECT_EQ(textures.of({.material = world::Material::Brick}), -1);
  test::expect_error(core::ErrorKind::Input, {"texture 3", "the world has 3"},
                     [&] { textures.of({.material = world::Material::Textured, .pattern = 3}); });
  const std::vector<ModelTexture> pictures = textures.take();
  ASSERT_EQ(pictures.size(), 3U);
  std::set<std::string> names;
  for (const ModelTexture& picture : pictures) names.insert(picture.name);
  EXPECT_EQ(names.size(), 3U);
  const auto image_of = [&](int row) {
    return std::get<core::Image8>(
        core::decode_png(pictures.at(static_cast<std::size_t>(row)).png, "picture"));
  };
  for (const std::size_t texture : {0, 1, 2}) EXPECT_EQ(rows[texture][0], rows[texture][1]);
  for (const std::size_t texture : {1, 2}) EXPECT_TRUE(image_of(rows[texture][0]) == opaque);
  const core::Image8 image = image_of(rows[0][0]);
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c)
      EXPECT_EQ(image(k % 2, k / 2, c), k == 3 ? 255 : texture_image()(k % 2, k / 2, c));
}

}  // namespace
}  // namespace terracast::world_export
