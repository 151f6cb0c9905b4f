#include <fmt/format.h>

#include <algorithm>

#include "validate/causes/trial.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

/// COLMAP's points: where their observations stand, of which image they are, their colours.
namespace terracast::validate {

namespace {

/// Half a pixel, or another constant, added to all observations.
void add_offset(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  const Trial& trial = symptoms.trial;
  std::vector<double> off_x, off_y;
  for (const auto& [id, image] : trial.model->images) {
    const std::size_t slash = image.name.rfind('/');
    if (slash == std::string::npos || image.name.size() < slash + 7) continue;
    const int c = trial.sequence.camera_index(image.name.substr(0, slash));
    const int f = std::atoi(image.name.c_str() + slash + 1) - trial.first_frame;
    if (c < 0 || f < 0 || f >= trial.num_frames()) continue;
    const auto view = view_at(trial.sequence, c, f, &trial.image(c, f));
    if (!view) continue;
    for (const ColmapObservation& seen : image.observations) {
      const auto point = trial.model->points.find(seen.point_id);
      if (point == trial.model->points.end()) continue;
      const auto& p = point->second.position;
      const auto at = Transfer::of_local_point(*view, {p[0], p[1], p[2]});
      if (!at || !(at->distance_b_m > 0.0)) continue;
      off_x.push_back(seen.x_px - at->pixel.x());
      off_y.push_back(seen.y_px - at->pixel.y());
    }
  }
  if (off_x.size() < 50) return;
  const Eigen::Vector2d offset(median(off_x), median(off_y));
  if (!(offset.norm() > 1e-5)) return;
  Hypothesis h;
  h.checks = {"colmap_observations"};
  h.rank = 1;
  h.undo = [offset](Trial& t, Cause& cause) {
    auto model = std::make_shared<ColmapModel>(*t.model);
    for (auto& [id, image] : model->images)
      for (ColmapObservation& seen : image.observations) {
        seen.x_px -= offset.x();
        seen.y_px -= offset.y();
      }
    t.model = std::move(model);
    const bool is_half = (offset.cwiseAbs() - Eigen::Vector2d(0.5, 0.5)).norm() < 1e-6;
    cause.name = "observations_offset";
    cause.size = offset.norm();
    cause.unit = "px";
    cause.words = fmt::format(
        "observations of points3D are off by ({:.4g}, {:.4g}) px{}", offset.x(), offset.y(),
        is_half ? ": pixel centres stand at whole numbers where +0.5 is meant" : "");
    return true;
  };
  hypotheses.push_back(std::move(h));
}

/// Each image has the observations of the same camera's next or last frame.
void add_shifts(std::vector<Hypothesis>& hypotheses) {
  for (const int shift : {1, -1}) {
    Hypothesis h;
    h.checks = {"colmap_observations"};
    h.rank = 2;
    h.undo = [shift](Trial& t, Cause& cause) {
      auto model = std::make_shared<ColmapModel>(*t.model);
      std::map<std::pair<std::string, int>, std::int64_t> by_place;
      for (const auto& [id, image] : model->images) {
        const std::size_t slash = image.name.rfind('/');
        if (slash != std::string::npos && image.name.size() >= slash + 7)
          by_place[{image.name.substr(0, slash), std::atoi(image.name.c_str() + slash + 1)}] = id;
      }
      for (const auto& [place, id] : by_place) {
        const auto from = by_place.find({place.first, place.second - shift});
        auto& list = model->images.at(id).observations;
        if (from == by_place.end())
          list.clear();
        else
          list = t.model->images.at(from->second).observations;
      }
      t.model = std::move(model);
      cause.name = "tracks_of_other_frame";
      cause.size = shift;
      cause.unit = "frames";
      cause.words = fmt::format(
          "points3D have another frame's tracks: the observations of each image are those of the "
          "frame {}",
          shift > 0 ? "after" : "before");
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

}  // namespace

void make_colmap_causes(const Symptoms& symptoms, std::vector<Hypothesis>& hypotheses) {
  if (!symptoms.trial.model) return;
  if (symptoms.fails_result("colmap_reprojection")) {
    add_offset(symptoms, hypotheses);
    add_shifts(hypotheses);
  }
  if (symptoms.fails_result("colmap_color")) {
    Hypothesis h;
    h.checks = {"colmap_point_colors"};
    h.rank = 1;
    h.undo = [](Trial& t, Cause& cause) {
      auto model = std::make_shared<ColmapModel>(*t.model);
      for (auto& [id, point] : model->points) std::swap(point.color[0], point.color[2]);
      t.model = std::move(model);
      cause.name = "channel_order";
      cause.words =
          "colours of points3D and of the images stand in another order: one of them is blue, "
          "green, "
          "red (BGR)";
      return true;
    };
    hypotheses.push_back(std::move(h));
  }
}

}  // namespace terracast::validate
