// What COLMAP and its scripts read: both forms of the model, parsed here by the format's
// description.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "core/json.h"
#include "tests/export/exported.h"
#include "tests/export/readers.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using Eigen::Vector3d;

const TinyCaptureOptions kSmall{.num_frames = 3, .has_tartan2 = false};

struct Pose {
  Eigen::Quaterniond rotation;
  Vector3d translation;
  Vector3d operator*(const Vector3d& point) const { return rotation * point + translation; }
  bool operator==(const Pose& other) const {
    return rotation.coeffs() == other.rotation.coeffs() && translation == other.translation;
  }
};
struct Camera {
  std::string model;
  std::uint64_t width, height;
  std::vector<double> parameters;
  bool operator==(const Camera&) const = default;
};
struct Observation {
  double x, y;
  std::int64_t point;
  bool operator==(const Observation&) const = default;
};
struct Image {
  Pose camera_from_world;
  std::uint32_t camera;
  std::string name;
  std::vector<Observation> observations;
  bool operator==(const Image&) const = default;
};
struct Point {
  Vector3d position;
  int color[3];
  double error;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> track;
  bool operator==(const Point& other) const {
    return position == other.position && error == other.error && track == other.track &&
           std::equal(color, color + 3, other.color);
  }
};
struct Rig {
  std::uint32_t reference;
  std::map<std::uint32_t, Pose> others;
  bool operator==(const Rig&) const = default;
};
struct Frame {
  std::uint32_t rig;
  Pose rig_from_world;
  std::map<std::uint32_t, std::uint64_t> images;
  bool operator==(const Frame&) const = default;
};
struct Model {
  std::map<std::uint32_t, Camera> cameras;
  std::map<std::uint32_t, Image> images;
  std::map<std::uint64_t, Point> points;
  std::map<std::uint32_t, Rig> rigs;
  std::map<std::uint32_t, Frame> frames;
  bool operator==(const Model&) const = default;
};

Pose read_pose(std::istream& words) {
  double w, x, y, z;
  Pose pose;
  words >> w >> x >> y >> z >> pose.translation.x() >> pose.translation.y() >> pose.translation.z();
  pose.rotation = Eigen::Quaterniond(w, x, y, z);
  return pose;
}

std::vector<std::string> content_lines(const fs::path& file) {
  std::vector<std::string> lines;
  std::istringstream stream(slurp(file));
  for (std::string line; std::getline(stream, line);)
    if (line.empty() || line[0] != '#') lines.push_back(line);
  return lines;
}

Model read_text(const fs::path& folder) {
  Model model;
  for (const std::string& line : content_lines(folder / "cameras.txt")) {
    std::istringstream words(line);
    std::uint32_t id;
    Camera camera;
    words >> id >> camera.model >> camera.width >> camera.height;
    for (double value; words >> value;) camera.parameters.push_back(value);
    model.cameras[id] = camera;
  }
  const std::vector<std::string> lines = content_lines(folder / "images.txt");
  for (std::size_t i = 0; i + 1 < lines.size(); i += 2) {
    std::istringstream words(lines[i]);
    std::uint32_t id;
    Image image;
    words >> id;
    image.camera_from_world = read_pose(words);
    words >> image.camera >> image.name;
    std::istringstream points(lines[i + 1]);
    for (Observation o{}; points >> o.x >> o.y >> o.point;) image.observations.push_back(o);
    model.images[id] = image;
  }
  for (const std::string& line : content_lines(folder / "points3D.txt")) {
    std::istringstream words(line);
    std::uint64_t id;
    Point point;
    words >> id >> point.position.x() >> point.position.y() >> point.position.z() >>
        point.color[0] >> point.color[1] >> point.color[2] >> point.error;
    for (std::uint32_t image, index; words >> image >> index;)
      point.track.emplace_back(image, index);
    model.points[id] = point;
  }
  for (const std::string& line : content_lines(folder / "rigs.txt")) {
    std::istringstream words(line);
    std::uint32_t id, num_sensors;
    std::string type;
    Rig rig;
    words >> id >> num_sensors >> type >> rig.reference;
    for (std::uint32_t i = 1, sensor, has_pose; i < num_sensors; ++i) {
      words >> type >> sensor >> has_pose;
      EXPECT_EQ(type, "CAMERA");
      EXPECT_EQ(has_pose, 1U);
      rig.others[sensor] = read_pose(words);
    }
    model.rigs[id] = rig;
  }
  for (const std::string& line : content_lines(folder / "frames.txt")) {
    std::istringstream words(line);
    std::uint32_t id, num_data, sensor;
    std::string type;
    Frame frame;
    words >> id >> frame.rig;
    frame.rig_from_world = read_pose(words);
    words >> num_data;
    for (std::uint64_t data; words >> type >> sensor >> data;) frame.images[sensor] = data;
    EXPECT_EQ(frame.images.size(), num_data);
    model.frames[id] = frame;
  }
  return model;
}

