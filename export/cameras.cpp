#include "export/cameras.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>

#include "core/error.h"
#include "core/registry.h"

namespace terracast::exporters {

using core::ErrorKind;
using core::fail;

std::vector<std::string> rigs_of(const std::vector<capture::CameraCalibration>& cameras) {
  std::vector<std::string> rigs;
  for (const capture::CameraCalibration& camera : cameras)
    if (std::find(rigs.begin(), rigs.end(), camera.rig) == rigs.end()) rigs.push_back(camera.rig);
  return rigs;
}

void check_rigs(const Exporter& exporter, const std::vector<std::string>& known) {
  for (const std::string& rig : exporter.rigs())
    if (std::find(known.begin(), known.end(), rig) == known.end())
      fail(ErrorKind::Config, "{}", core::unknown_name_message("rig", rig, known));
}

std::vector<ExportedCamera> cameras_taken(const Exporter& exporter,
                                          const std::vector<capture::CameraCalibration>& cameras) {
  std::vector<ExportedCamera> taken;
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (exporter.takes(cameras[i].rig))
      taken.push_back({cameras[i].rig + "/" + cameras[i].name, static_cast<int>(i)});
  if (!taken.empty()) return taken;
  check_rigs(exporter, rigs_of(cameras));
  fail(ErrorKind::Config, "there is no camera to export");
}

void check_provable(const Exporter& exporter,
                    const std::vector<capture::CameraCalibration>& cameras) {
  for (const ExportedCamera& taken : cameras_taken(exporter, cameras)) {
    const std::string& model =
        cameras[static_cast<std::size_t>(taken.camera_index)].intrinsics.model;
    if (model.find('.') != std::string::npos)
      fail(ErrorKind::Config,
           "camera {} has the model {} of a plug-in, whose projection `terracast validate` does "
           "not know, so that nothing exported of it could be proved; name other rigs, or export "
           "it in a format of a plug-in",
           taken.name, model);
  }
}

int find_camera(const std::vector<capture::CameraCalibration>& cameras, const std::string& rig,
                const std::string& name) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (cameras[i].rig != rig) continue;
    if (cameras[i].name == name) return static_cast<int>(i);
    names.push_back(cameras[i].name);
  }
  if (names.empty())
    fail(ErrorKind::Config, "{}", core::unknown_name_message("rig", rig, rigs_of(cameras)));
  fail(ErrorKind::Config, "{}",
       core::unknown_name_message(fmt::format("camera of the rig {}", rig), name, names));
}

void check_pinhole(const capture::CameraCalibration& camera, const char* format) {
  if (camera.intrinsics.model == "pinhole") return;
  fail(ErrorKind::Config,
       "{}: camera {}/{} is of the model {}; the format wants a pinhole (the capture itself holds "
       "every model, and coco labels of its images)",
       format, camera.rig, camera.name, camera.intrinsics.model);
}

void check_shutters_of_pair(const capture::CameraCalibration& left,
                            const capture::CameraCalibration& right, const char* format) {
  const geo::Shutter& a = left.shutter;
  const geo::Shutter& b = right.shutter;
  if (!a.is_rolling() && !b.is_rolling()) return;
  const auto words = [](const geo::Shutter& shutter) {
    return fmt::format("line_time_us = {}, readout = \"{}\"", 1e6 * shutter.line_time_s,
                       geo::kReadoutNames[static_cast<std::size_t>(shutter.readout)]);
  };
  if (a.line_time_s != b.line_time_s || a.readout != b.readout)
    fail(ErrorKind::Config,
         "{}: cameras {} ({}) and {} ({}) of {} have other rolling shutters; a rectified pair sees "
         "a point at "
         "one time in both only where the two are alike",
         format, left.name, words(a), right.name, words(b), left.rig);
  if (a.has_columns())
    fail(ErrorKind::Config,
         "{}: cameras {} and {} of {} have a rolling shutter by columns ({}); a point stands in "
         "other columns of "
         "a rectified pair, is seen at other times, and its disparity is not f b / z: readout = "
         "\"down\" or "
         "\"up\" is right",
         format, left.name, right.name, left.rig, words(a));
}

double rectified_baseline_m(const capture::CameraCalibration& left,
                            const capture::CameraCalibration& right, const char* format) {
  constexpr double kTolerance = 1e-9;  // of rad and m: rounding, not a misalignment
  if (left.rig != right.rig)
    fail(ErrorKind::Config, "{}: cameras {}/{} and {}/{} are of two rigs; a pair is of one", format,
         left.rig, left.name, right.rig, right.name);
  if (left.intrinsics != right.intrinsics)
    fail(ErrorKind::Config,
         "{}: cameras {} ({} x {} px) and {} ({} x {} px) of {} differ in size or intrinsics; a "
         "rectified pair has the same",
         format, left.name, left.intrinsics.width_px, left.intrinsics.height_px, right.name,
         right.intrinsics.width_px, right.intrinsics.height_px, left.rig);
  const geo::Rigid3d left_from_right = left.rig_from_camera.inverse() * right.rig_from_camera;
  const double angle_rad = left_from_right.rotation.angularDistance(Eigen::Quaterniond::Identity());
  if (!(angle_rad <= kTolerance))
    fail(ErrorKind::Config,
         "{}: cameras {} and {} of {} are turned by {:.3g} rad against each other; a rectified "
         "pair is parallel",
         format, left.name, right.name, left.rig, angle_rad);
  const Eigen::Vector3d& offset = left_from_right.translation;
  if (!(std::abs(offset.y()) <= kTolerance) || !(std::abs(offset.z()) <= kTolerance) ||
      !(offset.x() > 0.0))
    fail(ErrorKind::Config,
         "{}: camera {} of {} stands at ({:.9g}, {:.9g}, {:.9g}) m in the frame of {} (x right, y "
         "down, z forward); a rectified pair is apart along +x alone",
         format, right.name, left.rig, offset.x(), offset.y(), offset.z(), left.name);
  return offset.x();
}

FrameSize size_of_images(const std::vector<const capture::CameraCalibration*>& cameras,
                         double bytes_per_px) {
  FrameSize size;
  for (const capture::CameraCalibration* camera : cameras)
    size.num_pixels += static_cast<double>(camera->intrinsics.width_px) *
                       static_cast<double>(camera->intrinsics.height_px);
  size.num_bytes = size.num_pixels * bytes_per_px;
  return size;
}

std::string folder_word(const std::string& text) {
  std::string word = text;
  for (char& c : word)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_' && c != '-') c = '_';
  return word;
}

}  // namespace terracast::exporters
