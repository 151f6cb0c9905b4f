#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "capture/frame_reader.h"
#include "capture/frame_writer.h"
#include "capture/sequence_files.h"
#include "core/atomic_file.h"
#include "core/hash.h"
#include "core/image_io.h"
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
using test::kSmall;
using test::replace_in;
using test::ScratchFolder;

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

struct Forgery {
  const char* file;
  const char* from;
  const char* to;
  std::vector<std::string> words;
};

// Hashes that fit do not make a value possible.
TEST(SequenceFiles, ForgedValuesAreRefused) {
  const std::vector<Forgery> forgeries = {
      {"sequence.json", "\"version\": 7", "\"version\": 5", {"version 5", "reads versions 6 to 7"}},
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

// Version 6 has no terms of motions: its lines follow constants.
TEST(SequenceFiles, CapturesOfTheVersionBeforeAreReadByTheirOwnRule) {
  const ScratchFolder scratch;
  const fs::path folder = test::write_tiny_capture(scratch.path(), kSmall);
  for (const char* file : {"sequence.json", "tracks.json", "frames/000000.json",
                           "frames/000001.json", "manifest.json"}) {
    replace_in(folder / file, fmt::format("\"version\": {}", kCaptureVersion), "\"version\": 6");
    if (std::string(file) == "manifest.json")
      bless_itself(folder / file);
    else
      bless(folder, file);
  }
  const SequenceReader reader = SequenceReader::open(folder);
  for (const FrameRecord& record : reader.frames()) {
    EXPECT_FALSE(record.terms.are_any());
    EXPECT_EQ(record.state().terms, geo::MotionTerms{});
  }
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

}  // namespace
}  // namespace terracast::capture
