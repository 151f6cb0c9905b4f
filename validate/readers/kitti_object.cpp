#include "validate/readers/kitti_object.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "validate/readers/kitti_files.h"
#include "validate/readers/single_images.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

/// Lines of a calib file by their place among its keys.
constexpr std::size_t kLeftColor = 2, kCameraFromVelodyne = 5, kVelodyneFromBody = 6;
constexpr double kDigitsOfRotations = 1e-9;  // the files have 13

/// What one image's calib file says.
struct Calibration {
  Projection p2;
  Eigen::Matrix3d rect = Eigen::Matrix3d::Identity();
  Pose camera_from_body = {};
};

Pose pose_of(const std::vector<double>& numbers) {
  const Projection matrix = projection_from_numbers(numbers);
  return {matrix.leftCols<3>(), matrix.col(3)};
}

/// One camera stands for all four, at the place that P2 projects from; there is no scanner, so that its frame is
/// the camera's with x forward, y left, z up.
/// values   of the lines of a calib file
void check_frames(const std::span<const std::vector<double>> values, const std::string& name) {
  for (const std::size_t other : {0, 1, 3})
    if (values[other] != values[kLeftColor])
      fail(ErrorKind::Input, "{}: P{} is not P2; there is one camera", name, other);
  if (projection_from_numbers(values[kLeftColor]).col(3) != Vector3d::Zero())
    fail(ErrorKind::Input, "{}: P2 projects from beside the camera", name);
  if (values[kCameraFromVelodyne] != std::vector<double>{0, -1, 0, 0, 0, 0, -1, 0, 1, 0, 0, 0})
    fail(ErrorKind::Input, "{}: Tr_velo_to_cam is no change of axes from x forward, y left, z up",
         name);
}

Calibration read_calibration(const std::filesystem::path& file, const std::string& name) {
  struct Key {
    std::string_view name;
    std::size_t count;
  };
  constexpr std::array<Key, 7> kKeys = {Key{"P0", 12},
                                        Key{"P1", 12},
                                        Key{"P2", 12},
                                        Key{"P3", 12},
                                        Key{"R0_rect", 9},
                                        Key{"Tr_velo_to_cam", 12},
                                        Key{"Tr_imu_to_velo", 12}};
  std::array<std::vector<double>, kKeys.size()> values;
  const std::string text = core::read_text_file(file);
  for (const TextLine& line : split_lines(text)) {
    if (trimmed(line.text).empty()) continue;
    const std::string where = name + ":" + std::to_string(line.number);
    const std::size_t colon = line.text.find(':');
    const std::string_view word = line.text.substr(0, colon);
    const auto* key =
        std::find_if(kKeys.begin(), kKeys.end(), [&](const Key& one) { return one.name == word; });
    if (colon == std::string_view::npos || key == kKeys.end())
      fail(ErrorKind::Input, "{}: a line that begins with none of the format's keys", where);
    values[static_cast<std::size_t>(key - kKeys.begin())] =
        parse_numbers(line.text.substr(colon + 1), key->count, where);
  }
  for (std::size_t i = 0; i < kKeys.size(); ++i)
    if (values[i].empty()) fail(ErrorKind::Input, "{}: no line {}:", name, kKeys[i].name);
  Calibration calibration{.p2 = projection_from_numbers(values[2])};
  check_frames(values, name);
  calibration.camera_from_body =
      pose_of(values[kCameraFromVelodyne]) * pose_of(values[kVelodyneFromBody]);
  for (int i = 0; i < 9; ++i)
    calibration.rect(i / 3, i % 3) = values[4][static_cast<std::size_t>(i)];
  constexpr double kDigits = 1e-9;  // the files have 13
  if (!((calibration.rect.transpose() * calibration.rect - Eigen::Matrix3d::Identity())
            .cwiseAbs()
            .maxCoeff() < kDigits) ||
      !(calibration.rect.determinant() > 0.0))
    fail(ErrorKind::Input, "{}: R0_rect is no rotation", name);
  return calibration;
}

