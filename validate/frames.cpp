#include "validate/frames.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "validate/transfer.h"

namespace terracast::validate {

namespace {

core::ImageF smoothed_luma(const core::Image8& color) {
  const int width = color.width();
  const int height = color.height();
  core::ImageF luma(width, height);
  for (std::size_t i = 0; i < luma.data().size(); ++i) {
    const std::uint8_t* p = &color.data()[3 * i];
    luma.data()[i] = 0.299F * static_cast<float>(p[0]) + 0.587F * static_cast<float>(p[1]) +
                     0.114F * static_cast<float>(p[2]);
  }
  core::ImageF across(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      across(x, y) = 0.25F * luma(std::max(x - 1, 0), y) + 0.5F * luma(x, y) +
                     0.25F * luma(std::min(x + 1, width - 1), y);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      luma(x, y) = 0.25F * across(x, std::max(y - 1, 0)) + 0.5F * across(x, y) +
                   0.25F * across(x, std::min(y + 1, height - 1));
  return luma;
}

/// The colours where they belong, by the aberration that is stated.
core::Image8 aligned_color(const core::Image8& color, const Camera& camera) {
  if (!camera.imaging.has_aberration()) return color;
  const Intrinsics& k = camera.intrinsics;
  const Eigen::Vector2d axis_px = k.pixel_from_point(Eigen::Vector3d::UnitZ());
  const Eigen::Vector2d middle_px(0.5 * k.width_px, 0.5 * k.height_px);
  return without_aberration(color, camera.imaging, axis_px.allFinite() ? axis_px : middle_px);
}

/// Motion over one frame at `frame`, in the axes of the camera: central differences, one-sided of
/// second order at the ends.
void set_motion(View& view) {
  const auto& poses = view.camera->local_from_camera;
  const auto pose_at = [&](int frame) -> const Pose* {
    if (frame < 0 || frame >= static_cast<int>(poses.size())) return nullptr;
    const auto& pose = poses[static_cast<std::size_t>(frame)];
    return pose ? &*pose : nullptr;
  };
  const auto step = [](const Pose& from, const Pose& to, Eigen::Vector3d& shift,
                       Eigen::Vector3d& turn) {
    shift = to.translation - from.translation;
    turn = rotation_vector(from.rotation.transpose() * to.rotation);
  };
  const Pose* before = pose_at(view.frame - 1);
  const Pose* after = pose_at(view.frame + 1);
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  if (before != nullptr && after != nullptr) {
    step(*before, *after, shift, turn);
    shift *= 0.5;
    turn *= 0.5;
  } else if (before != nullptr || after != nullptr) {
    const int direction = after != nullptr ? 1 : -1;
    const Pose& near = *(after != nullptr ? after : before);
    step(view.local_from_camera, near, shift, turn);
    if (const Pose* far = pose_at(view.frame + 2 * direction)) {
      Eigen::Vector3d next_shift, next_turn;
      step(near, *far, next_shift, next_turn);
      shift = 1.5 * shift - 0.5 * next_shift;
      turn = 1.5 * turn - 0.5 * next_turn;
    }
    shift *= direction;
    turn *= direction;
  }
  view.velocity_camera = view.local_from_camera.rotation.transpose() * shift;
  view.angular_velocity_camera = turn;
}

/// Whether any of a grid of rays of one camera, at infinity or at a depth of its own image, stands
/// in the other's image.
bool may_overlap(const View& a, const View& b) {
  const Transfer transfer(a, b);
  constexpr int kGrid = 8;
  for (int row = 0; row <= kGrid; ++row)
    for (int column = 0; column <= kGrid; ++column) {
      const Intrinsics& k = a.camera->intrinsics;
      const Eigen::Vector2d pixel(k.width_px * (column + 0.01) / (kGrid + 0.02),
                                  k.height_px * (row + 0.01) / (kGrid + 0.02));
      double depth_m = 1e6;
      if (!a.image->depth.empty()) {
        const float measured =
            a.image->depth(static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
        if (std::isfinite(measured)) depth_m = static_cast<double>(measured);
      }
      const auto place = transfer.point(pixel, depth_m);
      if (place && place->distance_b_m > 0.0 && b.camera->intrinsics.contains(place->pixel))
        return true;
    }
  return false;
}

/// Every class is a known one; sky stands where a ray comes in and there is no depth, only there, and where no ray
/// comes in there is nothing.
/// throws  Input: the first pixel that is not so
void check_segmentation(const core::Image8& segmentation, const core::ImageF& depth,
                        const Intrinsics& camera, const std::map<int, std::string>& classes,
                        const std::string& name) {
  if (classes.empty()) return;  // a map that could not be read is a finding of its own
  const bool has_sky = std::any_of(classes.begin(), classes.end(),
                                   [](const auto& entry) { return entry.second == "sky"; });
  for (int y = 0; y < segmentation.height(); ++y)
    for (int x = 0; x < segmentation.width(); ++x) {
      const auto entry = classes.find(segmentation(x, y));
      if (entry == classes.end())
        core::fail(core::ErrorKind::Input,
                   "{}: class {} at pixel ({}, {}) is not in seg_label_map.json", name,
                   segmentation(x, y), x, y);
      if (!has_sky || depth.empty()) continue;
      const bool has_depth = std::isfinite(depth(x, y));
      const bool is_nothing = entry->second == "nothing";
      const bool has_ray = !camera.plane || camera.ray_from_pixel({x + 0.5, y + 0.5}).allFinite();
      if (is_nothing == has_ray)
        core::fail(core::ErrorKind::Input, "{}: class {} at pixel ({}, {}), where {}", name,
                   entry->second, x, y, has_ray ? "a ray comes in" : "no ray comes in");
      if (!is_nothing && has_depth == (entry->second == "sky"))
        core::fail(core::ErrorKind::Input, "{}: class {} at pixel ({}, {}), where depth is {}",
                   name, entry->second, x, y, has_depth ? "a surface's" : "the sky's");
    }
}

/// Bodies that pixels show are there, and have a depth.
/// throws  Input: the first pixel that is not so
void check_moving(const LoadedImage& image, const Moving& moving, int frame,
                  const std::string& name) {
  for (int y = 0; y < image.moving.height(); ++y)
    for (int x = 0; x < image.moving.width(); ++x) {
      const int body = image.moving(x, y);
      if (body == 0) continue;
      if (moving.state(frame, body) == nullptr)
        core::fail(core::ErrorKind::Input,
                   "{}: body {} at pixel ({}, {}) is not there by moving.csv", name, body, x, y);
      if (!image.depth.empty() && !std::isfinite(image.depth(x, y)))
        core::fail(core::ErrorKind::Input, "{}: body {} at pixel ({}, {}), where there is no depth",
                   name, body, x, y);
    }
}

/// Normals are of what has a depth, and of nothing else; nothing else is an instance.
/// throws  Input: the first pixel that is not so
void check_surfaces(const LoadedImage& image, const FrameFiles& files) {
  const bool has_normals = !image.normals.empty(), has_instances = !image.instances.empty();
  if (image.depth.empty()) return;
  for (int y = 0; y < image.depth.height(); ++y)
    for (int x = 0; x < image.depth.width(); ++x) {
      const bool has_depth = std::isfinite(image.depth_at(x, y));
      if (has_normals && std::isfinite(image.normals(x, y, 0)) != has_depth)
        core::fail(core::ErrorKind::Input, "{}: {} normal at pixel ({}, {}), where {}",
                   files.normals, has_depth ? "no" : "a", x, y,
                   has_depth ? "a surface is" : "no surface is");
      if (has_instances && !has_depth && image.instances(x, y) != 0)
        core::fail(core::ErrorKind::Input, "{}: instance {} at pixel ({}, {}), where no surface is",
                   files.instances, image.instances(x, y), x, y);
    }
}

/// Takes what moves out of the depth.
void part_depth(LoadedImage& image) {
  if (image.moving.empty() || image.depth.empty()) return;
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  image.moving_depth = core::ImageF(image.depth.width(), image.depth.height(), 1, kNone);
  for (std::size_t i = 0; i < image.moving.data().size(); ++i)
    if (image.moving.data()[i] != 0)
      image.moving_depth.data()[i] = std::exchange(image.depth.data()[i], kNone);
}

}  // namespace

bool LoadedImage::shows_moving_near(const Eigen::Vector2d& pixel) const {
  if (moving.empty()) return false;
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, moving.height() - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, moving.width() - 1); ++i)
      if (moving(i, j) != 0) return true;
  return false;
}

bool LoadedImage::hides_by_moving(const Eigen::Vector2d& pixel, double depth_m) const {
  if (moving_depth.empty()) return false;
  const int x = static_cast<int>(pixel.x()), y = static_cast<int>(pixel.y());
  if (x < 1 || y < 1 || x + 1 >= moving.width() || y + 1 >= moving.height()) return false;
  for (int j = y - 1; j <= y + 1; ++j)
    for (int i = x - 1; i <= x + 1; ++i)
      if (moving(i, j) == 0 || !(static_cast<double>(moving_depth(i, j)) < depth_m)) return false;
  return true;
}

FrameImages load_frame(const Dataset& dataset, const Sequence& sequence, int frame,
                       Findings& findings) {
  const std::size_t num_cameras = sequence.cameras.size();
  std::vector<LoadedImage> images(num_cameras);
  const Reader& reader = find_reader(dataset.format);
  enum Kind { kColor, kDepth, kDisparity, kFlow, kSurface, kNumKinds };
  core::parallel_for(static_cast<std::int64_t>(num_cameras) * kNumKinds, [&](std::int64_t task) {
    const auto index = static_cast<std::size_t>(task / kNumKinds);
    const Camera& camera = sequence.cameras[index];
    const FrameFiles& files = camera.files[static_cast<std::size_t>(frame)];
    LoadedImage& image = images[index];
    if (!camera.intrinsics.is_sound()) return;
    switch (static_cast<Kind>(task % kNumKinds)) {
      case kColor:
        if (!files.color.empty())
          findings.attempt(files.color, [&] {
            image.color = reader.color(dataset, camera, frame);
            image.grey = smoothed_luma(aligned_color(image.color, camera));
          });
        break;
      case kDepth:
        if (!files.depth.empty())
          findings.attempt(files.depth,
                           [&] { image.depth = reader.depth(dataset, camera, frame); });
        if (!files.moving.empty()) {
          TERRACAST_CHECK(sequence.moving, "{}: of a sequence where nothing moves", files.moving);
          findings.attempt(files.moving, [&] {
            image.moving =
                read_png16(dataset.root / files.moving, files.moving, 1, camera.intrinsics);
            check_moving(image, *sequence.moving, frame, files.moving);
          });
        }
        if (!files.segmentation.empty())
          findings.attempt(files.segmentation, [&] {
            image.segmentation = reader.segmentation(dataset, camera, frame);
            check_segmentation(image.segmentation, image.depth, camera.intrinsics, sequence.classes,
                               files.segmentation);
          });
        part_depth(image);
        break;
      case kDisparity:
        if (!files.disparity.empty())
          findings.attempt(files.disparity,
                           [&] { image.disparity = reader.disparity(dataset, camera, frame); });
        break;
      case kFlow:
        if (!files.flow.empty())
          findings.attempt(files.flow, [&] {
            image.flow = std::make_shared<const FlowFields>(reader.flow(dataset, camera, frame));
          });
        break;
      default:
        if (!files.normals.empty())
          findings.attempt(files.normals,
                           [&] { image.normals = reader.normals(dataset, camera, frame); });
        if (!files.instances.empty())
          findings.attempt(files.instances,
                           [&] { image.instances = reader.instances(dataset, camera, frame); });
        break;
    }
  });
  core::parallel_for(static_cast<std::int64_t>(num_cameras), [&](std::int64_t task) {
    const auto index = static_cast<std::size_t>(task);
    const FrameFiles& files = sequence.cameras[index].files[static_cast<std::size_t>(frame)];
    if (!files.normals.empty() || !files.instances.empty())
      findings.attempt(files.normals.empty() ? files.instances : files.normals,
                       [&] { check_surfaces(images[index], files); });
  });
  FrameImages shared;
  shared.reserve(num_cameras);
  for (LoadedImage& image : images)
    shared.push_back(std::make_shared<const LoadedImage>(std::move(image)));
  return shared;
}

std::optional<View> view_at(const Sequence& sequence, int camera_index, int frame,
                            const LoadedImage* image) {
  View view;
  view.camera_index = camera_index;
  view.frame = frame;
  view.camera = &sequence.cameras[static_cast<std::size_t>(camera_index)];
  view.image = image;
  view.sequence = &sequence;
  const auto index = static_cast<std::size_t>(frame);
  if (frame < 0 || index >= view.camera->local_from_camera.size()) return std::nullopt;
  const auto& pose = view.camera->local_from_camera[index];
  if (!pose || !view.camera->intrinsics.is_sound()) return std::nullopt;
  view.local_from_camera = *pose;
  if (view.camera->shutter) {
    // Without a motion only the pose of one of the lines is known.
    if (index >= sequence.motion.size() || !sequence.motion[index] ||
        !view.camera->body_from_camera)
      return std::nullopt;
    view.lines =
        LineMotion{*view.camera->shutter, *sequence.motion[index], *view.camera->body_from_camera};
  }
  set_motion(view);
  return view;
}

FrameWindow::FrameWindow(const Dataset& dataset, const Sequence& sequence, Findings& findings)
    : dataset_(dataset), sequence_(sequence), findings_(findings) {}

FrameWindow::FrameWindow(const Dataset& dataset, const Sequence& sequence, Findings& findings,
                         std::span<const FrameImages> images)
    : dataset_(dataset), sequence_(sequence), findings_(findings), given_(images) {}

bool FrameWindow::advance() {
  if (frame_ + 1 >= sequence_.num_frames) return false;
  ++frame_;
  loaded_.push_back(given_ ? (*given_)[static_cast<std::size_t>(frame_)]
                           : load_frame(dataset_, sequence_, frame_, findings_));
  constexpr std::size_t kKept = 5;  // the largest offset, and the newest
  static_assert(kOffsets[std::size(kOffsets) - 1] + 1 == kKept);
  if (loaded_.size() > kKept) loaded_.pop_front();
  return true;
}

std::optional<View> FrameWindow::view(int camera_index, int frame) const {
  const int age = frame_ - frame;
  if (age < 0 || age >= static_cast<int>(loaded_.size())) return std::nullopt;
  return view_at(sequence_, camera_index, frame,
                 loaded_[loaded_.size() - 1 - static_cast<std::size_t>(age)]
                        [static_cast<std::size_t>(camera_index)]
                            .get());
}

std::vector<ViewPair> FrameWindow::pairs() const {
  std::vector<ViewPair> pairs;
  const int num_cameras = static_cast<int>(sequence_.cameras.size());
  const auto add = [&](const std::optional<View>& a, const std::optional<View>& b) {
    if (a && b && !a->image->depth.empty() && may_overlap(*a, *b)) pairs.push_back({*a, *b});
  };
  for (int camera = 0; camera < num_cameras; ++camera) {
    const std::optional<View> newest = view(camera, frame_);
    for (const int offset : kOffsets) {
      const std::optional<View> earlier = view(camera, frame_ - offset);
      add(newest, earlier);
      add(earlier, newest);
    }
    for (int other = 0; other < num_cameras; ++other)
      if (other != camera) add(newest, view(other, frame_));
  }
  return pairs;
}

}  // namespace terracast::validate
