#include "tests/validate/mutations.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <sstream>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "core/json.h"
#include "tests/validate/analytic_writer.h"
#include "validate/npy.h"

namespace terracast::test {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;
namespace fs = std::filesystem;

const std::vector<std::string> kAll = {"tartanair", "tartanair_v1", "kitti", "kitti_raw", "colmap"};
const std::vector<std::string> kFlow = {"tartanair", "tartanair_v1"};
const std::vector<std::string> kCalibrated = {"kitti", "kitti_raw", "colmap"};

bool is_tartan(const RightDataset& d) { return d.format.starts_with("tartanair"); }

// ---------------------------------------------------------------- where files stand

std::string sequence_path(const RightDataset& d) {
  if (d.format == "kitti") return "dataset/sequences/00";
  if (d.format == "kitti_raw") return "2024_06_21/2024_06_21_drive_0005_sync";
  if (d.format == "tartanair") return "Hills/Data_easy/P000";
  if (d.format == "tartanair_v1") return "Hills/Easy/P000";
  return "flight";
}

fs::path color_file(const RightDataset& d, std::size_t c, std::size_t f) {
  const std::string name = d.recording.cameras[c].name;
  const fs::path base = sequence_path(d);
  if (d.format == "kitti") return base / name / (digits(f) + ".png");
  if (d.format == "kitti_raw") return base / name / "data" / fmt::format("{:010}.png", f);
  if (is_tartan(d)) return base / ("image_" + name) / (digits(f) + "_" + name + ".png");
  return base / "images" / name / (digits(f) + ".png");
}

/// Empty where the camera has no depth.
fs::path depth_file(const RightDataset& d, std::size_t c, std::size_t f) {
  const std::string name = d.recording.cameras[c].name;
  const fs::path base = sequence_path(d);
  if (d.format == "kitti") return c > 0 ? fs::path() : base / "depth_2" / (digits(f) + ".npy");
  if (d.format == "kitti_raw")
    return c > 0 ? fs::path() : base / "depth_02/data" / fmt::format("{:010}.npy", f);
  if (is_tartan(d))
    return base / ("depth_" + name) /
           (digits(f) + "_" + name + (d.format == "tartanair" ? "_depth.png" : "_depth.npy"));
  return base / "depth" / name / (digits(f) + ".npy");
}

fs::path georeference_file(const RightDataset& d) { return sequence_path(d) + "/georeference.csv"; }

// ---------------------------------------------------------------- colours, depth, classes

void edit_colors(const RightDataset& d, const fs::path& folder, std::size_t first_camera,
                 const std::function<core::Image8(std::size_t c, std::size_t f)>& color) {
  for (std::size_t c = first_camera; c < d.recording.cameras.size(); ++c)
    for (std::size_t f = 0; f < d.recording.body_world.size(); ++f)
      core::write_file(folder / color_file(d, c, f), core::encode_png(color(c, f)));
}

float sky_of(const RightDataset& d) { return is_tartan(d) ? 1e5F : 0.0F; }

/// A depth image as bytes, as the format stores it.
void write_depth(const RightDataset& d, const fs::path& folder, std::size_t c, std::size_t f,
                 const std::vector<float>& values) {
  const SceneCamera& camera = d.recording.cameras[c];
  const fs::path file = folder / depth_file(d, c, f);
  if (d.format == "tartanair") {
    core::Image8 rgba(camera.width, camera.height, 4);
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::uint8_t bytes[4];
      std::memcpy(bytes, &values[i], 4);
      const int order[4] = {2, 1, 0, 3};
      for (std::size_t k = 0; k < 4; ++k) rgba.data()[4 * i + k] = bytes[order[k]];
    }
    core::write_file(file, core::encode_png(rgba));
    return;
  }
  core::write_file(file, npy_bytes("<f4",
                                   {static_cast<std::size_t>(camera.height),
                                    static_cast<std::size_t>(camera.width)},
                                   values.data(), values.size() * 4));
}

/// Writes all depths anew: a function of the true depth (infinite for sky) and the pixel's ray.
void edit_depths(const RightDataset& d, const fs::path& folder,
                 const std::function<double(double depth_m, const Vector3d& ray)>& change) {
  for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
    for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
      if (depth_file(d, c, f).empty()) continue;
      const SceneCamera& camera = d.recording.cameras[c];
      std::vector<float> values;
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
          const Vector3d ray((x + 0.5 - 0.5 * camera.width) / camera.focal_px,
                             (y + 0.5 - 0.5 * camera.height) / camera.focal_px, 1.0);
          const double value = change(d.recording.depth[c][f](x, y), ray);
          values.push_back(std::isfinite(value) ? static_cast<float>(value) : sky_of(d));
        }
      write_depth(d, folder, c, f, values);
    }
}

/// A number that went through a 32-bit float. Volatile: g++ 12 at -O2 drops two such conversions
/// that stand side by side.
double single(double value) {
  const volatile float rounded = static_cast<float>(value);
  return static_cast<double>(rounded);
}

void copy_over(const fs::path& from, const fs::path& to) {
  core::write_file(to, core::read_text_file(from));
}

void write_classes(const RightDataset& d, const fs::path& folder, std::size_t c, std::size_t f,
                   const core::Image8& classes) {
  const std::string name = d.recording.cameras[c].name;
  const fs::path file =
      folder / sequence_path(d) / ("seg_" + name) /
      (digits(f) + "_" + name + (d.format == "tartanair" ? "_seg.png" : "_seg.npy"));
  if (d.format == "tartanair")
    core::write_file(file, core::encode_png(classes));
  else
    core::write_file(file, npy_bytes("|u1",
                                     {static_cast<std::size_t>(classes.height()),
                                      static_cast<std::size_t>(classes.width())},
                                     classes.data().data(), classes.data().size()));
}

// ---------------------------------------------------------------- text

std::vector<std::string> lines_of(const fs::path& file) {
  std::istringstream text(core::read_text_file(file));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}
void write_lines(const fs::path& file, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  core::write_file(file, text);
}
std::vector<double> numbers_of(std::string line, char separator = ' ') {
  std::replace(line.begin(), line.end(), separator, ' ');
  std::istringstream text(line);
  std::vector<double> numbers;
  for (double value; text >> value;) numbers.push_back(value);
  return numbers;
}
std::string joined(const std::vector<double>& numbers) {
  std::string text;
  for (const double value : numbers)
    text += fmt::format("{}{:.15g}", text.empty() ? "" : " ", value);
  return text;
}

