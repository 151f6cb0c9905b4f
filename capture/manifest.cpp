#include "capture/manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <tuple>

#include "capture/channel.h"

namespace terracast::capture {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr const char* kFormat = "terracast-capture";
/// How far a stored quaternion may be from unit length: rounding, not a slip.
constexpr double kUnitTolerance = 1e-9;
/// Of kPassedStep_m, to what is higher than any place.
constexpr double kMaxPassedSteps = 0x1.0p40;

Json json_from_rigid(const geo::Rigid3d& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  return Json::object()
      .set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
      .set("translation_m", Json::array_of({t.x(), t.y(), t.z()}));
}

Json json_from_vector(const Eigen::Vector3d& v) { return Json::array_of({v.x(), v.y(), v.z()}); }

/// One file's JSON, so that every message can name it.
struct Source {
  const std::string& file;

  double finite(const Json& json, const char* what) const {
    const double value = json.number();
    if (!std::isfinite(value)) fail(ErrorKind::Input, "{}: {} is not finite", file, what);
    return value;
  }

  std::vector<double> numbers(const Json& json, std::size_t count, const char* what) const {
    std::vector<double> values = json.numbers();
    if (values.size() != count)
      fail(ErrorKind::Input, "{}: {} has {} numbers, but must have {}", file, what, values.size(),
           count);
    for (const double value : values)
      if (!std::isfinite(value)) fail(ErrorKind::Input, "{}: {} is not finite", file, what);
    return values;
  }

  Eigen::Vector3d vector(const Json& json, const char* what) const {
    const std::vector<double> v = numbers(json, 3, what);
    return {v[0], v[1], v[2]};
  }

  geo::Rigid3d rigid(const Json& json, const char* what) const {
    const std::vector<double> q = numbers(json.at("rotation_wxyz"), 4, what);
    const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
    if (!(std::abs(rotation.norm() - 1.0) <= kUnitTolerance))
      fail(ErrorKind::Input, "{}: the rotation of {} has length {}, but must have 1", file, what,
           rotation.norm());
    return {rotation, vector(json.at("translation_m"), what)};
  }

  std::int64_t count(const Json& json, std::int64_t highest, const char* what) const {
    const std::int64_t value = json.integer();
    if (value < 0 || value > highest)
      fail(ErrorKind::Input, "{}: {} = {} is outside 0 to {}", file, what, value, highest);
    return value;
  }

  void format(const Json& json) const {
    if (!json.has("format") || json.at("format").string() != kFormat)
      fail(ErrorKind::Input, "{}: not a file of a terracast capture", file);
    const std::int64_t version = json.at("version").integer();
    if (version != kCaptureVersion)
      fail(ErrorKind::Input, "{}: capture format version {}; this program reads version {}", file,
           version, kCaptureVersion);
  }

  void inputs(const Json& json, const SequenceInfo& info) const {
    if (const std::string& found = json.at("input_hash").string(); found != info.input_hash)
      fail(ErrorKind::Input, "{}: input_hash {} is not the sequence's {}", file, found,
           info.input_hash);
  }

