#include "capture/frame_reader.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

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

namespace terracast::capture {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The first line from `first` on that is not among the others from there on.
std::string first_alone(const std::vector<std::string>& lines,
                        const std::vector<std::string>& others, std::size_t first) {
  const std::multiset<std::string> known(
      others.begin() + static_cast<std::ptrdiff_t>(std::min(first, others.size())), others.end());
  for (std::size_t i = first; i < lines.size(); ++i)
    if (!known.contains(lines[i])) return lines[i];
  return first < lines.size() ? lines[first] : "nothing";
}

/// What two texts have that the other has not, of each the first line; or where they differ in order.
std::pair<std::string, std::string> first_difference(const std::string& a, const std::string& b) {
  const std::vector<std::string> lines = lines_of(a), others = lines_of(b);
  std::size_t first = 0;
  while (first < std::min(lines.size(), others.size()) && lines[first] == others[first]) ++first;
  return {first_alone(lines, others, first), first_alone(others, lines, first)};
}

constexpr const char* kRemedy = "run the render stage again, which makes damaged frames anew";

/// A file's bytes, when they are what its entry says.
std::vector<std::byte> read_checked(const fs::path& folder, const FrameFile& entry) {
  const fs::path file = folder / entry.path;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error)
    fail(ErrorKind::Input, "{}: missing, though its record names it ({}); {}", file.string(),
         error.message(), kRemedy);
  if (size != entry.num_bytes)
    fail(ErrorKind::Input, "{}: damaged: {} bytes, but its record says {}; {}", file.string(), size,
         entry.num_bytes, kRemedy);
  std::vector<std::byte> bytes = core::read_file(file);
  const std::string hash = core::content_hash(bytes);
  if (hash != entry.content_hash)
    fail(ErrorKind::Input, "{}: damaged: its content hash is {}, but its record says {}; {}",
         file.string(), hash, entry.content_hash, kRemedy);
  return bytes;
}

core::Json read_json(const fs::path& folder, const FrameFile& entry) {
  const std::vector<std::byte> bytes = read_checked(folder, entry);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return core::Json::parse(text, (folder / entry.path).string());
}

core::Image8 decode_color(const std::vector<std::byte>& bytes, const std::string& file,
                          const geo::CameraIntrinsics& camera) {
  std::variant<core::Image8, core::Image16> decoded =
      core::decode_png(bytes, file, static_cast<std::size_t>(kMaxPixels));
  auto* image = std::get_if<core::Image8>(&decoded);
  if (image == nullptr || image->channels() != 3 || image->width() != camera.width_px ||
      image->height() != camera.height_px)
    fail(ErrorKind::Input, "{}: not an 8-bit RGB image of {} x {} px", file, camera.width_px,
         camera.height_px);
  return std::move(*image);
}

core::Image16 decode_raw(const std::vector<std::byte>& bytes, const std::string& file,
                         const geo::CameraIntrinsics& camera, int bits) {
  std::variant<core::Image8, core::Image16> decoded =
      core::decode_png(bytes, file, static_cast<std::size_t>(kMaxPixels));
  auto* image = std::get_if<core::Image16>(&decoded);
  if (image == nullptr || image->channels() != 1 || image->width() != camera.width_px ||
      image->height() != camera.height_px)
    fail(ErrorKind::Input, "{}: not a 16-bit grey image of {} x {} px", file, camera.width_px,
         camera.height_px);
  for (const std::uint16_t number : image->data())
    if (number >> bits != 0)
      fail(ErrorKind::Input, "{}: holds {}, which has more than {} bits", file, number, bits);
  return std::move(*image);
}

/// Refuses facts that contradict themselves.
void check_facts(const CameraFrame& frame, const std::string& file) {
  const auto width = static_cast<std::size_t>(frame.range_m.width());
  const std::span<const float> range_m = frame.range_m.data();
  const std::span<const float> normals = frame.normal_world.data();
  const std::span<const std::uint32_t> semantic = frame.semantic_id.data();
  for (std::size_t i = 0; i < range_m.size(); ++i) {
    if (!agree(range_m[i], semantic[i]))
      fail(ErrorKind::Input, "{}: pixel ({}, {}): range {} m with semantic id {} cannot be", file,
           i % width, i / width, range_m[i], semantic[i]);
    for (std::size_t k = 0; k < 3; ++k)
      if (!(std::abs(normals[3 * i + k]) <= 1.001F))
        fail(ErrorKind::Input, "{}: pixel ({}, {}): a normal's component is {}", file, i % width,
             i / width, normals[3 * i + k]);
  }
}