/// Columns of georeference.csv: time, latitude, longitude, height, w, x, y, z.
void edit_georeference(const RightDataset& d, const fs::path& folder,
                       const std::function<void(std::array<double, 8>&)>& change) {
  const fs::path file = folder / georeference_file(d);
  std::vector<std::string> lines = lines_of(file);
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::size_t second = lines[i].find(',', lines[i].find(',') + 1);
    const std::vector<double> n = numbers_of(lines[i].substr(second + 1), ',');
    std::array<double, 8> row{};
    std::copy(n.begin(), n.end(), row.begin());
    change(row);
    lines[i] = lines[i].substr(0, second) +
               fmt::format(",{:.12g},{:.13f},{:.13f},{:.6f},{:.17g},{:.17g},{:.17g},{:.17g}",
                           row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7]);
  }
  write_lines(file, lines);
}

/// Thirty numbers of each packet.
void edit_packets(const RightDataset& d, const fs::path& folder,
                  const std::function<void(std::vector<double>&)>& change) {
  for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
    const fs::path file = folder / sequence_path(d) / "oxts/data" / fmt::format("{:010}.txt", f);
    std::vector<double> numbers = numbers_of(core::read_text_file(file));
    change(numbers);
    core::write_file(
        file, fmt::format("{:.13f} {:.13f} {:.6f}", numbers[0], numbers[1], numbers[2]) + " " +
                  joined({numbers.begin() + 3, numbers.end()}) + "\n");
  }
}

// ---------------------------------------------------------------- calibration

struct Calibration {
  double focal_factor = 1.0;
  Vector2d centre_px = Vector2d::Zero();  ///< added
  double baseline_factor = 1.0;
  double size_factor = 1.0;
};

/// Calibration files of all cameras; of the last one in COLMAP and TartanAir where it is a baseline.
void edit_calibration(const RightDataset& d, const fs::path& folder, const Calibration& wrong) {
  // A size factor takes the principal point with it.
  const auto matrix = [&](std::vector<double> n) {
    const double half = 0.5;  // centres at whole numbers
    n[0] *= wrong.focal_factor * wrong.size_factor;
    n[5] *= wrong.focal_factor * wrong.size_factor;
    n[2] = (n[2] + half) * wrong.size_factor - half + wrong.centre_px.x();
    n[6] = (n[6] + half) * wrong.size_factor - half + wrong.centre_px.y();
    n[3] *= wrong.focal_factor * wrong.baseline_factor * wrong.size_factor;
    return n;
  };
  if (d.format == "kitti") {
    const fs::path file = folder / sequence_path(d) / "calib.txt";
    std::vector<std::string> lines = lines_of(file);
    for (std::string& line : lines)
      if (line[0] == 'P') line = line.substr(0, 4) + joined(matrix(numbers_of(line.substr(4))));
    write_lines(file, lines);
  } else if (d.format == "kitti_raw") {
    const fs::path file = folder / "2024_06_21/calib_cam_to_cam.txt";
    std::vector<std::string> lines = lines_of(file);
    for (std::string& line : lines) {
      const std::size_t colon = line.find(':');
      const std::string key = line.substr(0, colon + 2);
      if (line.starts_with("P_rect")) {
        line = key + joined(matrix(numbers_of(line.substr(colon + 1))));
      } else if (line.starts_with("K_")) {
        const std::vector<double> k = numbers_of(line.substr(colon + 1));
        const std::vector<double> p = matrix({k[0], 0, k[2], 0, 0, k[4], k[5], 0, 0, 0, 1, 0});
        line = key + joined({p[0], 0, p[2], 0, p[5], p[6], 0, 0, 1});
      } else if (line.starts_with("T_")) {
        std::vector<double> t = numbers_of(line.substr(colon + 1));
        t[0] *= wrong.baseline_factor;
        line = key + joined(t);
      }
    }
    write_lines(file, lines);
  } else {
    Mistake mistake;
    mistake.colmap.written_camera = [&](int& width, int& height, std::array<double, 4>& p) {
      width = static_cast<int>(wrong.size_factor * width);
      height = static_cast<int>(wrong.size_factor * height);
      for (std::size_t k = 0; k < 4; ++k) p[k] *= wrong.size_factor;
      p[0] *= wrong.focal_factor;
      p[1] *= wrong.focal_factor;
      p[2] += wrong.centre_px.x();
      p[3] += wrong.centre_px.y();
    };
    write_colmap(d.recording, folder, mistake);
  }
}

// ---------------------------------------------------------------- poses

SaidPose true_pose(const RightDataset& d, std::size_t c, std::size_t f) {
  return {d.longer.rotation(c, f), d.longer.centre(c, f)};
}

