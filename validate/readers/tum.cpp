#include "validate/readers/tum.h"

#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/printable.h"
#include "validate/geodesy.h"
#include "validate/readers/euroc_inertial.h"
#include "validate/readers/named_files.h"
#include "validate/readers/stated_model.h"
#include "validate/readers/terracast_arrays.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// When the frames of a sequence were taken.
struct Clock {
  std::int64_t start_ns = 0;
  double rate_hz = 0.0;
  int num_frames = 0;

  std::int64_t stamp_ns(double time_s) const { return start_ns + std::llround(1e9 * time_s); }
  std::int64_t frame_ns(std::size_t frame) const {
    return stamp_ns(static_cast<double>(frame) / rate_hz);
  }
};

/// A row's cells, of which the first is its stamp.
struct Row {
  std::int64_t stamp_ns = 0;
  std::vector<std::string_view> cells;
  std::string where;
};

/// Nanoseconds of "1750500000.123456789".
std::int64_t parse_stamp(std::string_view text, const std::string& where) {
  constexpr std::size_t kDecimals = 9;
  const std::size_t point = text.find('.');
  if (point == std::string_view::npos || text.size() - point - 1 != kDecimals)
    fail(ErrorKind::Input, "{}: a stamp without nine decimals", where);
  return parse_integer(std::string(text.substr(0, point)) + std::string(text.substr(point + 1)),
                       where);
}

/// The rows of a file. Single blanks part their cells: evo takes no others.
/// text         is viewed
/// num_heads    so many lines, which begin with #, come first: some readers skip them by their number
/// num_cells    of each row
std::vector<Row> read_rows(std::string_view text, const std::string& path, std::size_t num_heads,
                           std::size_t num_cells) {
  std::vector<Row> rows;
  for (const TextLine& line : split_lines(text)) {
    const std::string where = path + ":" + std::to_string(line.number);
    const bool is_head = line.number <= num_heads;
    if (line.text.starts_with("#") != is_head)
      fail(ErrorKind::Input, "{}: {} lines that begin with # come first, and no others", where,
           num_heads);
    if (is_head) continue;
    std::vector<std::string_view> cells = split_at(line.text, ' ');
    if (cells.size() != num_cells)
      fail(ErrorKind::Input, "{}: {} cells parted by single blanks, not {}", where, cells.size(),
           num_cells);
    const std::int64_t stamp_ns = parse_stamp(cells[0], where);
    rows.push_back({stamp_ns, std::move(cells), where});
  }
  return rows;
}

/// A row a frame, each stamped by its time.
void check_stamps(const std::vector<Row>& rows, const std::string& path, const Clock& clock) {
  if (rows.size() != static_cast<std::size_t>(clock.num_frames))
    fail(ErrorKind::Input, "{}: {} rows for {} frames", path, rows.size(), clock.num_frames);
  for (std::size_t frame = 0; frame < rows.size(); ++frame)
    if (rows[frame].stamp_ns != clock.frame_ns(frame))
      fail(ErrorKind::Input, "{}: {}", rows[frame].where,
           stamp_difference(rows[frame].stamp_ns, clock.frame_ns(frame), clock.start_ns));
}

/// The cell behind a stamp, which names the file of that stamp.
void check_file(const Row& row, std::size_t cell, const char* folder) {
  const std::string right = fmt::format("{}/{}.png", folder, row.cells[0]);
  if (row.cells[cell] != right)
    fail(ErrorKind::Input, "{}: the file is {}, not {}", row.where,
         core::first_letters(std::string(row.cells[cell]), 80), right);
}

/// The stamps of a list of files, as they are written.
std::vector<std::string> read_list(const std::string& text, const std::string& path,
                                   const char* folder, const Clock& clock) {
  constexpr std::size_t kHeads = 3;
  const std::vector<Row> rows = read_rows(text, path, kHeads, 2);
  check_stamps(rows, path, clock);
  std::vector<std::string> stamps;
  for (const Row& row : rows) {
    check_file(row, 1, folder);
    stamps.emplace_back(row.cells[0]);
  }
  return stamps;
}

/// What a metre counts, of the second line of depth.txt: "# depth_factor: 5000".
double read_depth_factor(const std::string& text, const std::string& path) {
  constexpr std::string_view kStart = "# depth_factor: ";
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.size() < 2 || !lines[1].text.starts_with(kStart))
    fail(ErrorKind::Input, "{}:2: \"{}…\" is right", path, kStart);
  const double factor = parse_number(lines[1].text.substr(kStart.size()), path + ":2");
  if (!(factor > 0.0)) fail(ErrorKind::Input, "{}:2: a factor of {}", path, factor);
  return factor;
}