  void whole(const Json& json) const {
    try {
      core::check_content_hash(json);
    } catch (const core::Error& error) {
      fail(ErrorKind::Input, "{}: {}", file, error.message());
    }
  }
};

Json header() {
  return std::move(Json::object().set("format", kFormat).set("version", kCaptureVersion));
}

Json json_from_file(const FrameFile& file) {
  return Json::object()
      .set("path", file.path)
      .set("bytes", file.num_bytes)
      .set("xxh3_128", file.content_hash);
}

FrameFile file_from_json(const Json& json, const std::string& expected_path,
                         const std::string& file) {
  FrameFile result{.path = json.at("path").string(),
                   .num_bytes = 0,
                   .content_hash = json.at("xxh3_128").string()};
  // A path that is not the one the format gives could lead out of the folder.
  if (result.path != expected_path)
    fail(ErrorKind::Input, "{}: the path \"{}\" must be \"{}\"", file, result.path, expected_path);
  const std::int64_t num_bytes = json.at("bytes").integer();
  if (num_bytes <= 0)
    fail(ErrorKind::Input, "{}: {} is said to have {} bytes", file, result.path, num_bytes);
  result.num_bytes = static_cast<std::uint64_t>(num_bytes);
  return result;
}

Json json_from_camera(const CameraCalibration& camera) {
  const geo::CameraIntrinsics& intrinsics = camera.intrinsics;
  return Json::object()
      .set("rig", camera.rig)
      .set("name", camera.name)
      .set("intrinsics", Json::object()
                             .set("model", intrinsics.model)
                             .set("width_px", intrinsics.width_px)
                             .set("height_px", intrinsics.height_px)
                             .set("parameters", Json::array_of(intrinsics.parameters)))
      .set("rig_from_camera", json_from_rigid(camera.rig_from_camera))
      .set("body_from_rig", json_from_rigid(camera.body_from_rig));
}

CameraCalibration camera_from_json(const Json& json, const Source& source) {
  const Json& intrinsics = json.at("intrinsics");
  const auto pixels = [&](const char* name) {
    return static_cast<int>(source.count(intrinsics.at(name), kMaxPixels, name));
  };
  return {.rig = json.at("rig").string(),
          .name = json.at("name").string(),
          .intrinsics = {.model = intrinsics.at("model").string(),
                         .width_px = pixels("width_px"),
                         .height_px = pixels("height_px"),
                         .parameters = intrinsics.at("parameters").numbers()},
          .rig_from_camera = source.rigid(json.at("rig_from_camera"), "rig_from_camera"),
          .body_from_rig = source.rigid(json.at("body_from_rig"), "body_from_rig")};
}

constexpr const char* kDepthBound = "depth_m";
constexpr const char* kFlowNextBound = "flow_next_px";
constexpr const char* kFlowPreviousBound = "flow_previous_px";

Json json_from_bounds(const LabelBounds& bounds) {
  Json json = Json::object();
  const auto set = [&](const char* name, const std::optional<LabelError>& error) {
    if (error)
      json.set(
          name,
          Json::object().set("arithmetic", error->arithmetic).set("rounding", error->rounding));
  };
  set(kDepthBound, bounds.depth_m);
  set(kFlowNextBound, bounds.flow_next_px);
  set(kFlowPreviousBound, bounds.flow_previous_px);
  return std::move(json.set("num_left_out", bounds.num_left_out));
}

LabelBounds bounds_from_json(const Json& json, const Source& source) {
  const auto error = [&](const char* name) -> std::optional<LabelError> {
    if (!json.has(name)) return std::nullopt;
    return LabelError{.arithmetic = source.finite(json.at(name).at("arithmetic"), name),
                      .rounding = source.finite(json.at(name).at("rounding"), name)};
  };
  return {.depth_m = error(kDepthBound),
          .flow_next_px = error(kFlowNextBound),
          .flow_previous_px = error(kFlowPreviousBound),
          .num_left_out = json.at("num_left_out").integer()};
}

std::string name_of(const ShownTile& tile) {
  return fmt::format("{}/{}/{}", tile.level, tile.x, tile.y);
}

bool is_content_hash(const std::string& text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// throws Input: not "level/x/y hash"
ShownTile tile_from_text(const std::string& text, const std::string& file) {
  ShownTile tile;
  int length = 0;
  if (text.size() > 80 ||
      std::sscanf(text.c_str(), "%9d/%9d/%9d %n", &tile.level, &tile.x, &tile.y, &length) != 3)
    fail(ErrorKind::Input, "{}: \"{}\" is not a tile's level/x/y and hash", file,
         text.substr(0, 80));
  tile.content_hash = text.substr(static_cast<std::size_t>(length));
  if (name_of(tile) + " " + tile.content_hash != text)
    fail(ErrorKind::Input, "{}: \"{}\" is not a tile's level/x/y and hash", file, text);
  return tile;
}

ShownGeometry geometry_from_json(const Json& json, const Source& source) {
  ShownGeometry geometry{
      .cell_px = source.finite(json.at("cell_px"), "cell_px"),
      .finest_spacing_m = source.finite(json.at("finest_spacing_m"), "finest_spacing_m"),
      .tiles = {}};
  const std::vector<std::string> tiles = json.at("tiles").strings();
  const std::vector<double> highest_z_m =
      source.numbers(json.at("highest_z_m"), tiles.size(), "highest_z_m");
  geometry.tiles.reserve(tiles.size());
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    geometry.tiles.push_back(tile_from_text(tiles[i], source.file));
    geometry.tiles.back().highest_z_world_m = highest_z_m[i];
  }
  return geometry;
}

/// What every sequence's geometry is: tiles in order, with hashes.
void check_geometry(const ShownGeometry& geometry, ErrorKind kind, const std::string& where) {
  if (!(geometry.cell_px > 0.0) || !(geometry.finest_spacing_m > 0.0))
    fail(kind, "{}: cell_px = {} and finest_spacing_m = {} must be positive", where,
         geometry.cell_px, geometry.finest_spacing_m);
  if (geometry.tiles.empty() || geometry.tiles.size() > kMaxShownTiles)
    fail(kind, "{}: shows {} tiles; a sequence shows 1 to {}", where, geometry.tiles.size(),
         kMaxShownTiles);
  for (const ShownTile& tile : geometry.tiles)
    if (!std::isfinite(tile.highest_z_world_m))
      fail(kind, "{}: the highest point of tile {} is not finite", where, name_of(tile));
  for (const ShownTile& tile : geometry.tiles)
    if (!is_content_hash(tile.content_hash))
      fail(kind, "{}: \"{}\", of tile {}, is no content hash of 32 hexadecimal digits", where,
           tile.content_hash, name_of(tile));
  const auto place = [](const ShownTile& tile) { return std::tuple(tile.level, tile.x, tile.y); };
  for (std::size_t i = 1; i < geometry.tiles.size(); ++i)
    if (!(place(geometry.tiles[i - 1]) < place(geometry.tiles[i])))
      fail(kind, "{}: tile {} stands twice or out of order", where, name_of(geometry.tiles[i]));
}

/// What the tiles of a record are: some of the sequence's, in order, each once.
void check_tiles(const FrameRecord& record, std::size_t num_tiles, ErrorKind kind,
                 const std::string& where) {
  const auto check_next = [&](int tile, int before, const char* what) {
    if (tile <= before || static_cast<std::size_t>(tile) >= num_tiles)
      fail(kind, "{}: tile {} among the {} is none of the sequence's {} tiles, or out of order",
           where, tile, what, num_tiles);
  };
  int before = -1;
  for (const int tile : record.touched_tiles) {
    check_next(tile, before, "touched");
    before = tile;
  }
  before = -1;
  for (const PassedTile& passed : record.passed_tiles) {
    check_next(passed.tile, before, "passed");
    before = passed.tile;
    if (std::binary_search(record.touched_tiles.begin(), record.touched_tiles.end(), passed.tile))
      fail(kind, "{}: tile {} is both touched and passed", where, passed.tile);
    const double steps = passed.above_z_world_m / kPassedStep_m;
    if (!(std::abs(steps) <= kMaxPassedSteps) || steps != std::floor(steps))
      fail(kind, "{}: tile {} is passed above {} m, which must be a whole number of {} m", where,
           passed.tile, passed.above_z_world_m, kPassedStep_m);
  }
}

bool is_utc(const std::string& text) {
  static constexpr std::string_view kShape = "0000-00-00T00:00:00";
  if (text.size() <= kShape.size() || text.back() != 'Z') return false;
  for (std::size_t i = 0; i < kShape.size(); ++i) {
    const bool is_digit = '0' <= text[i] && text[i] <= '9';
    if (kShape[i] == '0' ? !is_digit : text[i] != kShape[i]) return false;
  }
  const std::string fraction = text.substr(kShape.size(), text.size() - kShape.size() - 1);
  if (fraction.empty()) return true;
  return fraction.size() > 1 && fraction[0] == '.' &&
         fraction.find_first_not_of("0123456789", 1) == std::string::npos;
}

}  // namespace