/// Of the camera itself: K = P2 R0_rect.
void take_intrinsics(const Calibration& calibration, const std::string& name,
                     Intrinsics& intrinsics) {
  const Eigen::Matrix3d k = calibration.p2.leftCols<3>() * calibration.rect;
  const double largest = k.cwiseAbs().maxCoeff();
  const double kDigits = 1e-9 * largest;
  if (!(std::abs(k(0, 1)) < kDigits) || !(std::abs(k(1, 0)) < kDigits) ||
      !(std::abs(k(2, 0)) < kDigits) || !(std::abs(k(2, 1)) < kDigits) ||
      !(std::abs(k(2, 2) - 1.0) < kDigits) || !(k(0, 0) > 0.0) || !(k(1, 1) > 0.0))
    fail(ErrorKind::Input, "{}: P2 R0_rect is no camera matrix", name);
  intrinsics.fx_px = k(0, 0);
  intrinsics.fy_px = k(1, 1);
  intrinsics.cx_px = k(0, 2) + 0.5;
  intrinsics.cy_px = k(1, 2) + 0.5;
}

/// throws   Input: the camera is elsewhere on the body than dataset.json says
void check_mount(const Calibration& calibration, const std::string& name, const Camera& camera) {
  if (!camera.body_from_camera) return;
  const Pose stated = camera.body_from_camera->inverse();
  constexpr double kDigits_m = 1e-9;  // of metres
  if (!((calibration.camera_from_body.rotation - stated.rotation).norm() <= kDigitsOfRotations) ||
      !((calibration.camera_from_body.translation - stated.translation).norm() <=
        kDigits_m * (1.0 + stated.translation.norm())))
    fail(ErrorKind::Input, "{}: Tr_imu_to_velo is not the camera's mount of dataset.json", name);
}

/// A row of label_2.
struct Label {
  std::string type;
  double truncated = 0.0, alpha = 0.0;
  std::int64_t occluded = 0;
  Eigen::AlignedBox2d box;  ///< pixel centres at whole numbers
  double height_m = 0.0, width_m = 0.0, length_m = 0.0;
  Vector3d foot = Vector3d::Zero();
  double turn = 0.0;  ///< about y

  std::vector<Vector3d> corners() const {
    std::vector<Vector3d> all;
    const Eigen::AngleAxisd rotation(turn, Vector3d::UnitY());
    for (const double x : {-0.5, 0.5})
      for (const double y : {0.0, -1.0})
        for (const double z : {-0.5, 0.5})
          all.push_back(foot + rotation * Vector3d(x * length_m, y * height_m, z * width_m));
    return all;
  }
};

Label label_of(std::string_view line, const std::string& where) {
  const std::vector<std::string_view> words = split_at(line, ' ');
  if (words.size() != 15)
    fail(ErrorKind::Input, "{}: {} fields parted by single blanks, not 15", where, words.size());
  std::array<double, 15> n{};
  for (std::size_t i = 1; i < n.size(); ++i)
    if (i != 2) n[i] = parse_number(words[i], where);
  Label label{.type = std::string(words[0]),
              .truncated = n[1],
              .alpha = n[3],
              .occluded = parse_integer(words[2], where),
              .box = {Eigen::Vector2d(n[4], n[5]), Eigen::Vector2d(n[6], n[7])},
              .height_m = n[8],
              .width_m = n[9],
              .length_m = n[10],
              .foot = {n[11], n[12], n[13]},
              .turn = n[14]};
  constexpr std::array<std::string_view, 9> kTypes = {
      "Car", "Van", "Truck", "Pedestrian", "Person_sitting", "Cyclist", "Tram", "Misc", "DontCare"};
  if (std::find(kTypes.begin(), kTypes.end(), label.type) == kTypes.end())
    fail(ErrorKind::Input, "{}: type \"{}\" is none of KITTI's", where,
         core::first_letters(label.type, 40));
  return label;
}

