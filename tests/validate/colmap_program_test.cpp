// COLMAP on datasets of the tests' own writer: a right one passes, wrong ones fail the check that
// names them; a program that is missing, dies or gives nothing is a failed check and no crash.

#include "tests/support/colmap_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <random>

#include "core/atomic_file.h"
#include "core/log.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using test::Mistake;
using test::ScratchFolder;
using testing::HasSubstr;

/// Two cameras of 320 x 256 that look apart, five frames, six metres from frame to frame.
const test::Recording& flight() {
  static const test::Recording recording = [] {
    std::vector<test::SceneCamera> cameras = test::colmap_cameras();
    cameras.resize(2);
    for (test::SceneCamera& camera : cameras) {
      camera.width *= 2;
      camera.height *= 2;
      camera.focal_px *= 2.0;
    }
    return test::record_flight(cameras, 5, test::Ground::Smooth, 2);
  }();
  return recording;
}

/// Rows of georeference.csv, split at commas, without the head.
std::vector<std::vector<std::string>> georeferences(const fs::path& sequence) {
  std::vector<std::vector<std::string>> rows;
  const std::string text = core::read_text_file(sequence / "georeference.csv");
  for (const TextLine& line : split_lines(text)) {
    if (line.number == 1) continue;
    std::vector<std::string> row;
    for (const std::string_view word : split_at(line.text, ',')) row.emplace_back(word);
    rows.push_back(row);
  }
  return rows;
}

std::string image_name(const std::vector<std::string>& georeference) {
  return fmt::format("{}/{:06}.png", georeference[1], std::stoi(georeference[0]));
}

/// Adds what COLMAP starts from: database.db by COLMAP's and SQLite's own programs, with the
/// cameras that the dataset states, and georegistration.txt.
void add_colmap_files(const fs::path& folder) {
  const fs::path sequence = folder / "flight";
  const fs::path database = sequence / "database.db";
  std::string sql = "BEGIN;\n", places;
  const std::string cameras = core::read_text_file(sequence / "sparse_txt/0/cameras.txt");
  for (const TextLine& line : split_lines(cameras)) {
    if (line.text.starts_with("#")) continue;
    const std::vector<std::string_view> words = split_blanks(line.text);
    std::string hex;
    for (std::size_t k = 4; k < 8; ++k) {
      const double value = std::stod(std::string(words[k]));
      std::array<unsigned char, 8> bytes{};
      std::memcpy(bytes.data(), &value, 8);
      for (const unsigned char byte : bytes) hex += fmt::format("{:02x}", byte);
    }
    sql += fmt::format("INSERT INTO cameras VALUES ({}, 1, {}, {}, x'{}', 1);\n", words[0],
                       words[2], words[3], hex);
  }
  const auto rows = georeferences(sequence);
  const std::size_t num_cameras = flight().cameras.size();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    sql += fmt::format("INSERT INTO images (image_id, name, camera_id) VALUES ({}, '{}', {});\n",
                       i + 1, image_name(rows[i]), i % num_cameras + 1);
    places += fmt::format("{} {} {} {}\n", image_name(rows[i]), rows[i][3], rows[i][4], rows[i][5]);
  }
  core::write_file(sequence / "georegistration.txt", places);
  ASSERT_EQ(
      test::run_command(test::kColmap, {"database_creator", "--database_path", database.string()})
          .status,
      0);
  const auto filled = test::run_command("/usr/bin/sqlite3", {database.string(), sql + "COMMIT;"});
  ASSERT_EQ(filled.status, 0) << filled.output;
}

const std::vector<std::string> kAllModes{"free", "georegister", "sparse"};

using Results = std::map<std::string, CheckResult>;

Results ask_colmap(const fs::path& dataset, const fs::path& report,
                   const std::vector<std::string>& modes) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.colmap = modes;
  options.colmap_seeds = 1;
  Results results;
  for (CheckResult& result : run_validate_stage(dataset, options, report, {log}))
    if (result.name.starts_with("colmap_")) results[result.name] = std::move(result);
  return results;
}

std::string text_of(const Results& results) {
  std::string text;
  for (const auto& [name, result] : results)
    text += fmt::format("{} {} = {:.5g} {} (bound {:.4g}): {}\n   {}\n",
                        result.ok ? result.skipped ? "skip" : "ok  " : "BAD ", name, result.value,
                        result.unit, result.bound, result.worst, result.summary);
  return text;
}