/// Little-endian numbers one after the other.
struct Binary {
  std::string bytes;
  std::size_t at = 0;
  explicit Binary(const fs::path& file) : bytes(slurp(file)) {}
  ~Binary() { EXPECT_EQ(at, bytes.size()); }
  template <class T>
  T get() {
    T value;
    if (at + sizeof value > bytes.size()) throw std::runtime_error("binary model: short");
    std::memcpy(&value, bytes.data() + at, sizeof value);
    at += sizeof value;
    return value;
  }
  Pose pose() {
    const auto w = get<double>(), x = get<double>(), y = get<double>(), z = get<double>();
    Pose pose;
    pose.rotation = Eigen::Quaterniond(w, x, y, z);
    for (int k = 0; k < 3; ++k) pose.translation[k] = get<double>();
    return pose;
  }
};

Model read_binary(const fs::path& folder) {
  Model model;
  Binary cameras(folder / "cameras.bin");
  for (auto n = cameras.get<std::uint64_t>(); n > 0; --n) {
    Camera& camera = model.cameras[cameras.get<std::uint32_t>()];
    EXPECT_EQ(cameras.get<std::int32_t>(), 1);
    camera.model = "PINHOLE";
    camera.width = cameras.get<std::uint64_t>();
    camera.height = cameras.get<std::uint64_t>();
    for (int k = 0; k < 4; ++k) camera.parameters.push_back(cameras.get<double>());
  }
  Binary images(folder / "images.bin");
  for (auto n = images.get<std::uint64_t>(); n > 0; --n) {
    Image& image = model.images[images.get<std::uint32_t>()];
    image.camera_from_world = images.pose();
    image.camera = images.get<std::uint32_t>();
    for (char c; (c = images.get<char>()) != '\0';) image.name += c;
    for (auto m = images.get<std::uint64_t>(); m > 0; --m) {
      Observation& o = image.observations.emplace_back();
      o.x = images.get<double>();
      o.y = images.get<double>();
      o.point = images.get<std::int64_t>();
    }
  }
  Binary points(folder / "points3D.bin");
  for (auto n = points.get<std::uint64_t>(); n > 0; --n) {
    Point& point = model.points[points.get<std::uint64_t>()];
    for (int k = 0; k < 3; ++k) point.position[k] = points.get<double>();
    for (int& level : point.color) level = points.get<std::uint8_t>();
    point.error = points.get<double>();
    for (auto m = points.get<std::uint64_t>(); m > 0; --m) {
      const auto image = points.get<std::uint32_t>();
      point.track.emplace_back(image, points.get<std::uint32_t>());
    }
  }
  Binary rigs(folder / "rigs.bin");
  for (auto n = rigs.get<std::uint64_t>(); n > 0; --n) {
    Rig& rig = model.rigs[rigs.get<std::uint32_t>()];
    const auto num_sensors = rigs.get<std::uint32_t>();
    EXPECT_EQ(rigs.get<std::int32_t>(), 0);
    rig.reference = rigs.get<std::uint32_t>();
    for (std::uint32_t i = 1; i < num_sensors; ++i) {
      EXPECT_EQ(rigs.get<std::int32_t>(), 0);
      const auto sensor = rigs.get<std::uint32_t>();
      EXPECT_EQ(rigs.get<std::uint8_t>(), 1);
      rig.others[sensor] = rigs.pose();
    }
  }
  Binary frames(folder / "frames.bin");
  for (auto n = frames.get<std::uint64_t>(); n > 0; --n) {
    Frame& frame = model.frames[frames.get<std::uint32_t>()];
    frame.rig = frames.get<std::uint32_t>();
    frame.rig_from_world = frames.pose();
    for (auto m = frames.get<std::uint32_t>(); m > 0; --m) {
      EXPECT_EQ(frames.get<std::int32_t>(), 0);
      const auto sensor = frames.get<std::uint32_t>();
      frame.images[sensor] = frames.get<std::uint64_t>();
    }
  }
  return model;
}

