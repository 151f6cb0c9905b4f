#include "capture/frame_writer.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "capture/begun_sequence.h"
#include "capture/channel.h"
#include "capture/file_check.h"
#include "capture/frame_record_json.h"
#include "capture/manifest.h"
#include "capture/sequence_files.h"
#include "capture/sequence_json.h"
#include "capture/tracks_json.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/parallel.h"

namespace terracast::capture {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// Writes what every shard of a sequence writes the same.
void write_shared(const fs::path& file, const std::string& text) {
  if (fs::exists(file) && !is_damaged(file)) {
    if (core::read_text_file(file) == text) return;
    fail(ErrorKind::Config,
         "{}: differs from this run's, although the inputs have the same hash; remove its folder, "
         "or "
         "give another --out",
         file.string());
  }
  core::write_file(file, text);
}

/// What a renderer must never hand over.
void check_frame(const CameraFrame& frame, const CameraCalibration& camera, int frame_index) {
  const int width = camera.intrinsics.width_px;
  const int height = camera.intrinsics.height_px;
  const auto fits = [&](const auto& image, int channels) {
    return image.width() == width && image.height() == height && image.channels() == channels;
  };
  TERRACAST_CHECK(fits(frame.color, 3) && fits(frame.range_m, 1) && fits(frame.normal_world, 3) &&
                      fits(frame.semantic_id, 1) && fits(frame.instance_id, 1) &&
                      fits(frame.primitive_id, 1) && fits(frame.flags, 1),
                  "frame {} of {}/{}: an image is not {} x {}", frame_index, camera.rig,
                  camera.name, width, height);
  TERRACAST_CHECK(frame.raw.empty() || fits(frame.raw, 1), "frame {} of {}/{}: raw is not {} x {}",
                  frame_index, camera.rig, camera.name, width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float range_m = frame.range_m(x, y);
      const std::uint32_t semantic_id = frame.semantic_id(x, y);
      TERRACAST_CHECK(agree(range_m, semantic_id),
                      "frame {} of {}/{}, pixel ({}, {}): range {} m, semantic id {}", frame_index,
                      camera.rig, camera.name, x, y, range_m, semantic_id);
      for (int k = 0; k < 3; ++k)
        TERRACAST_CHECK(std::abs(frame.normal_world(x, y, k)) <= 1.001F,
                        "frame {} of {}/{}, pixel ({}, {}): normal component {}", frame_index,
                        camera.rig, camera.name, x, y, frame.normal_world(x, y, k));
    }
  }
}

}  // namespace

std::vector<std::byte> encode_color(const CameraFrame& frame) {
  return core::encode_png(frame.color, 1);
}

std::vector<std::byte> encode_raw(const CameraFrame& frame) {
  return core::encode_png(frame.raw, 1);
}

std::vector<std::byte> encode_facts(const CameraFrame& frame) {
  const std::size_t num_pixels = frame.range_m.num_pixels();
  std::vector<float> normal[3];
  for (std::vector<float>& plane : normal) plane.resize(num_pixels);
  const std::span<const float> normals = frame.normal_world.data();
  for (std::size_t i = 0; i < num_pixels; ++i)
    for (std::size_t k = 0; k < 3; ++k) normal[k][i] = normals[3 * i + k];

  using Type = core::ExrChannel::Type;
  core::ExrPart part;
  part.width = frame.range_m.width();
  part.height = frame.range_m.height();
  // Of the 50 ms that a 1280 x 720 frame may cost, the colour takes 18 and this 18; RLE takes 76 or
  // more for two thirds of the size, ZIPS 330 for a third (tests/bench/encode_bench.cpp).
  part.compression = core::ExrPart::Compression::None;
  for (const ChannelInfo& channel : channels()) {
    if (channel.is_optional && frame.bottom_range_m.num_pixels() == 0) continue;
    core::ExrChannel& entry = part.channels.emplace_back();
    entry.name = channel.name;
    entry.type = channel.type == "float"  ? Type::Float
                 : channel.type == "half" ? Type::Half
                                          : Type::Uint;
    if (channel.name == "range_m") entry.values_float = frame.range_m.data();
    if (channel.name == "normal.x") entry.values_float = normal[0];
    if (channel.name == "normal.y") entry.values_float = normal[1];
    if (channel.name == "normal.z") entry.values_float = normal[2];
    if (channel.name == "semantic_id") entry.values_uint = frame.semantic_id.data();
    if (channel.name == "instance_id") entry.values_uint = frame.instance_id.data();
    if (channel.name == "primitive_id") entry.values_uint = frame.primitive_id.data();
    if (channel.name == "flags") entry.values_uint = frame.flags.data();
    if (channel.name == "bottom_range_m") entry.values_float = frame.bottom_range_m.data();
  }
  part.attributes["terracast.capture"] = std::to_string(kCaptureVersion);
  return core::encode_exr({part});
}

SequenceWriter::SequenceWriter(const fs::path& folder, const SequenceInfo& info,
                               const std::vector<TrackPoint>& tracks)
    : folder_(folder), info_(info) {
  check_sequence(info_, ErrorKind::Config, folder.string());
  const fs::path sequence_file = folder_ / kSequenceFile;
  // Of frames whose sequence.json is damaged each record says of what inputs it is.
  if (fs::exists(sequence_file) && !is_damaged(sequence_file)) {
    const SequenceInfo present =
        sequence_from_json(core::Json::read(sequence_file), sequence_file.string());
    if (present.input_hash != info_.input_hash)
      fail(ErrorKind::Config,
           "{} holds a sequence of other inputs (hash {}, this run has {}): give another --out, "
           "or remove it",
           folder_.string(), present.input_hash, info_.input_hash);
  }
  core::make_folder(folder_ / kRecordsFolder);
  for (const CameraCalibration& camera : info_.cameras)
    core::make_folder(folder_ / camera.rig / camera.name);
  for (const StreamInfo& stream : info_.streams)
    core::make_folder(folder_ / stream.rig / stream.name);
  write_shared(folder_ / kTracksFile, json_from_tracks(tracks).text() + "\n");
  write_shared(sequence_file, json_from_sequence(info_).text() + "\n");
}