/// Puts a script before the real program, for as long as it lives.
class FakeColmap {
 public:
  FakeColmap(const fs::path& folder, const std::string& script) : old_path_(std::getenv("PATH")) {
    core::write_file(folder / "colmap", "#!/bin/sh\n" + script + "\n");
    fs::permissions(folder / "colmap", fs::perms::owner_all);
    ::setenv("PATH", (folder.string() + ":" + old_path_).c_str(), 1);
  }
  ~FakeColmap() { ::setenv("PATH", old_path_.c_str(), 1); }
  FakeColmap(const FakeColmap&) = delete;
  FakeColmap& operator=(const FakeColmap&) = delete;

 private:
  std::string old_path_;
};

constexpr const char* kSaysHelp = "[ $1 = help ] && { echo 'COLMAP 3.8 -- a test'; exit 0; }\n";

/// A dataset that a fake program can be asked about: COLMAP's files are there, whatever they hold.
void write_small(const fs::path& folder) {
  static const test::Recording recording = [] {
    std::vector<test::SceneCamera> cameras = test::colmap_cameras();
    cameras.resize(1);
    return test::record_flight(cameras, 3);
  }();
  test::write_colmap(recording, folder);
  core::write_file(folder / "flight/database.db", "");
  core::write_file(folder / "flight/georegistration.txt", "rig/cam0/000000.png 42 1 100\n");
}

TEST(ColmapProgram, AMissingOneIsAFailedCheckThatSaysWhatToInstall) {
  const ScratchFolder scratch;
  write_small(scratch / "data");
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", (scratch / "empty").c_str(), 1);
  const Results results = ask_colmap(scratch / "data", scratch / "report", kAllModes);
  ::setenv("PATH", path.c_str(), 1);
  for (const std::string& mode : kAllModes) {
    const CheckResult& result = results.at(fmt::format("colmap_{}_program", mode));
    EXPECT_FALSE(result.ok);
    EXPECT_THAT(result.worst, HasSubstr("apt-get install colmap"));
  }
}

TEST(ColmapProgram, OneThatAbortsIsAFailedCheckWithTheEndOfItsLog) {
  const ScratchFolder scratch;
  write_small(scratch / "data");
  const FakeColmap fake(scratch / "bin", std::string(kSaysHelp) + "echo last words; kill -ABRT $$");
  const Results results = ask_colmap(scratch / "data", scratch / "report", kAllModes);
  for (const std::string& mode : kAllModes) {
    const CheckResult& result = results.at(fmt::format("colmap_{}_program", mode));
    EXPECT_FALSE(result.ok);
    EXPECT_THAT(result.worst, HasSubstr("signal 6 (Aborted)"));
    EXPECT_THAT(result.worst, HasSubstr("last words"));
  }
}

TEST(ColmapProgram, OneThatEndsWellAndLeavesNothingIsAFailedCheck) {
  const ScratchFolder scratch;
  write_small(scratch / "data");
  const FakeColmap fake(scratch / "bin", std::string(kSaysHelp) + "exit 0");
  const Results results = ask_colmap(scratch / "data", scratch / "report", kAllModes);
  for (const std::string& mode : kAllModes)
    EXPECT_FALSE(results.at(fmt::format("colmap_{}_program", mode)).ok) << mode;
}

TEST(ColmapProgram, WhatWasDoneBeforeACommandFailedIsNotDoneAgain) {
  const ScratchFolder scratch;
  write_small(scratch / "data");
  const fs::path calls = scratch / "calls";
  const FakeColmap fake(scratch / "bin", std::string(kSaysHelp) + "echo $1 >> " + calls.string() +
                                             "\n[ $1 = matches_importer ] && [ $(grep -c matches " +
                                             calls.string() + ") = 1 ] && kill -KILL $$\nexit 0");
  const Results first = ask_colmap(scratch / "data", scratch / "report", {"sparse"});
  EXPECT_THAT(first.at("colmap_sparse_program").worst, HasSubstr("signal 9"));
  EXPECT_EQ(core::read_text_file(calls), "feature_extractor\nmatches_importer\n");
  ask_colmap(scratch / "data", scratch / "report", {"sparse"});
  EXPECT_EQ(core::read_text_file(calls),
            "feature_extractor\nmatches_importer\nmatches_importer\npoint_triangulator\n");
  // Another image: all is done again.
  core::write_file(scratch / "data/flight/images/rig/cam0/000001.png",
                   core::read_file(scratch / "data/flight/images/rig/cam0/000002.png"));
  fs::remove(calls);
  ask_colmap(scratch / "data", scratch / "report", {"sparse"});
  EXPECT_EQ(core::read_text_file(calls).substr(0, 18), "feature_extractor\n");
}

