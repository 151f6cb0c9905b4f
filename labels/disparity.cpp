// Disparity between cameras of a rig at one time, with what is hidden and by what, and what is out of view.
//
// Of a rectified pair (two pinholes that look the same way with the same focal lengths, side by side along their rows)
// disparity.x = x here - x there = f b / depth, b being how far to the right the other camera stands (below 0: to the
// left), plus the difference of the principal points; the sky has exactly that. Of any other pair that is named,
// disparity.x and disparity.y, to where the point is there.
//
// An OpenEXR file a pair of images: disparity.x, .y (float, px), sight and occluder (uint) as `pairs` have them
// (labels/pair_label.h). disparity.json, written last, says which there are, and f and b of rectified ones.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/log.h"
#include "labels/pair_cameras.h"
#include "labels/pair_label.h"

namespace terracast::labels {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;

/// What turns the disparity of a rectified pair into depth.
struct Rectified {
  double focal_length_px = 0.0;
  double baseline_m = 0.0;  ///< how far to the right of the first camera the second stands
  double offset_px = 0.0;   ///< what the sky has: of principal points that differ
};

/// Whether lines of two cameras with one height are exposed at one time.
bool have_rows_of_one_time(const geo::Shutter& a, const geo::Shutter& b) {
  if (!a.is_rolling() && !b.is_rolling()) return true;
  return a.line_time_s == b.line_time_s && a.readout == b.readout && !a.has_columns();
}

/// Nothing: the pair is not rectified.
std::optional<Rectified> rectified(const CameraCalibration& first,
                                   const CameraCalibration& second) {
  // In images of 10 000 px, and beside baselines, roundings stay below.
  constexpr double kRounding = 1e-9;
  const geo::CameraIntrinsics& a = first.intrinsics;
  const geo::CameraIntrinsics& b = second.intrinsics;
  if (a.model != "pinhole" || b.model != "pinhole" || a.height_px != b.height_px ||
      !have_rows_of_one_time(first.shutter, second.shutter))
    return std::nullopt;
  // fx, fy, cx, cy: all but cx are the same.
  for (const std::size_t i : {0U, 1U, 3U})
    if (std::abs(a.parameters[i] - b.parameters[i]) > kRounding * std::abs(a.parameters[i]))
      return std::nullopt;
  const geo::Rigid3d first_from_second =
      first.body_from_camera().inverse() * second.body_from_camera();
  const Eigen::Vector3d& place = first_from_second.translation;
  if (first_from_second.rotation.vec().norm() > kRounding ||
      !(place.tail<2>().cwiseAbs().maxCoeff() <= kRounding * std::abs(place.x())) ||
      place.x() == 0.0)
    return std::nullopt;
  return Rectified{.focal_length_px = a.parameters[0],
                   .baseline_m = place.x(),
                   .offset_px = a.parameters[2] - b.parameters[2]};
}

class DisparityLabel final : public PairLabel {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("cameras", cameras_,
              "Pairs of cameras, each as \"RIG/NAME RIG/NAME\": what the first shows is looked for "
              "in the second. Empty: both ways, all of a rig that are rectified to each other.");
  }

  void validate() const override {
    for (const std::string& text : cameras_) {
      const CameraPair pair = parse_camera_pair(text);
      if (pair.is_across())
        fail(ErrorKind::Config,
             "disparity: cameras: \"{}\" are of two sequences; labels of kind pairs have those",
             text);
      if (pair.from.camera == pair.to.camera)
        fail(ErrorKind::Config, "disparity: cameras: \"{}\" is each image with itself", text);
    }
  }
  std::unique_ptr<LabelMaker> clone() const override {
    return std::make_unique<DisparityLabel>(*this);
  }

  void check(std::span<const SequenceOutline> sequences, const core::Log& log) const override {
    check_camera_pairs(parse_camera_pairs(cameras_), std::span(&kSameFrame, 1), sequences, log);
    std::vector<std::string> without;
    for (const SequenceOutline& sequence : sequences)
      if (wanted(sequence.name, sequence.cameras).empty()) without.push_back(sequence.name);
    if (!sequences.empty() && without.size() == sequences.size())
      fail(
          ErrorKind::Config,
          "disparity: no two cameras of a rig are rectified to each other (pinholes that look the "
          "same way with the same focal lengths, side by side along their rows), as they are, with "
          "the errors of their rigs; name others by cameras = [\"RIG/NAME RIG/NAME\"]");
    if (!without.empty())
      log.info("disparity: no pair of cameras in {} of {} sequences, which get none: {}",
               without.size(), sequences.size(), fmt::join(without, ", "));
  }

