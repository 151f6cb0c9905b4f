#include "capture/sequence_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <set>
#include <tuple>

#include "capture/channel.h"
#include "capture/json_parts.h"
#include "capture/moving_json.h"
#include "capture/sequence_files.h"
#include "core/printable.h"

namespace terracast::capture {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

Json json_from_sites(const std::vector<std::int64_t>& sites) {
  Json json = Json::array();
  for (const std::int64_t site : sites) json.push(site);
  return json;
}

std::vector<std::int64_t> sites_from_json(const Json& json) {
  std::vector<std::int64_t> sites;
  for (std::size_t i = 0; i < json.size(); ++i) sites.push_back(json.at(i).integer());
  return sites;
}

Json json_from_imaging(const CameraImaging& imaging) {
  Json json = Json::object().set("settings_toml", imaging.settings_toml);
  const CameraImaging::RawFormat& raw = imaging.raw;
  if (imaging.has_raw())
    json.set("raw", Json::object()
                        .set("mosaic", raw.mosaic)
                        .set("bits", raw.bits)
                        .set("black_level_dn", raw.black_level_dn)
                        .set("white_level_dn", raw.white_level_dn)
                        .set("dn_per_electron", raw.dn_per_electron));
  if (!imaging.dead_sites.empty()) json.set("dead_sites", json_from_sites(imaging.dead_sites));
  if (!imaging.hot_sites.empty()) json.set("hot_sites", json_from_sites(imaging.hot_sites));
  return json;
}

CameraImaging imaging_from_json(const Json& json, const Source& source) {
  CameraImaging imaging{.settings_toml = json.at("settings_toml").string()};
  if (json.has("raw")) {
    const Json& raw = json.at("raw");
    imaging.raw = {.mosaic = raw.at("mosaic").string(),
                   .bits = static_cast<int>(source.count(raw.at("bits"), 16, "bits")),
                   .black_level_dn = source.finite(raw.at("black_level_dn"), "black_level_dn"),
                   .white_level_dn = source.finite(raw.at("white_level_dn"), "white_level_dn"),
                   .dn_per_electron = source.finite(raw.at("dn_per_electron"), "dn_per_electron")};
  }
  if (json.has("dead_sites")) imaging.dead_sites = sites_from_json(json.at("dead_sites"));
  if (json.has("hot_sites")) imaging.hot_sites = sites_from_json(json.at("hot_sites"));
  return imaging;
}

Json json_from_camera(const SequenceInfo& info, std::size_t index) {
  const CameraCalibration& camera = info.cameras[index];
  const geo::CameraIntrinsics& intrinsics = camera.intrinsics;
  Json json = Json::object()
                  .set("rig", camera.rig)
                  .set("name", camera.name)
                  .set("intrinsics", Json::object()
                                         .set("model", intrinsics.model)
                                         .set("width_px", intrinsics.width_px)
                                         .set("height_px", intrinsics.height_px)
                                         .set("parameters", Json::array_of(intrinsics.parameters)))
                  .set("rig_from_camera", json_from_rigid(camera.rig_from_camera))
                  .set("body_from_rig", json_from_rigid(camera.body_from_rig));
  if (!camera.shutter.is_instant())
    json.set(
        "shutter",
        Json::object()
            .set("exposure_s", camera.shutter.exposure_s)
            .set("line_time_s", camera.shutter.line_time_s)
            .set("readout", geo::kReadoutNames[static_cast<std::size_t>(camera.shutter.readout)]));
  if (camera.aperture.diameter_m > 0.0)
    json.set("aperture", Json::object()
                             .set("diameter_m", camera.aperture.diameter_m)
                             .set("focus_m", camera.aperture.focus_m));
  if (!info.believed_cameras.empty()) {
    const CameraCalibration& believed = info.believed_cameras[index];
    json.set("believed", Json::object()
                             .set("parameters", Json::array_of(believed.intrinsics.parameters))
                             .set("rig_from_camera", json_from_rigid(believed.rig_from_camera)));
  }
  if (!info.clocks.empty()) {
    const CameraClock& clock = info.clocks[index];
    json.set("clock", Json::object()
                          .set("offset_s", clock.offset_s)
                          .set("drift", clock.drift)
                          .set("jitter_sd_s", clock.jitter_sd_s));
  }
  if (!info.imaging.empty() && info.imaging[index].is_on())
    json.set("imaging", json_from_imaging(info.imaging[index]));
  return json;
}

geo::Shutter shutter_from_json(const Json& json, const Source& source) {
  geo::Shutter shutter{.exposure_s = source.finite(json.at("exposure_s"), "exposure_s"),
                       .line_time_s = source.finite(json.at("line_time_s"), "line_time_s")};
  const std::string readout = json.at("readout").string();
  const auto* const found =
      std::find(std::begin(geo::kReadoutNames), std::end(geo::kReadoutNames), readout);
  if (found == std::end(geo::kReadoutNames))
    fail(ErrorKind::Input, "{}: a shutter's readout is \"{}\"; known are down, up, right and left",
         source.file, readout);
  shutter.readout = static_cast<geo::Readout>(found - std::begin(geo::kReadoutNames));
  return shutter;
}

geo::Aperture aperture_from_json(const Json& json, const Source& source) {
  return {.diameter_m = source.finite(json.at("diameter_m"), "diameter_m"),
          .focus_m = source.finite(json.at("focus_m"), "focus_m")};
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
          .body_from_rig = source.rigid(json.at("body_from_rig"), "body_from_rig"),
          .shutter =
              json.has("shutter") ? shutter_from_json(json.at("shutter"), source) : geo::Shutter{},
          .aperture = json.has("aperture") ? aperture_from_json(json.at("aperture"), source)
                                           : geo::Aperture{}};
}

