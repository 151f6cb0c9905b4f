#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"
#include "core/semantic_class.h"
#include "validate/belief.h"
#include "validate/dataset.h"
#include "validate/plugin_format.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

Eigen::Vector3d vector3(const Json& json) {
  const std::vector<double> n = json.numbers();
  if (n.size() != 3) fail(ErrorKind::Input, "dataset.json: {} numbers where 3 should be", n.size());
  return {n[0], n[1], n[2]};
}

Eigen::Matrix3d rotation_wxyz(double w, double x, double y, double z, const std::string& where) {
  const Eigen::Quaterniond rotation(w, x, y, z);
  if (std::abs(rotation.norm() - 1.0) > 1e-9)
    fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", where, rotation.norm());
  return rotation.normalized().toRotationMatrix();
}

Geodetic geodetic(double lat_deg, double lon_deg, double height_m, const std::string& where) {
  if (!(std::abs(lat_deg) <= 90.0) || !(std::abs(lon_deg) <= 360.0) || !(std::abs(height_m) < 1e6))
    fail(ErrorKind::Input, "{}: latitude {}, longitude {}, height {} is no place", where, lat_deg,
         lon_deg, height_m);
  return {lat_deg, lon_deg, height_m};
}

int whole_number(const Json& json, std::int64_t least, std::int64_t most, const char* what) {
  const std::int64_t value = json.integer();
  if (value < least || value > most)
    fail(ErrorKind::Input, "dataset.json: {} = {} is outside {} to {}", what, value, least, most);
  return static_cast<int>(value);
}

/// Nothing of a global shutter.
std::optional<Shutter> read_shutter(const Json& json, const Intrinsics& size,
                                    const std::string& camera) {
  const double line_time_s = json.at("line_time_s").number();
  const std::string name = json.at("readout").string();
  const std::optional<Readout> readout = readout_of(name);
  if (!readout)
    fail(ErrorKind::Input,
         "dataset.json: readout = \"{}\" of {}; down, up, right and left are known",
         core::first_letters(name, 60), camera);
  constexpr double kLongest_s =
      3600.0;  // of an image: it takes no longer than the time to the next
  const Shutter shutter{line_time_s, *readout};
  if (!(line_time_s >= 0.0) || !(2.0 * shutter.reach_s(size) <= kLongest_s))
    fail(ErrorKind::Input, "dataset.json: line_time_s = {} of {}", line_time_s, camera);
  return line_time_s > 0.0 ? std::optional(shutter) : std::nullopt;
}

Camera read_camera(const Json& json, int num_frames) {
  Camera camera;
  camera.name = json.at("name").string();
  if (!is_safe_relative_path(camera.name))
    fail(ErrorKind::Input, "dataset.json: camera name \"{}\"", camera.name);
  if (json.has("rig")) {
    camera.rig = json.at("rig").string();
    camera.name_in_rig = json.at("camera").string();
  }
  Intrinsics stated;
  stated.width_px = whole_number(json.at("width_px"), 1, 1 << 15, "width_px");
  stated.height_px = whole_number(json.at("height_px"), 1, 1 << 15, "height_px");
  stated.fx_px = json.at("fx_px").number();
  stated.fy_px = json.at("fy_px").number();
  stated.cx_px = json.at("cx_px").number();
  stated.cy_px = json.at("cy_px").number();
  camera.stated = stated;
  if (json.has("model"))
    camera.stated_model = {json.at("model").string(), json.at("parameters").numbers()};
  camera.intrinsics.width_px = stated.width_px;
  camera.intrinsics.height_px = stated.height_px;
  if (json.has("shutter")) camera.shutter = read_shutter(json.at("shutter"), stated, camera.name);
  const Json& mount = json.at("body_from_camera");
  const std::vector<double> q = mount.at("rotation_wxyz").numbers();
  if (q.size() != 4) fail(ErrorKind::Input, "dataset.json: rotation_wxyz has {} numbers", q.size());
  camera.body_from_camera = Pose{
      rotation_wxyz(q[0], q[1], q[2], q[3], "dataset.json: body_from_camera of " + camera.name),
      vector3(mount.at("translation_m"))};
  const auto count = static_cast<std::size_t>(num_frames);
  camera.local_from_camera.resize(count);
  camera.georeference.resize(count);
  camera.bounds.resize(count);
  camera.files.resize(count);
  return camera;
}

