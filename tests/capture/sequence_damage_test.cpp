#include <gtest/gtest.h>

#include <fstream>
#include <optional>

#include "capture/frame_reader.h"
#include "capture/frame_writer.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/json.h"
#include "tests/capture/sequence_support.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_capture.h"

namespace terracast::capture {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using test::expect_error;
using test::hashes;
using test::kSmall;
using test::replace_in;
using test::ScratchFolder;

TEST(SequenceFiles, AFrameWithATruncatedFileIsUnfinished) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceWriter writer(folder, test::tiny_sequence(kSmall), test::tiny_tracks());
  ASSERT_TRUE(writer.has_frame(0));
  ASSERT_TRUE(writer.has_frame(1));
  fs::resize_file(folder / "mcs4/cam1/000001.exr", 100);
  EXPECT_TRUE(writer.has_frame(0));
  EXPECT_FALSE(writer.has_frame(1));
  EXPECT_FALSE(writer.finish_sequence());
  fs::remove(folder / "mcs4/cam3/000000.png");
  EXPECT_FALSE(writer.has_frame(0));
  EXPECT_FALSE(writer.has_frame(2));
}

TEST(SequenceFiles, ADamagedRecordIsAnUnfinishedFrame) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceWriter writer(folder, test::tiny_sequence(kSmall), test::tiny_tracks());
  fs::resize_file(folder / "frames/000001.json", 200);
  EXPECT_FALSE(writer.has_frame(1));
}

/// Behind the writer's back, and without its care for the disk.
void overwrite(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}
void flip_bit(const fs::path& file, std::size_t at, int bit) {
  std::string text = core::read_text_file(file);
  text.at(at) = static_cast<char>(text[at] ^ (1 << bit));
  overwrite(file, text);
}

// Seen in 2026: a flipped digit of a pose in a record was given a hash by the manifest that was
// written after it, and was exported.
TEST(SequenceFiles, ARecordInWhichAnyBitWasFlippedIsNoFrame) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceWriter writer(folder, test::tiny_sequence(kSmall), test::tiny_tracks());
  const fs::path record = folder / record_path(1);
  const std::string good = core::read_text_file(record);
  const std::string members = Json::read(record).text(-1);
  int num_tried = 0;
  for (std::size_t at = 0; at < good.size(); at += 23) {
    const int bit = static_cast<int>(at % 8);
    flip_bit(record, at, bit);
    ++num_tried;
    const bool is_frame = writer.has_frame(1);  // where an e of an exponent is an E now
    EXPECT_TRUE(!is_frame || Json::read(record).text(-1) == members) << "bit " << bit << ", " << at;
    overwrite(record, good);
  }
  EXPECT_GT(num_tried, 50);
  EXPECT_TRUE(writer.has_frame(1));
}

TEST(SequenceFiles, WhatAllShardsShareIsWrittenAnewWhereItIsDamagedAndTheFramesStay) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const auto before = hashes(folder);
  for (const char* name : {kSequenceFile, kTracksFile}) {
    const std::size_t version_at = core::read_text_file(folder / name).find("\"version\"");
    for (std::size_t at = 0; at < fs::file_size(folder / name); at += 397) {
      if (at >= version_at && at < version_at + 14) continue;  // another version's is not ours
      flip_bit(folder / name, at, static_cast<int>(at % 8));
      const SequenceWriter writer(folder, test::tiny_sequence(kSmall), test::tiny_tracks());
      EXPECT_TRUE(writer.has_frame(0) && writer.has_frame(1));
      EXPECT_EQ(hashes(folder), before) << name << ", byte " << at;
    }
    for (const std::size_t size : {0, 100}) {
      fs::resize_file(folder / name, size);
      SequenceWriter(folder, test::tiny_sequence(kSmall), test::tiny_tracks());
      EXPECT_EQ(hashes(folder), before) << name << " of " << size << " bytes";
    }
  }
}

TEST(SequenceFiles, FramesOfOtherInputsAreNoneOfASequenceWhoseDescriptionIsDamaged) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  fs::resize_file(folder / kSequenceFile, 100);
  test::TinyCaptureOptions other = kSmall;
  other.input_hash = "ffff";
  const SequenceWriter writer(folder, test::tiny_sequence(other), test::tiny_tracks());
  EXPECT_FALSE(writer.has_frame(0));
}

TEST(SequenceFiles, ASequenceIsNotFinishedWithWhatWasDamagedMeanwhile) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  for (const char* name : {kSequenceFile, kTracksFile}) {
    const SequenceWriter writer(folder, test::tiny_sequence(kSmall), test::tiny_tracks());
    flip_bit(folder / name, fs::file_size(folder / name) / 2, 0);
    expect_error(ErrorKind::Input, {name}, [&] { writer.finish_sequence(); });
  }
}