/// The camera as it is believed to be: what differs stands in the JSON.
CameraCalibration believed_from_json(CameraCalibration camera, const Json& json,
                                     const Source& source) {
  camera.intrinsics.parameters = json.at("parameters").numbers();
  camera.rig_from_camera = source.rigid(json.at("rig_from_camera"), "believed rig_from_camera");
  return camera;
}

CameraClock clock_from_json(const Json& json, const Source& source) {
  return {.offset_s = source.finite(json.at("offset_s"), "offset_s"),
          .drift = source.finite(json.at("drift"), "drift"),
          .jitter_sd_s = source.finite(json.at("jitter_sd_s"), "jitter_sd_s")};
}

/// By NumberType. Of doubles, which all but scans have, files say nothing.
constexpr std::array<std::string_view, 5> kNumberTypes = {"float64", "float32", "count32",
                                                          "count16", "count8"};

Json json_from_channel(const StreamChannel& channel) {
  Json json = Json::object();
  json.set("name", channel.name).set("unit", channel.unit);
  if (channel.type != NumberType::Float64)
    json.set("type", kNumberTypes.at(static_cast<std::size_t>(channel.type)));
  return json;
}

StreamChannel channel_from_json(const Json& json, const Source& source) {
  StreamChannel channel{.name = json.at("name").string(), .unit = json.at("unit").string()};
  if (!json.has("type")) return channel;
  const auto* const found =
      std::find(kNumberTypes.begin(), kNumberTypes.end(), json.at("type").string());
  if (found == kNumberTypes.end())
    fail(ErrorKind::Input, "{}: a channel's type is \"{}\", which this version does not know",
         source.file, core::printable(core::first_letters(json.at("type").string(), 100)));
  channel.type = static_cast<NumberType>(found - kNumberTypes.begin());
  return channel;
}

Json json_from_stream(const StreamInfo& stream) {
  Json channels = Json::array();
  for (const StreamChannel& channel : stream.channels) channels.push(json_from_channel(channel));
  Json json = Json::object();
  json.set("rig", stream.rig)
      .set("name", stream.name)
      .set("kind", stream.kind)
      .set("rate_hz", stream.rate_hz)
      .set("channels", std::move(channels))
      .set("rig_from_sensor", json_from_rigid(stream.rig_from_sensor))
      .set("body_from_rig", json_from_rigid(stream.body_from_rig))
      .set("settings_toml", stream.settings_toml);
  if (stream.is_scan) json.set("is_scan", true);
  if (stream.clock)
    json.set("clock", Json::object()
                          .set("offset_s", stream.clock->offset_s)
                          .set("drift", stream.clock->drift)
                          .set("jitter_sd_s", stream.clock->jitter_sd_s)
                          .set("believed_offset_s", stream.clock->believed_offset_s)
                          .set("believed_drift", stream.clock->believed_drift));
  return json;
}

StreamClock stream_clock_from_json(const Json& json, const Source& source) {
  const auto number = [&](const char* key) { return source.finite(json.at(key), key); };
  return {.offset_s = number("offset_s"),
          .drift = number("drift"),
          .jitter_sd_s = number("jitter_sd_s"),
          .believed_offset_s = number("believed_offset_s"),
          .believed_drift = number("believed_drift")};
}

