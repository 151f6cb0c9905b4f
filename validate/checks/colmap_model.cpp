#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/parallel.h"
#include "validate/checks/checker.h"
#include "validate/null_distribution.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// COLMAP's sparse model: that its parts agree with each other, and its points with images and
/// depth maps.
namespace terracast::validate {

namespace {

/// Counts contradictions and keeps the first.
struct Contradictions {
  std::int64_t count = 0;
  std::string first;
  template <class... Args>
  void add(fmt::format_string<Args...> format, Args&&... args) {
    if (++count == 1) first = fmt::format(format, std::forward<Args>(args)...);
  }
};

CheckResult count_result(const char* name, const Contradictions& found, std::string summary,
                         const char* reason, const char* detects) {
  CheckResult result;
  result.name = name;
  result.value = static_cast<double>(found.count);
  result.unit = "contradictions";
  result.ok = found.count == 0;
  result.worst = found.first;
  result.summary = std::move(summary);
  result.reason = reason;
  result.detects = detects;
  return result;
}

template <class Table>
void compare_tables(const char* what, const Table& text, const Table& binary,
                    Contradictions& found) {
  for (const auto& [id, entry] : binary) {
    const auto other = text.find(id);
    if (other == text.end())
      found.add("{} {} stands in the binary model only", what, id);
    else if (!(other->second == entry))
      found.add("{} {} differs between the text and the binary model", what, id);
  }
  for (const auto& [id, entry] : text)
    if (!binary.contains(id)) found.add("{} {} stands in the text model only", what, id);
}

struct Reprojection {
  double worst_px = 0.0;
  std::string worst;
  std::int64_t num_observations = 0;
  /// Of points that rolling shutters see: distances of their observations from where the images' one pose has
  /// them, px.
  std::map<std::int64_t, std::vector<double>> by_one_pose;
};

/// The largest difference between the error that points state and the mean distance of their observations.
/// Each model once.
void compare_errors(const ColmapModel& model, const Reprojection& found, CheckResult& result) {
  for (const auto& [id, distances] : found.by_one_pose) {
    const auto point = model.points.find(id);
    if (point == model.points.end() || point->second.track.size() != distances.size()) continue;
    double sum = 0.0;
    for (const double distance : distances) sum += distance;
    note_worst(result,
               std::abs(point->second.error_px - sum / static_cast<double>(distances.size())),
               fmt::format("point {}: {:.6g} px stated, {:.6g} px found", id,
                           point->second.error_px, sum / static_cast<double>(distances.size())));
  }
}

/// How far an observation is from its point's projection by an image's one pose, px; 1e9 of a point behind it.
double distance_by_one_pose(const ColmapIntrinsics& camera, const Pose& camera_from_world,
                            const Eigen::Vector3d& position, const ColmapObservation& seen) {
  const Eigen::Vector3d at = camera_from_world * position;
  if (!(at.z() > 0.0)) return 1e9;
  const Eigen::Vector2d place = camera.lens.distorted({at.x() / at.z(), at.y() / at.z()});
  return std::hypot(camera.fx_px * place.x() + camera.cx_px - seen.x_px,
                    camera.fy_px * place.y() + camera.cy_px - seen.y_px);
}

/// The camera and the pose by which the files of a rolling shutter's image state their errors.
struct StatedBy {
  ColmapIntrinsics camera;
  Pose camera_from_world;
};
std::optional<StatedBy> stated_by(const Sequence& sequence, std::int64_t image_id,
                                  const StatedBy& as_it_is) {
  if (!sequence.believed_model) return as_it_is;
  const auto image = sequence.believed_model->images.find(image_id);
  if (image == sequence.believed_model->images.end()) return std::nullopt;
  const auto camera = sequence.believed_model->cameras.find(image->second.camera_id);
  if (camera == sequence.believed_model->cameras.end()) return std::nullopt;
  const auto known = colmap_intrinsics(camera->second.model, camera->second.parameters);
  if (!known) return std::nullopt;
  return StatedBy{*known, image->second.camera_from_world.pose()};
}

void reproject(const ColmapModel& model, const char* kind, const Sequence& sequence,
               Reprojection& result) {
  for (const auto& [id, image] : model.images) {
    const std::size_t slash = image.name.rfind('/');
    const int index =
        slash == std::string::npos ? -1 : sequence.camera_index(image.name.substr(0, slash));
    if (index < 0) continue;
    const auto entry = model.cameras.find(image.camera_id);
    if (entry == model.cameras.end()) continue;
    const auto known = colmap_intrinsics(entry->second.model, entry->second.parameters);
    if (!known) continue;
    const Pose camera_from_world = image.camera_from_world.pose();
    Camera own = sequence.cameras[static_cast<std::size_t>(index)];
    own.intrinsics = {.width_px = own.intrinsics.width_px,
                      .height_px = own.intrinsics.height_px,
                      .fx_px = known->fx_px,
                      .fy_px = known->fy_px,
                      .cx_px = known->cx_px,
                      .cy_px = known->cy_px,
                      .lens = known->lens};
    std::optional<View> lines;  // of a rolling shutter, at the model's own pose
    const std::optional<StatedBy> stated = stated_by(sequence, id, {*known, camera_from_world});
    if (own.shutter) {
      lines = view_at(sequence, index, std::atoi(image.name.c_str() + slash + 1), nullptr);
      if (!lines) continue;  // `structure` tells of a motion that is missing
      lines->camera = &own;
      lines->local_from_camera = camera_from_world.inverse();
    }
    for (std::size_t k = 0; k < image.observations.size(); ++k) {
      const ColmapObservation& seen = image.observations[k];
      const auto point = model.points.find(seen.point_id);
      if (point == model.points.end()) continue;
      const Eigen::Vector3d position(point->second.position[0], point->second.position[1],
                                     point->second.position[2]);
      double error = 1e9;
      if (!lines) {
        error = distance_by_one_pose(*known, camera_from_world, position, seen);
      } else {
        if (const auto by_line = Transfer::of_local_point(*lines, position))
          error = (by_line->pixel - Eigen::Vector2d(seen.x_px, seen.y_px)).norm();
        if (stated)
          result.by_one_pose[seen.point_id].push_back(
              distance_by_one_pose(stated->camera, stated->camera_from_world, position, seen));
      }
      ++result.num_observations;
      if (error <= result.worst_px && !result.worst.empty()) continue;
      result.worst_px = std::isfinite(error) ? error : 1e9;
      result.worst = fmt::format("{} model, image {}, observation {} of point {}", kind, image.name,
                                 k, seen.point_id);
    }
  }
}

/// Tracks and observations name each other; every observation stands inside its image.
void check_tracks(const ColmapModel& model, Contradictions& found) {
  for (const auto& [id, point] : model.points) {
    std::set<std::int64_t> images;
    for (const auto& [image_id, index] : point.track) {
      const auto image = model.images.find(image_id);
      if (image == model.images.end()) {
        found.add("point {}: its track names image {}, which is not there", id, image_id);
      } else if (index < 0 ||
                 index >= static_cast<std::int64_t>(image->second.observations.size())) {
        found.add("point {}: observation {} of image {} is not there", id, index, image_id);
      } else if (image->second.observations[static_cast<std::size_t>(index)].point_id != id) {
        found.add("point {}: observation {} of image {} belongs to point {}", id, index, image_id,
                  image->second.observations[static_cast<std::size_t>(index)].point_id);
      }
      if (!images.insert(image_id).second)
        found.add("point {} is seen twice by image {}", id, image_id);
    }
  }
  std::int64_t num_tracked = 0;
  for (const auto& [id, point] : model.points)
    num_tracked += static_cast<std::int64_t>(point.track.size());
  std::int64_t num_observed = 0;
  for (const auto& [id, image] : model.images) {
    const auto camera = model.cameras.find(image.camera_id);
    if (camera == model.cameras.end())
      found.add("image {} names camera {}, which is not there", image.name, image.camera_id);
    for (const ColmapObservation& seen : image.observations) {
      if (seen.point_id < 0) continue;
      ++num_observed;
      if (!model.points.contains(seen.point_id))
        found.add("image {} sees point {}, which is not there", image.name, seen.point_id);
      if (camera != model.cameras.end() &&
          (seen.x_px < 0.0 || seen.y_px < 0.0 ||
           seen.x_px > static_cast<double>(camera->second.width_px) ||
           seen.y_px > static_cast<double>(camera->second.height_px)))
        found.add("image {}: ({}, {}) is outside", image.name, seen.x_px, seen.y_px);
    }
  }
  if (num_tracked != num_observed)
    found.add("{} entries of tracks for {} observations", num_tracked, num_observed);
}

/// The pose of each image by rig and frame, as COLMAP 3.12 and later take it, against the image's
/// own.
void check_rigs(const ColmapModel& model, CheckResult& result, Contradictions& found) {
  constexpr double kReach_m = 1000.0;  // what a rotation moves at this distance
  std::map<std::int64_t, std::int64_t> frame_of_image;
  for (const auto& [frame_id, frame] : model.frames) {
    const auto rig = model.rigs.find(frame.rig_id);
    if (rig == model.rigs.end() || rig->second.sensors.empty()) {
      found.add("frame {} names rig {}, which is not there or empty", frame_id, frame.rig_id);
      continue;
    }
    for (const ColmapData& data : frame.data) {
      const auto image = model.images.find(data.image_id);
      if (image == model.images.end()) {
        found.add("frame {} names image {}, which is not there", frame_id, data.image_id);
        continue;
      }
      if (!frame_of_image.emplace(data.image_id, frame_id).second)
        found.add("image {} is in two frames", data.image_id);
      if (image->second.camera_id != data.sensor_id)
        found.add("frame {}: image {} is of camera {}, not {}", frame_id, data.image_id,
                  image->second.camera_id, data.sensor_id);
      const ColmapSensor* sensor = nullptr;
      for (const ColmapSensor& candidate : rig->second.sensors)
        if (candidate.id == data.sensor_id && candidate.type == data.type) sensor = &candidate;
      const bool is_reference = sensor == rig->second.sensors.data();
      if (sensor == nullptr || (!is_reference && !sensor->has_pose)) {
        found.add("rig {} has no pose for sensor {}", frame.rig_id, data.sensor_id);
        continue;
      }
      const Pose sensor_from_rig = is_reference ? Pose{} : sensor->sensor_from_rig.pose();
      const Pose by_rig = sensor_from_rig * frame.rig_from_world.pose();
      const Pose own = image->second.camera_from_world.pose();
      const double centre_m = (by_rig.inverse().translation - own.inverse().translation).norm();
      note_worst(
          result,
          centre_m + kReach_m * rotation_angle_rad(by_rig.rotation.transpose() * own.rotation),
          fmt::format("image {}, frame {}", image->second.name, frame_id));
    }
  }
  for (const auto& [id, image] : model.images)
    if (!frame_of_image.contains(id))
      found.add("image {} is in no frame: COLMAP refuses such a model", image.name);
}

class ColmapModelChecker : public Checker {
 public:
  void frame(const FrameWindow& window, const std::vector<ViewPair>&) override {
    if (!window.sequence().binary_model) return;
    const ColmapModel& model = *window.sequence().binary_model;
    if (by_name_.empty())
      for (const auto& [id, image] : model.images) by_name_[image.name] = id;
    for (int camera = 0; camera < static_cast<int>(window.sequence().cameras.size()); ++camera) {
      const std::optional<View> view = window.view(camera, window.frame());
      if (!view) continue;
      const auto id = by_name_.find(view->camera->name + "/" + frame_digits(view->frame) + ".png");
      if (id != by_name_.end()) look(*view, model, model.images.at(id->second));
    }
  }