void read_clock(const Json& json, Camera& camera) {
  if (!json.has("clock")) return;
  const Json& clock = json.at("clock");
  camera.clock = StatedClock{clock.at("offset_s").number(), clock.at("drift").number(),
                             clock.at("jitter_sd_s").number()};
}

/// Names that formats of several rigs give cameras: rig and camera, parted by a slash, of COCO by a line.
void check_camera_name(const Dataset& dataset, const Camera& camera) {
  const bool has_slash = dataset.format == "colmap" || dataset.format == "mcap" ||
                         dataset.format == "terracast" || dataset.format == "tum";
  if (camera.rig.empty() || (!has_slash && dataset.format != "coco")) return;
  std::string name = camera.rig + "/" + camera.name_in_rig;
  if (!has_slash) std::replace(name.begin(), name.end(), '/', '_');
  if (camera.name != name)
    fail(ErrorKind::Input, "dataset.json: camera {} is {} of rig {}", camera.name,
         core::first_letters(camera.name_in_rig, 60), core::first_letters(camera.rig, 60));
}

/// A table with a row for each frame and camera.
/// header   its first line: frame,camera and the names of the numbers
/// row      is given the camera, the frame, the cells after the first two, and where they stand
/// has_row  whether the camera has that frame's row already
template <class Row, class HasRow>
void read_table(const Dataset& dataset, const std::string& path, const std::string& header,
                Sequence& sequence, Findings& findings, const HasRow& has_row, const Row& row) {
  findings.attempt(path, [&] {
    const std::string text = core::read_text_file(dataset.root / path);
    const std::vector<TextLine> lines = split_lines(text);
    if (lines.empty() || lines[0].text != header)
      fail(ErrorKind::Input, "{}:1: another header than {}", path, header);
    const std::size_t num_columns = split_at(header, ',').size();
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const std::string where = path + ":" + std::to_string(lines[i].number);
      const std::vector<std::string_view> parts = split_at(lines[i].text, ',');
      if (parts.size() != num_columns)
        fail(ErrorKind::Input, "{}: {} columns, not {}", where, parts.size(), num_columns);
      const std::int64_t frame = parse_integer(parts[0], where);
      const int camera_index = sequence.camera_index(std::string(parts[1]));
      if (frame < 0 || frame >= sequence.num_frames || camera_index < 0)
        fail(ErrorKind::Input, "{}: frame {} of camera \"{}\" is not in the dataset", where, frame,
             core::first_letters(parts[1], 60));
      Camera& camera = sequence.cameras[static_cast<std::size_t>(camera_index)];
      if (has_row(camera, static_cast<std::size_t>(frame)))
        fail(ErrorKind::Input, "{}: frame {} of camera {} stands twice", where, frame, parts[1]);
      row(camera, static_cast<std::size_t>(frame), std::span(parts).subspan(2), where);
    }
    for (const Camera& camera : sequence.cameras)
      for (std::size_t i = 0; i < static_cast<std::size_t>(sequence.num_frames); ++i)
        if (!has_row(camera, i))
          findings.add(path, fmt::format("no row for frame {} of {}", i, camera.name));
  });
}

using Cells = std::span<const std::string_view>;

void read_georeference(const Dataset& dataset, const std::string& path, Sequence& sequence,
                       Findings& findings) {
  read_table(
      dataset, path, "frame,camera,time_s,lat_deg,lon_deg,height_m,qw,qx,qy,qz", sequence, findings,
      [](const Camera& camera, std::size_t frame) {
        return camera.georeference[frame].has_value();
      },
      [](Camera& camera, std::size_t frame, Cells cells, const std::string& where) {
        double n[8];
        for (std::size_t k = 0; k < 8; ++k) n[k] = parse_number(cells[k], where);
        camera.georeference[frame] = Georeference{n[0], geodetic(n[1], n[2], n[3], where),
                                                  rotation_wxyz(n[4], n[5], n[6], n[7], where)};
      });
}