TEST(SequenceFiles, AFlippedBitIsFound) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceReader reader = SequenceReader::open(folder);
  for (const char* name :
       {"mcs4/cam0/000000.png", "mcs4/cam0/000000.exr", "frames/000000.json", "tracks.json"}) {
    const std::vector<std::byte> good = core::read_file(folder / name);
    std::vector<std::byte> bad = good;
    bad[bad.size() / 2] ^= std::byte{4};
    core::write_file(folder / name, bad);
    expect_error(ErrorKind::Input, {name, "damaged"},
                 [&] { SequenceReader::open(folder).read_camera(0, 0); });
    bad.resize(bad.size() - 1);
    core::write_file(folder / name, bad);
    expect_error(ErrorKind::Input, {name, "bytes"},
                 [&] { SequenceReader::open(folder).read_camera(0, 0); });
    core::write_file(folder / name, good);
  }
  fs::remove(folder / "mcs4/cam2/000001.exr");
  expect_error(ErrorKind::Input, {"mcs4/cam2/000001.exr", "missing"},
               [&] { reader.read_camera(1, 2); });
}

// Seen in 2026: a finished sequence that was damaged counted as finished for ever.
TEST(FindDamagedFrames, NamesThoseOfTheSelectionAndRemovesNothing) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceInfo info = test::tiny_sequence(kSmall);
  EXPECT_EQ(find_damaged_frames(folder, info, {}), std::vector<int>());

  const fs::path image = folder / facts_path(info.cameras[0], 1);
  std::vector<std::byte> bytes = core::read_file(image);
  bytes[bytes.size() / 2] ^= std::byte{1};
  core::write_file(image, bytes);
  EXPECT_EQ(find_damaged_frames(folder, info, {.first = 0, .step = 2}), std::vector<int>());
  EXPECT_EQ(find_damaged_frames(folder, info, {.first = 0, .end = 1}), std::vector<int>());
  EXPECT_EQ(find_damaged_frames(folder, info, {.first = 1, .end = 2}), std::vector<int>{1});
  EXPECT_EQ(find_damaged_frames(folder, info, {.first = 1, .step = 2}), std::vector<int>{1});
  // Another process may have rendered it again meanwhile: it is not for this one to remove.
  EXPECT_TRUE(fs::exists(folder / record_path(1)));
  fs::remove(folder / record_path(0));
  EXPECT_EQ(find_damaged_frames(folder, info, {}), (std::vector<int>{0, 1}));

  SequenceInfo other = info;
  other.input_hash = "another";
  EXPECT_EQ(find_damaged_frames(folder, other, {}), std::nullopt);
  fs::remove(folder / kManifestFile);
  EXPECT_EQ(find_damaged_frames(folder, info, {}), std::nullopt);  // not finished
}

TEST(WholeFrames, AreFoundInUnfinishedAndDamagedSequences) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const SequenceReader reader = SequenceReader::open(folder);
  fs::remove(folder / kManifestFile);
  const std::optional<WholeFrames> frames = WholeFrames::open(folder);
  ASSERT_TRUE(frames);
  EXPECT_EQ(frames->info(), reader.info());
  ASSERT_EQ(frames->record(1), reader.frames()[1]);
  EXPECT_TRUE(frames->has_files(reader.frames()[1]));
  EXPECT_EQ(frames->record(2), std::nullopt);  // there is none

  const fs::path image = folder / facts_path(reader.info().cameras[0], 1);
  std::vector<std::byte> bytes = core::read_file(image);
  bytes[bytes.size() / 2] ^= std::byte{1};
  core::write_file(image, bytes);
  EXPECT_FALSE(frames->has_files(reader.frames()[1]));
  fs::remove(image);
  EXPECT_FALSE(frames->has_files(reader.frames()[1]));

  // A record of another frame, and records with any one byte changed that still are JSON.
  fs::copy_file(folder / record_path(1), folder / record_path(0),
                fs::copy_options::overwrite_existing);
  EXPECT_EQ(frames->record(0), std::nullopt);
  const std::string good = core::read_text_file(folder / record_path(1));
  for (std::size_t at = good.find("\"num_sky\""); at < good.size(); at += 97) {
    std::string bad = good;
    bad[at] = bad[at] == '1' ? '2' : '1';
    core::write_file(folder / record_path(1), bad);
    EXPECT_EQ(frames->record(1), std::nullopt) << "byte " << at;
  }

  replace_in(folder / kSequenceFile, fmt::format("\"version\": {}", kCaptureVersion),
             "\"version\": 3");
  EXPECT_FALSE(WholeFrames::open(folder));
  EXPECT_FALSE(WholeFrames::open(scratch / "missing"));
}

}  // namespace
}  // namespace terracast::capture
