#include "tests/jobs/rigs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terracast::test {

namespace {

constexpr double kRadians = 3.14159265358979 / 180.0;

/// A camera's size in pixels.
struct ImageSize {
  int width_px = 64;
  int height_px = 48;
};

ImageSize draw_size(Draws& draws, double pixels) {
  const double aspect = draws.among({4.0 / 3.0, 4.0 / 3.0, 1.0, 16.0 / 9.0, 2.5, 0.75});
  const double width = std::clamp(std::sqrt(pixels * aspect), 64.0, 1280.0);
  const double height = std::clamp(width / aspect, 48.0, 960.0);
  return {static_cast<int>(width), static_cast<int>(height)};
}

/// A lens before which the image lies in a plane; most cameras have none.
/// returns   its keys, focal length included
std::string draw_planar_lens(Draws& draws, const ImageSize& size) {
  const double half_view_deg = draws.between(12.0, 55.0);
  const double f = 0.5 * size.width_px / std::tan(half_view_deg * kRadians);
  std::string text = fmt::format("fx_px = {:.4f}\n", f);
  if (draws.chance(0.3)) text += fmt::format("fy_px = {:.4f}\n", f * draws.between(0.95, 1.05));
  if (draws.chance(0.4))
    text += fmt::format("principal_point_px = [{:.3f}, {:.3f}]\n",
                        size.width_px * draws.between(0.45, 0.55),
                        size.height_px * draws.between(0.45, 0.55));
  // Distortion moves the corners of the view by at most a tenth, so that the model stays one-to-one.
  const double corner = 1.0 / std::pow(std::tan(half_view_deg * kRadians) * 1.4, 2.0);
  const double k1 = std::min(corner, 1.0) * draws.both_ways(0.1);
  switch (draws.weighted({6.0, 1.0, 1.0, 1.0})) {
    case 1:
      return text + fmt::format("model = \"simple_radial\"\nk1 = {:.5f}\n", k1);
    case 2:
      return text + fmt::format("model = \"radial\"\nk1 = {:.5f}\nk2 = {:.5f}\n", k1, -0.2 * k1);
    case 3:
      return text +
             fmt::format("model = \"opencv\"\nk1 = {:.5f}\nk2 = {:.5f}\np1 = {:.6f}\np2 = {:.6f}\n",
                         k1, -0.1 * k1, draws.both_ways(0.002), draws.both_ways(0.002));
    default:
      return text;
  }
}

/// A wide-angle model that COLMAP supports.
std::string draw_fisheye(Draws& draws, const ImageSize& size) {
  const double scale = size.width_px / 160.0;
  switch (draws.below(3)) {
    case 0:
      return fmt::format(
          "model = \"opencv_fisheye\"\nfx_px = {:.3f}\nk1 = {:.4f}\nk2 = -0.01\nk3 = 0.003\nk4 = "
          "-0.0005\n",
          90.0 * scale, draws.both_ways(0.02));
    case 1:
      return fmt::format(
          "model = \"thin_prism_fisheye\"\nfx_px = {:.3f}\nk1 = -0.03\nk2 = 0.004\np1 = {:.5f}\np2 "
          "= -0.0008\nsx1 = 0.001\n"
          "sy1 = -0.002\n",
          88.0 * scale, draws.both_ways(0.001));
    default:
      return fmt::format("model = \"fov\"\nfx_px = {:.3f}\nomega = {:.3f}\n", 100.0 * scale,
                         draws.between(0.6, 0.95));
  }
}

/// A wide-angle model that COLMAP does not support.
std::string draw_wide(Draws& draws, const ImageSize& size) {
  const double scale = size.width_px / 160.0;
  const double corner_px = 0.5 * std::hypot(size.width_px, size.height_px);
  switch (draws.below(7)) {
    case 0:
      // Straight backwards no pixel sees an angle: corners stay within 2.3 radians.
      return fmt::format("model = \"opencv_fisheye\"\nfx_px = {:.3f}\nk1 = 0.01\nk2 = -0.002\n",
                         std::max(45.0 * scale, corner_px / 2.3));
    case 1:
      return fmt::format("model = \"unified\"\nfx_px = {:.3f}\nxi = 1.25\nk1 = -0.05\np1 = 0.001\n",
                         80.0 * scale);
    // The next two end 2.4 focal lengths from the middle, where a pixel sees no angle at all: corners stay within 1.9.
    case 2:
      return fmt::format("model = \"extended_unified\"\nfx_px = {:.3f}\nalpha = 0.58\nbeta = 1.1\n",
                         std::max(55.0 * scale, corner_px / 1.9));
    case 3:
      return fmt::format("model = \"double_sphere\"\nfx_px = {:.3f}\nxi = -0.2\nalpha = 0.59\n",
                         std::max(40.0 * scale, corner_px / 1.9));
    case 4:
      return "model = \"equirectangular\"\n";
    case 5:
      return "model = \"cylindrical\"\n";
    default:
      return fmt::format("model = \"orthographic\"\nfx_px = {:.3f}\n", draws.log_between(0.5, 4.0));
  }
}

/// is_of_pair   whose rows have to stay rows of one time
std::string draw_shutter(Draws& draws, const ImageSize& size, double frame_s, bool is_of_pair) {
  const double lines = std::max(size.width_px, size.height_px);
  const double line_time_us =
      std::min(1e6 * draws.between(0.05, 0.7) * std::min(frame_s, 0.2) / lines, 500.0);
  return fmt::format("line_time_us = {:.2f}\nreadout = \"{}\"\n", line_time_us,
                     is_of_pair ? draws.among({"down", "up"})
                                : draws.among({"down", "down", "up", "left", "right"}));
}

std::string draw_imaging(Draws& draws) {
  std::string text;
  if (draws.chance(0.4))
    text += fmt::format(
        "[imaging.lens]\nvignetting_exponent = {:.2f}\nred_scale_permille = "
        "{:.3f}\nblue_scale_permille = {:.3f}\n"
        "veiling_glare = {:.3f}\nbloom = {:.3f}\n",
        draws.between(0.0, 4.0), draws.both_ways(2.0), draws.both_ways(2.0),
        draws.between(0.0, 0.1), draws.between(0.0, 0.1));
  if (draws.chance(0.2))
    text += fmt::format("[imaging.soiling]\nsmudges = {}\ndirt_spots = {}\n", draws.below(6),
                        draws.below(20));
  if (draws.chance(0.3))
    text +=
        fmt::format("[imaging.exposure]\nmode = \"automatic\"\nbias_ev = {:.2f}\nlock = \"{}\"\n",
                    draws.both_ways(1.0), draws.among({"rig", "camera"}));
  if (draws.chance(0.4))
    text += fmt::format(
        "[imaging.sensor]\nbits = {}\nfull_well_e = {:.0f}\ngain = {:.2f}\nread_noise_e = {:.2f}\n"
        "prnu_percent = {:.2f}\n",
        draws.among({8, 10, 12}), draws.log_between(4000.0, 40000.0), draws.log_between(1.0, 8.0),
        draws.between(0.0, 8.0), draws.between(0.0, 1.0));
  if (draws.chance(0.3))
    text += fmt::format(
        "[imaging.color]\nwhite_balance = \"{}\"\nsaturation = {:.2f}\ncurve = \"{}\"\n",
        draws.among({"scene", "temperature", "grey_world"}), draws.between(0.0, 1.5),
        draws.among({"film", "srgb", "gamma", "linear"}));
  return text;
}

std::string draw_errors(Draws& draws) {
  return fmt::format(
      "[errors]\nfocal_length_sd_px = {:.3f}\nazimuth_sd_deg = {:.3f}\npitch_sd_deg = "
      "{:.3f}\nroll_sd_deg = {:.3f}\n"
      "offset_sd_mm = [{:.2f}, {:.2f}, {:.2f}]\nclock_offset_sd_s = {:.5f}\nclock_jitter_sd_s = "
      "{:.6f}\n",
      draws.log_between(0.01, 2.0), draws.log_between(0.001, 0.5), draws.log_between(0.001, 0.5),
      draws.log_between(0.001, 0.5), draws.between(0.0, 5.0), draws.between(0.0, 5.0),
      draws.between(0.0, 5.0), draws.log_between(1e-5, 1e-2), draws.log_between(1e-6, 1e-4));
}

std::string camera_text(const std::string& name, const ImageSize& size, const std::string& keys) {
  return fmt::format("[[cameras]]\nname = \"{}\"\nwidth_px = {}\nheight_px = {}\n{}", name,
                     size.width_px, size.height_px, keys);
}

/// TartanAir's own cameras: size, focal length and distance are the format's.
JobRig tartan_rig(JobRig rig, bool is_v1) {
  const ImageSize size{640, is_v1 ? 480 : 640};
  for (const bool is_left : {true, false})
    rig.text += camera_text(
        is_v1 ? (is_left ? "left" : "right") : (is_left ? "lcam_front" : "rcam_front"), size,
        fmt::format("fx_px = 320.0\noffset_mm = [0.0, {}, 0.0]\n", is_left ? "0.0" : "-250.0"));
  rig.num_cameras = 2;
  rig.pixels_per_camera = size.width_px * size.height_px;
  (is_v1 ? rig.is_of_tartanair_v1 : rig.is_of_tartanair) = true;
  return rig;
}

/// An inertial unit beside the cameras, somewhere on the rig.
std::string draw_imu(Draws draws) {
  return fmt::format(
      "[[sensors]]\nname = \"imu\"\nkind = \"imu\"\nrate_hz = {}\nsampling = \"{}\"\n"
      "offset_mm = [{:.1f}, {:.1f}, {:.1f}]\neuler_deg = [{:.2f}, {:.2f}, {:.2f}]\n"
      "[sensors.gyroscope]\nnoise_radps_per_sqrt_hz = {:.3g}\nturn_on_radps = {:.3g}\n"
      "[sensors.accelerometer]\nwalk_mps2_per_s_per_sqrt_hz = {:.3g}\nmarkov_mps2 = {:.3g}\n",
      draws.among({50.0, 100.0, 200.0, 250.0, 400.0}), draws.among({"instant", "integrated"}),
      draws.both_ways(2000.0), draws.both_ways(500.0), draws.both_ways(500.0),
      draws.both_ways(180.0), draws.both_ways(90.0), draws.both_ways(180.0),
      draws.log_between(1e-7, 1e-3), draws.log_between(1e-6, 1e-2), draws.log_between(1e-6, 1e-2),
      draws.log_between(1e-6, 1e-1));
}

/// A sensor's head, somewhere on the rig.
/// turn_deg   how far it may be turned about each axis
std::string draw_mount(Draws& draws, const char* name, const char* kind, double rate_hz,
                       double turn_deg) {
  return fmt::format(
      "[[sensors]]\nname = \"{}\"\nkind = \"{}\"\nrate_hz = {}\noffset_mm = [{:.1f}, {:.1f}, "
      "{:.1f}]\neuler_deg = [{:.2f}, {:.2f}, {:.2f}]\n",
      name, kind, rate_hz, draws.both_ways(2000.0), draws.both_ways(800.0), draws.both_ways(800.0),
      draws.both_ways(turn_deg), draws.both_ways(0.5 * turn_deg), draws.both_ways(turn_deg));
}

/// Most sensors' clocks show the time.
std::string draw_clock(Draws& draws, double rate_hz) {
  if (!draws.chance(0.4)) return "";
  std::string keys = fmt::format("offset_s = {:.6f}", draws.both_ways(2.0));
  if (draws.chance(0.7))
    keys += fmt::format(", offset_sd_s = {:.3g}", draws.log_between(1e-6, 1e-1));
  if (draws.chance(0.7))
    keys += fmt::format(", drift_ppm = {:.3f}, drift_sd_ppm = {:.3g}", draws.both_ways(100.0),
                        draws.log_between(0.01, 50.0));
  if (draws.chance(0.7))
    keys += fmt::format(", jitter_sd_s = {:.3g}", draws.log_between(1e-9, 0.1) / rate_hz);
  return "clock = {" + keys + "}\n";
}

std::string draw_lidar(Draws& draws) {
  const double rate_hz = draws.among({5.0, 10.0, 20.0});
  std::string text =
      draw_mount(draws, "scanner", "lidar", rate_hz, 180.0) + draw_clock(draws, rate_hz);
  switch (draws.below(4)) {
    case 0:
      text += fmt::format("pattern = \"spinning\"\ncolumns = {}\norigin_mm = {:.1f}\n",
                          20 + draws.below(100), draws.between(0.0, 50.0));
      break;
    case 1:
      text += fmt::format("pattern = \"polygon\"\npulse_hz = {:.0f}\n",
                          draws.log_between(500.0, 5000.0));
      break;
    case 2:
      text += fmt::format("pattern = \"raster\"\nrows = {}\ncolumns = {}\n", 4 + draws.below(12),
                          8 + draws.below(40));
      break;
    default:
      text += fmt::format("pattern = \"risley\"\npulse_hz = {:.0f}\n",
                          draws.log_between(500.0, 5000.0));
  }
  if (draws.chance(0.5)) text += fmt::format("range_noise_m = {:.4f}\n", draws.between(0.0, 0.05));
  if (draws.chance(0.3)) text += "range_step_m = 0.002\n";
  if (draws.chance(0.3))
    text += fmt::format("rays = {}\ndivergence_mrad = {:.2f}\nmost_returns = {}\n",
                        draws.among({7, 19}), draws.between(0.1, 3.0), 1 + draws.below(3));
  return text;
}

std::string draw_gnss(Draws& draws) {
  const double rate_hz = draws.among({1.0, 5.0, 10.0, 20.0});
  std::string text =
      draw_mount(draws, "receiver", "gnss", rate_hz, 180.0) + draw_clock(draws, rate_hz);
  const auto errors = [&](const char* section, double size_m) {
    return fmt::format(
        "[sensors.{}]\nmarkov_horizontal_m = {:.3f}\nmarkov_vertical_m = {:.3f}\n"
        "noise_horizontal_m = {:.3f}\nvelocity_noise_horizontal_mps = {:.3f}\n",
        section, size_m * draws.unit(), size_m * draws.unit(), size_m * draws.unit(),
        0.1 * draws.unit());
  };
  if (draws.chance(0.3))
    return text + "mode = \"rtk\"\n" + errors("fixed", 0.02) + errors("floating", 0.5);
  return draws.chance(0.7) ? text + errors("single", 2.0) : text;
}

/// What stands beside cameras and IMUs: each rarely, and not always without errors.
std::string draw_sensors(Draws draws) {
  std::string text;
  if (draws.chance(0.25)) text += draw_lidar(draws);
  if (draws.chance(0.25)) text += draw_gnss(draws);
  if (draws.chance(0.2)) {
    const double rate_hz = draws.among({10.0, 25.0, 50.0});
    text += draw_mount(draws, "air", "barometer", rate_hz, 180.0) + draw_clock(draws, rate_hz) +
            fmt::format("sea_level_pressure_pa = {:.1f}\nwarmer_k = {:.2f}\n",
                        draws.between(98000.0, 104000.0), draws.both_ways(20.0));
    if (draws.chance(0.5))
      text += fmt::format("[sensors.errors]\nnoise_pa = {:.2f}\n", 5.0 * draws.unit());
  }
  if (draws.chance(0.2)) {
    const double rate_hz = draws.among({10.0, 50.0, 100.0});
    text +=
        draw_mount(draws, "compass", "magnetometer", rate_hz, 180.0) + draw_clock(draws, rate_hz);
    if (draws.chance(0.5))
      text += fmt::format("hard_iron_nt = [{:.1f}, {:.1f}, {:.1f}]\n", draws.both_ways(5000.0),
                          draws.both_ways(5000.0), draws.both_ways(5000.0));
  }
  if (draws.chance(0.2)) {
    const double rate_hz = draws.among({10.0, 40.0, 100.0});
    text += draw_mount(draws, "laser", "rangefinder", rate_hz, 60.0) + draw_clock(draws, rate_hz);
  }
  if (draws.chance(0.1)) {
    const double rate_hz = draws.among({10.0, 20.0});
    text +=
        draw_mount(draws, "radar", "radar_altimeter", rate_hz, 20.0) + draw_clock(draws, rate_hz);
  }
  return text;
}

JobRig draw_cameras(const std::string& name, Draws draws, const JobSize& size) {
  enum Kind { kSingle, kPair, kSeveral, kFisheyes, kWide, kTartanAir, kTartanAirV1 };
  const int kind = draws.weighted({3.0, 4.0, 2.0, 1.0, 1.0, 0.6, 0.6});
  JobRig rig;
  rig.name = name;
  const double pitch_deg =
      draws.chance(0.6) ? draws.between(25.0, 90.0) : draws.between(-5.0, 30.0);
  rig.text = fmt::format("name = \"{}\"\nmount_pitch_deg = {:.2f}\nmount_yaw_deg = {:.2f}\n", name,
                         pitch_deg, draws.chance(0.5) ? 0.0 : draws.both_ways(180.0));
  if (draws.chance(0.2))
    rig.text += fmt::format("mount_roll_deg = {:.2f}\n", draws.both_ways(30.0));
  if (draws.chance(0.3))
    rig.text += fmt::format("mount_offset_m = [{:.2f}, {:.2f}, {:.2f}]\n", draws.both_ways(2.0),
                            draws.both_ways(1.0), draws.both_ways(0.5));
  const bool has_imaging = draws.chance(0.3);
  rig.has_errors = draws.chance(0.15);
  const std::string imaging = has_imaging ? draw_imaging(draws) : "";
  const std::string errors = rig.has_errors ? draw_errors(draws) : "";
  const std::string extras = imaging + errors;
  if (kind == kTartanAir || kind == kTartanAirV1) {
    rig.has_errors = false;  // the format fixes its cameras
    rig.text += imaging;
    return tartan_rig(rig, kind == kTartanAirV1);
  }
  rig.text += extras;
  rig.num_cameras = kind == kSingle ? 1 : kind == kPair ? 2 : 2 + draws.below(3);
  const ImageSize image =
      draw_size(draws, size.rays / (size.num_frames * size.color_samples * rig.num_cameras));
  rig.pixels_per_camera = image.width_px * image.height_px;
  const std::string shutter =
      draws.chance(0.15) ? draw_shutter(draws, image, size.frame_s, kind == kPair) : "";
  const std::string exposure = draws.chance(0.1)
                                   ? fmt::format("exposure_ms = {:.3f}\n",
                                                 1e3 * size.frame_s * draws.log_between(0.001, 0.1))
                                   : "";
  rig.has_rolling_shutter = !shutter.empty();
  if (kind == kPair) {
    // A rectified pair is of two pinholes that are alike.
    const double half_view_deg = draws.between(15.0, 50.0);
    const std::string keys =
        fmt::format("fx_px = {:.4f}\n", 0.5 * image.width_px / std::tan(half_view_deg * kRadians));
    const double baseline_mm = draws.log_between(60.0, 2000.0);
    rig.text += camera_text("left", image, keys + shutter + exposure);
    rig.text += camera_text(
        "right", image,
        keys + fmt::format("offset_mm = [0.0, {:.2f}, 0.0]\n", -baseline_mm) + shutter + exposure);
    rig.is_rectified_pair = true;
    rig.has_lenses_of_euroc = true;
    return rig;
  }
  for (int i = 0; i < rig.num_cameras; ++i) {
    std::string keys = kind == kFisheyes ? draw_fisheye(draws, image)
                       : kind == kWide   ? draw_wide(draws, image)
                                         : draw_planar_lens(draws, image);
    if (i > 0)
      keys += fmt::format(
          "offset_mm = [{:.1f}, {:.1f}, {:.1f}]\neuler_deg = [{:.3f}, {:.3f}, {:.3f}]\n",
          draws.both_ways(400.0), draws.both_ways(600.0), draws.both_ways(300.0),
          draws.both_ways(40.0), draws.both_ways(20.0), draws.both_ways(15.0));
    rig.text += camera_text(fmt::format("cam{}", i), image,
                            keys + (draws.chance(0.7) ? shutter : "") + exposure);
  }
  rig.has_lenses_of_colmap = kind != kWide;
  rig.has_lenses_of_euroc = kind == kSingle || kind == kSeveral;
  return rig;
}

}  // namespace

JobRig draw_rig(const std::string& name, Draws draws, const JobSize& size) {
  JobRig rig = draw_cameras(name, draws, size);
  // A stream of its own: the cameras of a seed are what they were before there were such units.
  Draws of_imu(draws.seed(), name + " imu");
  if (of_imu.chance(0.3)) rig.text += draw_imu(of_imu);
  const std::string others = draw_sensors(Draws(draws.seed(), name + " sensors"));
  rig.has_sensors = !others.empty();
  rig.text += others;
  return rig;
}

}  // namespace terracast::test
