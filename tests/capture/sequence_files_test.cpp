#include "capture/sequence_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "capture/frame_reader.h"
#include "capture/frame_writer.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_capture.h"

namespace terracast::capture {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using test::ScratchFolder;
using testing::HasSubstr;

const test::TinyCaptureOptions kSmall{.num_frames = 2, .has_tartan2 = false};

std::map<std::string, std::string> hashes(const fs::path& folder) {
  std::map<std::string, std::string> result;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      result[fs::relative(entry.path(), folder).string()] =
          core::content_hash_of_file(entry.path());
  return result;
}

template <class Work>
void expect_error(ErrorKind kind, const std::vector<std::string>& words, Work&& work) {
  try {
    work();
    ADD_FAILURE() << "no error";
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), kind) << error.what();
    for (const std::string& word : words) EXPECT_THAT(error.what(), HasSubstr(word));
  }
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string text = core::read_text_file(file);
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  core::write_file(file, text.replace(at, from.size(), to));
}

/// Gives a changed JSON file its new hash, as a forger would; one that is no JSON any more has none.
void bless_itself(const fs::path& file) {
  try {
    Json json = Json::read(file);
    core::add_content_hash(json);
    json.write(file);
  } catch (const core::Error&) {
  }
}

/// The same in the manifest too.
void bless(const fs::path& folder, const std::string& path) {
  bless_itself(folder / path);
  const Json manifest = Json::read(folder / "manifest.json");
  std::string text = core::read_text_file(folder / "manifest.json");
  for (std::size_t i = 0; i < manifest.at("files").size(); ++i) {
    const Json& entry = manifest.at("files").at(i);
    if (entry.at("path").string() != path) continue;
    const std::string content = core::read_text_file(folder / path);
    const std::string old_hash = entry.at("xxh3_128").string();
    text.replace(text.find(old_hash), old_hash.size(), core::content_hash(content));
    const std::string head = "\"path\": \"" + path + "\",\n";
    const std::size_t at = text.find("\"bytes\": ", text.find(head)) + 9;
    text.replace(at, text.find_first_not_of("0123456789", at) - at, std::to_string(content.size()));
  }
  core::write_file(folder / "manifest.json", text);
  bless_itself(folder / "manifest.json");
}

/// Gives a changed image its new hash in its record, and the record its own.
void bless_image(const fs::path& folder, const std::string& path, int frame) {
  const std::string record_path = fmt::format("frames/{:06}.json", frame);
  const Json record = Json::read(folder / record_path);
  for (std::size_t i = 0; i < record.at("cameras").size(); ++i) {
    for (const char* part : {"color", "facts"}) {
      const Json& entry = record.at("cameras").at(i).at(part);
      if (entry.at("path").string() != path) continue;
      replace_in(folder / record_path, entry.at("xxh3_128").string(),
                 core::content_hash_of_file(folder / path));
      replace_in(folder / record_path, fmt::format("\"bytes\": {}", entry.at("bytes").integer()),
                 fmt::format("\"bytes\": {}", fs::file_size(folder / path)));
    }
  }
  bless(folder, record_path);
}

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

struct Forgery {
  const char* file;
  const char* from;
  const char* to;
  std::vector<std::string> words;
};