std::string record_path(int frame_index) {
  return fmt::format("{}/{:06}.json", kRecordsFolder, frame_index);
}
std::string color_path(const CameraCalibration& camera, int frame_index) {
  return fmt::format("{}/{}/{:06}.png", camera.rig, camera.name, frame_index);
}
std::string facts_path(const CameraCalibration& camera, int frame_index) {
  return fmt::format("{}/{}/{:06}.exr", camera.rig, camera.name, frame_index);
}

bool is_safe_name(const std::string& name) {
  if (name.empty() || name.size() > 64) return false;
  for (const char c : name)
    if (!(('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
          c == '-'))
      return false;
  return true;
}

void check_sequence(const SequenceInfo& info, ErrorKind kind, const std::string& where) {
  static constexpr const char* kNameRule = "1 to 64 letters, digits, _ or -";
  if (!is_safe_name(info.name))
    fail(kind, "{}: the sequence name \"{}\" must be {}", where, info.name, kNameRule);
  if (info.input_hash.empty()) fail(kind, "{}: input_hash is empty", where);
  if (info.num_frames < 1 || info.num_frames > kMaxFrames)
    fail(kind, "{}: num_frames = {} is outside 1 to {}", where, info.num_frames, kMaxFrames);
  if (!(info.rate_hz > 0.0) || !std::isfinite(info.rate_hz))
    fail(kind, "{}: rate_hz = {} must be positive", where, info.rate_hz);
  if (!is_utc(info.utc_start))
    fail(kind, "{}: utc_start = \"{}\" must be like 2024-06-21T10:00:00Z", where, info.utc_start);
  if (!(std::abs(info.origin.lat_deg) <= 90.0) || !(std::abs(info.origin.lon_deg) <= 360.0) ||
      !std::isfinite(info.origin.height_m))
    fail(kind, "{}: the origin ({} deg, {} deg, {} m) is not a place", where, info.origin.lat_deg,
         info.origin.lon_deg, info.origin.height_m);
  check_geometry(info.geometry, kind, where);
  if (info.cameras.empty() || info.cameras.size() > kMaxCameras)
    fail(kind, "{}: {} cameras; a sequence has 1 to {}", where, info.cameras.size(), kMaxCameras);
  std::set<std::pair<std::string, std::string>> names;
  for (const CameraCalibration& camera : info.cameras) {
    for (const std::string* name : {&camera.rig, &camera.name})
      if (!is_safe_name(*name))
        fail(kind, "{}: the name \"{}\" of a rig or camera must be {}", where, *name, kNameRule);
    if (camera.rig == kRecordsFolder)
      fail(kind, "{}: a rig cannot be called \"{}\", the folder of the records", where, camera.rig);
    if (!names.emplace(camera.rig, camera.name).second)
      fail(kind, "{}: camera {}/{} stands twice", where, camera.rig, camera.name);
    try {
      geo::make_camera(camera.intrinsics);
    } catch (const core::Error& error) {
      fail(kind, "{}: camera {}/{}: {}", where, camera.rig, camera.name, error.message());
    }
    if (std::int64_t{camera.intrinsics.width_px} * camera.intrinsics.height_px > kMaxPixels)
      fail(kind, "{}: camera {}/{}: {} x {} pixels are more than the {} allowed", where, camera.rig,
           camera.name, camera.intrinsics.width_px, camera.intrinsics.height_px, kMaxPixels);
  }
}

void check_record(const FrameRecord& record, const SequenceInfo& info, ErrorKind kind,
                  const std::string& where) {
  if (record.index < 0 || record.index >= info.num_frames)
    fail(kind, "{}: frame {} is outside 0 to {}", where, record.index, info.num_frames - 1);
  if (!std::isfinite(record.time_s) || !record.world_from_body.translation.allFinite() ||
      !record.velocity_world_mps.allFinite() || !record.acceleration_world_mps2.allFinite() ||
      !record.angular_velocity_body_radps.allFinite())
    fail(kind, "{}: time, position, velocity or acceleration is not finite", where);
  if (!(std::abs(record.world_from_body.rotation.norm() - 1.0) <= kUnitTolerance))
    fail(kind, "{}: the rotation of world_from_body is not of unit length", where);
  if (record.cameras.size() != info.cameras.size())
    fail(kind, "{}: {} cameras, but the sequence has {}", where, record.cameras.size(),
         info.cameras.size());
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    const CameraCalibration& camera = info.cameras[i];
    const CameraRecord& part = record.cameras[i];
    if (part.color.path != color_path(camera, record.index) ||
        part.facts.path != facts_path(camera, record.index))
      fail(kind, "{}: files \"{}\" and \"{}\" of camera {}/{} must be \"{}\" and \"{}\"", where,
           part.color.path, part.facts.path, camera.rig, camera.name,
           color_path(camera, record.index), facts_path(camera, record.index));
    const std::int64_t num_pixels =
        std::int64_t{camera.intrinsics.width_px} * camera.intrinsics.height_px;
    for (const std::int64_t count :
         {part.num_sky, part.num_outside, part.num_edge, part.bounds.num_left_out})
      if (count < 0 || count > num_pixels)
        fail(kind, "{}: camera {}/{} counts {} of {} pixels", where, camera.rig, camera.name, count,
             num_pixels);
    for (const auto& bound :
         {part.bounds.depth_m, part.bounds.flow_next_px, part.bounds.flow_previous_px})
      if (bound && !(bound->arithmetic >= 0.0 && bound->rounding >= 0.0))
        fail(kind, "{}: bounds of camera {}/{} must be 0 or more", where, camera.rig, camera.name);
    for (std::size_t k = 1; k < part.visible_tracks.size(); ++k)
      if (part.visible_tracks[k - 1] >= part.visible_tracks[k])
        fail(kind, "{}: visible_tracks of camera {}/{} must ascend: {} comes before {}", where,
             camera.rig, camera.name, part.visible_tracks[k - 1], part.visible_tracks[k]);
  }
  if (!is_content_hash(record.key))
    fail(kind, "{}: the key \"{}\" is no content hash of 32 hexadecimal digits", where, record.key);
  check_tiles(record, info.geometry.tiles.size(), kind, where);
}