void check_associations(const std::string& text, const std::string& path, const Clock& clock) {
  const std::vector<Row> rows = read_rows(text, path, 0, 4);
  check_stamps(rows, path, clock);
  for (const Row& row : rows) {
    if (row.cells[2] != row.cells[0])
      fail(ErrorKind::Input, "{}: two stamps, {} and {}, of one frame", row.where, row.cells[0],
           core::first_letters(std::string(row.cells[2]), 60));
    check_file(row, 1, "rgb");
    check_file(row, 3, "depth");
  }
}

/// The poses of a file, with their rows.
struct StampedPoses {
  std::vector<Row> rows;
  std::vector<Pose> local_from_source;
};

/// text   is viewed
StampedPoses read_poses(const std::string& text, const std::string& path) {
  constexpr std::size_t kHeads = 3, kCells = 8;
  StampedPoses poses{.rows = read_rows(text, path, kHeads, kCells), .local_from_source = {}};
  for (const Row& row : poses.rows) {
    double n[7];
    for (std::size_t i = 0; i < 7; ++i) n[i] = parse_number(row.cells[i + 1], row.where);
    const Eigen::Quaterniond q(n[6], n[3], n[4], n[5]);
    if (!(std::abs(q.norm() - 1.0) <= 1e-9))
      fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", row.where, q.norm());
    poses.local_from_source.push_back({q.normalized().toRotationMatrix(), {n[0], n[1], n[2]}});
  }
  return poses;
}

/// When and where something was, for a file of poses.
struct RightPose {
  std::int64_t stamp_ns = 0;
  Pose local_from_source;
};

void check_poses(const Dataset& dataset, const std::string& path,
                 const std::vector<RightPose>& right, const Clock& clock) {
  constexpr double kPlace_m = 5e-8, kAngle_rad = 1e-11;  // nine decimals, and fifteen
  const std::string text = core::read_text_file(dataset.root / path);
  const StampedPoses found = read_poses(text, path);
  if (found.rows.size() != right.size())
    fail(ErrorKind::Input, "{}: {} rows where {} are right", path, found.rows.size(), right.size());
  for (std::size_t i = 0; i < right.size(); ++i) {
    const Row& row = found.rows[i];
    if (row.stamp_ns != right[i].stamp_ns)
      fail(ErrorKind::Input, "{}: {}", row.where,
           stamp_difference(row.stamp_ns, right[i].stamp_ns, clock.start_ns));
    const Pose off = right[i].local_from_source.inverse() * found.local_from_source[i];
    if (!(off.translation.norm() <= kPlace_m) || !(rotation_angle_rad(off.rotation) <= kAngle_rad))
      fail(ErrorKind::Input, "{}: {:.3g} m and {:.3g} deg off", row.where, off.translation.norm(),
           degrees_from_radians(rotation_angle_rad(off.rotation)));
  }
}

/// The depth along the optical axis of a metre along each pixel's ray.
std::vector<double> depths_of_rays(const Intrinsics& camera) {
  std::vector<double> depths;
  for (int y = 0; y < camera.height_px; ++y)
    for (int x = 0; x < camera.width_px; ++x)
      depths.push_back(camera.ray_from_pixel({x + 0.5, y + 0.5}).z());
  return depths;
}

/// An image of depth against the ranges beside it.
/// ranges   empty: there are none
void check_depth(const Dataset& dataset, const Camera& camera, const std::string& path,
                 const std::string& ranges, const std::vector<double>& depth_of_ray,
                 double factor) {
  // Ranges are float32, and so was the depth that was rounded.
  constexpr double kMostCounts = 65535.0, kHalf = 0.52;
  const core::Image16 counts = read_png16(dataset.root / path, path, 1, camera.intrinsics);
  if (ranges.empty()) return;
  const core::ImageF range_m = read_range(dataset, ranges, camera.intrinsics);
  for (std::size_t i = 0; i < counts.data().size(); ++i) {
    const auto found = static_cast<double>(counts.data()[i]);
    const double right = factor * depth_of_ray[i] * static_cast<double>(range_m.data()[i]);
    const bool is_left_out = !(right > kHalf) || right > kMostCounts + 1.0 - kHalf;
    if (found == 0.0 ? is_left_out : std::abs(found - right) <= kHalf) continue;
    fail(ErrorKind::Input, "{} is {} where {} is right: {:.6g} m, {} a metre",
         pixel_text(path, i, camera.intrinsics.width_px), found,
         is_left_out ? "0" : fmt::format("{:.1f}", right), right / factor, factor);
  }
}

void check_depths(const Dataset& dataset, const Camera& camera,
                  const std::vector<std::string>& paths, double factor, Findings& findings) {
  if (!camera.intrinsics.is_sound() || !camera.intrinsics.plane) return;
  const std::vector<double> depth_of_ray = depths_of_rays(camera.intrinsics);
  core::parallel_for(static_cast<std::int64_t>(paths.size()), [&](std::int64_t i) {
    const auto frame = static_cast<std::size_t>(i);
    if (!paths[frame].empty())
      findings.attempt(paths[frame], [&] {
        check_depth(dataset, camera, paths[frame], camera.files[frame].depth, depth_of_ray, factor);
      });
  });
}

