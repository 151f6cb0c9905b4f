#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "capture/begun_sequence.h"
#include "capture/frame_reader.h"
#include "capture/frame_record_json.h"
#include "capture/frame_writer.h"
#include "capture/sequence_json.h"
#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/capture/sequence_support.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_capture.h"

namespace terracast::capture {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using test::expect_error;
using test::hashes;
using test::kSmall;
using test::ScratchFolder;
using testing::HasSubstr;

TEST(SequenceFiles, WhatIsWrittenIsRead) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceReader reader = SequenceReader::open(folder);
  const SequenceInfo info = test::tiny_sequence(kSmall);
  EXPECT_EQ(reader.info(), info);
  EXPECT_EQ(reader.tracks(), test::tiny_tracks());
  ASSERT_EQ(reader.frames().size(), 2U);
  for (int frame = 0; frame < 2; ++frame) {
    const FrameRecord& record = reader.frames()[static_cast<std::size_t>(frame)];
    EXPECT_EQ(record.index, frame);
    // Decimal text that reads back to the same bits.
    EXPECT_EQ(record.world_from_body, test::tiny_world_from_body(kSmall, frame));
    for (int k = 0; k < 4; ++k) {
      const CameraFrame truth = test::tiny_frame(kSmall, info, frame, k);
      const CameraFrame read = reader.read_camera(frame, k);
      EXPECT_EQ(read.color, truth.color);
      EXPECT_EQ(read.range_m, truth.range_m);
      EXPECT_EQ(read.semantic_id, truth.semantic_id);
      EXPECT_EQ(read.instance_id, truth.instance_id);
      EXPECT_EQ(read.primitive_id, truth.primitive_id);
      EXPECT_EQ(read.flags, truth.flags);
      for (std::size_t i = 0; i < truth.normal_world.data().size(); ++i)  // half: 11 bits
        EXPECT_NEAR(read.normal_world.data()[i], truth.normal_world.data()[i], 1.0F / 4096.0F);
      EXPECT_EQ(reader.world_from_camera(frame, k),
                test::tiny_world_from_camera(kSmall, frame, info.cameras[k]));
      std::int64_t num_sky = 0;
      for (const float range_m : truth.range_m.data()) num_sky += std::isinf(range_m) ? 1 : 0;
      EXPECT_EQ(record.cameras[k].num_sky, num_sky);
      EXPECT_EQ(record.cameras[k].num_edge, 0);
      EXPECT_EQ(record.cameras[k].bounds, test::tiny_bounds(record.index, static_cast<int>(k)));
    }
  }
  const CameraFrame color_only = reader.read_camera(0, 0, SequenceReader::kColor);
  EXPECT_FALSE(color_only.color.empty());
  EXPECT_TRUE(color_only.range_m.empty());
}

TEST(SequenceFiles, KeepWhatIsBelievedAndTheClocks) {
  const ScratchFolder scratch;
  test::TinyCaptureOptions options = kSmall;
  const fs::path plain = test::write_tiny_capture(scratch / "plain", options);
  for (const char* word : {"believed", "clock"})
    EXPECT_THAT(core::read_text_file(plain / "sequence.json"), testing::Not(HasSubstr(word)));
  EXPECT_THAT(core::read_text_file(plain / "frames/000001.json"),
              testing::Not(HasSubstr("stamps_s")));

  options.has_camera_errors = options.has_clock_errors = true;
  const fs::path folder = test::write_tiny_capture(scratch / "errors", options);
  const SequenceReader reader = SequenceReader::open(folder);
  const SequenceInfo info = test::tiny_sequence(options);
  EXPECT_EQ(reader.info(), info);
  EXPECT_EQ(info.believed(), test::tiny_sequence(kSmall).cameras);
  EXPECT_NE(info.cameras, info.believed());
  const FrameRecord& record = reader.frames()[1];
  EXPECT_EQ(record.time_s, 0.1);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(record.stamp_s(k), test::tiny_stamp_s(k, 0.1));
}