  std::vector<CheckResult> finish(const Dataset&, const Sequence& sequence) override {
    if (!sequence.binary_model || !sequence.text_model)
      return {skipped_result("colmap", "not a COLMAP dataset")};
    const ColmapModel& binary = *sequence.binary_model;
    const ColmapModel& text = *sequence.text_model;
    std::vector<CheckResult> results;

    Reprojection reprojection;
    reproject(binary, "binary", sequence, reprojection);
    const Reprojection of_binary = reprojection;
    reproject(text, "text", sequence, reprojection);
    CheckResult observations;
    observations.name = "colmap_reprojection";
    observations.value = reprojection.worst_px;
    observations.bound = 1e-6;
    observations.unit = "px";
    observations.ok = observations.is_within_bound() && reprojection.num_observations > 0;
    observations.worst = reprojection.worst;
    observations.summary = fmt::format(
        "Largest distance of {} observations (text and binary) from their point's projection.",
        reprojection.num_observations);
    observations.reason =
        "Points, poses and observations are written with 17 digits or as doubles; they are exact.";
    observations.detects =
        "1e-5 px; half a pixel of a wrong centre rule; a pose the wrong way round";
    if (sequence.has_rolling_shutters())
      observations.summary +=
          " Of rolling shutters from where the line that sees the point shows it.";
    const bool has_depth_maps =
        std::any_of(sequence.cameras.begin(), sequence.cameras.end(), [](const Camera& camera) {
          return std::any_of(camera.files.begin(), camera.files.end(),
                             [](const FrameFiles& files) { return !files.depth.empty(); });
        });
    const bool is_without_points = binary.points.empty();
    const char* const kNone =
        "the model has no points: no two of its images see one that was followed, or none was "
        "written; the dataset does not say how many were followed (tracks.num_points of the "
        "config)";
    if (is_without_points) observations = unseen_result(observations.name, kNone);
    results.push_back(std::move(observations));
    if (sequence.has_rolling_shutters()) results.push_back(errors_result(binary, of_binary));

    Contradictions differences;
    compare_tables("camera", text.cameras, binary.cameras, differences);
    compare_tables("image", text.images, binary.images, differences);
    compare_tables("point", text.points, binary.points, differences);
    compare_tables("rig", text.rigs, binary.rigs, differences);
    compare_tables("frame", text.frames, binary.frames, differences);
    results.push_back(count_result("colmap_text_binary", differences,
                                   "Entries that differ between the two models, to the bit.",
                                   "17 digits give back the same double.",
                                   "one bit of one number"));

    Contradictions tracks;
    check_tracks(binary, tracks);
    results.push_back(count_result(
        "colmap_tracks", tracks,
        fmt::format(
            "Tracks of {} points and observations of {} images name each other, once, inside "
            "their images.",
            binary.points.size(), binary.images.size()),
        "COLMAP and its readers follow these indices blindly.", "one index off by one"));

    CheckResult rigs;
    rigs.name = "colmap_rigs";
    rigs.bound = 1e-6;
    rigs.unit = "m at 1 km";
    Contradictions frames;
    check_rigs(binary, rigs, frames);
    rigs.ok = rigs.value <= rigs.bound;
    rigs.summary = fmt::format(
        "Poses by rig and frame against poses of images ({} rigs, {} frames): centres, and what "
        "rotations "
        "move at 1 km.",
        binary.rigs.size(), binary.frames.size());
    rigs.reason = "New versions of COLMAP take one, old ones the other; doubles leave 1e-9 m.";
    rigs.detects = "1e-5 m between the two";
    results.push_back(std::move(rigs));
    results.push_back(count_result(
        "colmap_frames", frames, "Every image stands in exactly one frame, with its own camera.",
        "COLMAP refuses to load other models.", "one image without frame"));

    CheckResult points;
    points.name = "colmap_points";
    points.value = static_cast<double>(binary.points.size());
    constexpr double kOfASequence = 2000.0, kOfAnImage = 50.0;
    points.bound =
        std::min(kOfASequence,
                 kOfAnImage * static_cast<double>(std::max<std::size_t>(binary.images.size(), 1)));
    points.is_lower_bound = true;
    points.unit = "points (at least)";
    // A few that are right are no mistake; whether some are missing nothing in the dataset tells.
    points.skipped = points.is_unseen = !points.is_within_bound() && !binary.points.empty();
    points.ok = points.skipped || points.is_within_bound();
    if (!points.is_within_bound())
      points.worst = fmt::format(
          "{} points for {} images, of {} that are wanted: raise tracks.num_points of the config, "
          "which says how many are followed, in all rigs' images; the model holds those that two "
          "of its images see",
          binary.points.size(), binary.images.size(), points.bound);
    points.summary = fmt::format("Points of the model, which has {} images.", binary.images.size());
    points.reason =
        "50 an image leave room above the 30 inliers without which COLMAP registers none; 2000 "
        "cover a longer sequence.";
    points.detects = "a model without points; fewer than the bound are told, not judged";
    if (is_without_points) points = unseen_result(points.name, kNone);
    results.push_back(std::move(points));
    results.push_back(complete_tracks_result(binary));

    const Seen seen = sum_of_seen();
    CheckResult depth;
    depth.name = "colmap_depth";
    constexpr double kThinRidges = 1e-3, kBeside = 0.03;
    PointShares shares(kThinRidges, kBeside);
    shares.add({seen.num_off, seen.num_judged,
                seen.first_off.empty() ? "all observations" : seen.first_off});
    shares.judge(depth);
    depth.summary = fmt::format(
        "Share of {} observations whose point stands over 1 % behind or before all 16 depths "
        "around its pixel. {} more are of points on what an image that shows them does not "
        "resolve: leaves and wires that are finer than its pixels.",
        seen.num_judged, num_looked_ - seen.num_judged);
    depth.reason =
        "Each observation was found visible by a ray; only ridges thinner than a pixel escape 16 "
        "pixels.";
    if (has_depth_maps && num_looked_ > 0 && seen.num_judged == 0)
      depth = unseen_result(depth.name, "all points lie on what no image resolves");
    depth.detects = "points seen through hills, points 3 % of the depth beside the surface";
    if (is_without_points) depth = unseen_result(depth.name, kNone);
    if (!has_depth_maps) depth = skipped_result(depth.name, "the dataset holds no depth maps");
    results.push_back(std::move(depth));
    CheckResult residual;
    residual.name = "colmap_depth_residual";
    residual.value = median(depth_residuals_);
    residual.bound = 2e-3;
    residual.unit = "of the depth";
    residual.ok = residual.value <= residual.bound;
    residual.summary = fmt::format(
        "Median |depth of the point / depth interpolated at its pixel - 1| of {} observations "
        "whose image resolves what it shows there.",
        depth_residuals_.size());
    residual.reason = "As for `reprojection`: what rough ground does between pixel centres.";
    residual.detects = "points 0.3 % of the depth beside the surface";
    if (!has_depth_maps)
      residual = skipped_result(residual.name, "the dataset holds no depth maps");
    else if (depth_residuals_.empty())
      residual = unseen_result(residual.name, "no observation stands where a depth map is smooth");
    results.push_back(std::move(residual));

    std::vector<double> color_differences;
    for (const auto& [id, difference] : least_color_difference_)
      color_differences.push_back(difference);
    CheckResult color;
    color.name = "colmap_color";
    const MedianEstimate difference = estimate_median(color_differences, 1.0);
    color.value = difference.judged();
    color.bound = 16.0;
    color.unit = "levels";
    color.ok = color.value <= color.bound;
    color.is_unseen = color.skipped = color.ok && !difference.tells(color.bound);
    color.worst = color.skipped ? fmt::format("too few points ({}) for their median",
                                              color_differences.size())
                                : "";
    color.summary = fmt::format(
        "Median over {} points of the difference (mean of the channels) between a point's colour "
        "and the most similar of its images: {:.3g}; what of it is sure.",
        color_differences.size(), difference.median);
    color.reason =
        "A point's colour is one image's, or their mean; fine texture changes it by some levels.";
    color.detects = "colours 40 levels off";
    if (color_differences.empty())
      color = unseen_result(color.name, "no point is observed in an image");
    results.push_back(std::move(color));
    return results;
  }

