// The files that COLMAP's programs start from: database.db as SQLite's own shell reads it,
// rig_config.json, georegistration.txt; and what COLMAP itself says of them, where it is installed.

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <set>

#include "core/json.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"
#include "tests/support/colmap_program.h"
#include "tests/support/run_program.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::Json;
using Eigen::Vector3d;

const TinyCaptureOptions kBoth{.num_frames = 2};

/// Rows of a query by SQLite's shell, columns parted by |.
std::vector<std::vector<std::string>> query(const fs::path& database, const std::string& sql) {
  const ProgramResult result =
      run_command("/usr/bin/sqlite3", {"-readonly", database.string(), sql});
  EXPECT_EQ(result.status, 0) << result.output;
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(result.output);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> row;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, '|');) row.push_back(word);
    rows.push_back(row);
  }
  return rows;
}

/// Little-endian doubles from SQLite's hex().
std::vector<double> doubles_from_hex(const std::string& hex) {
  std::vector<double> values;
  for (std::size_t at = 0; at + 16 <= hex.size(); at += 16) {
    std::uint64_t bits = 0;
    for (std::size_t k = 8; k-- > 0;)
      bits = bits << 8 | std::stoull(hex.substr(at + 2 * k, 2), nullptr, 16);
    values.push_back(std::bit_cast<double>(bits));
  }
  return values;
}

struct ColmapDatabase : testing::Test {
  ScratchFolder scratch;
  fs::path sequence = scratch / "out/colmap/valley";
  TinyScene scene;
  std::vector<std::string> names;  ///< of images, by id from 1
  std::vector<Vector3d> centres;   ///< of cameras in the world's frame, by the scene
  void SetUp() override {
    write_tiny_capture(scratch / "capture", kBoth);
    run_export(scratch / "capture", "format = \"colmap\"", scratch / "out");
    const capture::SequenceInfo info = tiny_sequence(kBoth);
    for (int frame = 0; frame < 2; ++frame)
      for (const auto& camera : info.cameras) {
        names.push_back(fmt::format("{}/{}/{:06}.png", camera.rig, camera.name, frame));
        centres.push_back(tiny_world_from_camera(kBoth, frame, camera).translation);
      }
  }
  /// How far a place on WGS84 is from a camera's centre.
  double distance_m(const std::vector<double>& lat_lon_height, std::size_t image) const {
    const geo::Geodetic place{lat_lon_height.at(0), lat_lon_height.at(1), lat_lon_height.at(2)};
    return tangent_change(scene.origin, place)(centres.at(image)).norm();
  }
};

TEST_F(ColmapDatabase, HoldsTheModelsCamerasAndImages) {
  const fs::path database = sequence / "database.db";
  EXPECT_EQ(query(database, "PRAGMA integrity_check"),
            (std::vector<std::vector<std::string>>{{"ok"}}));
  const auto cameras =
      query(database,
            "SELECT camera_id, model, width, height, prior_focal_length, hex(params) FROM cameras");
  ASSERT_EQ(cameras.size(), 6U);
  EXPECT_EQ(std::vector(cameras[2].begin(), cameras[2].end() - 1),
            (std::vector<std::string>{"3", "1", "90", "80", "1"}));
  EXPECT_EQ(doubles_from_hex(cameras[2].back()), (std::vector<double>{90.0, 90.0, 45.0, 40.0}));
  const auto images = query(database, "SELECT image_id, name, camera_id FROM images");
  ASSERT_EQ(images.size(), names.size());
  for (std::size_t i = 0; i < names.size(); ++i)
    EXPECT_EQ(images[i], (std::vector<std::string>{std::to_string(i + 1), names[i],
                                                   std::to_string(i % 6 + 1)}));
  for (const char* table : {"keypoints", "descriptors", "matches", "two_view_geometries"})
    EXPECT_TRUE(query(database, std::string("SELECT * FROM ") + table).empty()) << table;
}

TEST_F(ColmapDatabase, PriorsOfBothVersionsAreTheCamerasPlaces) {
  const auto rows =
      query(sequence / "database.db",
            "SELECT printf('%!.17g %!.17g %!.17g', prior_tx, prior_ty, prior_tz), "
            "quote(prior_qw), coordinate_system, hex(position), hex(position_covariance) FROM "
            "images JOIN pose_priors USING (image_id) ORDER BY image_id");
  ASSERT_EQ(rows.size(), names.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::vector<double> place = doubles_from_hex(rows[i].at(3));
    std::istringstream words(rows[i].at(0));
    std::vector<double> old(3);
    words >> old[0] >> old[1] >> old[2];
    EXPECT_EQ(place, old);
    EXPECT_LE(distance_m(place, i), 1e-6) << names[i];  // two passages through ecef
    EXPECT_EQ(rows[i].at(1), "NULL");
    EXPECT_EQ(rows[i].at(2), "0");  // WGS84
    const std::vector<double> covariance = doubles_from_hex(rows[i].at(4));
    ASSERT_EQ(covariance.size(), 9U);
    for (const double value : covariance) EXPECT_TRUE(std::isnan(value));
  }
}