void decode_facts(const std::vector<std::byte>& bytes, const std::string& file,
                  const geo::CameraIntrinsics& camera, CameraFrame& frame) {
  std::vector<core::ExrImage> parts =
      core::decode_exr(bytes, file, static_cast<std::size_t>(kMaxPixels));
  if (parts.size() != 1 || parts[0].width != camera.width_px || parts[0].height != camera.height_px)
    fail(ErrorKind::Input, "{}: not one part of {} x {} px", file, camera.width_px,
         camera.height_px);
  core::ExrImage& part = parts[0];
  const auto take = [&](auto& planes, const std::string& name) {
    const auto found = planes.find(name);
    if (found == planes.end())
      fail(ErrorKind::Input, "{}: no channel {} of the right type", file, name);
    return std::move(found->second);
  };
  frame.range_m = take(part.float_channels, "range_m");
  frame.semantic_id = take(part.uint_channels, "semantic_id");
  frame.instance_id = take(part.uint_channels, "instance_id");
  frame.primitive_id = take(part.uint_channels, "primitive_id");
  frame.flags = take(part.uint_channels, "flags");
  frame.bottom_range_m = {};
  if (part.float_channels.contains("bottom_range_m")) {
    frame.bottom_range_m = take(part.float_channels, "bottom_range_m");
    for (std::size_t i = 0; i < frame.range_m.num_pixels(); ++i)
      if (!(frame.bottom_range_m.data()[i] >= frame.range_m.data()[i]) &&
          !std::isnan(frame.range_m.data()[i]))
        fail(ErrorKind::Input, "{}: pixel {}: a bottom at {} m before the surface at {} m", file, i,
             frame.bottom_range_m.data()[i], frame.range_m.data()[i]);
  }
  frame.normal_world = core::ImageF(camera.width_px, camera.height_px, 3);
  const std::span<float> normals = frame.normal_world.data();
  static constexpr const char* kNames[] = {"normal.x", "normal.y", "normal.z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const core::ImageF plane = take(part.float_channels, kNames[k]);
    const std::span<const float> values = plane.data();
    for (std::size_t i = 0; i < values.size(); ++i) normals[3 * i + k] = values[i];
  }
  check_facts(frame, file);
}

/// False where `read` finds its input unfit.
template <class Read>
bool is_sound_input(Read&& read) {
  try {
    read();
    return true;
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return false;
    throw;
  }
}

}  // namespace

SequenceReader SequenceReader::open(const fs::path& folder) {
  SequenceReader reader;
  reader.folder_ = folder;
  if (!fs::is_directory(folder)) fail(ErrorKind::Io, "{}: no such folder", folder.string());
  const fs::path sequence_file = folder / kSequenceFile;
  if (!fs::exists(sequence_file))
    fail(ErrorKind::Input, "{}: no {}; a captured sequence is wanted", folder.string(),
         kSequenceFile);
  reader.info_ = sequence_from_json(core::Json::read(sequence_file), sequence_file.string());
  const SequenceInfo& info = reader.info_;

  int num_missing = 0;
  int first_missing = -1;
  for (int i = 0; i < info.num_frames; ++i) {
    if (fs::exists(folder / record_path(i))) continue;
    if (num_missing++ == 0) first_missing = i;
  }
  if (num_missing > 0)
    fail(ErrorKind::Input,
         "{}: unfinished: {} of {} frames are missing, the first is {}; run the render stage again",
         folder.string(), num_missing, info.num_frames, first_missing);
  const fs::path manifest_file = folder / kManifestFile;
  if (!fs::exists(manifest_file))
    fail(ErrorKind::Input,
         "{}: unfinished: all {} frames are there, but no {}; run the render stage again",
         folder.string(), info.num_frames, kManifestFile);

  const Manifest manifest = manifest_from_json(
      core::Json::read(manifest_file, core::Json::kMostOfDatasets), info, manifest_file.string());
  read_checked(folder, manifest.files[0]);
  reader.tracks_ =
      tracks_from_json(read_json(folder, manifest.files[1]), (folder / kTracksFile).string());
  for (int i = 0; i < info.num_frames; ++i) {
    const FrameFile& entry = manifest.files[static_cast<std::size_t>(i) + 2];
    const std::string file = (folder / entry.path).string();
    FrameRecord record = record_from_json(read_json(folder, entry), info, file);
    if (record.index != i)
      fail(ErrorKind::Input, "{}: the record of frame {}, but must be of {}", file, record.index,
           i);
    if (i > 0 && !(record.time_s > reader.frames_.back().time_s))
      fail(ErrorKind::Input, "{}: time_s = {} is not after the frame before ({})", file,
           record.time_s, reader.frames_.back().time_s);
    for (const CameraRecord& camera : record.cameras)
      for (const std::int64_t id : camera.visible_tracks) {
        const auto found = std::lower_bound(
            reader.tracks_.begin(), reader.tracks_.end(), id,
            [](const TrackPoint& track, std::int64_t wanted) { return track.id < wanted; });
        if (found == reader.tracks_.end() || found->id != id)
          fail(ErrorKind::Input, "{}: track {} is not in {}", file, id, kTracksFile);
      }
    reader.frames_.push_back(std::move(record));
  }
  return reader;
}