void read_bounds(const Dataset& dataset, const std::string& path, Sequence& sequence,
                 Findings& findings) {
  read_table(
      dataset, path,
      "frame,camera,depth_error_mm,depth_rounding_mm,flow_error_px,flow_rounding_px,left_out,"
      "pixels",
      sequence, findings,
      [](const Camera& camera, std::size_t frame) { return camera.bounds[frame].has_value(); },
      [](Camera& camera, std::size_t frame, Cells cells, const std::string& where) {
        double n[4];
        for (std::size_t k = 0; k < 4; ++k) {
          n[k] = cells[k].empty() ? std::numeric_limits<double>::quiet_NaN()
                                  : parse_number(cells[k], where);
          if (n[k] < 0.0) fail(ErrorKind::Input, "{}: a bound of {}", where, n[k]);
        }
        const StatedBounds bounds{
            n[0], n[1], n[2], n[3], parse_integer(cells[4], where), parse_integer(cells[5], where)};
        const std::int64_t num_pixels =
            std::int64_t{camera.stated->width_px} * camera.stated->height_px;
        if (bounds.num_pixels != num_pixels || bounds.num_left_out < 0 ||
            bounds.num_left_out > num_pixels)
          fail(ErrorKind::Input, "{}: {} of {} pixels left out, of an image of {}", where,
               bounds.num_left_out, bounds.num_pixels, num_pixels);
        camera.bounds[frame] = bounds;
      });
}

void read_timestamps(const Dataset& dataset, const std::string& path, Sequence& sequence,
                     Findings& findings) {
  const double not_there = std::numeric_limits<double>::quiet_NaN();
  for (Camera& camera : sequence.cameras)
    camera.stamps_s.assign(static_cast<std::size_t>(sequence.num_frames), not_there);
  read_table(
      dataset, path, "frame,camera,time_s,stamp_s", sequence, findings,
      [](const Camera& camera, std::size_t frame) { return !std::isnan(camera.stamps_s[frame]); },
      [&](Camera& camera, std::size_t frame, Cells cells, const std::string& where) {
        const double time_s = parse_number(cells[0], where);
        camera.stamps_s[frame] = parse_number(cells[1], where);
        if (camera.georeference[frame] && camera.georeference[frame]->time_s != time_s)
          fail(ErrorKind::Input, "{}: time_s = {}, but {} in georeference.csv", where, time_s,
               camera.georeference[frame]->time_s);
      });
}

/// motion.csv: a row a frame.
void read_motion(const Dataset& dataset, const std::string& path, Sequence& sequence,
                 Findings& findings) {
  constexpr std::string_view kHeader =
      "frame,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,wx_radps,wy_radps,wz_radps";
  sequence.motion.resize(static_cast<std::size_t>(sequence.num_frames));
  findings.attempt(path, [&] {
    const std::string text = core::read_text_file(dataset.root / path);
    const std::vector<TextLine> lines = split_lines(text);
    const std::string with_terms = fmt::format("{},{}", kHeader, kTermColumns);
    const bool has_terms = !lines.empty() && lines[0].text == with_terms;
    if (!has_terms && (lines.empty() || lines[0].text != kHeader))
      fail(ErrorKind::Input, "{}:1: another header than {}", path, with_terms);
    const std::size_t num_columns = has_terms ? 10 + kNumTermColumns : 10;
    for (std::size_t i = 1; i < lines.size(); ++i) {
      const std::string where = path + ":" + std::to_string(lines[i].number);
      const std::vector<std::string_view> parts = split_at(lines[i].text, ',');
      if (parts.size() != num_columns)
        fail(ErrorKind::Input, "{}: {} columns, not {}", where, parts.size(), num_columns);
      const std::int64_t frame = parse_integer(parts[0], where);
      if (frame < 0 || frame >= sequence.num_frames)
        fail(ErrorKind::Input, "{}: frame {} is not in the dataset", where, frame);
      std::optional<BodyMotion>& motion = sequence.motion[static_cast<std::size_t>(frame)];
      if (motion) fail(ErrorKind::Input, "{}: frame {} stands twice", where, frame);
      std::vector<double> n;
      for (std::size_t k = 1; k < num_columns; ++k) n.push_back(parse_number(parts[k], where));
      motion = BodyMotion{{n[0], n[1], n[2]}, {n[3], n[4], n[5]}, {n[6], n[7], n[8]}};
      if (has_terms) set_terms(&n[9], where, *motion);
    }
    for (std::size_t i = 0; i < sequence.motion.size(); ++i)
      if (!sequence.motion[i]) findings.add(path, fmt::format("no row for frame {}", i));
  });
}

