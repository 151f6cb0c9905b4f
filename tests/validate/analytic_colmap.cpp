#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/validate/analytic_writer.h"

/// COLMAP's sparse model, text and binary.
namespace terracast::test {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
namespace fs = std::filesystem;

template <class Value>
void put(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

struct Observation {
  double x, y;
  std::int64_t point;
};
struct Point {
  Vector3d position;
  std::array<std::uint8_t, 3> color;
  double sum_of_errors_px = 0.0;  ///< from where one pose has it, of rolling shutters
  std::vector<std::pair<std::uint32_t, std::uint32_t>> track;
};

}  // namespace

void write_colmap(const Recording& recording, const fs::path& folder, const Mistake& mistake) {
  const Said said{recording, mistake};
  const ColmapMistake& wrong = mistake.colmap;
  const std::string path = "flight";
  const std::size_t num_cameras = recording.cameras.size();
  const auto num_frames = static_cast<std::size_t>(recording.num_frames());
  const auto image_id = [&](std::size_t c, std::size_t f) {
    return static_cast<std::uint32_t>(1 + f * num_cameras + c);
  };

  // Points: the true ones, projected by what the dataset says, so that the model agrees with itself
  // even when it is wrong.
  std::map<std::uint32_t, std::vector<Observation>> observations;
  std::vector<Point> points;
  const SceneCamera& camera0 = recording.cameras[0];
  for (std::size_t f = 0; f < num_frames; f += 2)
    for (int y = 6; y < camera0.height - 6; y += 4)
      for (int x = 6; x < camera0.width - 6; x += 4) {
        const Vector3d ray((x + 0.5 - 0.5 * camera0.width) / camera0.focal_px,
                           (y + 0.5 - 0.5 * camera0.height) / camera0.focal_px, 1.0);
        if (points.size() == wrong.most_points || !std::isfinite(recording.depth[0][f](x, y)))
          continue;
        Point point;
        const SceneCamera& shown_by = recording.cameras[0];
        const SaidPose line =
            shown_by.line_time_s > 0.0
                ? recording.pose_after(0, f, shown_by.line_offset_s(x + 0.5, y + 0.5))
                : SaidPose{recording.rotation(0, f), recording.centre(0, f)};
        point.position =
            line.rotation *
                (ray * (recording.depth[0][f](x, y) * (1.0 + wrong.point_depth_relative))) +
            line.centre;
        for (int k = 0; k < 3; ++k)
          point.color[static_cast<std::size_t>(k)] = static_cast<std::uint8_t>(std::clamp(
              recording.color[0][f](x, y, wrong.is_color_swapped ? 2 - k : k) + wrong.color_levels,
              0, 255));
        const auto id = static_cast<std::int64_t>(points.size() + 1);
        for (std::size_t g = 0; g < num_frames; ++g)
          for (std::size_t c = 0; c < num_cameras; ++c) {
            const SaidPose pose = said.pose(c, g);
            const Vector3d at = pose.rotation.transpose() * (point.position - pose.centre);
            const Eigen::Vector2d by_one_pose(said.focal(c) * at.x() / at.z() + said.cx(c),
                                              said.focal(c) * at.y() / at.z() + said.cy(c));
            const Eigen::Vector2d place = recording.cameras[c].line_time_s > 0.0
                                              ? recording.shown(c, g, point.position).pixel
                                              : by_one_pose;
            const double u = place.x(), v = place.y();
            if (at.z() <= 0.0 || u < 1.0 || v < 1.0 || u >= recording.cameras[c].width - 1.0 ||
                v >= recording.cameras[c].height - 1.0)
              continue;
            if (point.track.size() == wrong.most_images) continue;
            const std::uint32_t id_of_image = image_id(
                c, wrong.are_observations_of_next_frame ? (g + num_frames - 1) % num_frames : g);
            auto& list = observations[id_of_image];
            point.track.emplace_back(id_of_image, static_cast<std::uint32_t>(list.size()));
            list.push_back({u + wrong.observations_px, v + wrong.observations_px, id});
            if (recording.cameras[c].line_time_s > 0.0)
              point.sum_of_errors_px += (place - by_one_pose).norm();
          }
        points.push_back(std::move(point));
      }
  observations.begin()->second[0].x += wrong.observation_px;
  points[0].track[0].second += wrong.track_index;

  std::string cameras_txt = "# cameras\n", images_txt = "# images\n", points_txt = "# points\n",
              rigs_txt, frames_txt, places_txt;
  std::string cameras_bin, images_bin, points_bin, rigs_bin, frames_bin;
  const auto pose_text = [](const Quaterniond& q, const Vector3d& t) {
    return fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(),
                       q.y(), q.z(), t.x(), t.y(), t.z());
  };
  const auto put_pose = [](std::string& bytes, const Quaterniond& q, const Vector3d& t) {
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) put(bytes, value);
  };
  const auto written = [&](std::size_t c, std::size_t f) {
    const SaidPose pose = wrong.written_pose ? wrong.written_pose(c, f) : said.pose(c, f);
    const Matrix3d camera_from_world = pose.rotation.transpose();
    std::pair<Quaterniond, Vector3d> raw{camera_from_world, -(camera_from_world * pose.centre)};
    if (wrong.raw_pose) wrong.raw_pose(raw.first, raw.second);
    return raw;
  };
  put(cameras_bin, static_cast<std::uint64_t>(num_cameras));
  put(images_bin, static_cast<std::uint64_t>(num_cameras * num_frames));
  put(rigs_bin, std::uint64_t{1});
  put(rigs_bin, std::uint32_t{1});
  put(rigs_bin, static_cast<std::uint32_t>(num_cameras));
  rigs_txt += fmt::format("1 {}", num_cameras);
  for (std::size_t c = 0; c < num_cameras; ++c) {
    const SceneCamera& camera = recording.cameras[c];
    const auto id = static_cast<std::uint32_t>(c + 1);
    int width = camera.width, height = camera.height;
    std::array<double, 4> parameters = {said.focal(c), said.focal(c), said.cx(c), said.cy(c)};
    if (wrong.written_camera) wrong.written_camera(width, height, parameters);
    cameras_txt += fmt::format("{} PINHOLE {} {} {:.17g} {:.17g} {:.17g} {:.17g}\n", id, width,
                               height, parameters[0], parameters[1], parameters[2], parameters[3]);
    put(cameras_bin, id);
    put(cameras_bin, std::int32_t{1});
    put(cameras_bin, static_cast<std::uint64_t>(width));
    put(cameras_bin, static_cast<std::uint64_t>(height));
    for (const double value : parameters) put(cameras_bin, value);
    rigs_txt += fmt::format(" CAMERA {}", id);
    put(rigs_bin, std::int32_t{0});
    put(rigs_bin, id);
    if (c == 0) continue;
    const Quaterniond q(said.mount(c).transpose() * said.mount(0));
    const Vector3d t =
        said.mount(c).transpose() * (recording.cameras[0].offset_body - camera.offset_body) +
        wrong.rig_move_m * Vector3d::UnitX();
    rigs_txt += " 1 " + pose_text(q, t);
    put(rigs_bin, std::uint8_t{1});
    put_pose(rigs_bin, q, t);
  }
  rigs_txt += "\n";
  put(frames_bin, static_cast<std::uint64_t>(num_frames));
  for (std::size_t f = 0; f < num_frames; ++f) {
    const auto [frame_q, frame_t] = written(0, f);
    const std::size_t num_members =
        num_cameras - (wrong.is_last_image_without_frame && f + 1 == num_frames ? 1 : 0);
    frames_txt += fmt::format("{} 1 {} {}", f + 1, pose_text(frame_q, frame_t), num_members);
    put(frames_bin, static_cast<std::uint32_t>(f + 1));
    put(frames_bin, std::uint32_t{1});
    put_pose(frames_bin, frame_q, frame_t);
    put(frames_bin, static_cast<std::uint32_t>(num_members));
    for (std::size_t c = 0; c < num_cameras; ++c) {
      if (c < num_members) {
        frames_txt += fmt::format(" CAMERA {} {}", c + 1, image_id(c, f));
        put(frames_bin, std::int32_t{0});
        put(frames_bin, static_cast<std::uint32_t>(c + 1));
        put(frames_bin, static_cast<std::uint64_t>(image_id(c, f)));
      }
      const auto [q, t] = written(c, f);
      const std::string name = recording.cameras[c].name + "/" + digits(f) + ".png";
      images_txt += fmt::format("{} {} {} {}\n", image_id(c, f), pose_text(q, t), c + 1, name);
      const ScenePlace place = place_of_scene(said.pose(c, f, false).centre);
      places_txt += fmt::format("{} {:.13f} {:.13f} {:.6f}\n", name, place.lat_deg, place.lon_deg,
                                place.height_m);
      put(images_bin, image_id(c, f));
      put_pose(images_bin, q, t);
      put(images_bin, static_cast<std::uint32_t>(c + 1));
      images_bin += name;
      images_bin += '\0';
      const auto& seen = observations[image_id(c, f)];
      put(images_bin, static_cast<std::uint64_t>(seen.size()));
      for (const Observation& o : seen) {
        images_txt += fmt::format("{:.17g} {:.17g} {} ", o.x, o.y, o.point);
        put(images_bin, o.x);
        put(images_bin, o.y);
        put(images_bin, static_cast<std::uint64_t>(o.point));
      }
      images_txt += "\n";
      core::write_file(folder / path / "images" / name, core::encode_png(said.color(c, f)));
      write_depth_npy(said, c, f,
                      folder / path / "depth" / recording.cameras[c].name / (digits(f) + ".npy"));
    }
    frames_txt += "\n";
  }
  put(points_bin, static_cast<std::uint64_t>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    Point p = points[i];
    if (wrong.written_point) p.position = wrong.written_point(p.position);
    const double error_px =
        p.track.empty() ? 0.0 : p.sum_of_errors_px / static_cast<double>(p.track.size());
    points_txt +=
        fmt::format("{} {:.17g} {:.17g} {:.17g} {} {} {} {:.17g}", i + 1, p.position.x(),
                    p.position.y(), p.position.z(), p.color[0], p.color[1], p.color[2], error_px);
    put(points_bin, static_cast<std::uint64_t>(i + 1));
    for (const double value : {p.position.x(), p.position.y(), p.position.z()})
      put(points_bin, value);
    for (const std::uint8_t value : p.color) put(points_bin, value);
    put(points_bin, error_px);
    put(points_bin, static_cast<std::uint64_t>(p.track.size()));
    for (const auto& [image, index] : p.track) {
      points_txt += fmt::format(" {} {}", image, index);
      put(points_bin, image);
      put(points_bin, index);
    }
    points_txt += "\n";
  }
  const fs::path text = folder / path / "sparse_txt/0";
  const fs::path binary = folder / path / "sparse/0";
  core::write_file(text / "cameras.txt", cameras_txt);
  core::write_file(text / "images.txt", images_txt);
  core::write_file(text / "points3D.txt", points_txt);
  core::write_file(text / "rigs.txt", rigs_txt);
  core::write_file(text / "frames.txt", frames_txt);
  core::write_file(binary / "cameras.bin", cameras_bin);
  core::write_file(binary / "images.bin", images_bin);
  core::write_file(binary / "points3D.bin", points_bin);
  core::write_file(binary / "rigs.bin", rigs_bin);
  core::write_file(binary / "frames.bin", frames_bin);
  core::write_file(folder / path / "georegistration.txt", places_txt);
  write_metadata(said, folder, "colmap", "flight", path, path + "/georeference.csv");
}

}  // namespace terracast::test
