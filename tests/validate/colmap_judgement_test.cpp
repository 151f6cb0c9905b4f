// What COLMAP's work is judged to be when it is known: a script stands in for the program and gives the exported model
// with a change.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <functional>
#include <map>
#include <random>

#include "core/atomic_file.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "tests/validate/ask_colmap.h"
#include "validate/check.h"

namespace terracast::validate {
namespace {

using test::Mistake;
using test::ScratchFolder;
using testing::HasSubstr;

/// A sparse model as bytes, to be changed by tests.
struct RawModel {
  struct RawImage {
    std::size_t begin, end;  ///< in images.bin; the pose is 4 bytes on
    std::string name;
  };
  std::string cameras, images, points;
  std::vector<RawImage> places;

  explicit RawModel(const fs::path& folder)
      : cameras(core::read_text_file(folder / "cameras.bin")),
        images(core::read_text_file(folder / "images.bin")),
        points(core::read_text_file(folder / "points3D.bin")) {
    std::size_t at = 8;
    for (auto n = get<std::uint64_t>(images, 0); n > 0; --n) {
      RawImage image{at, 0, images.c_str() + at + 64};
      at += 64 + image.name.size() + 1;
      at += 8 + 24 * get<std::uint64_t>(images, at);
      image.end = at;
      places.push_back(image);
    }
  }
  template <class Value>
  static Value get(const std::string& bytes, std::size_t at) {
    Value value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  }
  template <class Value>
  static void put(std::string& bytes, std::size_t at, Value value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }
  Eigen::Quaterniond rotation(std::size_t i) const {
    const std::size_t at = places[i].begin + 4;
    return {get<double>(images, at), get<double>(images, at + 8), get<double>(images, at + 16),
            get<double>(images, at + 24)};
  }
  Eigen::Vector3d centre(std::size_t i) const {
    const std::size_t at = places[i].begin + 36;
    return -(rotation(i).conjugate() * Eigen::Vector3d(get<double>(images, at),
                                                       get<double>(images, at + 8),
                                                       get<double>(images, at + 16)));
  }
  void set_pose(std::size_t i, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& centre) {
    const Eigen::Vector3d t = -(rotation * centre);
    std::size_t at = places[i].begin + 4;
    for (const double value :
         {rotation.w(), rotation.x(), rotation.y(), rotation.z(), t.x(), t.y(), t.z()}) {
      put(images, at, value);
      at += 8;
    }
  }
  /// Scales, turns and moves all, as a free reconstruction is.
  void move_away() {
    const double scale = 0.031;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(0.3, -0.8, 0.4, 0.2).normalized();
    const Eigen::Vector3d shift(5.0, -3.0, 2.0);
    for (std::size_t i = 0; i < places.size(); ++i)
      set_pose(i, rotation(i) * turn.conjugate(), scale * (turn * centre(i)) + shift);
    change_points([&](std::size_t, const Eigen::Vector3d& point) {
      return (scale * (turn * point) + shift).eval();
    });
  }
  void move_points(const std::function<Eigen::Vector3d(std::size_t)>& by) {
    change_points(
        [&](std::size_t i, const Eigen::Vector3d& point) { return (point + by(i)).eval(); });
  }
  void change_points(
      const std::function<Eigen::Vector3d(std::size_t, const Eigen::Vector3d&)>& changed) {
    std::size_t at = 8;
    const auto count = get<std::uint64_t>(points, 0);
    for (std::size_t i = 0; i < count; ++i) {
      Eigen::Vector3d point;
      for (std::size_t k = 0; k < 3; ++k)
        point[static_cast<int>(k)] = get<double>(points, at + 8 + 8 * k);
      point = changed(i, point);
      for (std::size_t k = 0; k < 3; ++k) put(points, at + 8 + 8 * k, point[static_cast<int>(k)]);
      at += 43;
      at += 8 + 8 * get<std::uint64_t>(points, at);
    }
  }
  /// Of an image, along x.
  void shift_observations(std::size_t i, double by_px) {
    for (std::size_t at = first_observation(places[i]); at < places[i].end; at += 24)
      put(images, at, get<double>(images, at) + by_px);
  }
  /// Each coordinate for itself, evenly up to so much to either side.
  void scatter_observations(double by_px) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> off(-by_px, by_px);
    for (const RawImage& image : places)
      for (std::size_t at = first_observation(image); at < image.end; at += 24)
        for (const std::size_t k : {0U, 8U})
          put(images, at + k, get<double>(images, at + k) + off(random));
  }
  void forget_observations(std::size_t i) {
    for (std::size_t at = first_observation(places[i]); at < places[i].end; at += 24)
      put(images, at + 16, ~std::uint64_t{0});
  }
  static std::size_t first_observation(const RawImage& image) {
    return image.begin + 64 + image.name.size() + 1 + 8;
  }
  void drop_last_image() {
    images.resize(places.back().begin);
    places.pop_back();
    put(images, 0, static_cast<std::uint64_t>(places.size()));
  }
  void write(const fs::path& folder) const {
    core::write_file(folder / "cameras.bin", cameras);
    core::write_file(folder / "images.bin", images);
    core::write_file(folder / "points3D.bin", points);
  }
};

/// A blob as SQL reads it.
template <class Number>
std::string blob_of(const std::vector<Number>& numbers) {
  std::string text = "x'";
  for (const Number number : numbers) {
    std::array<unsigned char, sizeof(Number)> bytes{};
    std::memcpy(bytes.data(), &number, sizeof number);
    for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  }
  return text + "'";
}

/// Keypoints and verified matches as COLMAP would find them: those of a model's observations, of which two match
/// where they are of one point.
void write_matches(const RawModel& model, const fs::path& database) {
  std::string sql =
      "BEGIN; CREATE TABLE keypoints (image_id, rows, cols, data); "
      "CREATE TABLE two_view_geometries (pair_id, rows, cols, data);\n";
  std::vector<std::int64_t> ids;
  std::vector<std::map<std::uint64_t, std::uint32_t>> keypoint_of_point;
  for (const RawModel::RawImage& image : model.places) {
    ids.push_back(RawModel::get<std::uint32_t>(model.images, image.begin));
    std::vector<float> keypoints;
    auto& of_point = keypoint_of_point.emplace_back();
    for (std::size_t at = RawModel::first_observation(image); at < image.end; at += 24) {
      const auto point = RawModel::get<std::uint64_t>(model.images, at + 16);
      if (point != ~std::uint64_t{0})
        of_point[point] = static_cast<std::uint32_t>(keypoints.size() / 2);
      for (const std::size_t k : {0U, 8U})
        keypoints.push_back(static_cast<float>(RawModel::get<double>(model.images, at + k)));
    }
    sql += fmt::format("INSERT INTO keypoints VALUES ({}, {}, 2, {});\n", ids.back(),
                       keypoints.size() / 2, blob_of(keypoints));
  }
  for (std::size_t a = 0; a < ids.size(); ++a)
    for (std::size_t b = a + 1; b < ids.size(); ++b) {
      std::vector<std::uint32_t> matches;
      for (const auto& [point, keypoint] : keypoint_of_point[a])
        if (const auto other = keypoint_of_point[b].find(point);
            other != keypoint_of_point[b].end())
          matches.insert(matches.end(), {keypoint, other->second});
      sql += fmt::format("INSERT INTO two_view_geometries VALUES ({}, {}, 2, {});\n",
                         2147483647 * ids[a] + ids[b], matches.size() / 2, blob_of(matches));
    }
  const fs::path script = database.parent_path() / "matches.sql";
  core::write_file(script, sql + "COMMIT;\n");
  fs::remove(database);
  const auto filled =
      test::run_command("/usr/bin/sqlite3", {database.string(), ".read " + script.string()});
  ASSERT_EQ(filled.status, 0) << filled.output;
  fs::remove(script);
}

/// What COLMAP's work is judged to be when it is known: a script stands in for COLMAP and gives the
/// exported model with a change; keypoints and matches are the exported model's own.
struct KnownWork : testing::Test {
  ScratchFolder scratch;
  /// Of what the dataset itself says of its poses, after COLMAP's work is known.
  std::function<void(RawModel&)> change_of_dataset = [](RawModel&) {};

