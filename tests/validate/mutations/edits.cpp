#include "tests/validate/mutations/edits.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <sstream>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/analytic_writer.h"

namespace terracast::test {

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

void write_depths(
    const RightDataset& d, const fs::path& folder,
    const std::function<double(std::size_t c, std::size_t f, int x, int y)>& depth_m) {
  for (std::size_t c = 0; c < d.recording.cameras.size(); ++c)
    for (std::size_t f = 0; f < d.recording.body_world.size(); ++f) {
      if (depth_file(d, c, f).empty()) continue;
      const SceneCamera& camera = d.recording.cameras[c];
      std::vector<float> values;
      for (int y = 0; y < camera.height; ++y)
        for (int x = 0; x < camera.width; ++x) {
          const double value = depth_m(c, f, x, y);
          values.push_back(std::isfinite(value) ? static_cast<float>(value) : sky_of(d));
        }
      write_depth(d, folder, c, f, values);
    }
}

void edit_depths(const RightDataset& d, const fs::path& folder,
                 const std::function<double(double depth_m, const Vector3d& ray)>& change) {
  write_depths(d, folder, [&](std::size_t c, std::size_t f, int x, int y) {
    const SceneCamera& camera = d.recording.cameras[c];
    const Vector3d ray((x + 0.5 - 0.5 * camera.width) / camera.focal_px,
                       (y + 0.5 - 0.5 * camera.height) / camera.focal_px, 1.0);
    return change(d.recording.depth[c][f](x, y), ray);
  });
}

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

std::vector<double> numbers_of(std::string line, char separator) {
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

void write_georeference(const RightDataset& d, const fs::path& folder,
                        const std::function<SaidPose(std::size_t c, std::size_t f)>& pose) {
  std::size_t row_index = 0;
  edit_georeference(d, folder, [&](std::array<double, 8>& row) {
    const std::size_t num_cameras = d.recording.cameras.size();
    const SaidPose said = pose(row_index % num_cameras, row_index / num_cameras);
    ++row_index;
    const ScenePlace place = place_of_scene(said.centre);
    const Quaterniond q(Matrix3d(enu_from_scene(place) * said.rotation));
    row = {row[0], place.lat_deg, place.lon_deg, place.height_m, q.w(), q.x(), q.y(), q.z()};
  });
}

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

// ---------------------------------------------------------------- dataset.json
void edit_stated(const fs::path& folder, const std::function<void(core::Json& sequence)>& change) {
  core::Json json = core::Json::read(folder / "dataset.json");
  core::Json sequence = json.at("sequences").at(0);
  change(sequence);
  json.set("sequences", core::Json::array().push(sequence));
  json.write(folder / "dataset.json");
}

void edit_stated_cameras(const fs::path& folder,
                         const std::function<void(std::size_t c, core::Json& camera)>& change) {
  edit_stated(folder, [&](core::Json& sequence) {
    core::Json cameras = core::Json::array();
    for (std::size_t c = 0; c < sequence.at("cameras").size(); ++c) {
      core::Json camera = sequence.at("cameras").at(c);
      change(c, camera);
      cameras.push(camera);
    }
    sequence.set("cameras", cameras);
  });
}

// ---------------------------------------------------------------- calibration
void edit_calibration(const RightDataset& d, const fs::path& folder, const Calibration& wrong) {
  // A size factor takes the principal point with it.
  const auto matrix = [&](std::vector<double> n) {
    const double half = 0.5;  // centres at whole numbers
    n[0] *= wrong.focal_factor * wrong.size_factor;
    n[5] *= wrong.focal_factor * wrong.size_factor;
    n[2] = (n[2] + half) * wrong.size_factor - half + wrong.centre_px.x();
    n[6] = (n[6] + half) * wrong.size_factor - half + wrong.centre_px.y();
    n[3] *= wrong.focal_factor * wrong.baseline_factor * wrong.size_factor;
    if (n[3] != 0.0) {
      n[3] -= n[0] * wrong.moved_m.x() + n[2] * wrong.moved_m.z();
      n[7] -= n[5] * wrong.moved_m.y() + n[6] * wrong.moved_m.z();
      n[11] -= wrong.moved_m.z();
    }
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
        if (t[0] != 0.0)
          for (int k = 0; k < 3; ++k) t[static_cast<std::size_t>(k)] -= wrong.moved_m[k];
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
Flow flow_between(const RightDataset& d, std::size_t from, std::size_t to, double off_px) {
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

core::Image8 shifted_by_half(const core::Image8& image) {
  core::Image8 result = image;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      for (int k = 0; k < image.channels(); ++k) {
        const int left = std::max(x - 1, 0), above = std::max(y - 1, 0);
        const int sum =
            image(x, y, k) + image(left, y, k) + image(x, above, k) + image(left, above, k);
        result(x, y, k) = static_cast<std::uint8_t>((sum + 2) / 4);
      }
  return result;
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

}  // namespace terracast::test
