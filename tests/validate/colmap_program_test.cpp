// COLMAP on datasets of the tests' own writer: a right one passes, wrong ones fail the check that
// names them; a program that is missing, dies or gives nothing is a failed check and no crash.

#include "tests/support/colmap_program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <functional>

#include "core/atomic_file.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "tests/validate/ask_colmap.h"
#include "validate/check.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

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
  EXPECT_EQ(core::read_text_file(calls), "feature_extractor\nmatches_importer\nmatches_importer\n");
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