Json json_from_geometry(const ShownGeometry& geometry) {
  std::vector<std::string> tiles;
  tiles.reserve(geometry.tiles.size());
  for (const ShownTile& tile : geometry.tiles)
    tiles.push_back(name_of(tile) + " " + tile.content_hash);
  return Json::object()
      .set("cell_px", geometry.cell_px)
      .set("finest_spacing_m", geometry.finest_spacing_m)
      .set("tiles", Json::array_of(tiles));
}

Json json_from_sequence(const SequenceInfo& info) {
  std::vector<double> highest_z_m;
  for (const ShownTile& tile : info.geometry.tiles) highest_z_m.push_back(tile.highest_z_world_m);
  Json geometry = json_from_geometry(info.geometry);
  geometry.set("highest_z_m", Json::array_of(highest_z_m));
  Json classes = Json::object();
  for (std::size_t i = 0; i < semantic_class_names().size(); ++i)
    classes.set(semantic_class_names()[i], static_cast<int>(i));
  Json channel_list = Json::array();
  for (const ChannelInfo& channel : channels())
    channel_list.push(Json::object()
                          .set("name", channel.name)
                          .set("type", channel.type)
                          .set("unit", channel.unit)
                          .set("meaning", channel.meaning)
                          .set("sky", channel.invalid));
  Json cameras = Json::array();
  for (const CameraCalibration& camera : info.cameras) cameras.push(json_from_camera(camera));
  Json json = header();
  json.set("name", info.name)
      .set("input_hash", info.input_hash)
      .set("world", Json::object()
                        .set("name", info.world_name)
                        .set("input_hash", info.world_input_hash)
                        .set("origin", Json::object()
                                           .set("lat_deg", info.origin.lat_deg)
                                           .set("lon_deg", info.origin.lon_deg)
                                           .set("height_m", info.origin.height_m)))
      .set("utc_start", info.utc_start)
      .set("rate_hz", info.rate_hz)
      .set("num_frames", info.num_frames)
      .set("geometry", std::move(geometry))
      .set("cameras", std::move(cameras))
      .set("channels", std::move(channel_list))
      .set("semantic_classes", std::move(classes))
      .set("licences", Json::array_of(info.licences))
      .set("config_toml", info.config_toml);
  core::add_content_hash(json);
  return json;
}

