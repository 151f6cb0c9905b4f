#include "rigs/opencv_lens.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "core/error.h"
#include "rigs/rig_file.h"

namespace terracast::rigs {
namespace {

using core::ErrorKind;
using core::fail;

bool are_zero(const std::vector<double>& values, std::size_t begin) {
  return std::all_of(values.begin() + static_cast<std::ptrdiff_t>(begin), values.end(),
                     [](double value) { return value == 0.0; });
}

void check_matrix(const std::vector<double>& k, std::string_view where) {
  if (k.size() != 9) fail(ErrorKind::Input, "{} has {} numbers; it takes 9", where, k.size());
  if (k[0] == 0.0 || k[4] == 0.0)
    fail(ErrorKind::Input,
         "{}: the focal lengths are {} and {} px: the camera was not calibrated; calibrate it, and "
         "import what that writes",
         where, k[0], k[4]);
  if (k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0)
    fail(ErrorKind::Input,
         "{}: {} {} {} / {} {} {} / {} {} {} is no camera matrix fx 0 cx / 0 fy cy / 0 0 1", where,
         k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]);
  if (k[1] != 0.0)
    fail(ErrorKind::Input,
         "{}: {} {} {} / … is no camera matrix fx 0 cx / 0 fy cy / 0 0 1: no model of a rig has a "
         "skew, here of {} px; calibrate with the skew fixed at 0, or write 0 where that moves no "
         "point by more than you can bear",
         where, k[0], k[1], k[2], k[1]);
}

/// How many of the coefficients a model of ours has to hold.
std::size_t num_needed(const std::vector<double>& d, std::string_view where) {
  constexpr std::size_t kRational = 8;
  if (d.size() != 0 && d.size() != 4 && d.size() != 5 && d.size() != kRational && d.size() != 12 &&
      d.size() != 14)
    fail(ErrorKind::Input,
         "{}: {} distortion coefficients; OpenCV has 4, 5, 8, 12 or 14, of a fisheye 4", where,
         d.size());
  if (d.size() > kRational && !are_zero(d, kRational))
    fail(
        ErrorKind::Input,
        "{}: the coefficients after the eighth, {}, are thin prisms and a tilted sensor, which no "
        "model of a rig has beside a pinhole's; calibrate without them (no CALIB_THIN_PRISM_MODEL, "
        "no CALIB_TILTED_MODEL)",
        where, fmt::join(d.begin() + kRational, d.end(), " "));
  if (are_zero(d, 0)) return 0;
  return are_zero(d, 4) ? 4 : kRational;
}

}  // namespace

bool is_fisheye_model(std::string_view name, const std::vector<double>& coefficients,
                      std::string_view where) {
  struct Model {
    std::string_view name;
    bool is_fisheye;
  };
  // Of those without a fisheye the number of coefficients decides, as in OpenCV, which takes them.
  constexpr std::array kModels = {Model{"plumb_bob", false}, Model{"rational_polynomial", false},
                                  Model{"equidistant", true}, Model{"fisheye", true},
                                  Model{"none", false}};
  if (name.empty()) return false;
  if (name == "none" && !are_zero(coefficients, 0))
    fail(ErrorKind::Input, "{}: none, beside coefficients {}; state the model, or leave them out",
         where, fmt::join(coefficients, " "));
  std::vector<std::string_view> names;
  for (const Model& known : kModels) {
    if (known.name == name) return known.is_fisheye;
    names.push_back(known.name);
  }
  fail(ErrorKind::Input, "{}: distortion_model {} is not known; known are {}", where, name,
       fmt::join(names, ", "));
}

geo::CameraIntrinsics intrinsics_of_opencv(const OpencvLens& lens, std::string_view where_matrix,
                                           std::string_view where_coefficients) {
  const std::vector<double>& k = lens.camera_matrix;
  check_matrix(k, where_matrix);
  std::vector<double> d = lens.coefficients;
  if (lens.is_fisheye && d.size() != 4)
    fail(ErrorKind::Input, "{}: {} distortion coefficients; a fisheye has 4, k1 k2 k3 k4",
         where_coefficients, d.size());
  if (!lens.is_fisheye) d.resize(num_needed(d, where_coefficients), 0.0);
  const auto model =
      std::find_if(kOpencvModels.begin(), kOpencvModels.end(), [&](const OpencvModel& one) {
        return one.is_fisheye == lens.is_fisheye && one.num_coefficients == d.size();
      });
  TERRACAST_CHECK(model != kOpencvModels.end(), "no model of {} coefficients", d.size());
  geo::CameraIntrinsics intrinsics{
      .model = std::string(model->model),
      .width_px = lens.width_px,
      .height_px = lens.height_px,
      .parameters = {k[0], k[4], k[2] + kCentreOfFirstPixel_px, k[5] + kCentreOfFirstPixel_px}};
  intrinsics.parameters.insert(intrinsics.parameters.end(), d.begin(), d.end());
  return intrinsics;
}

}  // namespace terracast::rigs