struct Colmap : testing::Test {
  ScratchFolder scratch;
  fs::path root = scratch / "out" / "colmap";
  fs::path sequence = root / "valley";
  TinyScene scene;

  void run(const TinyCaptureOptions& options = kSmall, const std::string& more = "") {
    write_tiny_capture(scratch / "capture", options);
    run_export(scratch / "capture", "format = \"colmap\"\n" + more, scratch / "out");
  }
  Vector3d local_from_world(const Vector3d& point_world) const {
    const Json origin =
        Json::read(root / "dataset.json").at("sequences").at(std::size_t{0}).at("origin");
    return tangent_change(
        scene.origin, geo::Geodetic{origin.at("lat_deg").number(), origin.at("lon_deg").number(),
                                    origin.at("height_m").number()})(point_world);
  }
};

TEST_F(Colmap, TextAndBinaryAreTheSameModel) {
  run();
  const Model text = read_text(sequence / "sparse_txt/0");
  EXPECT_EQ(text, read_binary(sequence / "sparse/0"));  // 17 digits: to the bit
  EXPECT_EQ(text.cameras.size(), 4U);
  EXPECT_EQ(text.images.size(), 12U);
  EXPECT_EQ(text.rigs.size(), 1U);
  EXPECT_EQ(text.frames.size(), 3U);
  EXPECT_EQ(text.cameras.at(1), (Camera{"PINHOLE", 90, 80, {90.0, 90.0, 45.0, 40.0}}));
  std::set<std::string> names;
  for (const auto& [id, image] : text.images) {
    names.insert(image.name);
    EXPECT_TRUE(fs::exists(sequence / "images" / image.name)) << image.name;
  }
  EXPECT_EQ(names.count("mcs4/cam2/000001.png"), 1U);
}

TEST_F(Colmap, ObservationsReprojectExactly) {
  run();
  const Model model = read_text(sequence / "sparse_txt/0");
  double worst_px = 0.0;
  std::size_t num_observations = 0;
  for (const auto& [id, image] : model.images) {
    const std::vector<double>& k = model.cameras.at(image.camera).parameters;
    for (std::size_t i = 0; i < image.observations.size(); ++i) {
      const Observation& o = image.observations[i];
      const Point& point = model.points.at(static_cast<std::uint64_t>(o.point));
      EXPECT_EQ(std::count(point.track.begin(), point.track.end(),
                           std::pair(id, static_cast<std::uint32_t>(i))),
                1);
      const Vector3d p = image.camera_from_world * point.position;
      worst_px = std::max({worst_px, std::abs(k[0] * p.x() / p.z() + k[2] - o.x),
                           std::abs(k[1] * p.y() / p.z() + k[3] - o.y)});
      ++num_observations;
    }
  }
  EXPECT_LT(worst_px, 1e-9);
  std::size_t num_in_tracks = 0;
  for (const auto& [id, point] : model.points) {
    EXPECT_GE(point.track.size(), 2U);
    EXPECT_EQ(point.error, 0.0);
    num_in_tracks += point.track.size();
  }
  EXPECT_EQ(num_observations, num_in_tracks);
  EXPECT_GT(model.points.size(), 50U);
}

