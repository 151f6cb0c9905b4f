#include "validate/page_images.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "validate/findings.h"
#include "validate/page_values.h"
#include "validate/pictures.h"
#include "validate/sampling.h"
#include "validate/transfer.h"

namespace terracast::validate {

namespace {

using core::Json;

/// A pose that can be computed with: finite, and no farther off than the Earth is wide.
const Pose* sound_pose(const Camera& camera, int frame) {
  if (frame < 0 || frame >= static_cast<int>(camera.local_from_camera.size())) return nullptr;
  const auto& pose = camera.local_from_camera[static_cast<std::size_t>(frame)];
  constexpr double kFarthest_m = 1e8;
  if (!pose || !pose->rotation.allFinite() || !pose->translation.allFinite() ||
      pose->translation.norm() > kFarthest_m || pose->rotation.cwiseAbs().maxCoeff() > 2.0)
    return nullptr;
  return &*pose;
}

/// Every step-th pixel, channel after channel.
template <class Value>
std::vector<Value> sampled(const core::Image<Value>& image, const PageImage& page) {
  std::vector<Value> values;
  values.reserve(static_cast<std::size_t>(page.width) * static_cast<std::size_t>(page.height) *
                 static_cast<std::size_t>(image.channels()));
  for (int c = 0; c < image.channels(); ++c)
    for (int y = 0; y < page.height; ++y)
      for (int x = 0; x < page.width; ++x)
        values.push_back(image(page.step * x + page.step / 2, page.step * y + page.step / 2, c));
  return values;
}

/// What is read of one image.
struct Files {
  core::Image8 color, classes;
  core::ImageF depth, disparity, other_depth;
  FlowFields flow;
};

/// The point of a pixel's centre, camera frame; nothing without depth.
std::optional<Eigen::Vector3d> point_at(const core::ImageF& depth, const Intrinsics& camera, int x,
                                        int y) {
  const auto depth_m = static_cast<double>(depth(x, y));
  if (!std::isfinite(depth_m)) return std::nullopt;
  return camera.point_from_pixel({x + 0.5, y + 0.5}, depth_m);
}

/// r of Reprojection at the sampled pixels, in steps of kResidualStep, at most 32767 of them; the
/// least number where there is nothing to compare, or the other image hides the point.
constexpr double kResidualStep = 1e-6;
std::vector<std::int16_t> residuals_of(const Files& files, const PageImage& page,
                                       const Transfer& transfer) {
  constexpr double kClear = 0.01;
  constexpr double kMost = 32767.0;
  std::vector<std::int16_t> residuals;
  for (int j = 0; j < page.height; ++j)
    for (int i = 0; i < page.width; ++i) {
      residuals.push_back(std::numeric_limits<std::int16_t>::min());
      const int x = page.step * i + page.step / 2;
      const int y = page.step * j + page.step / 2;
      const auto depth_m = static_cast<double>(files.depth(x, y));
      if (!std::isfinite(depth_m)) continue;
      const auto place = transfer.point({x + 0.5, y + 0.5}, depth_m);
      if (!place || !(place->distance_b_m > 1e-3 * depth_m)) continue;
      const double other_m = place->distance_b_m;
      const auto seen = sample_inverse_depth(files.other_depth, place->pixel);
      if (!seen || seen->farthest_m < other_m * (1.0 - kClear)) continue;
      const double r = seen->inverse_depth.value * other_m - 1.0;
      residuals.back() =
          static_cast<std::int16_t>(std::lround(std::clamp(r / kResidualStep, -kMost, kMost)));
    }
  return residuals;
}

void count_slopes(const Files& files, const Intrinsics& camera, PageImage& page) {
  for (int j = 0; j < page.height; ++j)
    for (int i = 0; i < page.width; ++i) {
      const int x = page.step * i + page.step / 2;
      const int y = page.step * j + page.step / 2;
      if (x < 1 || y < 1 || x + 1 >= camera.width_px || y + 1 >= camera.height_px) continue;
      const auto left = point_at(files.depth, camera, x - 1, y);
      const auto right = point_at(files.depth, camera, x + 1, y);
      const auto above = point_at(files.depth, camera, x, y - 1);
      const auto below = point_at(files.depth, camera, x, y + 1);
      if (!left || !right || !above || !below) continue;
      const Eigen::Vector3d normal =
          page.local_from_camera->rotation * (*right - *left).cross(*below - *above);
      if (!(normal.norm() > 0.0)) continue;
      const double slope_deg =
          degrees_from_radians(std::acos(std::min(std::abs(normal.z()) / normal.norm(), 1.0)));
      ++page.slopes[static_cast<std::size_t>(std::clamp(static_cast<int>(slope_deg), 0, 89))];
    }
}

void trace_footprint(const Files& files, const Intrinsics& camera, PageImage& page) {
  constexpr int kSide = 8;    // samples a side
  constexpr int kSteps = 32;  // from the border to the centre, past the sky
  const Eigen::Vector2d centre(0.5 * camera.width_px, 0.5 * camera.height_px);
  const Eigen::Vector2d corners[] = {{0.0, 0.0},
                                     {1.0 * camera.width_px, 0.0},
                                     {1.0 * camera.width_px, 1.0 * camera.height_px},
                                     {0.0, 1.0 * camera.height_px}};
  for (int side = 0; side < 4; ++side)
    for (int k = 0; k < kSide; ++k) {
      const Eigen::Vector2d border =
          corners[side] + (corners[(side + 1) % 4] - corners[side]) * k / kSide;
      for (int step = 0; step < kSteps; ++step) {
        const Eigen::Vector2d at = border + (centre - border) * step / kSteps;
        const int x = std::clamp(static_cast<int>(at.x()), 0, camera.width_px - 1);
        const int y = std::clamp(static_cast<int>(at.y()), 0, camera.height_px - 1);
        const auto depth_m = static_cast<double>(files.depth(x, y));
        if (!std::isfinite(depth_m)) continue;
        const Eigen::Vector2d pixel(x + 0.5, y + 0.5);
        const double shown_m = std::min(depth_m, kFarDepths * page.median_depth_m);
        page.footprint.push_back(
            local_point(page, camera, pixel, camera.point_from_pixel(pixel, shown_m)));
        break;
      }
    }
}

/// Share of the pixels with depth that stand in the image of another pose of the camera.
std::optional<double> overlap_with(const PageImage& page, const Intrinsics& camera,
                                   const Transfer& transfer) {
  std::int64_t num_points = 0;
  std::int64_t num_inside = 0;
  for (int y = 0; y < page.height; ++y)
    for (int x = 0; x < page.width; ++x) {
      const auto depth_m = static_cast<double>(page.depth(x, y));
      if (!std::isfinite(depth_m)) continue;
      ++num_points;
      const Eigen::Vector2d pixel(page.step * x + page.step / 2 + 0.5,
                                  page.step * y + page.step / 2 + 0.5);
      const auto other = transfer.point(pixel, depth_m);
      num_inside += other && other->distance_b_m > 0.0 && camera.contains(other->pixel);
    }
  if (num_points == 0) return std::nullopt;
  return static_cast<double>(num_inside) / static_cast<double>(num_points);
}

Files read_files(const Dataset& dataset, const Camera& camera, int frame, int other_frame) {
  const Reader& reader = find_reader(dataset.format);
  const auto& files = camera.files[static_cast<std::size_t>(frame)];
  Files read;
  Findings told_already;
  if (!files.color.empty())
    told_already.attempt(files.color, [&] { read.color = reader.color(dataset, camera, frame); });
  if (!files.depth.empty())
    told_already.attempt(files.depth, [&] { read.depth = reader.depth(dataset, camera, frame); });
  if (!files.segmentation.empty())
    told_already.attempt(files.segmentation,
                         [&] { read.classes = reader.segmentation(dataset, camera, frame); });
  if (!files.disparity.empty())
    told_already.attempt(files.disparity,
                         [&] { read.disparity = reader.disparity(dataset, camera, frame); });
  if (!files.flow.empty())
    told_already.attempt(files.flow, [&] { read.flow = reader.flow(dataset, camera, frame); });
  if (other_frame >= 0 && !read.depth.empty()) {
    const std::string& other = camera.files[static_cast<std::size_t>(other_frame)].depth;
    if (!other.empty())
      told_already.attempt(other,
                           [&] { read.other_depth = reader.depth(dataset, camera, other_frame); });
  }
  return read;
}

/// The neighbour of a frame whose depth is compared with its own: the next, or the one before the
/// last.
int neighbour_of(const Camera& camera, int frame) {
  for (const int other : {frame + 1, frame - 1})
    if (sound_pose(camera, other) != nullptr) return other;
  return -1;
}

}  // namespace

Eigen::Vector3d local_point(const PageImage& image, const Intrinsics& camera,
                            const Eigen::Vector2d& pixel, const Eigen::Vector3d& point_camera) {
  if (!image.lines) return *image.local_from_camera * point_camera;
  const double offset_s = image.lines->shutter.offset_s(pixel, camera);
  return *image.local_from_camera * (image.lines->start_from_camera(offset_s) * point_camera);
}

std::vector<Place> choose_page_images(const Dataset& dataset, const std::vector<Place>& places) {
  std::vector<Place> chosen;
  std::int64_t num_frames = 0;
  int most_cameras = 1;
  for (const Sequence& sequence : dataset.sequences) {
    num_frames += sequence.num_frames;
    most_cameras =
        std::max(most_cameras, std::min(static_cast<int>(sequence.cameras.size()), kPageCameras));
  }
  const std::int64_t num_shown =
      std::min<std::int64_t>(num_frames, std::max(2, kPageImages / most_cameras));
  for (std::int64_t k = 0; k < num_shown; ++k) {
    std::int64_t at = num_shown == 1 ? 0 : k * (num_frames - 1) / (num_shown - 1);
    int sequence = 0;
    while (at >= dataset.sequences[static_cast<std::size_t>(sequence)].num_frames)
      at -= dataset.sequences[static_cast<std::size_t>(sequence++)].num_frames;
    const auto num_cameras =
        static_cast<int>(dataset.sequences[static_cast<std::size_t>(sequence)].cameras.size());
    for (int camera = 0; camera < std::min(num_cameras, kPageCameras); ++camera)
      chosen.push_back({sequence, camera, static_cast<int>(at), {}});
  }
  for (Place place : places) {
    place.pixel.reset();
    chosen.push_back(place);
  }
  const auto key = [](const Place& place) {
    return std::tuple(place.sequence, place.camera, place.frame);
  };
  std::sort(chosen.begin(), chosen.end(),
            [&](const Place& a, const Place& b) { return key(a) < key(b); });
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

void OctaveHistogram::add(double value) {
  constexpr double kLeast = 1e-9, kMost = 1e15;
  if (value >= kLeast && value <= kMost)
    ++counts_[static_cast<int>(std::floor(4.0 * std::log2(value)))];
}

void OctaveHistogram::add(const OctaveHistogram& other) {
  for (const auto& [bin, count] : other.counts_) counts_[bin] += count;
}

Json OctaveHistogram::json() const {
  if (counts_.empty()) return {};
  Json edges = Json::array();
  Json counts = Json::array();
  const int first = counts_.begin()->first;
  const int last = counts_.rbegin()->first;
  for (int bin = first; bin <= last; ++bin) {
    const auto found = counts_.find(bin);
    edges.push(std::exp2(0.25 * bin));
    counts.push(found == counts_.end() ? std::int64_t{0} : found->second);
  }
  edges.push(std::exp2(0.25 * (last + 1)));
  return Json::object().set("edges", edges).set("counts", counts);
}

PageImage make_page_image(const Dataset& dataset, const Place& place, std::size_t index) {
  const Sequence& sequence = dataset.sequences[static_cast<std::size_t>(place.sequence)];
  const Camera& camera = sequence.cameras[static_cast<std::size_t>(place.camera)];
  PageImage page;
  page.place = place;
  page.place.pixel.reset();
  const Intrinsics& size = camera.intrinsics;
  if (!size.is_sound()) return page;
  page.step =
      std::max(1, (std::max(size.width_px, size.height_px) + kPageImagePx - 1) / kPageImagePx);
  page.width = size.width_px / page.step;
  page.height = size.height_px / page.step;
  if (page.width == 0 || page.height == 0) return page;  // a strip of pixels
  if (const Pose* pose = sound_pose(camera, place.frame)) page.local_from_camera = *pose;
  const std::optional<View> own =
      page.local_from_camera ? view_at(sequence, place.camera, place.frame, nullptr) : std::nullopt;
  if (own)
    page.lines = own->lines;
  else
    page.local_from_camera.reset();
  const int other = page.local_from_camera ? neighbour_of(camera, place.frame) : -1;
  const Files files = read_files(dataset, camera, place.frame, other);
  const auto is_whole = [&](const auto& image) {
    return image.width() == size.width_px && image.height() == size.height_px;
  };
  Json layers = Json::object();
  const auto add_layer = [&](const char* name, Json values) {
    layers.set(name, std::move(values));
    page.layers.emplace_back(name);
  };
  if (is_whole(files.color)) page.color = shrunk(files.color, kPageImagePx);
  if (is_whole(files.depth)) {
    page.depth = core::ImageF(page.width, page.height);
    const std::vector<float> values = sampled(files.depth, page);
    std::copy(values.begin(), values.end(), page.depth.data().begin());
    std::vector<float> finite;
    for (const float value : values)
      if (std::isfinite(value)) {
        finite.push_back(value);
        page.depths_m.add(static_cast<double>(value));
      }
    page.median_depth_m = median(finite);
    add_layer("depth", packed(values));
    if (page.local_from_camera && page.median_depth_m > 0.0) {
      count_slopes(files, size, page);
      trace_footprint(files, size, page);
      if (sound_pose(camera, place.frame + 1) != nullptr)
        if (const auto next = view_at(sequence, place.camera, place.frame + 1, nullptr))
          page.overlap = overlap_with(page, size, Transfer(*own, *next));
      const std::optional<View> beside = is_whole(files.other_depth)
                                             ? view_at(sequence, place.camera, other, nullptr)
                                             : std::nullopt;
      if (beside) {
        page.residual_frame = other;
        add_layer(
            "residual",
            packed(residuals_of(files, page, Transfer(*own, *beside))).set("scale", kResidualStep));
      }
    }
  }
  if (is_whole(files.flow.forward) && files.flow.forward.channels() == 2) {
    const std::vector<float> values = sampled(files.flow.forward, page);
    const std::size_t count = values.size() / 2;
    for (std::size_t i = 0; i < count; ++i)
      page.flows_px.add(static_cast<double>(std::hypot(values[i], values[count + i])));
    add_layer("flow", packed(values));
    if (is_whole(files.flow.in_view_forward) && is_whole(files.flow.covisible_forward)) {
      std::vector<std::uint8_t> masks = sampled(files.flow.in_view_forward, page);
      const std::vector<std::uint8_t> covisible = sampled(files.flow.covisible_forward, page);
      for (std::size_t i = 0; i < masks.size(); ++i)
        masks[i] = static_cast<std::uint8_t>((masks[i] != 0 ? 1 : 0) + (covisible[i] != 0 ? 2 : 0));
      add_layer("masks", packed(masks));
    }
  }
  if (is_whole(files.classes)) {
    const std::vector<std::uint8_t> values = sampled(files.classes, page);
    for (const std::uint8_t value : values) ++page.classes[value];
    add_layer("classes", packed(values));
  }
  if (is_whole(files.disparity)) add_layer("disparity", packed(sampled(files.disparity, page)));
  page.script = script_call(
      "terracastImage",
      Json::object().set("index", static_cast<std::uint64_t>(index)).set("layers", layers));
  return page;
}

}  // namespace terracast::validate