  Results judge(const char* mode, const std::function<void(RawModel&)>& change,
                const Mistake& mistake = {}) {
    static const test::Recording recording = test::record_flight(test::colmap_cameras(), 3);
    test::write_colmap(recording, scratch / "data", mistake);
    RawModel model(scratch / "data/flight/sparse/0");
    write_matches(model, scratch / "data/flight/database.db");
    change(model);
    model.write(scratch / "model");
    RawModel stated(scratch / "data/flight/sparse/0");
    change_of_dataset(stated);
    stated.write(scratch / "data/flight/sparse/0");
    const FakeColmap fake(
        scratch / "bin",
        std::string(kSaysHelp) +
            "while [ $# -gt 0 ]; do [ $1 = --output_path ] && out=$2; shift; done\n"
            "[ -z $out ] || { mkdir $out/0; for to in $out $out/0; do cp " +
            (scratch / "model").string() + "/* $to; done; }\nexit 0");
    return ask_colmap(scratch / "data", scratch / "report", {mode});
  }
};

struct Triangulation : KnownWork {
  Results judge(const std::function<void(RawModel&)>& change) {
    return KnownWork::judge("sparse", change);
  }
};

TEST_F(Triangulation, OneThatIsExactHasNoError) {
  const Results results = judge([](RawModel&) {});
  SCOPED_TRACE(text_of(results));
  EXPECT_TRUE(results.at("colmap_sparse_program").ok);
  EXPECT_LE(results.at("colmap_sparse_reprojection").value, 1e-6);
  EXPECT_LE(results.at("colmap_sparse_distance").value, 1e-4);  // depth between pixel centres
  EXPECT_LE(results.at("colmap_sparse_offset").value, 1e-4);
  EXPECT_TRUE(results.at("colmap_sparse_points").ok);
}

// Where all cameras look the same way, keypoints that are all off alike are points beside their place: their rays meet.
TEST_F(Triangulation, KeypointsThatErrEachForItselfAreNoErrorOfReprojection) {
  const Results results = judge([](RawModel& model) { model.scatter_observations(0.2); });
  EXPECT_TRUE(results.at("colmap_sparse_reprojection").ok) << text_of(results);
  EXPECT_FALSE(results.at("colmap_sparse_reprojection").skipped);
}

// If all were off alike, points would lie beside their place, and their rays meet.
TEST_F(Triangulation, KeypointsOfOneImageBesideTheirPointsAreAnErrorOfReprojection) {
  const Results results = judge([](RawModel& model) {
    model.scatter_observations(0.2);
    model.shift_observations(4, 2.0);
  });
  EXPECT_FALSE(results.at("colmap_sparse_reprojection").ok) << text_of(results);
}

TEST_F(Triangulation, DepthsThatAreLongerThanWhereRaysMeetAreAnOffset) {
  const Results results = KnownWork::judge("sparse", [](RawModel&) {}, {.depth_relative = 0.005});
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_sparse_offset").ok);
  EXPECT_NEAR(results.at("colmap_sparse_offset").value, 0.005, 5e-5);
  EXPECT_TRUE(results.at("colmap_sparse_distance").ok);
}

TEST_F(Triangulation, PointsOverAndUnderTheGroundAreADistanceAndNoOffset) {
  const Results results = judge([](RawModel& model) {
    model.move_points(
        [](std::size_t i) { return Eigen::Vector3d(0.0, 0.0, i % 2 == 0 ? 2.0 : -2.0); });
  });
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_sparse_distance").ok);
  EXPECT_NEAR(results.at("colmap_sparse_distance").value, 2.0, 0.8);
}

TEST_F(Triangulation, AnImageWithFewPointsIsNamed) {
  const Results results = judge([](RawModel& model) { model.forget_observations(4); });
  EXPECT_FALSE(results.at("colmap_sparse_points").ok);
  EXPECT_EQ(results.at("colmap_sparse_points").value, 0.0);
  EXPECT_THAT(results.at("colmap_sparse_points").worst, HasSubstr("rig/cam1/000001.png"));
}

struct FreeReconstruction : KnownWork {
  Results judge(const std::function<void(RawModel&)>& change, const Mistake& mistake = {}) {
    return KnownWork::judge(
        "free",
        [&](RawModel& model) {
          model.move_away();
          change(model);
        },
        mistake);
  }
};

TEST_F(FreeReconstruction, OneThatIsRightHasNoErrorAfterTheSimilarity) {
  const Results results = judge([](RawModel&) {});
  SCOPED_TRACE(text_of(results));
  EXPECT_TRUE(results.at("colmap_free_program").ok);
  for (const char* name : {"colmap_free_ate", "colmap_free_rpe", "colmap_free_rpe_rotation"}) {
    EXPECT_TRUE(results.at(name).ok) << name;
    EXPECT_LE(results.at(name).value, 1e-6) << name;  // doubles, and what float32 depth is not in
  }
  EXPECT_LE(results.at("colmap_free_scale_drift").value, 1e-5);  // depth between pixel centres
  EXPECT_EQ(results.at("colmap_free_registered").value, 1.0);
}

TEST_F(FreeReconstruction, ACameraBesideItsPlaceIsFoundByPositionAndStep) {
  // A ground pixel is about 1 m. One of nine cameras, and the similarity takes a part of it.
  change_of_dataset = [](RawModel& model) {
    model.set_pose(4, model.rotation(4), model.centre(4) + Eigen::Vector3d(0.0, 0.0, 5.0));
  };
  const Results results = judge([](RawModel&) {});
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_free_ate").ok);
  EXPECT_LE(results.at("colmap_free_ate").value, 2.5);
  EXPECT_FALSE(results.at("colmap_free_rpe").ok);
  EXPECT_TRUE(results.at("colmap_free_rpe_rotation").ok);
}

TEST_F(FreeReconstruction, ATurnedCameraIsFoundByTheRotationOfItsSteps) {
  change_of_dataset = [](RawModel& model) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()));
    model.set_pose(4, turn * model.rotation(4), model.centre(4));
  };
  const Results results = judge([](RawModel&) {});
  SCOPED_TRACE(text_of(results));
  EXPECT_TRUE(results.at("colmap_free_ate").ok);
  EXPECT_FALSE(results.at("colmap_free_rpe_rotation").ok);
  // Two of six steps are off by 0.02 rad times 120 px.
  EXPECT_NEAR(results.at("colmap_free_rpe_rotation").value, 2.4 * std::sqrt(2.0 / 6.0), 1e-3);
}