TEST_F(Colmap, StatesWhatIsBelievedOrWhatIsTrue) {
  TinyCaptureOptions options = kSmall;
  options.has_camera_errors = true;
  run(options);
  const Model truth = read_text(sequence / "sparse_txt/0");
  const Json sequence_true = Json::read(root / "dataset.json").at("sequences").at(std::size_t{0});
  const auto hashes_true = file_hashes(sequence);
  fs::remove_all(root);
  run(options, "calibration = \"believed\"");
  const Model believed = read_text(sequence / "sparse_txt/0");
  EXPECT_EQ(believed, read_binary(sequence / "sparse/0"));
  const Json sequence_believed =
      Json::read(root / "dataset.json").at("sequences").at(std::size_t{0});
  EXPECT_EQ(sequence_true.at("calibration").string(), "true");
  EXPECT_EQ(sequence_believed.at("calibration").string(), "believed");

  // All but the model, the rig and the database are of the true cameras in both.
  for (const auto& [file, hash] : file_hashes(sequence)) {
    const bool is_stated =
        file.starts_with("sparse") || file == "rig_config.json" || file == "database.db";
    if (!is_stated) {
      EXPECT_EQ(hashes_true.at(file), hash) << file;
    }
  }
  EXPECT_NE(hashes_true.at("rig_config.json"), file_hashes(sequence).at("rig_config.json"));
  EXPECT_EQ(truth.points, believed.points);

  const capture::SequenceInfo info = tiny_sequence(options);
  for (const auto& [id, image] : believed.images) {
    EXPECT_EQ(image.observations, truth.images.at(id).observations);
    const auto index = static_cast<std::size_t>(image.camera - 1);
    EXPECT_EQ(believed.cameras.at(image.camera).parameters, (std::vector<double>{90, 90, 45, 40}));
    EXPECT_EQ(truth.cameras.at(image.camera).parameters, info.cameras[index].intrinsics.parameters);
    // What takes the one camera's points to the other is as the capture has it.
    const Pose& a = truth.images.at(id).camera_from_world;
    const Pose& b = image.camera_from_world;
    const geo::Rigid3d expected = info.believed_cameras[index].rig_from_camera.inverse() *
                                  info.cameras[index].rig_from_camera;
    const Vector3d point = a * Vector3d(7.0, -11.0, 3.0);
    EXPECT_LT((expected * point - b * Vector3d(7.0, -11.0, 3.0)).norm(), 1e-9) << image.name;
    EXPECT_GT((point - b * Vector3d(7.0, -11.0, 3.0)).norm(), 0.01);
  }
  // Poses by rig and frame are those of the images.
  for (const auto& [id, frame] : believed.frames) {
    const Rig& rig = believed.rigs.at(frame.rig);
    for (const auto& [camera, image] : frame.images) {
      const Vector3d in_rig = frame.rig_from_world * Vector3d(7.0, -11.0, 3.0);
      const Vector3d by_rig = camera == rig.reference ? in_rig : rig.others.at(camera) * in_rig;
      const Pose& pose = believed.images.at(static_cast<std::uint32_t>(image)).camera_from_world;
      EXPECT_LT((by_rig - pose * Vector3d(7.0, -11.0, 3.0)).norm(), 1e-9);
    }
  }
}