TEST(SequenceFiles, KeepTheTermsOfMotions) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  EXPECT_THAT(core::read_text_file(folder / "frames/000001.json"),
              testing::Not(HasSubstr("motion_terms")));
  const SequenceReader reader = SequenceReader::open(folder);
  FrameRecord record = reader.frames()[1];
  record.terms.reach_s = 0.0125;
  record.terms.position_world = {
      Eigen::Vector3d(1.0 / 3.0, 2.0, -1e-9), {4.0, -5e5, 6.0}, {7.0, 8.0, 9e7}};
  record.terms.turning_body = {
      Eigen::Vector3d(5.0, -0.1, 0.0), {1.0, 2.0, 3.0}, {-4.0, 1e3, 6.0}, {7.0, 1.0 / 7.0, 1e5}};
  record.terms.spin_body_radps = {0.0, 0.0, 628.0};
  record.terms.error_m = 2e-9;
  record.terms.error_rad = 1e-10;
  const auto read = [&](const FrameRecord& one) {
    return record_from_json(
        core::Json::parse(json_from_record(one, reader.info().input_hash).text(), "here"),
        reader.info(), "here");
  };
  EXPECT_EQ(read(record), record);
  EXPECT_EQ(record.state().terms, record.terms);
  for (const double wrong : {-1e-3, std::numeric_limits<double>::infinity()}) {
    FrameRecord other = record;
    other.terms.error_rad = wrong;
    expect_error(ErrorKind::Input, {"term"},
                 [&] { check_record(other, reader.info(), ErrorKind::Input, "here"); });
  }
}

TEST(SequenceFiles, KeepShuttersAndLensesAndRefuseWhatIsNone) {
  const ScratchFolder scratch;
  const fs::path plain = test::write_tiny_capture(scratch / "plain", kSmall);
  for (const char* word : {"shutter", "aperture"})
    EXPECT_THAT(core::read_text_file(plain / "sequence.json"), testing::Not(HasSubstr(word)));

  SequenceInfo info = test::tiny_sequence(kSmall);
  EXPECT_FALSE(info.has_rolling_shutter());
  info.cameras[1].shutter = {
      .exposure_s = 0.01, .line_time_s = 3.1e-5, .readout = geo::Readout::Left};
  info.cameras[2].aperture = {.diameter_m = 0.004, .focus_m = 12.5};
  EXPECT_TRUE(info.has_rolling_shutter());
  const std::string text = json_from_sequence(info).text();
  const auto read = [](const std::string& json) {
    return sequence_from_json(core::Json::parse(json, "sequence.json"), "sequence.json");
  };
  EXPECT_EQ(read(text).cameras, info.cameras);
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string json = text;
    json.replace(json.find(from), from.size(), to);
    return json;
  };
  expect_error(core::ErrorKind::Input, {"sideways", "down, up, right and left"},
               [&] { read(changed("\"left\"", "\"sideways\"")); });
  expect_error(core::ErrorKind::Input, {"0 or more"},
               [&] { read(changed("\"focus_m\": 12.5", "\"focus_m\": -12.5")); });
}

TEST(SequenceFiles, PhotositesBeyondTheImageAreRefused) {
  SequenceInfo info = test::tiny_sequence(kSmall);
  info.imaging.resize(info.cameras.size());
  info.imaging[1] = {.settings_toml = "[sensor]\nbits = 12\n",
                     .raw = {.mosaic = "rggb", .bits = 12, .white_level_dn = 4095.0},
                     .hot_sites = {90 * 80 - 1}};
  const auto read = [&] {
    return sequence_from_json(core::Json::parse(json_from_sequence(info).text(), "sequence.json"),
                              "sequence.json");
  };
  EXPECT_EQ(read().imaging, info.imaging);
  info.imaging[1].hot_sites = {90 * 80};
  expect_error(core::ErrorKind::Input, {"photosite 7200"}, read);
  info.imaging[1].hot_sites = {};
  info.imaging[1].raw.dn_per_electron = -0.5;
  expect_error(core::ErrorKind::Input, {"raw of camera"}, read);
  info.imaging[1].raw = {};
  info.imaging[1].dead_sites = {3 * 90 * 80 - 1};
  EXPECT_EQ(read().imaging, info.imaging);
}

TEST(SequenceFiles, BeliefsOfOtherCamerasAreRefused) {
  const ScratchFolder scratch;
  test::TinyCaptureOptions options = kSmall;
  options.has_camera_errors = options.has_clock_errors = true;
  const auto refuse = [&](const char* words, auto&& change) {
    SequenceInfo info = test::tiny_sequence(options);
    change(info);
    expect_error(ErrorKind::Config, {words},
                 [&] { SequenceWriter(scratch / "refused", info, test::tiny_tracks()); });
  };
  refuse("another size, model or mount",
         [](SequenceInfo& info) { info.believed_cameras[1].intrinsics.width_px += 1; });
  refuse("another size, model or mount",
         [](SequenceInfo& info) { info.believed_cameras[1].body_from_rig.translation.x() += 1; });
  refuse("focal",
         [](SequenceInfo& info) { info.believed_cameras[0].intrinsics.parameters[0] = -1; });
  refuse("3 believed calibrations or clocks of 4 cameras",
         [](SequenceInfo& info) { info.clocks.pop_back(); });
  refuse("a clock of", [](SequenceInfo& info) { info.clocks[2].jitter_sd_s = -1.0; });
}