StreamInfo stream_from_json(const Json& json, const Source& source) {
  StreamInfo stream{.rig = json.at("rig").string(),
                    .name = json.at("name").string(),
                    .kind = json.at("kind").string(),
                    .rate_hz = source.finite(json.at("rate_hz"), "rate_hz"),
                    .channels = {},
                    .rig_from_sensor = source.rigid(json.at("rig_from_sensor"), "rig_from_sensor"),
                    .body_from_rig = source.rigid(json.at("body_from_rig"), "body_from_rig"),
                    .settings_toml = json.at("settings_toml").string(),
                    .is_scan = json.has("is_scan") && json.at("is_scan").boolean()};
  const Json& channels = json.at("channels");
  for (std::size_t i = 0; i < channels.size(); ++i)
    stream.channels.push_back(channel_from_json(channels.at(i), source));
  if (json.has("clock")) stream.clock = stream_clock_from_json(json.at("clock"), source);
  return stream;
}

std::string name_of(const ShownTile& tile) {
  return fmt::format("{}/{}/{}", tile.level, tile.x, tile.y);
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

void check_model(const CameraCalibration& camera, ErrorKind kind, const std::string& where) {
  try {
    geo::make_camera(camera.intrinsics);
  } catch (const core::Error& error) {
    fail(kind, "{}: camera {}/{}: {}", where, camera.rig, camera.name, error.message());
  }
}

void check_exposure(const CameraCalibration& camera, ErrorKind kind, const std::string& where) {
  for (const double value : {camera.shutter.exposure_s, camera.shutter.line_time_s,
                             camera.aperture.diameter_m, camera.aperture.focus_m})
    if (!(value >= 0.0) || !std::isfinite(value))
      fail(kind,
           "{}: camera {}/{}: an exposure of {} s, lines every {} s, an aperture of {} m and a "
           "focus "
           "of {} m; they are 0 or more",
           where, camera.rig, camera.name, camera.shutter.exposure_s, camera.shutter.line_time_s,
           camera.aperture.diameter_m, camera.aperture.focus_m);
}

/// What is believed is of the same cameras, and each has a clock.
void check_beliefs(const SequenceInfo& info, ErrorKind kind, const std::string& where) {
  for (const std::size_t count : {info.believed_cameras.size(), info.clocks.size()})
    if (count != 0 && count != info.cameras.size())
      fail(kind,
           "{}: {} believed calibrations or clocks of {} cameras; all cameras have them, or none",
           where, count, info.cameras.size());
  for (std::size_t i = 0; i < info.believed_cameras.size(); ++i) {
    const CameraCalibration& camera = info.cameras[i];
    const CameraCalibration& believed = info.believed_cameras[i];
    CameraCalibration same = believed;
    same.intrinsics.parameters = camera.intrinsics.parameters;
    same.rig_from_camera = camera.rig_from_camera;
    if (same != camera)
      fail(kind, "{}: what is believed of camera {}/{} is of another size, model or mount", where,
           camera.rig, camera.name);
    check_model(believed, kind, where);
  }
  for (const CameraClock& clock : info.clocks)
    if (!std::isfinite(clock.offset_s) || !std::isfinite(clock.drift) ||
        !(clock.jitter_sd_s >= 0.0) || !std::isfinite(clock.jitter_sd_s))
      fail(kind, "{}: a clock of offset {} s, drift {} and jitter {} s", where, clock.offset_s,
           clock.drift, clock.jitter_sd_s);
}

/// All cameras' imaging stands there, or none's; raw formats are ones that exist.
void check_imaging(const SequenceInfo& info, ErrorKind kind, const std::string& where) {
  if (!info.imaging.empty() && info.imaging.size() != info.cameras.size())
    fail(kind, "{}: imaging of {} of {} cameras", where, info.imaging.size(), info.cameras.size());
  static const std::set<std::string> kMosaics = {"rggb", "bggr", "grbg", "gbrg"};
  for (std::size_t i = 0; i < info.imaging.size(); ++i) {
    const CameraImaging& imaging = info.imaging[i];
    const CameraImaging::RawFormat& raw = imaging.raw;
    if (imaging.has_raw() &&
        (!kMosaics.contains(raw.mosaic) || raw.bits < 8 || raw.bits > 16 ||
         !(0.0 <= raw.black_level_dn && raw.black_level_dn < raw.white_level_dn &&
           raw.white_level_dn < static_cast<double>(1 << raw.bits)) ||
         !(raw.dn_per_electron >= 0.0) || !std::isfinite(raw.dn_per_electron)))
      fail(kind, "{}: raw of camera {}/{}: mosaic \"{}\", {} bits, levels {} and {}", where,
           info.cameras[i].rig, info.cameras[i].name, raw.mosaic, raw.bits, raw.black_level_dn,
           raw.white_level_dn);
    const geo::CameraIntrinsics& size = info.cameras[i].intrinsics;
    const std::int64_t num_sites =
        std::int64_t{size.width_px} * size.height_px * (imaging.has_raw() ? 1 : 3);
    for (const std::vector<std::int64_t>* sites : {&imaging.dead_sites, &imaging.hot_sites})
      for (std::size_t k = 0; k < sites->size(); ++k)
        if ((*sites)[k] < 0 || (*sites)[k] >= num_sites ||
            (k > 0 && (*sites)[k - 1] >= (*sites)[k]))
          fail(kind, "{}: photosite {} of camera {}/{} is out of range or order", where,
               (*sites)[k], info.cameras[i].rig, info.cameras[i].name);
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
    if (camera.rig == kRecordsFolder || camera.rig == kLabelsFolder)
      fail(kind, "{}: a rig cannot be called \"{}\", the folder of the {}", where, camera.rig,
           camera.rig == kRecordsFolder ? "records" : "labels");
    if (!names.emplace(camera.rig, camera.name).second)
      fail(kind, "{}: camera {}/{} stands twice", where, camera.rig, camera.name);
    check_model(camera, kind, where);
    check_exposure(camera, kind, where);
    if (std::int64_t{camera.intrinsics.width_px} * camera.intrinsics.height_px > kMaxPixels)
      fail(kind, "{}: camera {}/{}: {} x {} pixels are more than the {} allowed", where, camera.rig,
           camera.name, camera.intrinsics.width_px, camera.intrinsics.height_px, kMaxPixels);
  }
  for (const StreamInfo& stream : info.streams) {
    for (const std::string* name : {&stream.rig, &stream.name})
      if (!is_safe_name(*name))
        fail(kind, "{}: the name \"{}\" of a rig or sensor must be {}", where, *name, kNameRule);
    if (stream.rig == kRecordsFolder || stream.rig == kLabelsFolder)
      fail(kind, "{}: a rig cannot be called \"{}\"", where, stream.rig);
    if (!names.emplace(stream.rig, stream.name).second)
      fail(kind, "{}: {}/{} is the name of two sensors", where, stream.rig, stream.name);
    if (!(stream.rate_hz > 0.0) || !(stream.rate_hz <= kMaxStreamRate_hz))
      fail(kind, "{}: {}/{} measures {} times a second; it takes more than 0, and {} at most",
           where, stream.rig, stream.name, stream.rate_hz, kMaxStreamRate_hz);
    if (const std::string wrong = wrong_channels(stream.channels); !wrong.empty())
      fail(kind, "{}: {}/{} {}", where, stream.rig, stream.name, core::printable(wrong));
    if (stream.clock && stream.channels.back() != StreamChannel{.name = kStampChannel, .unit = "s"})
      fail(kind, "{}: {}/{} has a clock, but its last channel is not {} in s", where, stream.rig,
           stream.name, kStampChannel);
    if (stream.clock && !(stream.clock->jitter_sd_s >= 0.0))
      fail(kind, "{}: the clock of {}/{} jitters by {} s; 0 and more is right", where, stream.rig,
           stream.name, stream.clock->jitter_sd_s);
  }
  check_beliefs(info, kind, where);
  check_imaging(info, kind, where);
  check_moving(info.moving, kind, where);
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
  for (std::size_t i = 0; i < info.cameras.size(); ++i) cameras.push(json_from_camera(info, i));
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
      .set("cameras", std::move(cameras));
  if (!info.moving.empty()) json.set("moving", json_from_moving(info.moving));
  if (!info.streams.empty()) {
    Json streams = Json::array();
    for (const StreamInfo& stream : info.streams) streams.push(json_from_stream(stream));
    json.set("streams", std::move(streams));
  }
  json.set("channels", std::move(channel_list))
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
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Json& camera = cameras.at(i);
    info.cameras.push_back(camera_from_json(camera, source));
    if (camera.has("believed"))
      info.believed_cameras.push_back(
          believed_from_json(info.cameras.back(), camera.at("believed"), source));
    if (camera.has("clock")) info.clocks.push_back(clock_from_json(camera.at("clock"), source));
    if (camera.has("imaging")) {
      info.imaging.resize(cameras.size());
      info.imaging[i] = imaging_from_json(camera.at("imaging"), source);
    }
  }
  if (json.has("moving")) info.moving = moving_from_json(json.at("moving"), source);
  if (json.has("streams"))
    for (std::size_t i = 0; i < json.at("streams").size(); ++i)
      info.streams.push_back(stream_from_json(json.at("streams").at(i), source));
  info.licences = json.at("licences").strings();
  info.config_toml = json.at("config_toml").string();
  check_sequence(info, ErrorKind::Input, file);
  source.whole(json);
  return info;
}

}  // namespace terracast::capture