// Hashes that fit do not make a value possible.
TEST(SequenceFiles, ForgedValuesAreRefused) {
  const std::vector<Forgery> forgeries = {
      {"sequence.json", "\"version\": 4", "\"version\": 3", {"version 3", "reads version 4"}},
      {"sequence.json", "terracast-capture", "other", {"not a file of"}},
      {"sequence.json", "\"rate_hz\"", "\"rate\"", {"no member \"rate_hz\""}},
      {"sequence.json", "\"rate_hz\": 10.0", "\"rate_hz\": -1", {"rate_hz = -1"}},
      {"sequence.json", "\"num_frames\": 2", "\"num_frames\": 2000000000", {"num_frames"}},
      {"sequence.json", "\"width_px\": 90", "\"width_px\": 2147483648", {"width_px"}},
      {"sequence.json", "\"width_px\": 90", "\"width_px\": 200000000", {"pixels"}},
      {"sequence.json", "\"width_px\": 90", "\"width_px\": 0", {"mcs4/cam0"}},
      {"sequence.json", "\"model\": \"pinhole\"", "\"model\": \"pinhol\"", {"pinhol", "mcs4/cam0"}},
      {"sequence.json", "\"name\": \"cam0\"", "\"name\": \"../up\"", {"../up"}},
      {"sequence.json", "\"rig\": \"mcs4\"", "\"rig\": \"/etc\"", {"/etc"}},
      {"sequence.json", "\"name\": \"cam0\"", "\"name\": \"cam1\"", {"stands twice"}},
      {"sequence.json", "\"lat_deg\": 42.5", "\"lat_deg\": 142.5", {"not a place"}},
      {"sequence.json", "2024-06-21T10", "2024-06-21 10", {"utc_start"}},
      {"sequence.json", "\"geometry\"", "\"geometri\"", {"no member \"geometry\""}},
      {"sequence.json", "\"cell_px\": 2.0", "\"cell_px\": 0.0", {"cell_px"}},
      {"sequence.json", "\"7/-1/0 ", "\"7/-1/0/", {"level/x/y"}},
      {"sequence.json", "\"7/-1/0 ", "\"7/ -1/0 ", {"level/x/y"}},
      {"sequence.json", "\"7/-1/0 00", "\"7/-1/0 0g", {"7/-1/0", "hash"}},
      {"sequence.json", "\"7/-1/0 ", "\"7/0/0 ", {"7/0/0", "twice"}},
      {"sequence.json", "\"highest_z_m\": [411.5, ", "\"highest_z_m\": [", {"highest_z_m"}},
      {"sequence.json", "411.5", "\"high\"", {"highest_z_m"}},
      {"frames/000000.json",
       "mcs4/cam0/000000.png",
       "../../../etc/passwd",
       {"etc/passwd", "must be"}},
      {"frames/000000.json", "\"index\": 0", "\"index\": 1", {"frames/000000.json"}},
      {"frames/000001.json", "\"time_s\": 0.1", "\"time_s\": -0.1", {"not after"}},
      {"frames/000000.json", "\"rotation_wxyz\": [0.", "\"rotation_wxyz\": [10.", {"length"}},
      {"frames/000000.json",
       "\"acceleration_world_mps2\": [",
       "\"acceleration_world_mps2\": [1.0, ",
       {"acceleration_world_mps2"}},
      {"frames/000000.json", "\"translation_m\": [2", "\"translation_m\": [1e999, 2", {"JSON"}},
      {"frames/000000.json", "\"num_sky\": ", "\"num_sky\": -7", {"counts"}},
      {"frames/000000.json", "\"num_left_out\": ", "\"num_left_out\": -7", {"counts"}},
      {"frames/000000.json", "\"arithmetic\": ", "\"arithmetic\": -", {"bounds of", "0 or more"}},
      {"frames/000000.json", "\"visible_tracks\": [", "\"visible_tracks\": [9, 9, ", {"ascend"}},
      {"frames/000000.json", "\"visible_tracks\": [", "\"visible_tracks\": [1, ", {"track 1 "}},
      {"frames/000000.json", "\"bytes\": ", "\"bytes\": -", {"bytes"}},
      {"frames/000000.json", "\"key\": \"0", "\"key\": \"x", {"key", "hexadecimal"}},
      {"frames/000000.json", "\"key\": \"0", "\"key\": \"", {"key", "hexadecimal"}},
      {"frames/000000.json", "\"touched_tiles\": [", "\"touched_tiles\": [-1, ", {"-1"}},
      {"frames/000000.json", "\"touched_tiles\": [", "\"touched_tiles\": [0, ", {"out of order"}},
      {"frames/000000.json", "\"touched_tiles\": [0", "\"touched_tiles\": [2", {"tile 2"}},
      {"frames/000000.json", "\"touched_tiles\": [0", "\"touched_tiles\": [99999999999", {"tile"}},
      {"frames/000000.json", "\"touched_tiles\": [0", "\"touched_tiles\": [0, 1", {"both"}},
      {"frames/000000.json", "\"passed_tiles\": [1", "\"passed_tiles\": [2", {"tile 2"}},
      {"frames/000000.json", "\"passed_tiles\": [1", "\"passed_tiles\": [1, 1", {"passed_above_m"}},
      {"frames/000000.json",
       "\"passed_above_m\": [380.0",
       "\"passed_above_m\": [380.01",
       {"380.01"}},
      {"frames/000000.json",
       "\"passed_above_m\": [380.0",
       "\"passed_above_m\": [1e300",
       {"1e+300"}},
      {"tracks.json", "\"id\": 10,", "\"id\": 999,", {"ascend"}},
      {"tracks.json", "\"point_world_m\": [", "\"point_world_m\": [1.0, ", {"4 numbers"}},
      {"manifest.json", "frames/000001.json", "frames/000000.json", {"must be"}},
      {"frames/000001.json", "\"input_hash\": \"0", "\"input_hash\": \"1", {"input_hash"}},
      {"manifest.json", "\"input_hash\": \"0", "\"input_hash\": \"1", {"input_hash"}},
  };
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  fs::copy(folder, scratch / "good", fs::copy_options::recursive);
  for (const Forgery& forgery : forgeries) {
    SCOPED_TRACE(std::string(forgery.file) + ": " + forgery.to);
    replace_in(folder / forgery.file, forgery.from, forgery.to);
    if (std::string(forgery.file) == "manifest.json")
      bless_itself(folder / forgery.file);
    else
      bless(folder, forgery.file);
    std::vector<std::string> words = forgery.words;
    words.emplace_back(forgery.file);
    expect_error(ErrorKind::Input, words, [&] { SequenceReader::open(folder); });
    for (const std::string& name : {std::string(forgery.file), std::string("manifest.json")})
      fs::copy_file(scratch / "good" / name, folder / name, fs::copy_options::overwrite_existing);
  }
  EXPECT_NO_THROW(SequenceReader::open(folder));
}