// COLMAP may settle on poses that are not the best of its own keypoints; these say nothing against the dataset.
TEST_F(FreeReconstruction, PosesThatExplainTheKeypointsNoBetterThanTheKnownOnesAreUnseen) {
  const Results results = judge([](RawModel& model) {
    model.set_pose(4, model.rotation(4), model.centre(4) + Eigen::Vector3d(0.0, 0.0, 5.0 * 0.031));
  });
  SCOPED_TRACE(text_of(results));
  EXPECT_TRUE(results.at("colmap_free_ate").is_unseen);
  EXPECT_THAT(results.at("colmap_free_ate").worst, HasSubstr("no better than the known ones"));
}

TEST_F(FreeReconstruction, DepthsOfTheLastThirdOffByTwoThousandthsAreADrift) {
  const Results results = judge([](RawModel&) {}, {.depth_relative = 0.002, .depth_frame = 2});
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_free_scale_drift").ok);
  EXPECT_NEAR(results.at("colmap_free_scale_drift").value, 0.002, 2e-5);
}

struct DriftOfKeypoints : FreeReconstruction {
  /// by_px   up to which keypoints err
  CheckResult drift(double by_px, double depth_relative) {
    return judge([&](RawModel& model) { model.scatter_observations(by_px); },
                 {.depth_relative = depth_relative, .depth_frame = 2})
        .at("colmap_free_scale_drift");
  }
};