TEST(SequenceFiles, ImagingThatCannotBeIsRefused) {
  const ScratchFolder scratch;
  const auto refuse = [&](const char* words, auto&& change) {
    SequenceInfo info = test::tiny_sequence(kSmall);
    info.imaging.assign(
        4, {.settings_toml = "[sensor]\n",
            .raw = {.mosaic = "rggb", .bits = 10, .black_level_dn = 64.0, .white_level_dn = 1023.0},
            .dead_sites = {3, 8}});
    change(info);
    expect_error(ErrorKind::Config, {words},
                 [&] { SequenceWriter(scratch / "refused", info, test::tiny_tracks()); });
  };
  refuse("imaging of 3 of 4", [](SequenceInfo& info) { info.imaging.pop_back(); });
  refuse("mosaic \"rgb\"", [](SequenceInfo& info) { info.imaging[1].raw.mosaic = "rgb"; });
  refuse("levels 64 and 1024",
         [](SequenceInfo& info) { info.imaging[2].raw.white_level_dn = 1024; });
  refuse("photosite 3", [](SequenceInfo& info) { info.imaging[3].dead_sites = {8, 3}; });

  // A frame of such a camera has its raw numbers.
  SequenceInfo info = test::tiny_sequence(kSmall);
  info.imaging.resize(4);
  info.imaging[0] = {.settings_toml = "[sensor]\n",
                     .raw = {.mosaic = "rggb", .bits = 10, .white_level_dn = 1023.0}};
  const SequenceReader plain =
      SequenceReader::open(test::write_tiny_capture(scratch / "plain", kSmall));
  const SequenceWriter writer(scratch / "raw", info, test::tiny_tracks());
  expect_error(ErrorKind::Internal, {"the raw file of camera", "is none"},
               [&] { writer.finish_frame(plain.frames()[0]); });
}

TEST(SequenceFiles, RepeatsGiveTheSameBytesWhateverTheOrder) {
  const ScratchFolder scratch;
  const fs::path first = test::write_tiny_capture(scratch / "a", kSmall);
  // The other way round, each frame by a writer of its own, as shards do.
  const SequenceInfo info = test::tiny_sequence(kSmall);
  const fs::path second = scratch / "b" / "valley";
  const SequenceReader reader = SequenceReader::open(first);
  for (int frame = 1; frame >= 0; --frame) {
    const SequenceWriter writer(second, info, test::tiny_tracks());
    EXPECT_FALSE(writer.has_frame(frame));
    FrameRecord record = reader.frames()[static_cast<std::size_t>(frame)];
    for (int k = 3; k >= 0; --k) {
      const auto tracks = record.cameras[k].visible_tracks;
      record.cameras[k] = writer.write_camera(frame, k, test::tiny_frame(kSmall, info, frame, k));
      record.cameras[k].visible_tracks = tracks;
      record.cameras[k].bounds = test::tiny_bounds(frame, k);
    }
    writer.finish_frame(record);
    EXPECT_TRUE(writer.has_frame(frame));
    EXPECT_EQ(writer.finish_sequence(), frame == 0);
  }
  fs::remove_all(first / "labels");  // the writer knows nothing of labels
  EXPECT_EQ(hashes(first), hashes(second));
}

TEST(SequenceFiles, NothingTellsWhereOrWhen) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  for (const char* file : {"sequence.json", "manifest.json", "tracks.json", "frames/000000.json"})
    EXPECT_THAT(core::read_text_file(folder / file),
                testing::Not(HasSubstr(scratch.path().string())));
}

TEST(SequenceFiles, AnotherRunsFolderIsRefused) {
  const ScratchFolder scratch;
  test::write_tiny_capture(scratch.path(), kSmall);
  test::TinyCaptureOptions other = kSmall;
  other.input_hash = "ffff";
  expect_error(ErrorKind::Config, {kSmall.input_hash, "ffff", "--out"},
               [&] { test::write_tiny_capture(scratch.path(), other); });
  // The same hash for something else is a lie about what determines the frames.
  other = kSmall;
  other.num_frames = 3;
  expect_error(ErrorKind::Config, {"sequence.json", "same hash"},
               [&] { test::write_tiny_capture(scratch.path(), other); });
}

