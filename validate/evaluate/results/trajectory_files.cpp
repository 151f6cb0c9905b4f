#include "validate/evaluate/results/trajectory_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/readers/colmap_model.h"
#include "validate/readers/tartanair_files.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostBytes = std::size_t{1} << 28;

/// Numbers with few decimals make a quaternion no longer of length 1.
constexpr double kMostOff = 0.01;

Eigen::Matrix3d rotation_of(double w, double x, double y, double z, const std::string& where) {
  const Eigen::Quaterniond rotation(w, x, y, z);
  if (std::abs(rotation.norm() - 1.0) > kMostOff)
    fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", where, rotation.norm());
  return rotation.normalized().toRotationMatrix();
}

Eigen::Vector3d place_of(double x, double y, double z, const std::string& where) {
  constexpr double kFarthest_m = 1e9;
  const Eigen::Vector3d place(x, y, z);
  if (!(place.cwiseAbs().maxCoeff() < kFarthest_m))
    fail(ErrorKind::Input, "{}: ({}, {}, {}) m is no place", where, x, y, z);
  return place;
}

/// A line that holds values, in words.
struct Row {
  std::string where;
  std::vector<std::string_view> words;

  std::vector<double> numbers() const {
    std::vector<double> values;
    for (const std::string_view word : words) values.push_back(parse_number(word, where));
    return values;
  }
  /// Whether it stands for a frame that was lost.
  bool is_lost() const {
    return std::all_of(words.begin(), words.end(), [](std::string_view word) {
      return word == "nan" || word == "NaN" || word == "-nan" || word == "NAN";
    });
  }
};

std::vector<Row> rows_of(const std::string& text, const std::string& name) {
  std::vector<Row> rows;
  for (const TextLine& line : split_lines(text)) {
    if (trimmed(line.text).starts_with('#')) continue;
    rows.push_back({name + ":" + std::to_string(line.number), split_blanks(line.text)});
  }
  while (!rows.empty() && rows.back().words.empty()) rows.pop_back();
  return rows;
}

Pose pose_from_tum(const std::vector<double>& n, const std::string& where) {
  return {rotation_of(n[7], n[4], n[5], n[6], where), place_of(n[1], n[2], n[3], where)};
}

Pose pose_from_kitti(const std::vector<double>& n, const std::string& where) {
  Pose pose;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      pose.rotation(row, column) = n[static_cast<std::size_t>(4 * row + column)];
  pose.translation = place_of(n[3], n[7], n[11], where);
  const Eigen::Matrix3d off =
      pose.rotation * pose.rotation.transpose() - Eigen::Matrix3d::Identity();
  if (off.cwiseAbs().maxCoeff() > kMostOff || pose.rotation.determinant() < 0.0)
    fail(ErrorKind::Input, "{}: the left three columns are no rotation", where);
  return pose;
}

Pose pose_from_tartanair(const std::vector<double>& n, const std::string& where) {
  Eigen::Matrix3d enu_from_ned;
  enu_from_ned << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return {enu_from_ned * rotation_of(n[6], n[3], n[4], n[5], where) * frd_from_rdf(),
          enu_from_ned * place_of(n[0], n[1], n[2], where)};
}

/// KITTI's and TartanAir's: the n-th row is frame n.
void take_rows(const std::vector<Row>& rows, std::size_t num_columns, const fs::path& file,
               Pose (*pose_from)(const std::vector<double>&, const std::string&),
               ResultTrajectory& trajectory) {
  if (rows.size() > trajectory.world_from_camera.size())
    fail(ErrorKind::Input,
         "{}: {} rows for {} frames; the n-th row is frame n, a row of {} times \"nan\" a frame "
         "that was lost",
         file.string(), rows.size(), trajectory.world_from_camera.size(), num_columns);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i].words.size() != num_columns)
      fail(ErrorKind::Input, "{}: {} columns where {} should be", rows[i].where,
           rows[i].words.size(), num_columns);
    if (!rows[i].is_lost())
      trajectory.world_from_camera[i] = pose_from(rows[i].numbers(), rows[i].where);
  }
}

