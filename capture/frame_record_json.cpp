#include "capture/frame_record_json.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "capture/json_parts.h"
#include "capture/moving_json.h"
#include "capture/sequence_files.h"

namespace terracast::capture {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

/// Of kPassedStep_m, to what is higher than any place.
constexpr double kMaxPassedSteps = 0x1.0p40;

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

}  // namespace

void check_record(const FrameRecord& record, const SequenceInfo& info, ErrorKind kind,
                  const std::string& where) {
  if (record.index < 0 || record.index >= info.num_frames)
    fail(kind, "{}: frame {} is outside 0 to {}", where, record.index, info.num_frames - 1);
  if (!std::isfinite(record.time_s) || !record.world_from_body.translation.allFinite() ||
      !record.velocity_world_mps.allFinite() || !record.acceleration_world_mps2.allFinite() ||
      !record.angular_velocity_body_radps.allFinite() || !are_sound(record.terms))
    fail(kind,
         "{}: time, position, velocity, acceleration or a term of the motion is not finite, or a "
         "size below 0",
         where);
  if (record.stamps_s.size() != info.clocks.size() ||
      !std::all_of(record.stamps_s.begin(), record.stamps_s.end(),
                   [](double stamp_s) { return std::isfinite(stamp_s); }))
    fail(kind, "{}: {} stamps of {} clocks, or one that is not finite", where,
         record.stamps_s.size(), info.clocks.size());
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
    const bool has_raw = i < info.imaging.size() && info.imaging[i].has_raw();
    if (part.raw.has_value() != has_raw ||
        (part.raw && part.raw->path != raw_path(camera, record.index)))
      fail(kind, "{}: the raw file of camera {}/{} is {}, but must be {}", where, camera.rig,
           camera.name, part.raw ? part.raw->path : "none",
           has_raw ? raw_path(camera, record.index) : "none");
    if (part.exposure_ev && !std::isfinite(*part.exposure_ev))
      fail(kind, "{}: the exposure of camera {}/{} is not finite", where, camera.rig, camera.name);
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
  if (record.streams.size() != info.streams.size())
    fail(kind, "{}: samples of {} streams, but the sequence has {}", where, record.streams.size(),
         info.streams.size());
  for (std::size_t i = 0; i < info.streams.size(); ++i)
    if (record.streams[i].path != samples_path(info.streams[i], record.index))
      fail(kind, "{}: the samples of {}/{} are in \"{}\"; they must be in \"{}\"", where,
           info.streams[i].rig, info.streams[i].name, record.streams[i].path,
           samples_path(info.streams[i], record.index));
  if (!is_content_hash(record.key))
    fail(kind, "{}: the key \"{}\" is no content hash of 32 hexadecimal digits", where, record.key);
  check_tiles(record, info.geometry.tiles.size(), kind, where);
  check_states(record.moving, info.moving, kind, where);
}

Json json_from_record(const FrameRecord& record, const std::string& input_hash) {
  Json cameras = Json::array();
  for (const CameraRecord& camera : record.cameras) {
    Json visible = Json::array();
    for (const std::int64_t id : camera.visible_tracks) visible.push(id);
    Json part = Json::object();
    part.set("color", json_from_file(camera.color)).set("facts", json_from_file(camera.facts));
    if (camera.raw) part.set("raw", json_from_file(*camera.raw));
    if (camera.exposure_ev) part.set("exposure_ev", *camera.exposure_ev);
    part.set("num_sky", camera.num_sky)
        .set("num_outside", camera.num_outside)
        .set("num_edge", camera.num_edge)
        .set("bounds", json_from_bounds(camera.bounds))
        .set("visible_tracks", std::move(visible));
    cameras.push(std::move(part));
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
  json.set("index", record.index).set("input_hash", input_hash).set("time_s", record.time_s);
  if (!record.stamps_s.empty()) json.set("stamps_s", Json::array_of(record.stamps_s));
  json.set("world_from_body", json_from_rigid(record.world_from_body))
      .set("velocity_world_mps", json_from_vector(record.velocity_world_mps))
      .set("acceleration_world_mps2", json_from_vector(record.acceleration_world_mps2))
      .set("angular_velocity_body_radps", json_from_vector(record.angular_velocity_body_radps));
  if (record.terms.are_any()) json.set("motion_terms", json_from_terms(record.terms));
  if (!record.moving.empty()) json.set("moving", json_from_states(record.moving));
  json.set("cameras", std::move(cameras));
  if (!record.streams.empty()) {
    Json streams = Json::array();
    for (const FrameFile& file : record.streams) streams.push(json_from_file(file));
    json.set("streams", std::move(streams));
  }
  json.set("key", record.key)
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
  if (json.has("stamps_s"))
    record.stamps_s = source.numbers(json.at("stamps_s"), info.clocks.size(), "stamps_s");
  record.world_from_body = source.rigid(json.at("world_from_body"), "world_from_body");
  record.velocity_world_mps = source.vector(json.at("velocity_world_mps"), "velocity_world_mps");
  record.acceleration_world_mps2 =
      source.vector(json.at("acceleration_world_mps2"), "acceleration_world_mps2");
  record.angular_velocity_body_radps =
      source.vector(json.at("angular_velocity_body_radps"), "angular_velocity_body_radps");
  if (json.has("motion_terms")) record.terms = terms_from_json(json.at("motion_terms"), source);
  if (json.has("moving"))
    record.moving = states_from_json(json.at("moving"), record.time_s, source);
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
    if (camera.has("raw"))
      part.raw = file_from_json(camera.at("raw"), raw_path(info.cameras[i], record.index), file);
    if (camera.has("exposure_ev"))
      part.exposure_ev = source.finite(camera.at("exposure_ev"), "exposure_ev");
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
  const std::size_t num_streams = json.has("streams") ? json.at("streams").size() : 0;
  if (num_streams != info.streams.size())
    fail(ErrorKind::Input, "{}: streams must be a list of {}", file, info.streams.size());
  for (std::size_t i = 0; i < num_streams; ++i)
    record.streams.push_back(file_from_json(json.at("streams").at(i),
                                            samples_path(info.streams[i], record.index), file));
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

}  // namespace terracast::capture
