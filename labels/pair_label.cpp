#include "labels/pair_label.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "capture/labels.h"
#include "capture/object_labels.h"
#include "capture/sequence_files.h"
#include "core/progress.h"
#include "core/stop.h"
#include "labels/label_image.h"
#include "labels/pair_cameras.h"

namespace terracast::labels {
namespace {

namespace fs = std::filesystem;
using core::Json;
using Eigen::Vector2d;

/// Of files and indices. 2: out of view and not there are told from the sky, and flow goes on beyond the border.
constexpr int kVersion = 2;
/// A version stands in the name of an image's part, by which files of an earlier one are known.
std::string part_name_of(const std::string& kind) { return fmt::format("{} {}", kind, kVersion); }

/// What tells one image of a pair from the other.
std::string_view difference_of(bool is_other_camera, bool is_other_frame) {
  if (!is_other_frame) return "camera";
  return is_other_camera ? "camera and frame" : "frame";
}

ImageOf image_apart(const ImageOf& from, std::int64_t apart, int camera) {
  return {static_cast<int>(from.frame + apart), camera};
}

/// What an image shows, as far as it shows something: points, and pixels of the sky.
struct ShownPixels {
  std::vector<ShownPoint> points;
  std::vector<std::size_t> point_places;  ///< in rows of pixels
  std::vector<Eigen::Vector2i> sky;
  std::vector<std::size_t> sky_places;
};

ShownPixels shown_pixels(const PairRoute& route, const PairSight& sight, const ImageOf& from) {
  const capture::CameraFrame facts =
      route.from.read_camera(from.frame, from.camera, capture::SequenceReader::kFacts);
  const core::ImageF& range_m = facts.range_m;
  std::vector<Eigen::Vector2i> pixels;
  for (int y = 0; y < range_m.height(); ++y)
    for (int x = 0; x < range_m.width(); ++x) pixels.emplace_back(x, y);
  const std::vector<std::optional<ShownPoint>> points = sight.points(from, facts, pixels);
  ShownPixels shown;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i]) {
      shown.points.push_back(*points[i]);
      shown.point_places.push_back(i);
    } else if (std::isinf(range_m.data()[i])) {
      shown.sky.push_back(pixels[i]);
      shown.sky_places.push_back(i);
    }
  }
  return shown;
}

/// Fills in where things are in another image.
class PairFiller {
 public:
  PairFiller(const PairSight& sight, const ImageOf& from, const ImageOf& to,
             const ShownPixels& shown, PairImage& pair)
      : sight_(sight), from_(from), to_(to), shown_(shown), pair_(pair) {}

  void fill(const geo::CameraIntrinsics& image) {
    width_px_ = image.width_px;
    fill_points();
    const auto sky = sight_.sky_flow(from_, shown_.sky, to_);
    for (std::size_t k = 0; k < sky.size(); ++k)
      if (sky[k]) set_flow(shown_.sky_places[k], *sky[k]);
  }

 private:
  void fill_points() {
    const std::vector<std::optional<Sighting>> found = sight_.follow(shown_.points, to_);
    for (std::size_t k = 0; k < found.size(); ++k) {
      const std::size_t place = shown_.point_places[k];
      if (const auto motion_m = sight_.motion(shown_.points[k], to_.frame))
        for (int axis = 0; axis < 3; ++axis)
          pair_.scene_flow[static_cast<std::size_t>(axis)][place] =
              static_cast<float>((*motion_m)[axis]);
      pair_.sight[place] = static_cast<std::uint32_t>(sight_of(shown_.points[k], found[k]));
      if (!found[k]) continue;
      set_flow(place, found[k]->pixel - center_of(place));
      pair_.occluder[place] = found[k]->occluder_id;
    }
  }

  Sight sight_of(const ShownPoint& point, const std::optional<Sighting>& found) const {
    if (!found) return sight_.is_there(point, to_.frame) ? Sight::OutOfView : Sight::NotThere;
    if (!found->is_in_image) return Sight::OutOfView;
    return found->is_visible ? Sight::Seen : Sight::Hidden;
  }

  Vector2d center_of(std::size_t place) const {
    const auto width = static_cast<std::size_t>(width_px_);
    return capture::pixel_center(static_cast<int>(place % width), static_cast<int>(place / width));
  }
  void set_flow(std::size_t place, const Vector2d& flow_px) {
    pair_.flow_x[place] = static_cast<float>(flow_px.x());
    pair_.flow_y[place] = static_cast<float>(flow_px.y());
  }

  const PairSight& sight_;
  const ImageOf from_, to_;
  const ShownPixels& shown_;
  PairImage& pair_;
  int width_px_ = 0;
};

/// Whether a pair is of a sequence's own cameras, where it carries both.
bool is_within(const CameraPair& pair, const std::string& sequence) {
  return !pair.is_across() && (pair.from.sequence.empty() || pair.from.sequence == sequence);
}

}  // namespace

SecondCameras named_pairs(std::span<const CameraPair> pairs, const std::string& sequence,
                          const std::vector<capture::CameraCalibration>& cameras) {
  SecondCameras seconds;
  for (const CameraPair& pair : pairs)
    if (is_within(pair, sequence) && has_cameras(cameras, pair))
      seconds[find_camera(cameras, pair.from.camera)].insert(find_camera(cameras, pair.to.camera));
  return seconds;
}