void read_camera(const Dataset& dataset, const Sequence& sequence, const Clock& clock,
                 Camera& camera, Findings& findings) {
  if (camera.stated && findings.attempt("dataset.json", [&] { complete_stated(camera); }))
    camera.intrinsics = *camera.stated;
  const std::string folder = sequence.path + "/" + camera.name;
  const auto attempt = [&](const char* file, const auto& work) {
    const std::string path = folder + "/" + file;
    return findings.attempt(path, [&] { work(core::read_text_file(dataset.root / path), path); });
  };
  const auto files = [&](const std::vector<std::string>& stamps, const char* of, const char* suffix,
                         bool is_optional) {
    std::vector<std::string> names;
    for (const std::string& stamp : stamps) names.push_back(stamp + suffix);
    return named_files(dataset, folder + "/" + of, names, is_optional, findings);
  };
  attempt("rgb.txt", [&](const std::string& text, const std::string& path) {
    const std::vector<std::string> stamps = read_list(text, path, "rgb", clock);
    const std::vector<std::string> images = files(stamps, "rgb", ".png", false);
    for (std::size_t i = 0; i < images.size(); ++i) camera.files[i].color = images[i];
    const std::vector<std::string> ranges = files(stamps, "range", ".npy", true);
    if (camera.intrinsics.plane)
      for (std::size_t i = 0; i < ranges.size(); ++i) camera.files[i].depth = ranges[i];
  });
  attempt("depth.txt", [&](const std::string& text, const std::string& path) {
    const double factor = read_depth_factor(text, path);
    const std::vector<std::string> stamps = read_list(text, path, "depth", clock);
    check_depths(dataset, camera, files(stamps, "depth", ".png", false), factor, findings);
  });
  attempt("associations.txt", [&](const std::string& text, const std::string& path) {
    check_associations(text, path, clock);
  });
  attempt("groundtruth.txt", [&](const std::string& text, const std::string& path) {
    const StampedPoses poses = read_poses(text, path);
    check_stamps(poses.rows, path, clock);
    for (std::size_t i = 0; i < poses.local_from_source.size(); ++i)
      camera.local_from_camera[i] = poses.local_from_source[i];
  });
}

/// The body by the first camera's poses and its place on the body.
std::vector<RightPose> right_poses_of_body(const Sequence& sequence, const Clock& clock) {
  std::vector<RightPose> right;
  const Camera& camera = sequence.cameras.front();
  if (!camera.body_from_camera) return right;
  for (std::size_t frame = 0; frame < camera.local_from_camera.size(); ++frame)
    if (camera.local_from_camera[frame])
      right.push_back({clock.frame_ns(frame),
                       *camera.local_from_camera[frame] * camera.body_from_camera->inverse()});
  return right;
}

}  // namespace

void TumReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  Clock clock{.rate_hz = sequence.rate_hz, .num_frames = sequence.num_frames};
  std::vector<SensorRecord> imus;
  const bool is_known = findings.attempt(sequence.path + "/sensors.json", [&] {
    clock.start_ns = parse_utc_ns(sequence.utc_start, "dataset.json: utc_start");
    imus = euroc_imus(dataset, sequence);
  });
  if (!is_known) return;
  for (Camera& camera : sequence.cameras) read_camera(dataset, sequence, clock, camera, findings);
  const std::vector<RightPose> of_body = right_poses_of_body(sequence, clock);
  // What else is wrong with the camera's poses was told.
  if (of_body.size() == static_cast<std::size_t>(sequence.num_frames)) {
    const std::string path = sequence.path + "/trajectories/body.txt";
    findings.attempt(path, [&] { check_poses(dataset, path, of_body, clock); });
  }
  const Pose local_from_ecef = ecef_from_local(sequence.origin).inverse();
  for (const SensorRecord& imu : imus) {
    const std::string path =
        fmt::format("{}/trajectories/{}/{}.txt", sequence.path, imu.rig, imu.name);
    findings.attempt(path, [&] {
      std::vector<RightPose> right;
      for (std::size_t k = 0; k < imu.times_s.size(); ++k)
        if (const auto state = imu.imu_state(k))
          right.push_back(
              {clock.stamp_ns(imu.times_s[k]), local_from_ecef * state->ecef_from_sensor});
      check_poses(dataset, path, right, clock);
    });
  }
}

core::ImageF TumReader::depth(const Dataset& dataset, const Camera& camera, int frame) const {
  return read_range(dataset, camera.files[static_cast<std::size_t>(frame)].depth,
                    camera.intrinsics);
}

}  // namespace terracast::validate