/// The cameras of a calibration file, in the sequence's order.
/// kind   "true" or "believed"
std::vector<Camera> read_calibration_file(const Dataset& dataset, const std::string& path,
                                          const std::string& kind, const Sequence& sequence) {
  const Json json = Json::read(dataset.root / path);
  if (json.has("format") &&
      (json.at("format").string() != "terracast-calibration" || json.at("version").integer() != 1 ||
       json.at("calibration").string() != kind))
    fail(ErrorKind::Input, "{}: \"terracast-calibration\", version 1, calibration \"{}\" are right",
         path, kind);
  const Json& cameras = json.at("cameras");
  if (!cameras.is_array() || cameras.size() != sequence.cameras.size())
    fail(ErrorKind::Input, "{}: other cameras than dataset.json has", path);
  std::vector<Camera> read;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    read.push_back(read_camera(cameras.at(i), 0));
    const Camera& known = sequence.cameras[i];
    if (read.back().name != known.name || read.back().rig != known.rig ||
        read.back().name_in_rig != known.name_in_rig)
      fail(ErrorKind::Input, "{}: camera {} ({} of rig {}) where {} stands in dataset.json", path,
           core::first_letters(read.back().name, 60),
           core::first_letters(read.back().name_in_rig, 60),
           core::first_letters(read.back().rig, 60), known.name);
    read_clock(cameras.at(i), read.back());
  }
  return read;
}

/// The calibration as it is believed to be; the true one must be dataset.json's.
std::vector<Camera> read_calibrations(const Dataset& dataset, const std::string& true_path,
                                      const std::string& believed_path, Sequence& sequence,
                                      Findings& findings) {
  findings.attempt(true_path, [&] {
    const std::vector<Camera> truth = read_calibration_file(dataset, true_path, "true", sequence);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      Camera& camera = sequence.cameras[i];
      camera.clock = truth[i].clock;
      if (truth[i].stated != camera.stated || truth[i].stated_model != camera.stated_model ||
          truth[i].shutter != camera.shutter ||
          truth[i].body_from_camera->rotation != camera.body_from_camera->rotation ||
          truth[i].body_from_camera->translation != camera.body_from_camera->translation)
        findings.add(true_path, fmt::format("camera {} is another in dataset.json", camera.name));
    }
  });
  std::vector<Camera> believed;
  findings.attempt(believed_path, [&] {
    believed = read_calibration_file(dataset, believed_path, "believed", sequence);
    for (std::size_t i = 0; i < believed.size(); ++i)
      if (believed[i].stated->width_px != sequence.cameras[i].stated->width_px ||
          believed[i].stated->height_px != sequence.cameras[i].stated->height_px)
        fail(ErrorKind::Input, "{}: camera {} has another size in dataset.json", believed_path,
             believed[i].name);
  });
  return believed;
}

/// Exchanges mounts and shutters as they are for those that are believed, or back.
void exchange_mounts(Sequence& sequence, std::vector<Camera>& believed) {
  for (std::size_t i = 0; i < believed.size(); ++i) {
    std::swap(sequence.cameras[i].body_from_camera, believed[i].body_from_camera);
    std::swap(sequence.cameras[i].shutter, believed[i].shutter);
  }
}

/// Refuses cameras and frames that the dataset cannot hold: all formats have an image of its own for every
/// frame of every camera.
/// num_cameras   in the sequence
/// num_images    of the sequences before; the sequence's are added
void check_image_count(const Dataset& dataset, const Sequence& sequence, std::size_t num_cameras,
                       std::size_t& num_images) {
  constexpr std::size_t kMostImages = 4'000'000;
  const std::size_t num_of_sequence = num_cameras * static_cast<std::size_t>(sequence.num_frames);
  if (dataset.format == "mcap") {
    // Images are messages of one file, which take some bytes each.
    constexpr std::size_t kLeastBytes = 100;
    std::error_code missing;
    const std::uintmax_t num_bytes = std::filesystem::file_size(
        dataset.root / sequence.path / (sequence.name + ".mcap"), missing);
    if (missing || num_of_sequence > num_bytes / kLeastBytes)
      fail(ErrorKind::Input,
           "dataset.json: sequences: num_frames = {} of {} cameras in \"{}\" makes {} images, "
           "which {}/{}.mcap cannot hold",
           sequence.num_frames, num_cameras, sequence.name, num_of_sequence, sequence.path,
           sequence.name);
  }
  num_images += num_of_sequence;
  if (dataset.format != "mcap" && num_images > dataset.files.size())
    fail(ErrorKind::Input,
         "dataset.json: sequences: num_frames = {} of {} cameras in \"{}\" makes {} images so far, "
         "but \"files\" lists {} files",
         sequence.num_frames, num_cameras, sequence.name, num_images, dataset.files.size());
  if (num_images > kMostImages)
    fail(ErrorKind::Input,
         "dataset.json: sequences: num_frames = {} of {} cameras in \"{}\" makes {} images so far; "
         "{} are the most",
         sequence.num_frames, num_cameras, sequence.name, num_images, kMostImages);
}