TEST_F(DriftOfKeypoints, IsNone) {
  const CheckResult found = drift(0.04, 0.002);
  EXPECT_TRUE(found.ok) << found.bound;
  EXPECT_FALSE(found.skipped);
  EXPECT_NEAR(found.value, 0.002, 2e-5);
  EXPECT_LE(found.bound, 0.01);
}

TEST_F(DriftOfKeypoints, IsNotWhatIsMore) {
  const CheckResult found = drift(0.04, 0.012);
  EXPECT_FALSE(found.ok) << found.bound;
  EXPECT_FALSE(found.skipped);
}

TEST_F(DriftOfKeypoints, ThatErrMuchIsUnseen) { EXPECT_TRUE(drift(0.3, 0.002).is_unseen); }

TEST_F(DriftOfKeypoints, ThatErrAsNoKeypointsDoExcusesNothing) {
  const CheckResult found = drift(8.0, 0.3);
  EXPECT_FALSE(found.ok) << found.bound;
  EXPECT_FALSE(found.skipped);
}

TEST_F(FreeReconstruction, AnImageThatIsLeftOutIsCountedAndNamed) {
  const Results results = judge([](RawModel& model) { model.drop_last_image(); });
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_free_registered").ok);
  EXPECT_NEAR(results.at("colmap_free_registered").value, 8.0 / 9.0, 1e-12);
  EXPECT_THAT(results.at("colmap_free_registered").worst, HasSubstr("rig/cam2/000002.png"));
}

}  // namespace
}  // namespace terracast::validate