/// Rows of the pose file as matrices; COLMAP's images (and frames) likewise.
using RawChange = std::function<void(Matrix3d&, Vector3d&)>;
void edit_raw_poses(const RightDataset& d, const fs::path& folder, const RawChange& change) {
  if (d.format == "colmap") {
    Mistake mistake;
    mistake.colmap.raw_pose = [&](Quaterniond& q, Vector3d& t) {
      Matrix3d r = q.toRotationMatrix();
      change(r, t);
      q = Quaterniond(r);
    };
    write_colmap(d.recording, folder, mistake);
    return;
  }
  if (is_tartan(d)) {
    for (const SceneCamera& camera : d.recording.cameras) {
      const fs::path file = folder / sequence_path(d) / ("pose_" + camera.name + ".txt");
      std::vector<std::string> lines = lines_of(file);
      for (std::string& line : lines) {
        const std::vector<double> n = numbers_of(line);
        Matrix3d r = Quaterniond(n[6], n[3], n[4], n[5]).toRotationMatrix();
        Vector3d t(n[0], n[1], n[2]);
        change(r, t);
        const Quaterniond q(r);
        line = joined({t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
      }
      write_lines(file, lines);
    }
    return;
  }
  const fs::path file = folder / (d.format == "kitti" ? fs::path("dataset/poses/00.txt")
                                                      : fs::path(sequence_path(d)) / "poses.txt");
  std::vector<std::string> lines = lines_of(file);
  for (std::string& line : lines) {
    const std::vector<double> n = numbers_of(line);
    Matrix3d r;
    r << n[0], n[1], n[2], n[4], n[5], n[6], n[8], n[9], n[10];
    Vector3d t(n[3], n[7], n[11]);
    change(r, t);
    line = joined({r(0, 0), r(0, 1), r(0, 2), t[0], r(1, 0), r(1, 1), r(1, 2), t[1], r(2, 0),
                   r(2, 1), r(2, 2), t[2]});
  }
  write_lines(file, lines);
}

/// Writes poses of the pose file anew, from world-from-camera of each camera and frame; KITTI's in
/// the true first one.
void write_poses(const RightDataset& d, const fs::path& folder,
                 const std::function<SaidPose(std::size_t c, std::size_t f)>& pose) {
  const std::size_t num_frames = d.recording.body_world.size();
  if (d.format == "colmap") {
    Mistake mistake;
    mistake.colmap.written_pose = pose;
    write_colmap(d.recording, folder, mistake);
    return;
  }
  if (is_tartan(d)) {
    Matrix3d ned_from_enu;
    ned_from_enu << 0, 1, 0, 1, 0, 0, 0, 0, -1;
    for (std::size_t c = 0; c < d.recording.cameras.size(); ++c) {
      std::vector<std::string> lines;
      for (std::size_t f = 0; f < num_frames; ++f) {
        const SaidPose p = pose(c, f);
        Matrix3d frd;
        frd << p.rotation.col(2), p.rotation.col(0), p.rotation.col(1);
        const Quaterniond q(ned_from_enu * frd);
        const Vector3d t = ned_from_enu * p.centre;
        lines.push_back(joined({t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}));
      }
      write_lines(folder / sequence_path(d) / ("pose_" + d.recording.cameras[c].name + ".txt"),
                  lines);
    }
    return;
  }
  const SaidPose first = true_pose(d, 0, 0);
  std::vector<std::string> lines;
  for (std::size_t f = 0; f < num_frames; ++f) {
    const SaidPose p = pose(0, f);
    const Matrix3d r = first.rotation.transpose() * p.rotation;
    const Vector3d t = first.rotation.transpose() * (p.centre - first.centre);
    lines.push_back(joined({r(0, 0), r(0, 1), r(0, 2), t[0], r(1, 0), r(1, 1), r(1, 2), t[1],
                            r(2, 0), r(2, 1), r(2, 2), t[2]}));
  }
  write_lines(folder / (d.format == "kitti" ? fs::path("dataset/poses/00.txt")
                                            : fs::path(sequence_path(d)) / "poses.txt"),
              lines);
}

// ---------------------------------------------------------------- flow

struct Flow {
  std::vector<Vector2d> flow;
  std::vector<bool> in_view, covisible;
};

/// From frame to frame, in closed form, of the left camera; the principal point may be off.
Flow flow_between(const RightDataset& d, std::size_t from, std::size_t to, double off_px = 0.0) {
  const SceneCamera& camera = d.recording.cameras[0];
  Flow result;
  const double f = camera.focal_px, cx = 0.5 * camera.width + off_px,
               cy = 0.5 * camera.height + off_px;
  // Depth of the longer path's frames is unknown: only `to` may lie beyond the images.
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vector3d ray((x + 0.5 - cx) / f, (y + 0.5 - cy) / f, 1.0);
      const double depth_m = d.recording.depth[0][from](x, y);
      const bool is_sky = !std::isfinite(depth_m);
      const Vector3d world = d.longer.rotation(0, from) * (ray * (is_sky ? 1.0 : depth_m));
      const Vector3d moved = d.longer.centre(0, from) - d.longer.centre(0, to);
      const Vector3d there =
          d.longer.rotation(0, to).transpose() * (is_sky ? world : Vector3d(world + moved));
      const Vector2d at(f * there.x() / there.z() + cx, f * there.y() / there.z() + cy);
      result.flow.push_back(at - Vector2d(x + 0.5, y + 0.5));
      const bool in_view = there.z() > 0.0 && at.x() >= 0.0 && at.y() >= 0.0 &&
                           at.x() < camera.width && at.y() < camera.height;
      result.in_view.push_back(in_view);
      result.covisible.push_back(in_view && !is_sky);
    }
  return result;
}

/// Writes the flow of each pair anew: forward of what `forward` says, backward likewise.
using FlowOf = std::function<Flow(std::size_t f)>;
void write_flows(const RightDataset& d, const fs::path& folder, const FlowOf& forward,
                 const FlowOf& backward) {
  const SceneCamera& camera = d.recording.cameras[0];
  const auto width = static_cast<std::size_t>(camera.width);
  const auto height = static_cast<std::size_t>(camera.height);
  const std::size_t count = width * height;
  for (std::size_t f = 0; f + 1 < d.recording.body_world.size(); ++f) {
    const Flow flows[2] = {forward(f), d.format == "tartanair" ? backward(f) : Flow{}};
    if (d.format == "tartanair") {
      std::map<std::string, std::string> arrays;
      for (const bool is_forward : {true, false}) {
        const Flow& flow = flows[is_forward ? 0 : 1];
        std::vector<float> values(2 * count);
        std::vector<std::uint8_t> in_view(count), covisible(count);
        for (std::size_t i = 0; i < count; ++i) {
          values[i] = static_cast<float>(flow.flow[i].x());
          values[count + i] = static_cast<float>(flow.flow[i].y());
          in_view[i] = flow.in_view[i] ? 1 : 0;
          covisible[i] = flow.covisible[i] ? 1 : 0;
        }
        const std::string way = is_forward ? "fwd" : "bwd";
        arrays["flow_" + way + ".npy"] =
            npy_bytes("<f4", {1, 2, height, width}, values.data(), values.size() * 4);
        arrays["fov_mask_" + way + ".npy"] =
            npy_bytes("|b1", {1, height, width}, in_view.data(), count);
        arrays["covisible_mask_" + way + ".npy"] =
            npy_bytes("|b1", {1, height, width}, covisible.data(), count);
      }
      const fs::path file = folder / sequence_path(d) / "flow_lcam_front" /
                            (digits(f) + "_" + digits(f + 1) + "_lcam_front_flow.npz");
      fs::remove(file);
      write_npz(file, arrays);
    } else {
      std::vector<float> values;
      std::vector<std::uint8_t> mask;
      for (std::size_t i = 0; i < count; ++i) {
        values.push_back(static_cast<float>(flows[0].flow[i].x()));
        values.push_back(static_cast<float>(flows[0].flow[i].y()));
        mask.push_back(flows[0].covisible[i] ? 0 : flows[0].in_view[i] ? 10 : 110);
      }
      const fs::path stem = folder / sequence_path(d) / "flow" / (digits(f) + "_" + digits(f + 1));
      core::write_file(stem.string() + "_flow.npy",
                       npy_bytes("<f4", {height, width, 2}, values.data(), values.size() * 4));
      core::write_file(stem.string() + "_mask.npy",
                       npy_bytes("|u1", {height, width}, mask.data(), mask.size()));
    }
  }
}

/// A change of every right flow.
void edit_flows(const RightDataset& d, const fs::path& folder,
                const std::function<void(Flow&)>& change) {
  const auto changed = [&](std::size_t from, std::size_t to) {
    Flow flow = flow_between(d, from, to);
    change(flow);
    return flow;
  };
  write_flows(
      d, folder, [&](std::size_t f) { return changed(f, f + 1); },
      [&](std::size_t f) { return changed(f + 1, f); });
}

// ---------------------------------------------------------------- what compression leaves

/// Coefficients of 8 x 8 blocks rounded to steps, as JPEG's table for brightness has them at quality
/// 50, times `scale`; each channel alone.
core::Image8 compressed(const core::Image8& image, double scale) {
  static constexpr int kTable[64] = {16,  11,  10,  16,  24, 40, 51,  61,  12,  12,  14,  19,  26,
                                     58,  60,  55,  14,  13, 16, 24,  40,  57,  69,  56,  14,  17,
                                     22,  29,  51,  87,  80, 62, 18,  22,  37,  56,  68,  109, 103,
                                     77,  24,  35,  55,  64, 81, 104, 113, 92,  49,  64,  78,  87,
                                     103, 121, 120, 101, 72, 92, 95,  98,  112, 100, 103, 99};
  double basis[8][8];
  for (int k = 0; k < 8; ++k)
    for (int n = 0; n < 8; ++n)
      basis[k][n] =
          (k == 0 ? std::sqrt(0.125) : 0.5) * std::cos((2 * n + 1) * k * std::numbers::pi / 16.0);
  core::Image8 result = image;
  for (int by = 0; by + 8 <= image.height(); by += 8)
    for (int bx = 0; bx + 8 <= image.width(); bx += 8)
      for (int channel = 0; channel < 3; ++channel) {
        double block[8][8], half[8][8];
        const auto apply = [&](bool is_forward) {
          for (int y = 0; y < 8; ++y)
            for (int k = 0; k < 8; ++k) {
              half[y][k] = 0.0;
              for (int n = 0; n < 8; ++n)
                half[y][k] += block[y][n] * (is_forward ? basis[k][n] : basis[n][k]);
            }
          for (int k = 0; k < 8; ++k)
            for (int x = 0; x < 8; ++x) {
              block[k][x] = 0.0;
              for (int n = 0; n < 8; ++n)
                block[k][x] += half[n][x] * (is_forward ? basis[k][n] : basis[n][k]);
            }
        };
        for (int y = 0; y < 8; ++y)
          for (int x = 0; x < 8; ++x) block[y][x] = image(bx + x, by + y, channel) - 128.0;
        apply(true);
        for (int k = 0; k < 64; ++k) {
          const double step = scale * kTable[k];
          block[k / 8][k % 8] = step * std::round(block[k / 8][k % 8] / step);
        }
        apply(false);
        for (int y = 0; y < 8; ++y)
          for (int x = 0; x < 8; ++x)
            result(bx + x, by + y, channel) =
                static_cast<std::uint8_t>(std::lround(std::clamp(block[y][x] + 128.0, 0.0, 255.0)));
      }
  return result;
}

core::Image8 with_channels_swapped(core::Image8 image) {
  for (std::size_t i = 0; i < image.data().size(); i += 3)
    std::swap(image.data()[i], image.data()[i + 2]);
  return image;
}

std::function<Expected(const RightDataset&)> says(std::vector<std::string> words) {
  return [words = std::move(words)](const RightDataset&) {
    return Expected{words, std::nullopt, 0.0};
  };
}
std::function<Expected(const RightDataset&)> says(std::vector<std::string> words, double size,
                                                  double tolerance) {
  return [=](const RightDataset&) { return Expected{words, size, tolerance}; };
}

std::vector<Mutation> make_mutations() {
  std::vector<Mutation> list;
  const auto add = [&](const char* name, std::vector<std::string> formats, auto change,
                       std::function<Expected(const RightDataset&)> expected) {
    list.push_back({name, std::move(formats), change, std::move(expected)});
  };

  // Intrinsics.
  add(
      "HalfPixel", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.centre_px = {0.5, 0.5}});
      },
      says({"principal point off by (0.5, 0.5) px", "half a pixel"}, std::sqrt(0.5), 1e-6));
  add(
      "HalfPixelOfFlow", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f + 1, -0.5); },
            [&](std::size_t f) { return flow_between(d, f + 1, f, -0.5); });
      },
      says({"principal point off by (-0.50, -0.50) px", "flow"}, std::sqrt(0.5), 0.01));
  add(
      "FocalLength", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.focal_factor = 1.01});
      },
      says({"focal length off by +1.000 %"}, 1.0, 1e-6));
  add(
      "CalibrationOfOtherSize", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.size_factor = 2.0});
      },
      says({"stale", "320 x 256 px"}, 2.0, 1e-6));
  add(
      "CalibrationBeforeChange", kCalibrated,
      [](const RightDataset& d, const fs::path& folder) {
        edit_calibration(d, folder, {.focal_factor = 0.996, .centre_px = {1.3, -0.7}});
      },
      says({"stale", "focal length off by -0.400 %", "(1.30, -0.70) px"}, -0.4, 1e-6));

  // Poses.
  add(
      "PosesInverted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d& r, Vector3d& t) {
          t = -(r.transpose() * t);
          r.transposeInPlace();
        });
      },
      says({"poses", "are inverted"}));
  add(
      "RotationsTransposed", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d& r, Vector3d&) { r.transposeInPlace(); });
      },
      says({"poses", "transposed rotations"}));
  add(
      "QuaternionOrder", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (d.format == "colmap") {
          Mistake mistake;
          mistake.colmap.raw_pose = [](Quaterniond& q, Vector3d&) {
            q = Quaterniond(q.x(), q.y(), q.z(), q.w());
          };
          write_colmap(d.recording, folder, mistake);
        } else if (is_tartan(d)) {
          for (const SceneCamera& camera : d.recording.cameras) {
            const fs::path file = folder / sequence_path(d) / ("pose_" + camera.name + ".txt");
            std::vector<std::string> lines = lines_of(file);
            for (std::string& line : lines) {
              const std::vector<double> n = numbers_of(line);
              line = joined({n[0], n[1], n[2], n[6], n[3], n[4], n[5]});
            }
            write_lines(file, lines);
          }
        } else {
          edit_georeference(d, folder, [](std::array<double, 8>& row) {
            row = {row[0], row[1], row[2], row[3], row[5], row[6], row[7], row[4]};
          });
        }
      },
      [](const RightDataset& d) {
        return Expected{{is_tartan(d)           ? "quaternions that stand as w x y z"
                         : d.format == "colmap" ? "quaternions that stand as x y z w"
                                                : "quaternions stand as x y z w"},
                        std::nullopt,
                        0.0};
      });
  add(
      "FlippedAxis", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d&, Vector3d& t) { t.y() = -t.y(); });
      },
      says({"flipped axis", "y of the positions has the opposite sign"}));
  add(
      "CameraAxes", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const bool is_relative = d.format.starts_with("kitti");
        edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d& t) {
          const Matrix3d up_and_back = Vector3d(1, -1, -1).asDiagonal();
          // Camera to world; COLMAP's are the other way round, KITTI's between two cameras.
          if (d.format == "colmap" || is_relative) {
            r = up_and_back * r;
            t = up_and_back * t;
          }
          if (d.format != "colmap") r = r * up_and_back;
        });
      },
      [](const RightDataset& d) {
        // Straight ahead nothing turns and nothing moves to the side: that y and z are flipped is
        // that the way is.
        const bool is_inversion = d.path == Path::Straight && d.format.starts_with("kitti");
        return Expected{{is_inversion ? "poses are inverted" : "axes"}, std::nullopt, 0.0};
      });
  add(
      "NedForEnu", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        Matrix3d swap;
        swap << 0, 1, 0, 1, 0, 0, 0, 0, -1;
        if (is_tartan(d)) {
          edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d& t) {
            r = swap * r;
            t = swap * t;
          });
        } else if (d.format == "colmap") {
          edit_raw_poses(d, folder, [&](Matrix3d& r, Vector3d&) { r = r * swap; });
        } else if (d.format == "kitti") {
          edit_georeference(d, folder, [&](std::array<double, 8>& row) {
            const Quaterniond q(
                Matrix3d(swap * Quaterniond(row[4], row[5], row[6], row[7]).toRotationMatrix()));
            row = {row[0], row[1], row[2], row[3], q.w(), q.x(), q.y(), q.z()};
          });
        } else {
          edit_packets(d, folder, [](std::vector<double>& n) {
            n[4] = -n[4];
            n[5] = 0.5 * std::numbers::pi - n[5];
          });
        }
      },
      says({"east, north, up", "north, east, down"}));
  add(
      "PosesInMillimetres", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_raw_poses(d, folder, [](Matrix3d&, Vector3d& t) { t *= 1000.0; });
      },
      says({"poses", "in millimetres where metres are meant"}));
  add(
      "PosesShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        write_poses(d, folder,
                    [&](std::size_t c, std::size_t f) { return true_pose(d, c, f + 1); });
      },
      says({"poses", "shifted by 1 frame", "frame after"}, 1.0, 0.0));
  add(
      "PoseRowTwice", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        write_poses(d, folder,
                    [&](std::size_t c, std::size_t f) { return true_pose(d, c, f == 2 ? 1 : f); });
      },
      says({"the pose of frame 2 is wrong", "that of frame 1"}));
  add(
      "Float32", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (!is_tartan(d)) {
          if (d.format == "kitti_raw")
            edit_packets(d, folder, [&](std::vector<double>& n) {
              n[0] = single(n[0]);
              n[1] = single(n[1]);
            });
          else
            edit_georeference(d, folder, [&](std::array<double, 8>& row) {
              row[1] = single(row[1]);
              row[2] = single(row[2]);
            });
          return;
        }
        // Poses about an origin 40 km to the west.
        const Vector3d far_scene(-40000.0, 0.0, 0.0);
        const ScenePlace place = place_of_scene(far_scene);
        const Matrix3d enu = enu_from_scene(place);
        write_poses(d, folder, [&](std::size_t c, std::size_t f) {
          const SaidPose p = true_pose(d, c, f);
          const Vector3d centre = enu * (p.centre - far_scene);
          return SaidPose{enu * p.rotation,
                          {single(centre.x()), single(centre.y()), single(centre.z())}};
        });
        core::Json json = core::Json::read(folder / "dataset.json");
        core::Json sequence = json.at("sequences").at(0);
        sequence.set("origin", core::Json::object()
                                   .set("lat_deg", place.lat_deg)
                                   .set("lon_deg", place.lon_deg)
                                   .set("height_m", place.height_m));
        json.set("sequences", core::Json::array().push(sequence));
        json.write(folder / "dataset.json");
      },
      says({"32-bit floats"}));
  add(
      "PosesSwapped", {"tartanair", "tartanair_v1", "colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.cameras.size() - 1;
        write_poses(d, folder, [&](std::size_t c, std::size_t f) {
          return true_pose(d, c == last ? last - 1 : c == last - 1 ? last : c, f);
        });
      },
      [](const RightDataset& d) {
        const auto& cameras = d.recording.cameras;
        return Expected{{fmt::format("poses of '{}' and '{}' are swapped",
                                     cameras[cameras.size() - 2].name, cameras.back().name)},
                        std::nullopt,
                        0.0};
      });
  const auto edit_baseline = [](double factor) {
    return [factor](const RightDataset& d, const fs::path& folder) {
      if (d.format.starts_with("kitti")) {
        edit_calibration(d, folder, {.baseline_factor = factor});
        return;
      }
      const std::size_t last = d.recording.cameras.size() - 1;
      write_poses(d, folder, [&](std::size_t c, std::size_t f) {
        SaidPose p = true_pose(d, c, f);
        const SaidPose reference = true_pose(d, 0, f);
        if (c == last) p.centre = reference.centre + factor * (p.centre - reference.centre);
        return p;
      });
    };
  };
  add("Baseline", kAll, edit_baseline(1.1), [](const RightDataset& d) {
    const double right_m = is_tartan(d) ? 0.25 : 0.5;
    return Expected{
        {"baseline", fmt::format("is {:.4f} m where {:.4f} m is right", 1.1 * right_m, right_m)},
        0.1 * right_m,
        1e-5};
  });
  add("BaselineSign", kAll, edit_baseline(-1.0), says({"baseline", "opposite sign"}));
  add(
      "ColorsOfCamerasSwapped", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.cameras.size() - 1;
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c == last ? last - 1 : c == last - 1 ? last : c][f];
        });
      },
      [](const RightDataset& d) {
        const auto& cameras = d.recording.cameras;
        return Expected{{fmt::format("colours of '{}' and '{}' are swapped",
                                     cameras[cameras.size() - 2].name, cameras.back().name)},
                        std::nullopt,
                        0.0};
      });

  // Times.
  const auto edit_times = [](const RightDataset& d, const fs::path& folder,
                             const std::function<double(double)>& change) {
    if (d.format == "kitti") {
      const fs::path file = folder / sequence_path(d) / "times.txt";
      std::vector<std::string> lines = lines_of(file);
      for (std::string& line : lines) line = fmt::format("{:e}", change(std::stod(line)));
      write_lines(file, lines);
    } else {
      edit_georeference(d, folder, [&](std::array<double, 8>& row) { row[0] = change(row[0]); });
    }
  };
  add(
      "TimesInMilliseconds", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        edit_times(d, folder, [](double time_s) { return 1000.0 * time_s; });
      },
      says({"times", "are in ms where seconds are meant"}, 1000.0, 0.0));
  add(
      "TimesShifted", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        edit_times(d, folder, [&](double time_s) { return time_s + 1.0 / d.recording.rate_hz; });
      },
      says({"times", "shifted by 1 frame"}, 1.0, 1e-6));
  add(
      "TimesOfOtherRate", kAll,
      [=](const RightDataset& d, const fs::path& folder) {
        edit_times(d, folder, [](double time_s) { return 1.25 * time_s; });
      },
      says({"times", "1.25"}, 1.25, 1e-6));

  // Depth.
  add(
      "DepthIsRange", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d& ray) { return m * ray.norm(); });
      },
      says({"depth is range along the ray"}));
  add(
      "DepthInMillimetres", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return 1000.0 * m; });
      },
      says({"depth is in millimetres"}, 1000.0, 1e-9));
  add(
      "DepthInCentimetres", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return 100.0 * m; });
      },
      says({"depth is in centimetres"}, 100.0, 1e-9));
  add(
      "DepthClipped", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) {
          return std::isfinite(m) ? std::min(m, 120.0) : m;
        });
      },
      says({"depth is clipped at 120 m"}, 120.0, 1e-6));
  add(
      "DepthOf8Bits", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) {
          return std::round(m / 256.0 * 255.0) / 255.0 * 256.0;
        });
      },
      says({"depth is quantised to 8 bits"}, 256.0 / 255.0, 1e-3));
  add(
      "DepthOffset", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return m + 0.8; });
      },
      says({"depth is 0.", "m too large everywhere"}, 0.8, 0.02));
  add(
      "DepthScaled", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder, [](double m, const Vector3d&) { return 1.005 * m; });
      },
      says({"depth is +0."}, 0.5, 0.01));
  add(
      "SkyIsDepth", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_depths(d, folder,
                    [](double m, const Vector3d&) { return std::isfinite(m) ? m : 1000.0; });
      },
      says({"sky is written as a depth of 1000 m"}, 1000.0, 1e-6));
  add(
      "ByteOrder", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
            if (depth_file(d, c, f).empty()) continue;
            const SceneCamera& camera = d.recording.cameras[c];
            std::vector<float> values;
            for (int y = 0; y < camera.height; ++y)
              for (int x = 0; x < camera.width; ++x) {
                const double m = d.recording.depth[c][f](x, y);
                const float value = std::isfinite(m) ? static_cast<float>(m) : sky_of(d);
                const auto bits = std::bit_cast<std::uint32_t>(value);
                // Of TartanAir's PNG the first and third byte change places.
                values.push_back(std::bit_cast<float>(
                    d.format == "tartanair"
                        ? (bits & 0xff00ff00U) | (bits & 0xffU) << 16 | (bits >> 16 & 0xffU)
                        : __builtin_bswap32(bits)));
              }
            write_depth(d, folder, c, f, values);
          }
      },
      [](const RightDataset& d) {
        return Expected{
            {"byte order", d.format == "tartanair" ? "R G B A" : "big-endian"}, std::nullopt, 0.0};
      });
  add(
      "DepthShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 1; f < d.recording.body_world.size(); ++f)
            if (!depth_file(d, c, f).empty())
              copy_over(d.folder / depth_file(d, c, f - 1), folder / depth_file(d, c, f));
      },
      says({"depths are shifted by 1 frame", "frame before"}, -1.0, 0.0));
  add(
      "DepthTwice", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        copy_over(d.folder / depth_file(d, 0, 1), folder / depth_file(d, 0, 2));
      },
      says({"depth of", "frame 2 is duplicated", "that of frame 1"}));

  // Flow and disparity.
  add(
      "FlowSign", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) {
          for (Vector2d& v : flow.flow) v = -v;
        });
      },
      says({"flow has the opposite sign"}));
  add(
      "FlowOrder", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [](Flow& flow) {
          for (Vector2d& v : flow.flow) std::swap(v.x(), v.y());
        });
      },
      says({"u and v swapped"}));
  add(
      "FlowBackward", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f + 1, f); },
            [&](std::size_t f) { return flow_between(d, f, f + 1); });
      },
      says({"backward flow is stored as forward flow"}));
  add(
      "FlowToTheFrameAfter", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        write_flows(
            d, folder, [&](std::size_t f) { return flow_between(d, f, f + 2); },
            [&](std::size_t f) { return flow_between(d, f + 1, f); });
      },
      says({"flow is of the wrong frame", "frame + 2"}));
  add(
      "FlowScaled", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [&](Flow& flow) {
          for (Vector2d& v : flow.flow) v /= d.recording.cameras[0].width;
        });
      },
      says({"flow is scaled by 0.0015625"}, 1.0 / 640.0, 1e-6));
  add(
      "MasksInverted", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        edit_flows(d, folder, [&](Flow& flow) {
          // V1 holds both masks as one: what is not valid is all the same.
          if (d.format == "tartanair_v1") flow.in_view = flow.covisible;
          flow.in_view.flip();
          flow.covisible.flip();
        });
      },
      says({"masks of flow are inverted"}));
  const auto scale_disparity = [](double factor) {
    return [factor](const RightDataset& d, const fs::path& folder) {
      const SceneCamera& camera = d.recording.cameras[0];
      const double product =
          camera.focal_px * (d.recording.cameras[1].offset_body - camera.offset_body).norm();
      for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
        core::Image16 counts(camera.width, camera.height);
        for (int y = 0; y < camera.height; ++y)
          for (int x = 0; x < camera.width; ++x)
            counts(x, y) = static_cast<std::uint16_t>(
                std::lround(256.0 * factor * product / d.recording.depth[0][f](x, y)));
        core::write_file(folder / sequence_path(d) / "disp_2" / (digits(f) + ".png"),
                         core::encode_png(counts));
      }
    };
  };
  add("DisparityDoubled", {"kitti"}, scale_disparity(2.0),
      says({"disparity is scaled by 2"}, 2.0, 1e-9));
  add("DisparityScaled", {"kitti"}, scale_disparity(1.03),
      says({"disparity is scaled by 1.0"}, 1.03, 2e-3));

  // Colours.
  add(
      "ChannelOrder", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // TartanAir holds colours once: there one of two cameras is wrong.
        edit_colors(d, folder, is_tartan(d) ? 1 : 0, [&](std::size_t c, std::size_t f) {
          return with_channels_swapped(d.recording.color[c][f]);
        });
      },
      says({"blue, green, red (BGR)"}));
  add(
      "ColorsShifted", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c][f == 0 ? 0 : f - 1];
        });
      },
      says({"colours", "shifted by 1 frame", "frame before"}, -1.0, 0.0));
  add(
      "FrameDropped", {"kitti", "kitti_raw", "colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        const std::size_t last = d.recording.body_world.size() - 1;
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return d.recording.color[c][c > 0 || f < 2 ? f : std::min(f + 1, last)];
        });
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("frame 2 of {} is dropped", d.recording.cameras[0].name)},
                        std::nullopt,
                        0.0};
      });
  add(
      "FrameTwice", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        copy_over(d.folder / color_file(d, 0, 1), folder / color_file(d, 0, 2));
      },
      [](const RightDataset& d) {
        return Expected{
            {fmt::format("image of {}, frame 2 is duplicated", d.recording.cameras[0].name),
             "that of frame 1"},
            std::nullopt,
            0.0};
      });
  add(
      "FrameOfOtherSequence", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // Another place looks like none of these: this one upside down does as well.
        core::Image8 other = d.recording.color[0][2];
        for (int y = 0; y < other.height(); ++y)
          for (int x = 0; x < other.width(); ++x)
            for (int k = 0; k < 3; ++k)
              other(x, y, k) =
                  d.recording.color[0][2](other.width() - 1 - x, other.height() - 1 - y, k);
        core::write_file(folder / color_file(d, 0, 2), core::encode_png(other));
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("image of {}, frame 2 does not belong there",
                                     d.recording.cameras[0].name)},
                        std::nullopt,
                        0.0};
      });
  add(
      "Jpeg", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        // Half the table's steps: quality 75.
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          return compressed(d.recording.color[c][f], 0.5);
        });
      },
      says({"JPEG"}));
  add(
      "ColorLevels", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_colors(d, folder, 0, [&](std::size_t c, std::size_t f) {
          core::Image8 image = d.recording.color[c][f];
          for (std::uint8_t& value : image.data()) value &= 0xf0;
          return image;
        });
      },
      says({"colours are quantised"}));

  // Georeference.
  add(
      "GeoidLeftOut", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        if (d.format == "kitti_raw")
          edit_packets(d, folder, [](std::vector<double>& n) { n[2] -= 48.2; });
        else
          edit_georeference(d, folder, [](std::array<double, 8>& row) { row[3] -= 48.2; });
      },
      [](const RightDataset& d) {
        // KITTI's rows are held against the origin, which is rounded to a metre.
        return Expected{
            {"heights are above the geoid", d.format == "kitti" ? "m too low" : "48.2 m too low"},
            -48.2,
            d.format == "kitti" ? 0.6 : 0.01};
      });
  add(
      "ArcSecond", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_georeference(d, folder, [](std::array<double, 8>& row) { row[1] += 1.0 / 3600.0; });
      },
      [](const RightDataset& d) {
        return Expected{
            {d.format == "kitti" ? "arc-seconds of latitude" : "1.00 arc-seconds of latitude"},
            30.86,
            d.format == "kitti" ? 0.6 : 0.05};
      });
  add(
      "LatitudeForLongitude", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        edit_georeference(d, folder, [](std::array<double, 8>& row) { std::swap(row[1], row[2]); });
      },
      says({"latitude and longitude are swapped"}));

  // Packets.
  add(
      "AnglesInDegrees", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          for (std::size_t i = 3; i < 6; ++i) n[i] *= 180.0 / std::numbers::pi;
        });
      },
      says({"angles are in degrees"}));
  add(
      "AnglesOfTheWorldsOrigin", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.oxts.axes_east_m = 25000.0;
        write_kitti_raw(d.recording, folder, mistake);
      },
      says({"angles stand in the east, north, up of a place 25.0 km east"}, 25.0, 0.1));
  add(
      "VelocitiesSwapped", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) { std::swap(n[6], n[7]); });
      },
      says({"velocities to the north and to the east are swapped"}));
  add(
      "RatesInDegrees", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        edit_packets(d, folder, [](std::vector<double>& n) {
          for (std::size_t i = 17; i < 23; ++i) n[i] *= 180.0 / std::numbers::pi;
        });
      },
      says({"turn rates are in deg/s"}));
  add(
      "GravityLeftOut", {"kitti_raw"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.oxts.gravity = 0.0;
        write_kitti_raw(d.recording, folder, mistake);
      },
      says({"forces lack gravity"}));

  // Classes.
  add(
      "ClassesPermuted", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
          for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
            core::Image8 classes = d.recording.classes[c][f];
            for (std::uint8_t& value : classes.data())
              value = static_cast<std::uint8_t>((value + 1) % 3);
            write_classes(d, folder, c, f, classes);
          }
      },
      says({"classes of the segmentation are permuted", "the sky is called 'ground'"}));
  add(
      "ClassesOfOneFramePermuted", kFlow,
      [](const RightDataset& d, const fs::path& folder) {
        core::Image8 classes = d.recording.classes[0][1];
        for (std::uint8_t& value : classes.data()) value = value == 0 ? 0 : value == 1 ? 2 : 1;
        write_classes(d, folder, 0, 1, classes);
      },
      [](const RightDataset& d) {
        return Expected{{fmt::format("classes of {}, frame 1", d.recording.cameras[0].name)},
                        std::nullopt,
                        0.0};
      });

  // COLMAP's points.
  add(
      "ObservationsHalfAPixelOff", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.colmap.observations_px = -0.5;
        write_colmap(d.recording, folder, mistake);
      },
      says({"observations", "(-0.5, -0.5) px", "whole numbers"}, std::sqrt(0.5), 1e-6));
  add(
      "TracksOfOtherFrame", {"colmap"},
      [](const RightDataset& d, const fs::path& folder) {
        Mistake mistake;
        mistake.colmap.are_observations_of_next_frame = true;
        write_colmap(d.recording, folder, mistake);
      },
      says({"points3D have another frame's tracks", "frame after"}, 1.0, 0.0));

  // Files.
  add(
      "FileTruncated", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        const fs::path file = depth_file(d, 0, 1);
        std::string bytes = core::read_text_file(d.folder / file);
        bytes.resize(bytes.size() / 2);
        core::write_file(folder / file, bytes);
      },
      [](const RightDataset& d) {
        return Expected{{"a file does not hold what it should", depth_file(d, 0, 1).filename()},
                        std::nullopt,
                        0.0};
      });
  add(
      "FileMissing", kAll,
      [](const RightDataset& d, const fs::path& folder) {
        fs::remove(folder / color_file(d, 0, 1));
      },
      [](const RightDataset& d) {
        return Expected{{"a file is missing", color_file(d, 0, 1).filename()}, std::nullopt, 0.0};
      });
  return list;
}