void tell_left_out(std::string_view kind, std::span<const CameraPair> pairs,
                   const LabelInputs& inputs) {
  const capture::SequenceInfo& own = inputs.sequence.info();
  const auto& all = inputs.job.sequences;
  for (const CameraPair& pair : pairs) {
    if (!is_within(pair, own.name) || has_cameras(own.cameras, pair)) continue;
    const bool has_any = std::any_of(all.begin(), all.end(), [&](const auto& sequence) {
      return has_cameras(sequence.info().cameras, pair);
    });
    if (!has_any)
      for (const PairEnd& end : {pair.from, pair.to}) find_camera(own.cameras, end.camera);
    inputs.context.log.info("{}: sequence {} has not both {} and {}: without this pair", kind,
                            own.name, pair.from.camera, pair.to.camera);
  }
}

bool PairRoute::has_pair(const ImageOf& first, const ImageOf& second) const {
  return second.frame >= 0 && second.frame < static_cast<int>(to.frames().size()) &&
         (is_across() || first != second);
}

PairImage::PairImage(std::size_t num_pixels)
    : flow_x(num_pixels, std::numeric_limits<float>::quiet_NaN()),
      flow_y(flow_x),
      scene_flow({flow_x, flow_x, flow_x}),
      sight(num_pixels, static_cast<std::uint32_t>(Sight::NoPoint)),
      occluder(num_pixels, 0) {}

std::string PairLabel::file_name(const PairRoute& route, const ImageOf& first,
                                 const ImageOf& second) const {
  return fmt::format("{}/{}{}/{:06}_{:06}.exr", camera_name(route.first_camera(first.camera)),
                     route.is_across() ? route.to.info().name + "/" : "",
                     camera_name(route.second_camera(second.camera)), first.frame, second.frame);
}

LabelFiles PairLabel::make(const LabelInputs& inputs) const {
  const std::vector<PairRoute> routes = routes_of(inputs);
  for (const PairRoute& route : routes) make_images(inputs, route);
  return write_index_of(inputs.sequence, routes);
}

void PairLabel::make_images(const LabelInputs& inputs, const PairRoute& route) const {
  const PairSight sight(inputs, route.is_across() ? &route.to : nullptr);
  const auto num_frames = static_cast<int>(route.from.frames().size());
  core::Progress progress(inputs.context, "images",
                          num_frames * static_cast<std::int64_t>(route.seconds.size()));
  for (int frame = 0; frame < num_frames; ++frame)
    for (const auto& [camera, seconds] : route.seconds) {
      core::throw_if_stop_asked();
      make_image(route, sight, {frame, camera}, seconds);
      progress.advance();
    }
}

/// All pairs of which an image is the first.
void PairLabel::make_image(const PairRoute& route, const PairSight& sight, const ImageOf& from,
                           const std::set<int>& seconds) const {
  const geo::CameraIntrinsics& image = route.first_camera(from.camera).intrinsics;
  const std::string part_name = part_name_of(kind());
  const fs::path folder = route.from.folder() / capture::kLabelsFolder / kind();
  const auto file_of = [&](const ImageOf& to) { return folder / file_name(route, from, to); };
  std::vector<ImageOf> missing;
  for (const int second : seconds)
    for (const std::int64_t apart : frames_apart()) {
      const ImageOf to = image_apart(from, apart, second);
      if (route.has_pair(from, to) &&
          !is_label_image_done(file_of(to), sight.source(), image, part_name, "sight"))
        missing.push_back(to);
    }
  if (missing.empty()) return;
  remove_index(folder / (kind() + ".json"));
  const ShownPixels shown = shown_pixels(route, sight, from);
  for (const ImageOf& to : missing) {
    PairImage pair(static_cast<std::size_t>(image.width_px) *
                   static_cast<std::size_t>(image.height_px));
    PairFiller(sight, from, to, shown, pair).fill(image);
    write_label_image(file_of(to), sight.source(), image, part_name,
                      channels(route, from.camera, to.camera, pair));
  }
}

/// All files, that of the index itself among them.
LabelFiles PairLabel::write_index_of(const capture::SequenceReader& sequence,
                                     const std::vector<PairRoute>& routes) const {
  const std::string name = kind() + ".json";
  LabelFiles all = {name};
  Json pairs = Json::array();
  for (const PairRoute& route : routes)
    for (const auto& [first, seconds] : route.seconds)
      for (const int second : seconds)
        for (const std::int64_t apart : frames_apart())
          list_files(route, first, second, apart, all, pairs);
  Json index = begin_index(kind(), kVersion, sequence, meanings());
  index.set("pairs", std::move(pairs));
  write_index(sequence.folder() / capture::kLabelsFolder / kind() / name, index);
  return all;
}

/// Adds what there is of two cameras so many frames apart.
void PairLabel::list_files(const PairRoute& route, int first, int second, std::int64_t apart,
                           LabelFiles& all, Json& pairs) const {
  Json files = Json::array();
  std::size_t num_files = 0;
  for (int frame = 0; frame < static_cast<int>(route.from.frames().size()); ++frame) {
    const ImageOf from{frame, first}, to = image_apart(from, apart, second);
    if (!route.has_pair(from, to)) continue;
    const std::string name = file_name(route, from, to);
    all.insert(name);
    files.push(name);
    ++num_files;
  }
  if (num_files == 0) return;
  const bool is_other_camera = first != second || route.is_across();
  Json pair = Json::object();
  pair.set("camera", camera_name(route.first_camera(first)))
      .set("other_camera", camera_name(route.second_camera(second)));
  if (route.is_across())
    pair.set("other_sequence", route.to.info().name)
        .set("other_capture", capture::labels_source(route.to));
  pair.set("frames_apart", apart).set("differs_in", difference_of(is_other_camera, apart != 0));
  describe_pair(route, first, second, pair);
  pair.set("files", std::move(files));
  pairs.push(std::move(pair));
}

}  // namespace terracast::labels
