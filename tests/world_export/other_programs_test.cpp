#include <opencv2/imgcodecs.hpp>

#include "core/atomic_file.h"
#include "core/json.h"
#include "core/random.h"
#include "core/srgb.h"
#include "scene/light/hit_shader.h"
#include "tests/support/run_program.h"
#include "tests/world_export/export_world.h"

// Exports as other programs find them: three.js loads models, OpenCV their pictures.

namespace terracast::world_export {
namespace {

using core::Json;

class OtherPrograms : public WorldExport {
 protected:
  /// What read_models.mjs tells.
  struct Query {
    fs::path file;
    std::vector<Eigen::Vector2d> places_en;
  };
  Json read_models(const std::vector<Query>& queries) const {
    Json files = Json::array();
    for (const Query& query : queries) {
      Json places = Json::array();
      for (const Eigen::Vector2d& place : query.places_en)
        places.push(Json::array_of(std::vector<double>{place.x(), place.y()}));
      Json one = Json::object();
      one.set("file", query.file.string()).set("places", std::move(places));
      files.push(std::move(one));
    }
    Json all = Json::object();
    fs::create_directories(folder_ / "pictures");
    all.set("pictures", (folder_ / "pictures").string()).set("files", std::move(files));
    all.write(folder_ / "queries.json", 0);
    const test::ProgramResult run = test::run_command(
        TERRACAST_NODE, {TERRACAST_SOURCE_DIR "/tests/world_export/read_models.mjs",
                         TERRACAST_PAGE_PACKAGES, (folder_ / "queries.json").string()});
    EXPECT_EQ(run.status, 0) << run.output;
    return Json::parse(run.output, "read_models");
  }
  Eigen::Vector2d place_en(double x, double y, double z, const geo::Geodetic& about) const {
    return enu_from_world({x, y, z}, about).head<2>();
  }
  static cv::Mat picture(const Json& seen) {
    const cv::Mat image = cv::imread(seen.at("picture").string(), cv::IMREAD_COLOR);
    EXPECT_FALSE(image.empty()) << seen.at("picture").string();
    return image;
  }
  /// The pixel of a picture that lies at a place of a model.
  static Code code_at(const Json& seen) {
    const cv::Mat image = picture(seen);
    const std::vector<double> uv = seen.at("uv").numbers();
    const auto column = static_cast<int>(std::floor((uv[0] - std::floor(uv[0])) * image.cols));
    const auto row = static_cast<int>(std::floor((uv[1] - std::floor(uv[1])) * image.rows));
    const auto& bgr = image.at<cv::Vec3b>(row, column);
    return {bgr[2], bgr[1], bgr[0]};
  }
  static std::size_t num_triangles(const Json& told) {
    double sum = 0.0;
    for (std::size_t i = 0; i < told.at("meshes").size(); ++i)
      sum += told.at("meshes").at(i).at("triangles").number();
    return static_cast<std::size_t>(sum);
  }
};

/// Linear values may be off by rounding where a code was decoded and encoded again.
void expect_near(const Code& seen, const Code& expected, int tolerance) {
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_NEAR(seen[c], expected[c], tolerance) << "channel " << c;
}

bool is_grey(const Code& code) {
  const auto [least, most] = std::minmax_element(code.begin(), code.end());
  return *most - *least <= 12;
}

TEST_F(OtherPrograms, SeeTheGroundsPictureAndWhatIsPaintedWhereItLies) {
  const Region region = around(160.0, 60.0, 55.0);
  const geo::Geodetic about = region.center();
  write("gltf", region, folder_ / "a.glb", 1.0, 2, 1.0);
  write("obj", region, folder_ / "a.obj", 1.0, 2, 1.0);
  // Squares of the picture on both sides of the road, and two places on it.
  std::vector<Eigen::Vector2d> places;
  for (double y = 24.5; y < 110.0; y += 16.0)
    for (const double x : {120.5, 136.5, 168.5, 184.5, 200.5}) places.emplace_back(x, y);
  const std::size_t num_pictured = places.size();
  places.emplace_back(kRoadX + 3.5, 40.5);
  places.emplace_back(kRoadX - 4.5, 90.5);
  std::vector<Eigen::Vector2d> places_en;
  for (const Eigen::Vector2d& place : places)
    places_en.push_back(place_en(place.x(), place.y(), hills_m(place.x(), place.y()), about));
  const Json told = read_models({{folder_ / "a.glb", places_en}, {folder_ / "a.obj", places_en}});
  EXPECT_EQ(num_triangles(told.at(0)), num_triangles(told.at(1)));
  // Two triangles a square metre, 110 m x 110 m; a row more or less.
  EXPECT_NEAR(static_cast<double>(num_triangles(told.at(0))), 2 * 110 * 110, 2 * 2 * 111);
  for (const std::size_t file : {0, 1}) {
    SCOPED_TRACE(file == 0 ? "a.glb" : "a.obj");
    for (int k = 0; k < 2; ++k) {
      // A cell of a metre may stand out by half, and the sides of the region are as long to a centimetre.
      EXPECT_NEAR(told.at(file).at("lowest").numbers()[static_cast<std::size_t>(k)], -55.0, 0.6);
      EXPECT_NEAR(told.at(file).at("highest").numbers()[static_cast<std::size_t>(k)], 55.0, 0.6);
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      SCOPED_TRACE(fmt::format("place {} {}", places[i].x(), places[i].y()));
      const Json& seen = told.at(file).at("seen").at(i);
      const double up =
          enu_from_world({places[i].x(), places[i].y(), hills_m(places[i].x(), places[i].y())},
                         about)
              .z();
      // Between samples a metre apart the triangles lie off the hills by an eighth of their curvature; OBJ is written with
      // six digits.
      EXPECT_NEAR(seen.at("up").number(), up, 30.0 / 70.0 / 70.0 / 4.0 + kRounded_m + 2e-3);
      EXPECT_EQ(picture(seen).cols, 256);
      EXPECT_EQ(picture(seen).rows, 256);
      const Code code = code_at(seen);
      const Code below = pictured(places[i].x(), places[i].y());
      if (i < num_pictured) {
        expect_near(code, below, 1);
      } else {
        EXPECT_TRUE(is_grey(code)) << int{code[0]} << " " << int{code[1]} << " " << int{code[2]};
        EXPECT_FALSE(is_grey(below));
      }
    }
  }
}

TEST_F(OtherPrograms, SeeModelsTextures) {
  const Region region = around(kSquareX + 5.0, kSquareY + 5.0, 20.0);
  write("gltf", region, folder_ / "a.glb");
  write("obj", region, folder_ / "a.obj");
  std::vector<Eigen::Vector2d> places_en;
  std::vector<Code> expected;
  for (const double x : {1.3, 3.8, 6.2, 8.7})  // the texture is 5 m wide and 10 m high
    for (const double y : {2.4, 7.7}) {
      places_en.push_back(place_en(kSquareX + x, kSquareY + y, 450.0, region.center()));
      const bool is_left = x < 2.5 || (x > 5.0 && x < 7.5);
      // Where the texture is transparent it is white.
      expected.push_back(y > 5.0 ? (is_left ? Code{200, 10, 10} : Code{10, 200, 10})
                                 : (is_left ? Code{200, 200, 10} : Code{255, 255, 255}));
    }
  const Json told = read_models({{folder_ / "a.glb", places_en}, {folder_ / "a.obj", places_en}});
  for (const std::size_t file : {0, 1})
    for (std::size_t i = 0; i < places_en.size(); ++i) {
      SCOPED_TRACE(fmt::format("file {}, place {}", file, i));
      const Json& seen = told.at(file).at("seen").at(i);
      EXPECT_NEAR(seen.at("up").number(), told.at(file).at("highest").numbers()[2], 1e-2);
      EXPECT_TRUE(seen.at("repeats").boolean());
      expect_near(code_at(seen), expected[i], 0);
      // The finish's colour multiplies the picture. three.js reads Kd as sRGB, glTF's factor as linear light.
      if (file != 0) continue;
      const std::vector<double> factor = seen.at("color").numbers();
      const Code tint = textured_square().finishes[0].color_srgb;
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(factor[k], static_cast<double>(core::linear_from_srgb8(tint[k])), 1e-6);
    }
}

TEST_F(OtherPrograms, LoadEveryTileOfATileset) {
  const Region region = around(256.0, 0.0, 270.0);
  write("3dtiles", region, folder_ / "t", 1.0, 2, 4.0);
  std::vector<Query> queries;
  const auto visit = [&](const auto& self, const Json& tile) -> void {
    if (tile.has("content"))
      queries.push_back({folder_ / "t" / tile.at("content").at("uri").string(), {{3.0, 5.0}}});
    if (!tile.has("children")) return;
    for (std::size_t i = 0; i < tile.at("children").size(); ++i)
      self(self, tile.at("children").at(i));
  };
  visit(visit, Json::read(folder_ / "t" / "tileset.json").at("root"));
  ASSERT_GE(queries.size(), 8u);
  const Json told = read_models(queries);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    SCOPED_TRACE(queries[i].file.string());
    // The ground, its skirt, and what stands there: tetrahedra and a square.
    constexpr std::size_t kGround = 2 * 256 * 256 + 4 * 2 * 256;
    EXPECT_GE(num_triangles(told.at(i)), kGround);
    EXPECT_LE(num_triangles(told.at(i)), kGround + 2 * 4 + 2);
    const Json& seen = told.at(i).at("seen").at(0);
    EXPECT_FALSE(seen.at("repeats").boolean());
    const cv::Mat image = picture(seen);
    EXPECT_EQ(image.cols, 64);  // 256 m at 4 m; on coarser tiles as many
    EXPECT_EQ(image.rows, 64);
  }
}

/// Rays straight down, with samples as wide as the pixels: another way to the renderer's albedo.
TEST_F(OtherPrograms, SeeTheRenderersAlbedo) {
  const Region region = around(200.0, -100.0, 60.0);
  write("gltf", region, folder_ / "a.glb", 1.0, 2, 1.0);
  std::vector<Eigen::Vector2d> places_en;
  std::vector<world::WorldRay> rays;
  constexpr double kFrom_m = 1000.0;
  for (double x = 146.5; x < 250.0; x += 8.0)
    for (double y = -150.5; y < -50.0; y += 9.0) {
      // Texels' centres; not on the road's edges, where they are means.
      if (std::abs(std::abs(x - kRoadX) - kRoadHalfWidth_m) < 1.0) continue;
      const double z = hills_m(x, y);
      places_en.push_back(place_en(x, y, z, region.center()));
      rays.push_back(
          {.origin_world = {x, y, kFrom_m}, .direction_world = -Eigen::Vector3d::UnitZ()});
    }
  const Json told = read_models({{folder_ / "a.glb", places_en}});

  const world::RayQuery query(*store_, cut_of_region(*store_, region, 1.0), {});
  std::vector<world::SurfaceHit> hits(rays.size());
  std::vector<world::SurfaceSample> surfaces(rays.size());
  query.intersect(rays, hits, world::Coherence::Incoherent, surfaces);
  const scene::Ground ground(scene::climate_of(
      *store_, static_cast<std::uint32_t>(core::mix_bits(store_->manifest().seed))));
  const scene::GroundImagery imagery(*store_, 1e8);
  const scene::TextureLibrary textures(*store_);
  const scene::SurfaceLooks looks(ground, imagery, textures);
  scene::SurfaceLooks::Scratch scratch;
  int num_on_road = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    SCOPED_TRACE(i);
    // The renderer widens samples on slopes; what it is given makes up for that.
    const double facing = hits[i].normal_world().z();
    const scene::LitHits one{.rays = std::span(rays).subspan(i, 1),
                             .hits = std::span(hits).subspan(i, 1),
                             .surfaces = std::span(surfaces).subspan(i, 1),
                             .sun_share = {},
                             .sky_share = {},
                             .sample_width = {.angle_rad = std::pow(facing, 0.6) / hits[i].t}};
    scene::Color albedo;
    looks.find_albedo(one, Eigen::Vector3f::UnitZ(), scratch, std::span(&albedo, 1));
    Code expected;
    for (std::size_t c = 0; c < 3; ++c)
      expected[c] = core::srgb8_from_linear(albedo[static_cast<int>(c)]);
    num_on_road += surfaces[i].paint.is_painted ? 1 : 0;
    // Heights and widths differ in float's last places.
    expect_near(code_at(told.at(0).at("seen").at(i)), expected, 1);
  }
  EXPECT_GT(num_on_road, 5);
  EXPECT_GT(rays.size(), 100u);
}