/// throws   Input: what is wrong with it
void check_label(const Label& label, const Calibration& calibration, const Intrinsics& image,
                 const std::string& where) {
  if (label.box.isEmpty() || !(label.box.min().minCoeff() >= 0.0) ||
      !(label.box.max().x() <= image.width_px - 1.0) ||
      !(label.box.max().y() <= image.height_px - 1.0))
    fail(ErrorKind::Input, "{}: its box is empty or leaves the image", where);
  if (label.type == "DontCare") return;
  if (!(label.truncated >= 0.0 && label.truncated <= 1.0) || label.occluded < 0 ||
      label.occluded > 3 || !(std::min({label.height_m, label.width_m, label.length_m}) >= 0.0))
    fail(ErrorKind::Input, "{}: truncated {}, occluded {} or dimensions that none can be", where,
         label.truncated, label.occluded);
  // Six decimals of angles, four of places.
  constexpr double kAngle_rad = 1e-4;
  const double alpha = label.turn - std::atan2(label.foot.x(), label.foot.z());
  if (!(std::abs(std::remainder(label.alpha - alpha, 2.0 * kPi)) < kAngle_rad))
    fail(ErrorKind::Input,
         "{}: alpha {} does not follow from its place and turn, which make {:.6f}", where,
         label.alpha, std::remainder(alpha, 2.0 * kPi));
  Eigen::AlignedBox2d projected;
  constexpr double kNear_m = 0.1;
  for (const Vector3d& corner : label.corners()) {
    const Vector3d pixel = calibration.p2 * corner.homogeneous();
    if (pixel.z() < kNear_m) return;  // passes the camera
    projected.extend(pixel.hnormalized().head<2>());
  }
  // Places of 0.1 mm near by; farther off the ground curves by less than that.
  constexpr double kSlack_px = 0.2;
  const double out_px = std::max((projected.min() - label.box.min()).maxCoeff(),
                                 (label.box.max() - projected.max()).maxCoeff());
  if (!(out_px <= kSlack_px))
    fail(ErrorKind::Input,
         "{}: its box in the image reaches {:.2f} px beyond the projection of its box in space",
         where, out_px);
}

}  // namespace

void KittiObjectReader::read(const Dataset& dataset, Sequence& sequence, Findings& findings) const {
  take_georeferenced_poses(sequence);
  int first_number = 0;
  for (const Sequence& before : dataset.sequences) first_number += before.num_frames;
  const int camera_index = sequence.camera_index("image_2");
  if (camera_index < 0) {
    findings.add("dataset.json", "no camera image_2 in sequence " + sequence.name);
    return;
  }
  Camera& camera = sequence.cameras[static_cast<std::size_t>(camera_index)];
  for (int frame = 0; frame < sequence.num_frames; ++frame) {
    const std::string digits = frame_digits(first_number + frame);
    const std::string image = "training/image_2/" + digits + ".png";
    const std::string calib = "training/calib/" + digits + ".txt";
    const std::string labels = "training/label_2/" + digits + ".txt";
    if (findings.attempt(image, [&] {
          Intrinsics size;
          read_size(dataset, image, size);
          if (size.width_px != camera.intrinsics.width_px ||
              size.height_px != camera.intrinsics.height_px)
            fail(ErrorKind::Input, "{}: {} x {} pixels", image, size.width_px, size.height_px);
        }))
      camera.files[static_cast<std::size_t>(frame)].color = image;
    Calibration calibration;
    if (!findings.attempt(calib, [&] {
          calibration = read_calibration(dataset.root / calib, calib);
          take_intrinsics(calibration, calib, camera.intrinsics);
          check_mount(calibration, calib, camera);
        }))
      continue;
    std::string text;
    if (!findings.attempt(labels, [&] { text = core::read_text_file(dataset.root / labels); }))
      continue;
    for (const TextLine& line : split_lines(text))
      findings.attempt(labels, [&] {
        const std::string where = labels + ":" + std::to_string(line.number);
        check_label(label_of(line.text, where), calibration, camera.intrinsics, where);
      });
  }
}

core::ImageF KittiObjectReader::depth(const Dataset& dataset, const Camera& camera, int) const {
  fail(ErrorKind::Internal, "{} holds no depth (asked for {})", dataset.format, camera.name);
}

}  // namespace terracast::validate