CameraFrame SequenceReader::read_camera(int frame_index, int camera_index, unsigned parts) const {
  const CameraRecord& record = frames_.at(static_cast<std::size_t>(frame_index))
                                   .cameras.at(static_cast<std::size_t>(camera_index));
  const geo::CameraIntrinsics& camera =
      info_.cameras[static_cast<std::size_t>(camera_index)].intrinsics;
  CameraFrame frame;
  if ((parts & kColor) != 0)
    frame.color = decode_color(read_checked(folder_, record.color),
                               (folder_ / record.color.path).string(), camera);
  if ((parts & kFacts) != 0)
    decode_facts(read_checked(folder_, record.facts), (folder_ / record.facts.path).string(),
                 camera, frame);
  if ((parts & kRaw) != 0 && record.raw)
    frame.raw =
        decode_raw(read_checked(folder_, *record.raw), (folder_ / record.raw->path).string(),
                   camera, info_.imaging.at(static_cast<std::size_t>(camera_index)).raw.bits);
  return frame;
}

Samples SequenceReader::read_samples(int stream_index) const {
  Samples all;
  for (const FrameRecord& record : frames_) {
    const Samples part = read_samples(stream_index, record.index);
    all.times_s.insert(all.times_s.end(), part.times_s.begin(), part.times_s.end());
    all.values.insert(all.values.end(), part.values.begin(), part.values.end());
  }
  return all;
}

Samples SequenceReader::read_samples(int stream_index, int frame_index) const {
  const StreamInfo& stream = info_.streams.at(static_cast<std::size_t>(stream_index));
  const FrameFile& entry = frames_.at(static_cast<std::size_t>(frame_index))
                               .streams.at(static_cast<std::size_t>(stream_index));
  const std::vector<std::byte> bytes = read_checked(folder_, entry);
  const std::string where = (folder_ / entry.path).string();
  const TickRange ticks =
      ticks_of_frame(stream.rate_hz, info_.rate_hz, frame_index, info_.num_frames);
  if (stream.is_scan) return decode_scans(bytes, ticks, stream.rate_hz, stream.channels, where);
  return decode_samples(bytes, times_of(ticks, stream.rate_hz), stream.channels.size(), where);
}

geo::Rigid3d SequenceReader::world_from_camera(int frame_index, int camera_index) const {
  return frames_.at(static_cast<std::size_t>(frame_index)).world_from_body *
         info_.cameras.at(static_cast<std::size_t>(camera_index)).body_from_camera();
}

CameraView SequenceReader::view(const geo::CameraModel& model, int frame_index,
                                int camera_index) const {
  const FrameRecord& record = frames_.at(static_cast<std::size_t>(frame_index));
  return view_of(model, info_.cameras.at(static_cast<std::size_t>(camera_index)), record.state());
}

std::optional<WholeFrames> WholeFrames::open(const fs::path& folder) {
  const fs::path file = folder / kSequenceFile;
  if (!fs::exists(file)) return std::nullopt;
  WholeFrames frames;
  frames.folder_ = folder;
  const bool is_sound = is_sound_input(
      [&] { frames.info_ = sequence_from_json(core::Json::read(file), file.string()); });
  if (!is_sound) return std::nullopt;
  return frames;
}

std::optional<FrameRecord> WholeFrames::record(int frame) const {
  const fs::path file = folder_ / record_path(frame);
  if (!fs::exists(file)) return std::nullopt;
  FrameRecord record;
  const bool is_sound = is_sound_input(
      [&] { record = record_from_json(core::Json::read(file), info_, file.string()); });
  if (!is_sound || record.index != frame) return std::nullopt;
  return record;
}

bool WholeFrames::has_files(const FrameRecord& record) const {
  const std::vector<const FrameFile*> files = record.files();
  return std::all_of(files.begin(), files.end(),
                     [&](const FrameFile* file) { return is_whole(folder_, *file); });
}

void check_same_config(const fs::path& folder, const std::string& captured_toml,
                       const std::string& config_toml) {
  if (captured_toml == config_toml) return;
  const auto [captured, wanted] = first_difference(captured_toml, config_toml);
  fail(ErrorKind::Config,
       "{} was captured with another config ({}; this one says {}): give another --out, or "
       "remove it and render again",
       folder.string(), captured, wanted);
}

void check_captured_config(const fs::path& folder, const std::string& config_toml) {
  if (const std::optional<std::string> captured = captured_config(folder))
    check_same_config(folder, *captured, config_toml);
}

std::vector<fs::path> list_sequences(const fs::path& capture_folder) {
  if (!fs::is_directory(capture_folder))
    fail(ErrorKind::Io, "{}: no such folder", capture_folder.string());
  std::vector<fs::path> sequences;
  for (const fs::directory_entry& entry : fs::directory_iterator(capture_folder))
    if (fs::exists(entry.path() / kSequenceFile)) sequences.push_back(entry.path());
  if (sequences.empty())
    fail(ErrorKind::Input, "{}: no sequence there; run the render stage first",
         capture_folder.string());
  std::sort(sequences.begin(), sequences.end());
  return sequences;
}

}  // namespace terracast::capture