TEST(SequenceFiles, LeftoversOfKilledWritersDoNotMatter) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  for (const char* name : {"frames/.terracast-tmp-1.json", "mcs4/cam0/.terracast-tmp-2.png"})
    std::ofstream(folder / name) << "half";
  EXPECT_NO_THROW(SequenceReader::open(folder).read_camera(0, 0));
  EXPECT_TRUE(
      SequenceWriter(folder, test::tiny_sequence(kSmall), test::tiny_tracks()).finish_sequence());
}

TEST(SequenceFiles, AnUnfinishedSequenceSaysWhatIsMissing) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  fs::rename(folder / "manifest.json", scratch / "kept.json");
  expect_error(ErrorKind::Input, {"unfinished", "manifest.json", "render stage again"},
               [&] { SequenceReader::open(folder); });
  fs::remove(folder / "frames/000001.json");
  expect_error(ErrorKind::Input, {"1 of 2 frames", "first is 1"},
               [&] { SequenceReader::open(folder); });
  expect_error(ErrorKind::Io, {"no such folder"}, [&] { SequenceReader::open(scratch / "none"); });
  expect_error(ErrorKind::Input, {"sequence.json"}, [&] { SequenceReader::open(scratch.path()); });
}

TEST(SequenceFiles, TracksOfABegunSequenceAreThoseThatItsWriterWasGiven) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  SequenceInfo info = test::tiny_sequence(kSmall);
  EXPECT_EQ(tracks_of_begun(folder, info), test::tiny_tracks());
  EXPECT_EQ(tracks_of_begun(scratch / "elsewhere", info), std::nullopt);
  info.input_hash += "0";
  EXPECT_EQ(tracks_of_begun(folder, info), std::nullopt);
  info = test::tiny_sequence(kSmall);
  std::string text = core::read_text_file(folder / "tracks.json");
  text[text.find("point_world_m") + 17] ^= 1;
  core::write_file(folder / "tracks.json", std::string_view(text));
  EXPECT_EQ(tracks_of_begun(folder, info), std::nullopt);
}

TEST(SequenceFiles, SequencesAreListedByName) {
  const ScratchFolder scratch;
  expect_error(ErrorKind::Input, {"no sequence"}, [&] { list_sequences(scratch.path()); });
  for (const char* name : {"b", "a"}) {
    test::TinyCaptureOptions options = kSmall;
    options.name = name;
    test::write_tiny_capture(scratch.path(), options);
  }
  fs::create_directory(scratch / "logs");
  EXPECT_THAT(list_sequences(scratch.path()), testing::ElementsAre(scratch / "a", scratch / "b"));
}

TEST(SequenceFiles, AWriterRefusesWrongFacts) {
  const ScratchFolder scratch;
  const SequenceInfo info = test::tiny_sequence(kSmall);
  const SequenceWriter writer(scratch / "s", info, {});
  CameraFrame frame = test::tiny_frame(kSmall, info, 0, 0);
  frame.range_m(4, 70) = std::nanf("");
  expect_error(ErrorKind::Internal, {"pixel (4, 70)", "mcs4/cam0"},
               [&] { writer.write_camera(0, 0, frame); });
  frame = test::tiny_frame(kSmall, info, 0, 0);
  frame.flags = core::ImageU32(10, 10);
  expect_error(ErrorKind::Internal, {"90 x 80"}, [&] { writer.write_camera(0, 0, frame); });
  FrameRecord record;
  expect_error(ErrorKind::Internal, {"0 cameras"}, [&] { writer.finish_frame(record); });
}

TEST(SequenceFiles, AnUnusableSequenceIsRefusedBeforeWriting) {
  const ScratchFolder scratch;
  SequenceInfo info = test::tiny_sequence(kSmall);
  info.name = "up/../..";
  expect_error(ErrorKind::Config, {"up/../.."}, [&] { SequenceWriter(scratch / "s", info, {}); });
  info = test::tiny_sequence(kSmall);
  info.cameras.clear();
  expect_error(ErrorKind::Config, {"0 cameras"}, [&] { SequenceWriter(scratch / "s", info, {}); });
  EXPECT_FALSE(fs::exists(scratch / "s"));
}

}  // namespace
}  // namespace terracast::capture