 private:
  /// Whether images that show a point stand in its track. How many do is the flight's: short ones have short tracks.
  CheckResult complete_tracks_result(const ColmapModel& model) const {
    CheckResult tracks;
    tracks.name = "colmap_complete_tracks";
    if (model.points.empty()) return unseen_result(tracks.name, "the model has no points");
    if (num_shown_ == 0)
      return unseen_result(tracks.name, "no smooth depth tells which images show a point");
    std::size_t num_entries = 0;
    for (const auto& [id, point] : model.points) num_entries += point.track.size();
    constexpr double kJustHidden = 0.1, kHalf = 0.5;
    PointShares shares(kJustHidden, kHalf);
    shares.add({num_left_out_, num_shown_, "all images"});
    shares.judge(tracks);
    tracks.summary = fmt::format(
        "Of all images that show a point by smooth depths around its projection, the share that "
        "its track leaves out. Tracks have {:.3g} images in the mean.",
        static_cast<double>(num_entries) / static_cast<double>(model.points.size()));
    tracks.reason =
        "Tracks have every image that a ray reaches the point from; depths between pixels may show "
        "one that is just hidden: one in ten, and what few sightings may be more by chance.";
    tracks.detects = "tracks cut to half of their images";
    return tracks;
  }

  static CheckResult errors_result(const ColmapModel& model, const Reprojection& found) {
    if (found.by_one_pose.empty())
      return unseen_result("colmap_errors", "no image of a rolling shutter sees a point");
    CheckResult errors;
    errors.name = "colmap_errors";
    errors.bound = 1e-6;
    errors.unit = "px";
    compare_errors(model, found, errors);
    errors.ok = errors.is_within_bound();
    errors.summary = fmt::format(
        "ERROR of {} points of the binary model against the mean distance of their observations "
        "from their "
        "projections by the images' one pose.",
        found.by_one_pose.size());
    errors.reason = "It is a mean of doubles.";
    errors.detects =
        "an error of 0 where rolling shutters show a point elsewhere than one pose has it";
    return errors;
  }