 private:
  static constexpr std::int64_t kSameFrame = 0;

  std::string kind() const override { return "disparity"; }
  std::set<std::int64_t> frames_apart() const override { return {kSameFrame}; }

  SecondCameras wanted(const std::string& sequence,
                       const std::vector<CameraCalibration>& cameras) const {
    if (!cameras_.empty()) return named_pairs(parse_camera_pairs(cameras_), sequence, cameras);
    SecondCameras seconds;
    for (std::size_t a = 0; a < cameras.size(); ++a)
      for (std::size_t b = 0; b < cameras.size(); ++b)
        if (a != b && cameras[a].rig == cameras[b].rig && rectified(cameras[a], cameras[b]))
          seconds[static_cast<int>(a)].insert(static_cast<int>(b));
    return seconds;
  }

  std::vector<PairRoute> routes_of(const LabelInputs& inputs) const override {
    const capture::SequenceInfo& info = inputs.sequence.info();
    tell_left_out(kind(), parse_camera_pairs(cameras_), inputs);
    SecondCameras seconds = wanted(info.name, info.cameras);
    if (seconds.empty()) return {};
    return {{inputs.sequence, inputs.sequence, std::move(seconds)}};
  }

  ChannelMeanings meanings() const override {
    return {
        {"disparity.x",
         "float, px: x here less x there; of a rectified pair focal_length_px baseline_m / depth "
         "+ offset_px; NaN no ray, behind the other camera or not there"},
        {"disparity.y", "float, px: y here less y there; of pairs that are not rectified"},
        {"sight", kSightMeaning},
        {"occluder", kOccluderMeaning}};
  }

  std::vector<core::ExrChannel> channels(const PairRoute& route, int first, int second,
                                         PairImage& pair) const override {
    using Type = core::ExrChannel::Type;
    constexpr auto kNoPoint = static_cast<std::uint32_t>(Sight::NoPoint);
    const auto pair_rectified = rectified(route.first_camera(first), route.second_camera(second));
    for (std::size_t i = 0; i < pair.flow_x.size(); ++i) {
      const bool is_sky = pair.sight[i] == kNoPoint && !std::isnan(pair.flow_x[i]);
      pair.flow_x[i] = is_sky && pair_rectified ? static_cast<float>(pair_rectified->offset_px)
                                                : -pair.flow_x[i];
      pair.flow_y[i] = -pair.flow_y[i];
    }
    std::vector<core::ExrChannel> channels = {
        {.name = "disparity.x", .type = Type::Float, .values_float = pair.flow_x}};
    if (!pair_rectified)
      channels.push_back({.name = "disparity.y", .type = Type::Float, .values_float = pair.flow_y});
    channels.push_back({.name = "occluder", .type = Type::Uint, .values_uint = pair.occluder});
    channels.push_back({.name = "sight", .type = Type::Uint, .values_uint = pair.sight});
    return channels;
  }

  /// <rig>/<camera>/<rig>/<camera>/NNNNNN.exr
  std::string file_name(const PairRoute& route, const ImageOf& first,
                        const ImageOf& second) const override {
    return fmt::format("{}/{}/{:06}.exr", camera_name(route.first_camera(first.camera)),
                       camera_name(route.second_camera(second.camera)), first.frame);
  }

  void describe_pair(const PairRoute& route, int first, int second,
                     core::Json& pair) const override {
    const auto found = rectified(route.first_camera(first), route.second_camera(second));
    pair.set("is_rectified", found.has_value());
    if (!found) return;
    pair.set("focal_length_px", found->focal_length_px)
        .set("baseline_m", found->baseline_m)
        .set("offset_px", found->offset_px);
  }

  std::vector<std::string> cameras_;
};

}  // namespace

LabelInfo disparity_label() {
  return {
      .name = "disparity",
      .summary =
          "Disparity of rectified cameras of a rig, or of any that are named, with what is "
          "hidden and by what, and what is out of view.",
      .make = []() -> std::unique_ptr<LabelMaker> { return std::make_unique<DisparityLabel>(); }};
}

}  // namespace terracast::labels