/// Masks of what moves, one a frame of each camera.
void find_moving_masks(const Dataset& dataset, Sequence& sequence, Findings& findings) {
  for (Camera& camera : sequence.cameras) {
    const std::vector<std::string> masks = numbered_files(
        dataset, sequence.moving->masks + "/" + camera.name, ".png", sequence.num_frames, findings);
    for (std::size_t frame = 0; frame < std::min(masks.size(), camera.files.size()); ++frame)
      camera.files[frame].moving = masks[frame];
  }
}

/// Which lidar the format's own files are of.
FormatScans read_lidar(const Json& json) {
  FormatScans scans;
  scans.rig = json.at("rig").string();
  scans.name = json.at("name").string();
  scans.num_points = json.at("num_points").integer();
  scans.num_after_last_frame = json.at("num_points_after_last_frame").integer();
  if (!json.has("num_points_without_label")) return scans;
  const Json& counts = json.at("num_points_without_label");
  for (const std::string_view name : core::semantic_class_names())
    if (counts.has(name)) scans.num_without_label[std::string(name)] = counts.at(name).integer();
  return scans;
}

void read_sequence(const Json& json, Dataset& dataset, std::size_t& num_images,
                   Findings& findings) {
  constexpr int kMostFrames = 1'000'000;
  Sequence sequence;
  sequence.name = json.at("name").string();
  sequence.path = json.at("path").string();
  if (!is_safe_relative_path(sequence.path) || !is_safe_relative_path(sequence.name))
    fail(ErrorKind::Input, "dataset.json: the path \"{}\" leaves the dataset", sequence.path);
  while (sequence.path.ends_with('/')) sequence.path.pop_back();
  if (!("/" + sequence.path).ends_with("/" + sequence.name))
    fail(ErrorKind::Input, "dataset.json: the path of sequence {} ends otherwise: {}",
         sequence.name, sequence.path);
  sequence.num_frames = whole_number(json.at("num_frames"), 1, kMostFrames, "num_frames");
  sequence.rate_hz = json.at("rate_hz").number();
  if (!(sequence.rate_hz > 0.0))
    fail(ErrorKind::Input, "dataset.json: rate_hz = {}", sequence.rate_hz);
  sequence.utc_start = json.at("utc_start").string();
  if (json.has("first_number")) {
    std::int64_t num_before = 0;
    for (const Sequence& before : dataset.sequences) num_before += before.num_frames;
    if (json.at("first_number").integer() != num_before)
      fail(ErrorKind::Input, "dataset.json: first_number = {} of {}, after {} frames",
           json.at("first_number").integer(), sequence.name, num_before);
  }
  const Json& origin = json.at("origin");
  sequence.origin = geodetic(origin.at("lat_deg").number(), origin.at("lon_deg").number(),
                             origin.at("height_m").number(), "dataset.json: origin");
  const Json& cameras = json.at("cameras");
  constexpr std::size_t kMostCameras = 256;
  if (cameras.size() < 1 || cameras.size() > kMostCameras)
    fail(ErrorKind::Input, "dataset.json: {} cameras in \"{}\"; 1 to {} are right", cameras.size(),
         sequence.name, kMostCameras);
  check_image_count(dataset, sequence, cameras.size(), num_images);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Camera camera = read_camera(cameras.at(i), sequence.num_frames);
    if (sequence.camera_index(camera.name) >= 0)
      fail(ErrorKind::Input, "dataset.json: camera {} stands twice", camera.name);
    check_camera_name(dataset, camera);
    sequence.cameras.push_back(std::move(camera));
  }
  const auto addition = [&](const char* name) {
    const std::string path = json.at(name).string();
    if (!is_safe_relative_path(path))
      fail(ErrorKind::Input, "dataset.json: the path \"{}\" leaves the dataset", path);
    return path;
  };
  if (!addition("georeference").starts_with(sequence.path + "/"))
    fail(ErrorKind::Input, "dataset.json: georeference of {} is outside of its path {}",
         sequence.name, sequence.path);
  read_georeference(dataset, addition("georeference"), sequence, findings);
  if (json.has("bounds")) read_bounds(dataset, addition("bounds"), sequence, findings);
  if (json.has("geometry")) sequence.geometry = addition("geometry");
  // It stands beside the other additions, of cameras that have any.
  read_imaging(dataset,
               (std::filesystem::path(addition("georeference")).parent_path() / "imaging.json")
                   .generic_string(),
               sequence, findings);
  if (json.has("motion"))
    read_motion(dataset, addition("motion"), sequence, findings);
  else if (sequence.has_rolling_shutters())
    findings.add(
        "dataset.json",
        fmt::format("sequence {} has rolling shutters, but no \"motion\" says how they move",
                    sequence.name));
  if (json.has("moving"))
    sequence.moving = read_moving(dataset, json.at("moving"), sequence.num_frames, findings);
  if (json.has("lidar")) sequence.scans = read_lidar(json.at("lidar"));
  std::vector<Camera> believed;
  if (json.has("calibration")) {
    const std::string calibration = json.at("calibration").string();
    if (calibration != "true" && calibration != "believed")
      fail(ErrorKind::Input, "dataset.json: calibration = \"{}\"; true and believed are known",
           core::first_letters(calibration, 60));
    sequence.states_belief = calibration == "believed";
    believed = read_calibrations(dataset, addition("calibration_true"),
                                 addition("calibration_believed"), sequence, findings);
  }
  if (json.has("sensor_stamps")) {
    const std::string stamps = json.at("sensor_stamps").string();
    if (stamps != "true" && stamps != "believed")
      fail(ErrorKind::Input, "dataset.json: sensor_stamps = \"{}\"; true and believed are known",
           core::first_letters(stamps, 60));
    sequence.states_sensor_stamps = stamps == "believed";
  }
  if (json.has("timestamps")) read_timestamps(dataset, addition("timestamps"), sequence, findings);
  // The format's files state what is believed, and are held against that.
  if (sequence.states_belief) exchange_mounts(sequence, believed);
  find_reader(dataset.format).read(dataset, sequence, findings);
  if (sequence.states_belief) exchange_mounts(sequence, believed);
  if (sequence.states_belief && !believed.empty()) adopt_truth(believed, sequence);
  if (sequence.moving) find_moving_masks(dataset, sequence, findings);
  for (const Camera& camera : sequence.cameras)
    if (!camera.intrinsics.is_sound())
      findings.add(sequence.path, fmt::format("{}: no sound intrinsics", camera.name));
  dataset.sequences.push_back(std::move(sequence));
}

}  // namespace