void take_tum(const std::vector<Row>& rows, const Subject& subject, const fs::path& file,
              double time_offset_s, double max_time_difference_s, ResultTrajectory& trajectory) {
  const std::vector<double> times_s = frame_times_s(subject.sequence);
  std::vector<double> difference_s(times_s.size(), std::numeric_limits<double>::infinity());
  std::size_t num_unused = 0;
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
  for (const Row& row : rows) {
    if (row.words.size() != 8)
      fail(ErrorKind::Input, "{}: {} columns where 8 should be", row.where, row.words.size());
    const std::vector<double> n = row.numbers();
    const double time_s = n[0] + time_offset_s;
    first_s = std::min(first_s, time_s);
    last_s = std::max(last_s, time_s);
    auto nearest = std::lower_bound(times_s.begin(), times_s.end(), time_s);
    if (nearest == times_s.end() ||
        (nearest != times_s.begin() && time_s - *(nearest - 1) <= *nearest - time_s))
      --nearest;
    const auto frame = static_cast<std::size_t>(nearest - times_s.begin());
    const double off_s = std::abs(*nearest - time_s);
    const Pose pose = pose_from_tum(n, row.where);
    if (off_s > max_time_difference_s || off_s >= difference_s[frame]) {
      ++num_unused;
      continue;
    }
    if (trajectory.world_from_camera[frame]) ++num_unused;  // one farther off
    difference_s[frame] = off_s;
    trajectory.world_from_camera[frame] = pose;
  }
  if (num_unused == rows.size())
    fail(ErrorKind::Input,
         "{}: no time stamp within {} s of a frame's: they run from {} to {} s, the frames' from "
         "{} to {} s (--time-offset-s is added to a result's)",
         file.string(), max_time_difference_s, first_s, last_s, times_s.front(), times_s.back());
  double largest_off_s = 0.0;
  for (std::size_t i = 0; i < times_s.size(); ++i)
    if (trajectory.world_from_camera[i]) largest_off_s = std::max(largest_off_s, difference_s[i]);
  constexpr double kRoundedStamp_s = 1e-6;
  if (largest_off_s > kRoundedStamp_s)
    trajectory.notes.push_back(
        fmt::format("{}: time stamps are up to {:.3g} s from their frames', and count as theirs; "
                    "--times result "
                    "compares each row with the truth at its own time",
                    file.string(), largest_off_s));
  if (num_unused > 0)
    trajectory.notes.push_back(
        fmt::format("{}: {} of {} rows are not used: no frame within {} s, or a nearer row",
                    file.string(), num_unused, rows.size(), max_time_difference_s));
}

std::string without_extension(const std::string& path) {
  return path.substr(0, path.size() - fs::path(path).extension().string().size());
}

void take_colmap(const std::map<std::int64_t, ColmapImage>& images, const Subject& subject,
                 const fs::path& file, ResultTrajectory& trajectory) {
  const Camera& camera = subject.camera();
  // By the last part of the path, of which a camera has one a frame.
  std::map<std::string, std::size_t> frame_of;
  for (std::size_t i = 0; i < camera.files.size(); ++i)
    frame_of[without_extension(fs::path(camera.files[i].color).filename().string())] = i;
  std::size_t num_others = 0;
  for (const auto& [id, image] : images) {
    const std::string name = without_extension(image.name);
    const auto found = frame_of.find(fs::path(name).filename().string());
    const std::string path =
        found == frame_of.end() ? "" : without_extension(camera.files[found->second].color);
    if (path.empty() || (path != name && !path.ends_with("/" + name))) {
      ++num_others;
      continue;
    }
    auto& pose = trajectory.world_from_camera[found->second];
    if (pose) fail(ErrorKind::Input, "{}: image \"{}\" stands twice", file.string(), image.name);
    const auto& q = image.camera_from_world.rotation_wxyz;
    const auto& t = image.camera_from_world.translation;
    const std::string where = fmt::format("{}: image {}", file.string(), id);
    const Pose camera_from_world{rotation_of(q[0], q[1], q[2], q[3], where),
                                 place_of(t[0], t[1], t[2], where)};
    pose = camera_from_world.inverse();
  }
  if (num_others == images.size())
    fail(ErrorKind::Input, "{}: none of its {} images is one of {}, as \"{}\"", file.string(),
         images.size(), camera.name, camera.files.front().color);
  if (num_others > 0)
    trajectory.notes.push_back(fmt::format("{}: {} of {} images are not of {} and do not count",
                                           file.string(), num_others, images.size(), camera.name));
}

}  // namespace