bool SequenceWriter::has_frame(int index) const { return is_finished(folder_, info_, index); }

CameraRecord SequenceWriter::write_camera(int frame_index, int camera_index,
                                          const CameraFrame& frame) const {
  TERRACAST_CHECK(frame_index >= 0 && frame_index < info_.num_frames, "frame {}", frame_index);
  const CameraCalibration& camera = info_.cameras.at(static_cast<std::size_t>(camera_index));
  check_frame(frame, camera, frame_index);
  CameraRecord record = count_pixels(frame);
  record.color = write(color_path(camera, frame_index), encode_color(frame));
  if (!frame.raw.empty()) record.raw = write(raw_path(camera, frame_index), encode_raw(frame));
  record.facts = write(facts_path(camera, frame_index), encode_facts(frame));
  return record;
}

FrameFile SequenceWriter::write_samples(int frame_index, int stream_index,
                                        const Samples& samples) const {
  TERRACAST_CHECK(frame_index >= 0 && frame_index < info_.num_frames, "frame {}", frame_index);
  const StreamInfo& stream = info_.streams.at(static_cast<std::size_t>(stream_index));
  const TickRange ticks =
      ticks_of_frame(stream.rate_hz, info_.rate_hz, frame_index, info_.num_frames);
  TERRACAST_CHECK(stream.is_scan ? are_times_of_scans(samples.times_s, ticks, stream.rate_hz)
                                 : samples.times_s == times_of(ticks, stream.rate_hz),
                  "frame {} of {}/{}: samples at other times", frame_index, stream.rig,
                  stream.name);
  if (stream.is_scan)
    return write(samples_path(stream, frame_index), encode_scans(samples, stream.channels));
  return write(samples_path(stream, frame_index), encode_samples(samples, stream.channels.size()));
}

FrameFile SequenceWriter::write(const std::string& path,
                                const std::vector<std::byte>& bytes) const {
  core::write_file(folder_ / path, bytes);
  return {.path = path, .num_bytes = bytes.size(), .content_hash = core::content_hash(bytes)};
}

void SequenceWriter::link_camera(const fs::path& earlier_folder, const CameraRecord& camera) const {
  for (const FrameFile* file : camera.files())
    core::link_file(earlier_folder / file->path, folder_ / file->path);
}

void SequenceWriter::finish_frame(const FrameRecord& record) const {
  const std::string path = record_path(record.index);
  check_record(record, info_, ErrorKind::Internal, path);
  core::write_file(folder_ / path, json_from_record(record, info_.input_hash).text() + "\n");
}

bool SequenceWriter::finish_sequence() const {
  for (int i = 0; i < info_.num_frames; ++i)
    if (!has_frame(i)) return false;
  Manifest manifest;
  manifest.input_hash = info_.input_hash;
  std::vector<FrameRecord> records;
  const auto add = [&](const std::string& path) {
    std::string text = core::read_text_file(folder_ / path);
    manifest.files.push_back(
        {.path = path, .num_bytes = text.size(), .content_hash = core::content_hash(text)});
    return text;
  };
  const auto read = [&](const std::string& path) {
    return core::Json::parse(add(path), (folder_ / path).string());
  };
  // What was damaged since it was written gets no hash here that would make it right.
  sequence_from_json(read(kSequenceFile), (folder_ / kSequenceFile).string());
  tracks_from_json(read(kTracksFile), (folder_ / kTracksFile).string());
  for (int i = 0; i < info_.num_frames; ++i) {
    records.push_back(
        record_from_json(read(record_path(i)), info_, (folder_ / record_path(i)).string()));
  }
  json_from_manifest(manifest, info_, records).write(folder_ / kManifestFile);
  return true;
}

// Nothing is removed: another process may have rendered a damaged frame again meanwhile.
std::optional<std::vector<int>> find_damaged_frames(const fs::path& folder,
                                                    const SequenceInfo& info,
                                                    const FrameSelection& selection) {
  const fs::path manifest_file = folder / kManifestFile;
  if (!fs::exists(manifest_file)) return std::nullopt;
  Manifest manifest;
  try {
    manifest = manifest_from_json(core::Json::read(manifest_file, core::Json::kMostOfDatasets),
                                  info, manifest_file.string());
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return std::nullopt;
    throw;
  }
  if (!is_whole(folder, manifest.files[0]) || !is_whole(folder, manifest.files[1]))
    return std::nullopt;

  const std::vector<int> frames = selection.frames_of(info.num_frames);
  std::vector<std::uint8_t> is_damaged(frames.size());
  core::parallel_for(static_cast<std::int64_t>(frames.size()), [&](std::int64_t i) {
    const auto at = static_cast<std::size_t>(i);
    const FrameFile& entry = manifest.files[static_cast<std::size_t>(frames[at]) + 2];
    bool is_right = is_whole(folder, entry);
    if (is_right) {
      const std::string file = (folder / entry.path).string();
      const FrameRecord record = record_from_json(core::Json::read(file), info, file);
      for (const FrameFile* part : record.files()) is_right = is_right && is_whole(folder, *part);
    }
    is_damaged[at] = is_right ? 0 : 1;
  });
  std::vector<int> damaged;
  for (std::size_t at = 0; at < frames.size(); ++at)
    if (is_damaged[at] != 0) damaged.push_back(frames[at]);
  return damaged;
}

}  // namespace terracast::capture