/// The pair's grey images, as KITTI has them beside the colours.
void add_grey(const RightDataset& d) {
  for (std::size_t c = 0; c < 2; ++c) {
    std::string name = d.recording.cameras[c].name;
    name.back() = static_cast<char>('0' + c);
    RightDataset grey = d;
    grey.recording.cameras[c].name = name;
    for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
      const core::Image8& color = d.recording.color[c][f];
      core::Image8 luma(color.width(), color.height(), 1);
      for (std::size_t i = 0; i < luma.data().size(); ++i)
        luma.data()[i] = static_cast<std::uint8_t>(std::lround(0.299 * color.data()[3 * i] +
                                                               0.587 * color.data()[3 * i + 1] +
                                                               0.114 * color.data()[3 * i + 2]));
      core::write_file(d.folder / color_file(grey, c, f), core::encode_png(luma));
    }
    if (d.format == "kitti_raw")
      copy_over(d.folder / sequence_path(d) / "oxts/timestamps.txt",
                d.folder / sequence_path(d) / name / "timestamps.txt");
  }
  list_files_again(d.folder);
}

}  // namespace

RightDataset write_right_dataset(const std::string& format, Path path, const fs::path& folder) {
  static std::map<Path, Recording> tartan;
  RightDataset d;
  d.format = format;
  d.path = path;
  d.folder = folder;
  constexpr int kFrames = 6, kTartanFrames = 3, kMore = 3;
  if (format.starts_with("tartanair")) {
    if (!tartan.contains(path))
      tartan[path] = record_island_flight(tartanair_cameras(), kTartanFrames, path);
    d.recording =
        format == "tartanair" ? tartan[path] : cropped(tartan[path], tartanair_v1_cameras());
    d.longer = island_path(d.recording.cameras, kTartanFrames + kMore, path);
  } else {
    const auto cameras = format == "kitti"       ? kitti_cameras()
                         : format == "kitti_raw" ? kitti_raw_cameras()
                                                 : colmap_cameras();
    d.recording = record_island_flight(cameras, kFrames, path);
    d.longer = island_path(cameras, kFrames + kMore, path);
  }
  if (format == "tartanair") write_tartanair(d.recording, folder);
  if (format == "tartanair_v1") write_tartanair_v1(d.recording, folder);
  if (format == "kitti") write_kitti(d.recording, folder);
  if (format == "kitti_raw") write_kitti_raw(d.recording, folder);
  if (format == "colmap") write_colmap(d.recording, folder);
  if (format.starts_with("kitti")) add_grey(d);
  return d;
}