SequenceInfo sequence_from_json(const Json& json, const std::string& file) {
  const Source source{file};
  source.format(json);
  SequenceInfo info;
  info.name = json.at("name").string();
  info.input_hash = json.at("input_hash").string();
  const Json& world = json.at("world");
  info.world_name = world.at("name").string();
  info.world_input_hash = world.at("input_hash").string();
  const Json& origin = world.at("origin");
  info.origin = {.lat_deg = source.finite(origin.at("lat_deg"), "lat_deg"),
                 .lon_deg = source.finite(origin.at("lon_deg"), "lon_deg"),
                 .height_m = source.finite(origin.at("height_m"), "height_m")};
  info.utc_start = json.at("utc_start").string();
  info.rate_hz = source.finite(json.at("rate_hz"), "rate_hz");
  info.num_frames = static_cast<int>(source.count(json.at("num_frames"), kMaxFrames, "num_frames"));
  info.geometry = geometry_from_json(json.at("geometry"), source);
  const Json& cameras = json.at("cameras");
  if (!cameras.is_array() || cameras.size() > kMaxCameras)
    fail(ErrorKind::Input, "{}: cameras must be a list of 1 to {}", file, kMaxCameras);
  for (std::size_t i = 0; i < cameras.size(); ++i)
    info.cameras.push_back(camera_from_json(cameras.at(i), source));
  info.licences = json.at("licences").strings();
  info.config_toml = json.at("config_toml").string();
  check_sequence(info, ErrorKind::Input, file);
  source.whole(json);
  return info;
}