TEST_F(Colmap, PointsAreTheTracksThatTwoImagesSee) {
  run();
  const Model model = read_text(sequence / "sparse_txt/0");
  const capture::SequenceInfo info = tiny_sequence(kSmall);
  std::size_t num_expected = 0, num_once = 0;
  for (const capture::TrackPoint& track : tiny_tracks()) {
    std::vector<std::pair<std::string, Eigen::Vector2d>> seen;
    for (int frame = 0; frame < 3; ++frame) {
      for (const auto& camera : info.cameras) {
        const geo::Rigid3d pose = tiny_world_from_camera(kSmall, frame, camera);
        Eigen::Vector2d pixel;
        if (tiny_sees(camera, pose.inverse() * track.point_world, &pixel) &&
            !scene.is_hidden(pose.translation, track.point_world))
          seen.emplace_back(fmt::format("mcs4/{}/{:06}.png", camera.name, frame), pixel);
      }
    }
    num_once += seen.size() == 1 ? 1 : 0;
    if (seen.size() < 2) continue;
    ++num_expected;
    const Vector3d local = local_from_world(track.point_world);
    const Point* nearest = nullptr;
    for (const auto& [id, point] : model.points)
      if (nearest == nullptr ||
          (point.position - local).norm() < (nearest->position - local).norm())
        nearest = &point;
    ASSERT_NE(nearest, nullptr);
    EXPECT_LE((nearest->position - local).norm(), 1e-8);  // two passages through ecef
    ASSERT_EQ(nearest->track.size(), seen.size());
    for (const auto& [image_id, index] : nearest->track) {
      const Image& image = model.images.at(image_id);
      const auto found = std::find_if(seen.begin(), seen.end(),
                                      [&](const auto& each) { return each.first == image.name; });
      ASSERT_NE(found, seen.end()) << image.name;
      const Observation& o = image.observations.at(index);
      EXPECT_LE((Eigen::Vector2d(o.x, o.y) - found->second).norm(), 1e-9);
    }
    // The scene's colour is smooth: within a pixel of the point it changes by a few levels.
    const Vector3d color = tiny_color(track.point_world);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(nearest->color[k], color[k], 12.0);
  }
  EXPECT_EQ(model.points.size(), num_expected);
  EXPECT_GT(num_once, 0U);  // a point that one image sees was there to be left out
}

TEST_F(Colmap, RigsAndImagesGiveTheSamePoses) {
  TinyCaptureOptions both = kSmall;
  both.has_tartan2 = true;
  both.num_frames = 2;
  run(both);
  const Model model = read_binary(sequence / "sparse/0");
  EXPECT_EQ(model.rigs.size(), 2U);
  EXPECT_EQ(model.frames.size(), 4U);  // a frame of COLMAP's is one rig at one instant
  std::set<std::uint64_t> images_in_frames;
  for (const auto& [id, frame] : model.frames) {
    const Rig& rig = model.rigs.at(frame.rig);
    for (const auto& [sensor, image_id] : frame.images) {
      EXPECT_TRUE(images_in_frames.insert(image_id).second);
      const Image& image = model.images.at(static_cast<std::uint32_t>(image_id));
      EXPECT_EQ(image.camera, sensor);
      const Vector3d point(-30.0, 210.0, -150.0);
      Vector3d by_rig = frame.rig_from_world * point;
      if (sensor != rig.reference) by_rig = rig.others.at(sensor) * by_rig;
      EXPECT_LE((by_rig - image.camera_from_world * point).norm(), 1e-12 * point.norm());
    }
  }
  EXPECT_EQ(images_in_frames.size(), model.images.size());
}