TEST_F(OtherPrograms, SeeWhatIsPaintedInRasters) {
  const Region region = around(160.0, 60.0, 40.0);
  write("geotiff", region, folder_ / "a.tif");
  // OpenCV reads the pixels of a TIFF and no place; those are held by GeotiffHoldsHeightsAtItsPixelsCentres.
  const cv::Mat heights = cv::imread((folder_ / "a.tif").string(), cv::IMREAD_UNCHANGED);
  const cv::Mat albedo = cv::imread((folder_ / "a_albedo.tif").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(albedo.type(), CV_8UC4);
  ASSERT_EQ(albedo.size(), heights.size());
  int num_known = 0;
  int num_grey = 0;
  int num_within = 0;
  int num_as_pictured = 0;
  for (int y = 0; y < albedo.rows; ++y)
    for (int x = 0; x < albedo.cols; ++x) {
      const auto& bgra = albedo.at<cv::Vec4b>(y, x);
      ASSERT_EQ(bgra[3] != 0, heights.at<float>(y, x) > -9000.0f);
      if (bgra[3] == 0) continue;
      ++num_known;
      num_grey += is_grey({bgra[2], bgra[1], bgra[0]}) ? 1 : 0;
      // To some metres, which is what the raster's axes may turn against the world's.
      const double x_world = 160.0 + x + 0.5 - 0.5 * albedo.cols;
      const double y_world = 60.0 - y - 0.5 + 0.5 * albedo.rows;
      const Code code = pictured(x_world, y_world);
      bool is_alike = std::abs(x_world - kRoadX) > kRoadHalfWidth_m + 3.0;
      for (const double aside_x : {-3.0, 3.0})
        for (const double aside_y : {-3.0, 3.0})
          is_alike = is_alike && pictured(x_world + aside_x, y_world + aside_y) == code;
      if (!is_alike) continue;
      ++num_within;
      num_as_pictured += std::abs(bgra[2] - code[0]) <= 1 && std::abs(bgra[1] - code[1]) <= 1 &&
                                 std::abs(bgra[0] - code[2]) <= 1
                             ? 1
                             : 0;
    }
  EXPECT_GT(num_within, 1000);
  EXPECT_EQ(num_as_pictured, num_within);
  // The road is 12 m of the region's 80 m; of the picture's squares few are grey, and its asphalt is dark.
  EXPECT_NEAR(num_known, 80 * 80, 2 * 4 * 80);
  EXPECT_GT(num_grey, 11 * 80);
  EXPECT_LT(num_grey, 2 * 12 * 80);
}

}  // namespace
}  // namespace terracast::world_export