Json json_from_tracks(const std::vector<TrackPoint>& tracks) {
  Json list = Json::array();
  for (const TrackPoint& track : tracks)
    list.push(Json::object()
                  .set("id", track.id)
                  .set("point_world_m", json_from_vector(track.point_world)));
  Json json = header();
  json.set("tracks", std::move(list));
  core::add_content_hash(json);
  return json;
}

std::vector<TrackPoint> tracks_from_json(const Json& json, const std::string& file) {
  const Source source{file};
  source.format(json);
  const Json& list = json.at("tracks");
  if (!list.is_array()) fail(ErrorKind::Input, "{}: tracks must be a list", file);
  std::vector<TrackPoint> tracks;
  tracks.reserve(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    tracks.push_back(
        {.id = list.at(i).at("id").integer(),
         .point_world = source.vector(list.at(i).at("point_world_m"), "point_world_m")});
    if (i > 0 && tracks[i - 1].id >= tracks[i].id)
      fail(ErrorKind::Input, "{}: track ids must ascend: {} comes before {}", file,
           tracks[i - 1].id, tracks[i].id);
  }
  source.whole(json);
  return tracks;
}

Json json_from_record(const FrameRecord& record, const std::string& input_hash) {
  Json cameras = Json::array();
  for (const CameraRecord& camera : record.cameras) {
    Json visible = Json::array();
    for (const std::int64_t id : camera.visible_tracks) visible.push(id);
    cameras.push(Json::object()
                     .set("color", json_from_file(camera.color))
                     .set("facts", json_from_file(camera.facts))
                     .set("num_sky", camera.num_sky)
                     .set("num_outside", camera.num_outside)
                     .set("num_edge", camera.num_edge)
                     .set("bounds", json_from_bounds(camera.bounds))
                     .set("visible_tracks", std::move(visible)));
  }
  Json touched = Json::array();
  for (const int tile : record.touched_tiles) touched.push(tile);
  Json passed = Json::array();
  std::vector<double> passed_above_m;
  for (const PassedTile& tile : record.passed_tiles) {
    passed.push(tile.tile);
    passed_above_m.push_back(tile.above_z_world_m);
  }
  Json json = header();
  json.set("index", record.index)
      .set("input_hash", input_hash)
      .set("time_s", record.time_s)
      .set("world_from_body", json_from_rigid(record.world_from_body))
      .set("velocity_world_mps", json_from_vector(record.velocity_world_mps))
      .set("acceleration_world_mps2", json_from_vector(record.acceleration_world_mps2))
      .set("angular_velocity_body_radps", json_from_vector(record.angular_velocity_body_radps))
      .set("cameras", std::move(cameras))
      .set("key", record.key)
      .set("touched_tiles", std::move(touched))
      .set("passed_tiles", std::move(passed))
      .set("passed_above_m", Json::array_of(passed_above_m));
  core::add_content_hash(json);
  return json;
}