TEST_F(Colmap, DepthsBackProjectOntoTheScene) {
  run();
  const Model model = read_text(sequence / "sparse_txt/0");
  const Vector3d ground = local_from_world(scene.ground_point);
  const Vector3d ground_normal =
      local_from_world(scene.ground_point + scene.ground_normal) - ground;
  const Vector3d wall = local_from_world(scene.wall_center);
  const Vector3d wall_normal = local_from_world(scene.wall_center + scene.wall_normal()) - wall;
  int num_checked = 0;
  for (const auto& [id, image] : model.images) {
    const Array depth =
        parse_npy(slurp(sequence / "depth" / fs::path(image.name).replace_extension(".npy")));
    ASSERT_EQ(depth.shape, (std::vector<int>{80, 90}));
    const std::vector<double>& k = model.cameras.at(image.camera).parameters;
    for (int v = 0; v < 80; v += 3) {
      for (int u = 0; u < 90; u += 3) {
        const double d = static_cast<double>(depth.values[static_cast<std::size_t>(90 * v + u)]);
        if (d == 0.0) continue;
        const Vector3d camera((u + 0.5 - k[2]) / k[0] * d, (v + 0.5 - k[3]) / k[1] * d, d);
        const Vector3d local = image.camera_from_world.rotation.conjugate() *
                               (camera - image.camera_from_world.translation);
        const double off = std::min(std::abs(ground_normal.dot(local - ground)),
                                    std::abs(wall_normal.dot(local - wall)));
        EXPECT_LE(off, 1.3e-7 * camera.norm() + 1e-7);  // float32 range and depth
        ++num_checked;
      }
    }
  }
  EXPECT_GT(num_checked, 2000);
}

TEST_F(Colmap, RigsCanBeChosenAndDepthLeftOut) {
  TinyCaptureOptions both = kSmall;
  both.has_tartan2 = true;
  both.num_frames = 2;
  run(both, "rigs = [\"tartan2\"]\ndepth = false");
  const Model model = read_text(sequence / "sparse_txt/0");
  EXPECT_EQ(model.cameras.size(), 2U);
  EXPECT_EQ(model.images.size(), 4U);
  EXPECT_FALSE(fs::exists(sequence / "depth"));
  EXPECT_FALSE(fs::exists(sequence / "images/mcs4"));
}

// A right model of one of four rigs held too few points for its own check.
TEST(ColmapTrackPoints, AreSoManyThatThoseOfItsOwnCamerasWillDo) {
  std::vector<capture::CameraCalibration> cameras(8);
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    cameras[c].rig = c < 2 ? "pair" : "ring";
    cameras[c].name = "cam" + std::to_string(c);
  }
  const auto wanted = [&](const char* rigs, std::int64_t num_frames) {
    return export_options(std::string("format = \"colmap\"\n") + rigs)
        .exporter()
        .track_points_wanted(cameras, num_frames);
  };
  // All cameras: each point is theirs.
  EXPECT_EQ(wanted("", 3).least, 50 * 3 * 8);
  EXPECT_EQ(wanted("", 3).expected, 50 * 3 * 8);
  EXPECT_EQ(wanted("", 300).expected, 2000);
  // A quarter of them: of n points a binomial number, n / 4 with a variance of 3 n / 16.
  const auto fewest = [](std::int64_t n) { return 0.25 * n - 5.0 * std::sqrt(0.1875 * n); };
  for (const auto& [num_frames, least] : {std::pair(3, 300), std::pair(300, 2000)}) {
    const auto found = wanted("rigs = [\"pair\"]\n", num_frames);
    EXPECT_EQ(found.least, least);
    EXPECT_GE(fewest(found.expected), least - 1e-9);
    EXPECT_LT(fewest(found.expected - 1), least);
  }
}

TEST_F(Colmap, TooFewImagesAreRefused) {
  TinyCaptureOptions one = kSmall;
  one.has_mcs4 = false;
  one.has_tartan2 = true;
  one.num_frames = 1;
  expect_error(ErrorKind::Input, {"2 images", "3 or more", "valley"}, [&] { run(one); });
}

TEST(ColmapCheck, UnknownRigsAreNamed) {
  expect_error(ErrorKind::Config, {"mcs5", "mcs4"}, [] {
    export_options("format = \"colmap\"\nrigs = [\"mcs5\"]")
        .exporter()
        .check(tiny_sequence(kSmall).cameras);
  });
}

}  // namespace
}  // namespace terracast::test