  /// Points that an image's depths show, and its observations leave out; of a large model some thousands.
  void count_left_out(const View& view, const ColmapModel& model, const ColmapImage& image) {
    if (view.image->depth.empty()) return;
    std::set<std::int64_t> observed;
    for (const ColmapObservation& seen : image.observations) observed.insert(seen.point_id);
    constexpr std::size_t kEnough = 4000;
    const std::size_t step = 1 + model.points.size() / kEnough;
    std::size_t index = 0;
    for (const auto& [id, point] : model.points) {
      if (index++ % step != 0) continue;
      const Eigen::Vector3d position(point.position[0], point.position[1], point.position[2]);
      const auto place = Transfer::of_local_point(view, position);
      if (!place || !(place->distance_b_m > 0.0) || !view.camera->intrinsics.contains(place->pixel))
        continue;
      const auto depth = sample_inverse_depth(view.image->depth, place->pixel);
      constexpr double kOnTheSurface = 1e-3;
      if (!depth || depth->roughness >= kSmoothRoughness ||
          std::abs(depth->inverse_depth.value * place->distance_b_m - 1.0) >= kOnTheSurface)
        continue;
      ++num_shown_;
      if (!observed.contains(id)) ++num_left_out_;
    }
  }

  void look(const View& view, const ColmapModel& model, const ColmapImage& image) {
    count_left_out(view, model, image);
    for (const ColmapObservation& seen : image.observations) {
      const auto found = model.points.find(seen.point_id);
      if (found == model.points.end()) continue;
      const ColmapPoint& point = found->second;
      const Eigen::Vector2d pixel(seen.x_px, seen.y_px);
      const int x = static_cast<int>(std::floor(seen.x_px));
      const int y = static_cast<int>(std::floor(seen.y_px));
      if (!view.camera->intrinsics.contains(pixel)) continue;
      if (!view.image->color.empty()) {
        double difference = 0.0;
        for (int c = 0; c < 3; ++c)
          difference +=
              std::abs(view.image->color(x, y, c) - point.color[static_cast<std::size_t>(c)]) / 3.0;
        const auto [entry, is_new] = least_color_difference_.emplace(seen.point_id, difference);
        if (!is_new) entry->second = std::min(entry->second, difference);
      }
      if (view.image->depth.empty()) continue;
      const auto depth = sample_inverse_depth(view.image->depth, pixel);
      if (!depth) continue;
      const double expected_m =
          (pose_of_line(view, pixel).inverse() *
           Eigen::Vector3d(point.position[0], point.position[1], point.position[2]))
              .z();
      ++num_looked_;
      constexpr double kClear = 0.01;
      const bool is_off = expected_m > depth->farthest_m * (1.0 + kClear) ||
                          expected_m < depth->nearest_m * (1.0 - kClear);
      const bool is_resolved = depth->roughness < kResolvedRoughness;
      PointSeen& point_seen = seen_[seen.point_id];
      ++point_seen.num_looked;
      if (!is_off && !is_resolved) point_seen.is_on_thin_thing = true;
      if (is_off && ++point_seen.num_off == 1)
        point_seen.first_off =
            fmt::format("{}: point {} at {:.3f} m, depths {:.3f} to {:.3f} m", place_of(view, x, y),
                        seen.point_id, expected_m, depth->nearest_m, depth->farthest_m);
      if (is_resolved)
        depth_residuals_.push_back(std::abs(expected_m * depth->inverse_depth.value - 1.0));
    }
  }