const std::vector<Mutation>& mutations() {
  static const std::vector<Mutation> list = make_mutations();
  return list;
}

const std::vector<Unseeable>& unseeable_mutations() {
  static const std::vector<Unseeable> list = {
      {"RatesInDegrees", "kitti_raw", "turn rates of a straight flight are 0 in any unit", true},
      {"RotationsTransposed", "kitti",
       "between frames of a straight flight nothing turns: the rotations are 1, and so are their "
       "transposes",
       true},
      {"RotationsTransposed", "kitti_raw",
       "poses.txt holds rotations between frames alone: as above", true},
      {"HalfPixel", "", "the intrinsics are the format's own: no file holds any"},
      {"HalfPixelOfFlow", "", "the format holds no flow"},
      {"FocalLength", "", "the intrinsics are the format's own: no file holds any"},
      {"CalibrationOfOtherSize", "", "the intrinsics are the format's own: no file holds any"},
      {"CalibrationBeforeChange", "", "the intrinsics are the format's own: no file holds any"},
      {"PosesSwapped", "", "one file or packet holds the poses of all cameras"},
      {"FlowSign", "", "the format holds no flow"},
      {"FlowOrder", "", "the format holds no flow"},
      {"FlowBackward", "", "the format holds no flow"},
      {"FlowToTheFrameAfter", "", "the format holds no flow"},
      {"FlowScaled", "", "the format holds no flow"},
      {"MasksInverted", "", "the format holds no flow"},
      {"DisparityDoubled", "", "the format holds no disparity"},
      {"DisparityScaled", "", "the format holds no disparity"},
      {"FrameDropped", "",
       "of three frames the second is dropped as it is duplicated: the last stands twice"},
      {"AnglesInDegrees", "", "the format holds no angles"},
      {"AnglesOfTheWorldsOrigin", "", "the format holds no packets"},
      {"VelocitiesSwapped", "", "the format holds no velocities"},
      {"RatesInDegrees", "", "the format holds no turn rates"},
      {"GravityLeftOut", "", "the format holds no forces"},
      {"ClassesPermuted", "", "the format holds no classes"},
      {"ClassesOfOneFramePermuted", "", "the format holds no classes"},
      {"ObservationsHalfAPixelOff", "", "the format holds no points"},
      {"TracksOfOtherFrame", "", "the format holds no points"},
  };
  return list;
}

void corrupt(const RightDataset& right, const Mutation& mutation, const fs::path& folder) {
  // Links cost nothing; what is corrupted is written beside and renamed, so that the right dataset
  // keeps its own.
  fs::copy(right.folder, folder, fs::copy_options::recursive | fs::copy_options::create_hard_links);
  copy_over(right.folder / "dataset.json", folder / "dataset.json");
  mutation.corrupt(right, folder);
  list_files_again(folder);
}

}  // namespace terracast::test