TEST(ColmapProgram, AnotherProgramOfThatNameIsAFailedCheck) {
  const ScratchFolder scratch;
  write_small(scratch / "data");
  const FakeColmap fake(scratch / "bin", "echo hello");
  const Results results = ask_colmap(scratch / "data", scratch / "report", {"sparse"});
  EXPECT_THAT(results.at("colmap_sparse_program").worst, HasSubstr("is not COLMAP"));
}

TEST(ColmapProgram, ADatasetThatLacksItsFilesIsAFailedCheck) {
  const ScratchFolder scratch;
  write_small(scratch / "data");
  fs::remove(scratch / "data/flight/database.db");
  core::write_file(scratch / "data/flight/georegistration.txt", "rig/cam0/000000.png 42 x 100\n");
  const FakeColmap fake(scratch / "bin", std::string(kSaysHelp) + "exit 0");
  const Results results =
      ask_colmap(scratch / "data", scratch / "report", {"sparse", "georegister"});
  EXPECT_THAT(results.at("colmap_sparse_program").worst, HasSubstr("database.db is missing"));
  EXPECT_FALSE(results.at("colmap_georegister_program").ok);
}

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
  /// Along x.
  void shift_observations(double by_px) {
    for (const RawImage& image : places)
      for (std::size_t at = first_observation(image); at < image.end; at += 24)
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

/// What COLMAP's work is judged to be when it is known: a script stands in for COLMAP and gives the
/// exported model with a change.
struct KnownWork : testing::Test {
  ScratchFolder scratch;
  Results judge(const char* mode, const std::function<void(RawModel&)>& change,
                const Mistake& mistake = {}) {
    static const test::Recording recording = test::record_flight(test::colmap_cameras(), 3);
    test::write_colmap(recording, scratch / "data", mistake);
    core::write_file(scratch / "data/flight/database.db", "");
    RawModel model(scratch / "data/flight/sparse/0");
    change(model);
    model.write(scratch / "model");
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
  EXPECT_LE(results.at("colmap_sparse_reprojection").value, 1e-9);
  EXPECT_LE(results.at("colmap_sparse_distance").value, 1e-4);  // depth between pixel centres
  EXPECT_LE(results.at("colmap_sparse_offset").value, 1e-4);
  EXPECT_TRUE(results.at("colmap_sparse_points").ok);
}

TEST_F(Triangulation, KeypointsBesideTheirPointsAreAnErrorOfReprojection) {
  const Results results = judge([](RawModel& model) { model.shift_observations(0.31); });
  EXPECT_NEAR(results.at("colmap_sparse_reprojection").value, 0.31, 1e-9);
  EXPECT_FALSE(results.at("colmap_sparse_reprojection").ok);
}

TEST_F(Triangulation, PointsOverTheGroundAreAnOffset) {
  // A ground pixel of this flight is 0.8 to 1 m; the ground slopes, so that a metre up is less along
  // its normal.
  const Results results = judge([](RawModel& model) {
    model.move_points([](std::size_t) { return Eigen::Vector3d(0.0, 0.0, 0.3); });
  });
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_sparse_offset").ok);
  EXPECT_GE(results.at("colmap_sparse_offset").value, 0.2);
  EXPECT_LE(results.at("colmap_sparse_offset").value, 0.4);
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
  EXPECT_EQ(results.at("colmap_sparse_points").worst, "rig/cam1/000001.png");
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
  // 0.031 units a metre; a ground pixel is about 1 m. One of nine cameras, and the similarity takes
  // a part of it.
  const Results results = judge([](RawModel& model) {
    model.set_pose(4, model.rotation(4), model.centre(4) + Eigen::Vector3d(0.0, 0.0, 3.0 * 0.031));
  });
  SCOPED_TRACE(text_of(results));
  EXPECT_FALSE(results.at("colmap_free_ate").ok);
  EXPECT_LE(results.at("colmap_free_ate").value, 1.5);
  EXPECT_FALSE(results.at("colmap_free_rpe").ok);
  EXPECT_TRUE(results.at("colmap_free_rpe_rotation").ok);
}

TEST_F(FreeReconstruction, ATurnedCameraIsFoundByTheRotationOfItsSteps) {
  const Results results = judge([](RawModel& model) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitY()));
    model.set_pose(4, turn * model.rotation(4), model.centre(4));
  });
  SCOPED_TRACE(text_of(results));
  EXPECT_TRUE(results.at("colmap_free_ate").ok);
  EXPECT_FALSE(results.at("colmap_free_rpe_rotation").ok);
  // Two of six steps are off by 0.02 rad times 120 px.
  EXPECT_NEAR(results.at("colmap_free_rpe_rotation").value, 2.4 * std::sqrt(2.0 / 6.0), 1e-3);
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