  /// What depth maps say of one point.
  struct PointSeen {
    std::int64_t num_looked = 0;
    std::int64_t num_off = 0;  ///< observations that the depths around contradict
    /// An image shows it among depths that it does not resolve. What is thinner than a pixel there falls
    /// between the centres of another image's pixels.
    bool is_on_thin_thing = false;
    std::string first_off;
  };
  struct Seen {
    std::int64_t num_judged = 0;
    std::int64_t num_off = 0;
    std::string first_off;
  };
  Seen sum_of_seen() const {
    Seen sum;
    for (const auto& [id, point] : seen_) {
      if (point.is_on_thin_thing) continue;
      sum.num_judged += point.num_looked;
      sum.num_off += point.num_off;
      if (sum.first_off.empty()) sum.first_off = point.first_off;
    }
    return sum;
  }

  std::map<std::string, std::int64_t> by_name_;
  std::int64_t num_looked_ = 0;
  std::int64_t num_shown_ = 0;  ///< sightings of points by smooth depths around their projections
  std::int64_t num_left_out_ = 0;           ///< of these, by no observation
  std::map<std::int64_t, PointSeen> seen_;  ///< by point
  std::vector<double> depth_residuals_;
  std::map<std::int64_t, double> least_color_difference_;
};

}  // namespace

std::unique_ptr<Checker> make_colmap_model_check(const ValidateOptions&) {
  return std::make_unique<ColmapModelChecker>();
}

}  // namespace terracast::validate