std::vector<double> frame_times_s(const Sequence& sequence) {
  const auto num_frames = static_cast<std::size_t>(sequence.num_frames);
  std::vector<double> times_s = sequence.times_s;
  if (times_s.size() != num_frames) {
    times_s.resize(num_frames);
    for (std::size_t i = 0; i < num_frames; ++i)
      times_s[i] = static_cast<double>(i) / sequence.rate_hz;
  }
  if (!std::is_sorted(times_s.begin(), times_s.end()))
    fail(ErrorKind::Input, "{}: the frames' times do not increase", sequence.path);
  return times_s;
}

fs::path find_trajectory(const fs::path& result, const Subject& subject) {
  const bool is_only = subject.is_only_sequence && subject.is_only_camera;
  std::error_code error;
  if (!fs::exists(result, error))
    fail(ErrorKind::Input, "{}: no such file or folder", result.string());
  if (!fs::is_directory(result, error)) {
    if (!is_only)
      fail(ErrorKind::Input,
           "{}: one file for several trajectories; give a folder with {}.txt, or name one "
           "sequence and camera",
           result.string(),
           subject.is_only_camera ? subject.sequence.name
                                  : subject.sequence.name + "/" + subject.camera().name);
    return result;
  }
  std::vector<std::string> stems{subject.sequence.name + "/" + subject.camera().name};
  if (subject.is_only_camera) stems.push_back(subject.sequence.name);
  if (subject.is_only_sequence) stems.push_back(subject.camera().name);
  std::vector<std::string> tried;
  for (const std::string& stem : stems)
    for (const char* end : {".txt", ".tum", "/images.bin", "/images.txt"})
      tried.push_back(stem + end);
  if (is_only) tried.insert(tried.end(), {"images.bin", "images.txt"});
  for (const std::string& path : tried)
    if (fs::is_regular_file(result / path, error)) return result / path;
  fail(ErrorKind::Input, "{}: no trajectory there; {} was looked for", result.string(),
       fmt::join(tried, ", "));
}

TimedTrajectory read_timed_trajectory(const fs::path& file, double time_offset_s) {
  const std::string text = core::read_text_file(file, kMostBytes);
  TimedTrajectory trajectory;
  for (const Row& row : rows_of(text, file.string())) {
    if (row.words.size() != 8)
      fail(ErrorKind::Input,
           "{}: {} columns; --times result takes TUM's 8, whose rows have times of their own",
           row.where, row.words.size());
    const std::vector<double> n = row.numbers();
    const double time_s = n[0] + time_offset_s;
    if (!trajectory.times_s.empty() && !(time_s > trajectory.times_s.back()))
      fail(ErrorKind::Input, "{}: {} s after {} s; --times result takes rows sorted by time",
           row.where, time_s, trajectory.times_s.back());
    trajectory.times_s.push_back(time_s);
    trajectory.world_from_camera.emplace_back(pose_from_tum(n, row.where));
  }
  if (trajectory.times_s.empty()) fail(ErrorKind::Input, "{}: no poses in it", file.string());
  return trajectory;
}