/// A right dataset, what COLMAP said of it, and the same dataset after a change.
struct ColmapOnWrongData : testing::Test {
  ScratchFolder scratch;
  fs::path sequence = scratch / "data/flight";

  void write() {
    test::write_colmap(flight(), scratch / "data");
    add_colmap_files(scratch / "data");
  }
  /// Features and matches of an earlier call are taken up.
  Results ask(const std::vector<std::string>& modes) {
    return ask_colmap(scratch / "data", scratch / "report", modes);
  }
  void expect_right(const Results& results, const std::vector<std::string>& names) {
    SCOPED_TRACE(text_of(results));
    for (const std::string& name : names) {
      ASSERT_TRUE(results.contains(name)) << name;
      EXPECT_TRUE(results.at(name).ok && !results.at(name).skipped) << name;
    }
  }
  /// Changes doubles of a binary file of the model.
  void change(const char* name, std::size_t at, std::size_t count,
              const std::function<double(double)>& changed) {
    const fs::path file = sequence / "sparse/0" / name;
    std::vector<std::byte> bytes = core::read_file(file);
    for (std::size_t i = 0; i < count; ++i) {
      double value = 0.0;
      std::memcpy(&value, bytes.data() + at + 8 * i, 8);
      value = changed(value);
      std::memcpy(bytes.data() + at + 8 * i, &value, 8);
    }
    core::write_file(file, bytes);
  }
};

TEST_F(ColmapOnWrongData, SparsePassesARightOneAndFindsAFocalLengthOffByHalfAPercent) {
  TERRACAST_NEEDS_COLMAP();
  write();
  expect_right(ask({"sparse"}),
               {"colmap_sparse_program", "colmap_sparse_reprojection", "colmap_sparse_distance",
                "colmap_sparse_offset", "colmap_sparse_points"});
  // cameras.bin: a count, then id, model, width, height, fx, fy, cx, cy.
  for (std::size_t camera = 0; camera < 2; ++camera)
    change("cameras.bin", 8 + camera * 56 + 24, 2, [](double focal) { return 1.005 * focal; });
  const Results wrong = ask({"sparse"});
  SCOPED_TRACE(text_of(wrong));
  EXPECT_TRUE(wrong.at("colmap_sparse_program").ok);
  EXPECT_FALSE(wrong.at("colmap_sparse_reprojection").ok && wrong.at("colmap_sparse_offset").ok);
}

TEST_F(ColmapOnWrongData, GeoregisterFindsAnotherDatumAndSwappedAxes) {
  TERRACAST_NEEDS_COLMAP();
  write();
  expect_right(ask({"georegister"}), {"colmap_georegister_program", "colmap_georegister_position"});
  std::string higher, swapped;
  for (const std::vector<std::string>& row : georeferences(sequence)) {
    const std::string name = image_name(row);
    higher += fmt::format("{} {} {} {:.6f}\n", name, row[3], row[4], std::stod(row[5]) + 0.02);
    swapped += fmt::format("{} {} {} {}\n", name, row[4], row[3], row[5]);
  }
  for (const std::string& text : {higher, swapped}) {
    core::write_file(sequence / "georegistration.txt", text);
    const Results wrong = ask({"georegister"});
    EXPECT_FALSE(wrong.at("colmap_georegister_program").ok &&
                 wrong.at("colmap_georegister_position").ok)
        << text_of(wrong);
  }
}

}  // namespace
}  // namespace terracast::validate