Dataset read_dataset(const std::filesystem::path& root, const std::string& format,
                     Findings& findings) {
  const std::filesystem::path file = root / "dataset.json";
  if (!std::filesystem::exists(file))
    fail(ErrorKind::Input, "{}: no dataset.json; the folder of one exported format is right",
         root.string());
  Dataset dataset;
  dataset.root = root;
  const Json json = Json::read(file, Json::kMostOfDatasets);
  dataset.format = json.at("format").string();
  const bool is_of_plugin = is_format_of_plugin(dataset.format);
  if (!is_of_plugin) find_reader(format.empty() ? dataset.format : format);
  if (!format.empty() && dataset.format != format)
    fail(ErrorKind::Input, "{}: a dataset of the format {}, not {}", file.string(), dataset.format,
         format);
  findings.attempt("dataset.json", [&] {
    dataset.world_name = json.at("world").at("name").string();
    dataset.world_input_hash = json.at("world").at("input_hash").string();
    if (json.has("sky_depth_m")) {
      dataset.sky_depth_m = static_cast<float>(json.at("sky_depth_m").number());
      if (!(dataset.sky_depth_m > 0.0F) || !std::isfinite(dataset.sky_depth_m))
        fail(ErrorKind::Input, "dataset.json: sky_depth_m = {}", dataset.sky_depth_m);
    }
    for (const auto& [path, record] : json.at("files").members()) {
      const std::int64_t num_bytes = record.at("bytes").integer();
      if (!is_safe_relative_path(path) || num_bytes < 0)
        fail(ErrorKind::Input, "dataset.json: file \"{}\" of {} bytes", path, num_bytes);
      dataset.files[path] = {static_cast<std::uint64_t>(num_bytes), record.at("xxh3_128").string()};
    }
    if (is_of_plugin) return;
    const Json& sequences = json.at("sequences");
    if (sequences.size() == 0) fail(ErrorKind::Input, "dataset.json: no sequence");
    std::size_t num_images = 0;
    for (std::size_t i = 0; i < sequences.size(); ++i)
      read_sequence(sequences.at(i), dataset, num_images, findings);
  });
  return dataset;
}

}  // namespace terracast::validate