FrameRecord record_from_json(const Json& json, const SequenceInfo& info, const std::string& file) {
  const Source source{file};
  source.format(json);
  FrameRecord record;
  record.index = static_cast<int>(source.count(json.at("index"), kMaxFrames, "index"));
  record.time_s = source.finite(json.at("time_s"), "time_s");
  record.world_from_body = source.rigid(json.at("world_from_body"), "world_from_body");
  record.velocity_world_mps = source.vector(json.at("velocity_world_mps"), "velocity_world_mps");
  record.acceleration_world_mps2 =
      source.vector(json.at("acceleration_world_mps2"), "acceleration_world_mps2");
  record.angular_velocity_body_radps =
      source.vector(json.at("angular_velocity_body_radps"), "angular_velocity_body_radps");
  const Json& cameras = json.at("cameras");
  if (!cameras.is_array() || cameras.size() != info.cameras.size())
    fail(ErrorKind::Input, "{}: cameras must be a list of {}", file, info.cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Json& camera = cameras.at(i);
    CameraRecord part;
    part.color =
        file_from_json(camera.at("color"), color_path(info.cameras[i], record.index), file);
    part.facts =
        file_from_json(camera.at("facts"), facts_path(info.cameras[i], record.index), file);
    part.num_sky = camera.at("num_sky").integer();
    part.num_outside = camera.at("num_outside").integer();
    part.num_edge = camera.at("num_edge").integer();
    part.bounds = bounds_from_json(camera.at("bounds"), source);
    const Json& visible = camera.at("visible_tracks");
    if (!visible.is_array()) fail(ErrorKind::Input, "{}: visible_tracks must be a list", file);
    part.visible_tracks.reserve(visible.size());
    for (std::size_t k = 0; k < visible.size(); ++k)
      part.visible_tracks.push_back(visible.at(k).integer());
    record.cameras.push_back(std::move(part));
  }
  record.key = json.at("key").string();
  const auto tile_of = [&](const Json& tile) {
    return static_cast<int>(source.count(tile, kMaxShownTiles, "a tile"));
  };
  const Json& touched = json.at("touched_tiles");
  if (!touched.is_array()) fail(ErrorKind::Input, "{}: touched_tiles must be a list", file);
  for (std::size_t i = 0; i < touched.size(); ++i)
    record.touched_tiles.push_back(tile_of(touched.at(i)));
  const Json& passed = json.at("passed_tiles");
  if (!passed.is_array()) fail(ErrorKind::Input, "{}: passed_tiles must be a list", file);
  const std::vector<double> passed_above_m =
      source.numbers(json.at("passed_above_m"), passed.size(), "passed_above_m");
  for (std::size_t i = 0; i < passed.size(); ++i)
    record.passed_tiles.push_back(
        {.tile = tile_of(passed.at(i)), .above_z_world_m = passed_above_m[i]});
  check_record(record, info, ErrorKind::Input, file);
  source.inputs(json, info);
  source.whole(json);
  return record;
}

bool is_damaged(const std::filesystem::path& file) {
  try {
    const Json json = Json::read(file);
    const bool is_of_other_version =
        json.has("version") && json.at("version").integer() != kCaptureVersion;
    if (!is_of_other_version) core::check_content_hash(json);
    return false;
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return true;
    throw;
  }
}

Json json_from_manifest(const Manifest& manifest, const SequenceInfo& info,
                        const std::vector<FrameRecord>& records) {
  Json cameras = Json::array();
  for (std::size_t i = 0; i < info.cameras.size(); ++i) {
    const CameraCalibration& camera = info.cameras[i];
    std::int64_t num_sky = 0, num_outside = 0, num_edge = 0;
    for (const FrameRecord& record : records) {
      num_sky += record.cameras[i].num_sky;
      num_outside += record.cameras[i].num_outside;
      num_edge += record.cameras[i].num_edge;
    }
    const std::int64_t num_pixels =
        std::int64_t{camera.intrinsics.width_px} * camera.intrinsics.height_px;
    cameras.push(Json::object()
                     .set("rig", camera.rig)
                     .set("name", camera.name)
                     .set("num_pixels", num_pixels * static_cast<std::int64_t>(records.size()))
                     .set("num_sky", num_sky)
                     .set("num_outside", num_outside)
                     .set("num_edge", num_edge));
  }
  Json files = Json::array();
  for (const FrameFile& file : manifest.files) files.push(json_from_file(file));
  Json json = header();
  json.set("input_hash", manifest.input_hash)
      .set("num_frames", info.num_frames)
      .set("cameras", std::move(cameras))
      .set("files", std::move(files));
  core::add_content_hash(json);
  return json;
}

Manifest manifest_from_json(const Json& json, const SequenceInfo& info, const std::string& file) {
  const Source source{file};
  source.format(json);
  Manifest manifest;
  manifest.input_hash = json.at("input_hash").string();
  source.inputs(json, info);
  const Json& files = json.at("files");
  const std::size_t num_files = 2 + static_cast<std::size_t>(info.num_frames);
  if (!files.is_array() || files.size() != num_files)
    fail(ErrorKind::Input, "{}: files must be a list of {}", file, num_files);
  for (std::size_t i = 0; i < num_files; ++i) {
    const std::string path = i == 0   ? kSequenceFile
                             : i == 1 ? kTracksFile
                                      : record_path(static_cast<int>(i) - 2);
    manifest.files.push_back(file_from_json(files.at(i), path, file));
  }
  source.whole(json);
  return manifest;
}

}  // namespace terracast::capture