FilledTrajectory fill_gaps(const TimedTrajectory& trajectory,
                           std::span<const double> frame_times_s) {
  constexpr double kLongest = 1.5, kMostFilled = 1e6;
  const std::vector<double>& times_s = trajectory.times_s;
  FilledTrajectory filled;
  const auto begin = frame_times_s.empty()
                         ? times_s.end()
                         : std::lower_bound(times_s.begin(), times_s.end(), frame_times_s.front());
  const auto end =
      frame_times_s.empty() ? begin : std::upper_bound(begin, times_s.end(), frame_times_s.back());
  if (begin == end || frame_times_s.size() < 2) {
    filled.rows = trajectory;
    return filled;
  }
  const double first_s = frame_times_s.front(), last_s = frame_times_s.back();
  std::vector<double> intervals_s;
  for (auto row = begin + 1; row < end; ++row) intervals_s.push_back(*row - *(row - 1));
  if (intervals_s.empty())
    intervals_s.push_back((last_s - first_s) / static_cast<double>(frame_times_s.size() - 1));
  const auto median = intervals_s.begin() + static_cast<std::ptrdiff_t>(intervals_s.size() / 2);
  std::nth_element(intervals_s.begin(), median, intervals_s.end());
  filled.interval_s = *median;
  const double step_s = std::max(filled.interval_s, (last_s - first_s) / kMostFilled);

  const auto add_lacking = [&](double time_s) {
    filled.rows.times_s.push_back(time_s);
    filled.rows.world_from_camera.emplace_back();
    ++filled.num_filled;
  };
  const auto add_rows = [&](auto from, auto to) {
    for (auto row = from; row < to; ++row) {
      filled.rows.times_s.push_back(*row);
      filled.rows.world_from_camera.push_back(
          trajectory.world_from_camera[static_cast<std::size_t>(row - times_s.begin())]);
    }
  };
  add_rows(times_s.begin(), begin);
  for (auto k = static_cast<std::int64_t>((*begin - first_s) / step_s); k > 0; --k)
    if (const double time_s = *begin - static_cast<double>(k) * step_s; time_s >= first_s)
      add_lacking(time_s);
  for (auto row = begin; row < end; ++row) {
    add_rows(row, row + 1);
    const bool is_last = row + 1 == end;
    if (!is_last && *(row + 1) - *row <= kLongest * step_s) continue;
    const double until_s = is_last ? last_s : *(row + 1) - 0.5 * step_s;
    for (std::int64_t k = 1; *row + static_cast<double>(k) * step_s <= until_s; ++k)
      add_lacking(*row + static_cast<double>(k) * step_s);
  }
  add_rows(end, times_s.end());
  return filled;
}

ResultTrajectory read_trajectory(const fs::path& file, const Subject& subject, double time_offset_s,
                                 double max_time_difference_s) {
  ResultTrajectory trajectory;
  trajectory.world_from_camera.resize(static_cast<std::size_t>(subject.sequence.num_frames));
  if (file.filename() == "images.bin" || file.filename() == "images.txt") {
    trajectory.form = "COLMAP";
    take_colmap(file.extension() == ".bin" ? read_colmap_images_binary(file)
                                           : read_colmap_images_text(file),
                subject, file, trajectory);
    return trajectory;
  }
  const std::string text = core::read_text_file(file, kMostBytes);
  const std::vector<Row> rows = rows_of(text, file.string());
  if (rows.empty()) fail(ErrorKind::Input, "{}: no poses in it", file.string());
  switch (rows.front().words.size()) {
    case 8:
      trajectory.form = "TUM";
      take_tum(rows, subject, file, time_offset_s, max_time_difference_s, trajectory);
      break;
    case 12: {
      trajectory.form = "KITTI";
      take_rows(rows, 12, file, &pose_from_kitti, trajectory);
      const std::optional<Pose>& first = subject.camera().local_from_camera.front();
      if (first)
        for (std::optional<Pose>& pose : trajectory.world_from_camera)
          if (pose) pose = *first * *pose;
      break;
    }
    case 7:
      trajectory.form = "TartanAir";
      take_rows(rows, 7, file, &pose_from_tartanair, trajectory);
      break;
    default:
      fail(ErrorKind::Input,
           "{}: {} columns; 8 (TUM), 12 (KITTI) or 7 (TartanAir) are right, or COLMAP's images.txt "
           "or images.bin",
           rows.front().where, rows.front().words.size());
  }
  if (std::none_of(trajectory.world_from_camera.begin(), trajectory.world_from_camera.end(),
                   [](const auto& pose) { return pose.has_value(); }))
    fail(ErrorKind::Input, "{}: no pose of any frame", file.string());
  return trajectory;
}

}  // namespace terracast::validate