std::vector<std::byte> facts_with(const CameraFrame& frame,
                                  const std::function<void(core::ExrPart&)>& change) {
  static std::vector<core::ExrImage> parts;
  parts = core::decode_exr(encode_facts(frame), "facts");
  core::ExrPart part;
  part.width = parts[0].width;
  part.height = parts[0].height;
  for (auto& [name, image] : parts[0].float_channels)
    part.channels.push_back({.name = name,
                             .type = core::ExrChannel::Type::Float,
                             .values_float = image.data(),
                             .values_uint = {}});
  for (auto& [name, image] : parts[0].uint_channels)
    part.channels.push_back({.name = name,
                             .type = core::ExrChannel::Type::Uint,
                             .values_float = {},
                             .values_uint = image.data()});
  change(part);
  return core::encode_exr({part});
}

TEST(SequenceFiles, FactsThatCannotBeAreRefused) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  const CameraFrame frame = test::tiny_frame(kSmall, test::tiny_sequence(kSmall), 0, 0);
  const std::string path = "mcs4/cam0/000000.exr";
  const auto refuse = [&](const std::vector<std::string>& words,
                          const std::function<void(core::ExrPart&)>& change) {
    core::write_file(folder / path, facts_with(frame, change));
    bless_image(folder, path, 0);
    std::vector<std::string> all = words;
    all.push_back(path);
    expect_error(ErrorKind::Input, all, [&] { SequenceReader::open(folder).read_camera(0, 0); });
  };
  const auto channel = [](core::ExrPart& part, const std::string& name) -> core::ExrChannel& {
    return *std::find_if(part.channels.begin(), part.channels.end(),
                         [&](const core::ExrChannel& c) { return c.name == name; });
  };
  for (const float bad : {std::nanf(""), -5.0F, 0.0F}) {
    std::vector<float> ranges(frame.range_m.data().begin(), frame.range_m.data().end());
    ranges[79 * 90 + 3] = bad;
    refuse({"pixel (3, 79)"},
           [&](core::ExrPart& part) { channel(part, "range_m").values_float = ranges; });
  }
  std::vector<std::uint32_t> classes(frame.semantic_id.data().begin(),
                                     frame.semantic_id.data().end());
  classes[7] = 77;
  refuse({"semantic id 77"},
         [&](core::ExrPart& part) { channel(part, "semantic_id").values_uint = classes; });
  refuse({"no channel flags"}, [&](core::ExrPart& part) { channel(part, "flags").name = "flag"; });
  refuse({"no channel instance_id"}, [&](core::ExrPart& part) {
    core::ExrChannel& ids = channel(part, "instance_id");
    ids = {.name = "instance_id",
           .type = core::ExrChannel::Type::Float,
           .values_float = frame.range_m.data(),
           .values_uint = {}};
  });
  refuse({"90 x 80"}, [&](core::ExrPart& part) { std::swap(part.width, part.height); });

  core::write_file(folder / "mcs4/cam0/000000.png", core::encode_png(core::Image8(90, 80, 1)));
  bless_image(folder, "mcs4/cam0/000000.png", 0);
  expect_error(ErrorKind::Input, {"mcs4/cam0/000000.png", "RGB"},
               [&] { SequenceReader::open(folder).read_camera(0, 0, SequenceReader::kColor); });
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

TEST(FrameSelection, HoldsEveryStepFromTheFirstBelowTheEnd) {
  for (const int num_frames : {1, 7, 10}) {
    for (const FrameSelection& selection :
         {FrameSelection{}, FrameSelection{.first = 2, .step = 3}, FrameSelection{.end = 7},
          FrameSelection{.first = 3, .end = 9, .step = 2}, FrameSelection{.first = 4, .end = 4},
          FrameSelection{.first = 12}, FrameSelection{.step = std::numeric_limits<int>::max()}}) {
      std::vector<int> expected;
      for (int frame = 0; frame < num_frames; ++frame)
        if (frame >= selection.first && frame < selection.end &&
            (frame - selection.first) % selection.step == 0)
          expected.push_back(frame);
      EXPECT_EQ(selection.frames_of(num_frames), expected);
    }
  }
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