TEST_F(ColmapDatabase, GeoregistrationNamesEveryImageAndItsPlace) {
  std::istringstream lines(slurp(sequence / "georegistration.txt"));
  std::size_t num_lines = 0;
  for (std::string line; std::getline(lines, line); ++num_lines) {
    ASSERT_LT(num_lines, names.size());
    std::istringstream words(line);
    std::string name;
    std::vector<double> place(3);
    words >> name >> place[0] >> place[1] >> place[2];
    EXPECT_EQ(name, names[num_lines]);
    EXPECT_LE(distance_m(place, num_lines), 2e-6);  // heights have six decimals
  }
  EXPECT_EQ(num_lines, names.size());
}

TEST_F(ColmapDatabase, RigConfigMountsTheCamerasAsTheScene) {
  const Json rigs = Json::read(sequence / "rig_config.json");
  ASSERT_EQ(rigs.size(), 2U);
  const capture::SequenceInfo info = tiny_sequence(kBoth);
  std::set<std::string> prefixes;
  for (std::size_t r = 0; r < 2; ++r) {
    const Json& cameras = rigs.at(r).at("cameras");
    const capture::CameraCalibration* reference = nullptr;
    for (std::size_t k = 0; k < cameras.size(); ++k) {
      const Json& camera = cameras.at(k);
      const std::string& prefix = camera.at("image_prefix").string();
      EXPECT_TRUE(prefixes.insert(prefix).second);
      const capture::CameraCalibration* calibration = nullptr;
      for (const auto& candidate : info.cameras)
        if (candidate.rig + "/" + candidate.name + "/" == prefix) calibration = &candidate;
      ASSERT_NE(calibration, nullptr) << prefix;
      EXPECT_EQ(camera.at("camera_params").numbers(), calibration->intrinsics.parameters);
      EXPECT_EQ(camera.has("ref_sensor"), k == 0);
      EXPECT_EQ(camera.has("cam_from_rig_rotation"), k > 0);
      if (k == 0) {
        reference = calibration;
        continue;
      }
      // A point of the rig, brought into the camera by the file and by the scene.
      const std::vector<double> q = camera.at("cam_from_rig_rotation").numbers();
      const std::vector<double> t = camera.at("cam_from_rig_translation").numbers();
      const Vector3d point(3.0, -2.0, 50.0);
      const Vector3d by_file =
          Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * point + Vector3d(t[0], t[1], t[2]);
      const Vector3d by_scene =
          calibration->rig_from_camera.inverse() * (reference->rig_from_camera * point);
      EXPECT_LE((by_file - by_scene).norm(), 1e-12 * point.norm());
    }
  }
  EXPECT_EQ(prefixes.size(), info.cameras.size());
}

TEST_F(ColmapDatabase, IsTheSchemaThatColmapItselfMakes) {
  TERRACAST_NEEDS_COLMAP();
  const fs::path made = scratch / "made.db";
  const auto run = run_command(kColmap, {"database_creator", "--database_path", made.string()});
  ASSERT_EQ(run.status, 0) << run.output;
  const fs::path ours = sequence / "database.db";
  EXPECT_EQ(query(ours, "PRAGMA user_version"), query(made, "PRAGMA user_version"));
  const std::string tables_of =
      "SELECT name FROM sqlite_master WHERE type = 'table' AND name <> 'pose_priors' ORDER BY name";
  const auto tables = query(made, tables_of);
  EXPECT_EQ(query(ours, tables_of), tables);
  EXPECT_GE(tables.size(), 6U);
  for (const auto& table : tables)
    for (const char* what : {"table_info", "foreign_key_list", "index_list"}) {
      const std::string sql = fmt::format("SELECT * FROM pragma_{}('{}')", what, table.at(0));
      EXPECT_EQ(query(ours, sql), query(made, sql)) << table.at(0) << ": " << what;
    }
}

TEST_F(ColmapDatabase, ColmapReadsBothFormsOfTheModelAlike) {
  TERRACAST_NEEDS_COLMAP();
  const auto analyzed = [&](const char* model) {
    const auto run =
        run_command(kColmap, {"model_analyzer", "--path", (sequence / model).string()});
    EXPECT_EQ(run.status, 0) << run.output;
    return run.output;
  };
  const std::string binary = analyzed("sparse/0");
  EXPECT_EQ(binary, analyzed("sparse_txt/0"));
  EXPECT_THAT(binary, testing::HasSubstr(fmt::format("Registered images: {}", names.size())));
  EXPECT_THAT(binary, testing::HasSubstr("Mean reprojection error: 0.000000px"));
}

}  // namespace
}  // namespace terracast::test
